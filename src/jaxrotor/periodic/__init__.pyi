from .branch import Branch as Branch, SpecialPoint as SpecialPoint
from .continuation import continuation as continuation
from .harmonic_balance import harmonic_balance as harmonic_balance
from .motion import PeriodicMotion as PeriodicMotion
from .switching import switch_branch as switch_branch
