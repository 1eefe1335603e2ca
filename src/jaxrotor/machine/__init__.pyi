from .machine import Machine as Machine
