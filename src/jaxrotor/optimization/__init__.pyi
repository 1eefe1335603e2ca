from .experiment import NoRun as NoRun, SimulatedRun as SimulatedRun
from .optimize import optimize as optimize
from .optimum import Optimum as Optimum
from .variations import Variations as Variations
