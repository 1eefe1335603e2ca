"""What joins two stations."""

from .matrix import ElasticMatrix as ElasticMatrix
from .shaft import STEEL as STEEL, Material as Material, Shaft as Shaft
