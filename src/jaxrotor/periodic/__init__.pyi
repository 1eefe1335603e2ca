from .harmonic_balance import harmonic_balance as harmonic_balance
from .motion import PeriodicMotion as PeriodicMotion
