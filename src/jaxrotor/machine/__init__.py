"""The machine, what it is made of inside, and its vector field."""

from .machine import Machine as Machine
