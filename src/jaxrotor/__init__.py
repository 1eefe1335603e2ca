from .attach import *
