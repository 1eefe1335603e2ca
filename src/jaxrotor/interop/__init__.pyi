from .accelerations import read_accelerations as read_accelerations
from .coefficients import read_coefficients as read_coefficients
from .modal_fit import FittedModes as FittedModes, fit_modes as fit_modes
from .receptance import FittedReceptance as FittedReceptance, fit_receptance as fit_receptance
from .ross import from_ross as from_ross
from .to_ross import to_ross as to_ross
