from .exponential import ETD4RK as ETD4RK, ExponentialAdams as ExponentialAdams
from .rosenbrock import Rosenbrock as Rosenbrock
