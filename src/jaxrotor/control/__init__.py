"""Control: what is measured, the controllers, the actuator; loops that close over them."""

from .actuator import Actuator as Actuator
from .controller import (
    PD as PD,
    PI as PI,
    AbstractController as AbstractController,
    Compensator as Compensator,
    PositivePositionFeedback as PositivePositionFeedback,
    ResonantController as ResonantController,
    StateFeedback as StateFeedback,
)
from .loop import ActiveTorque as ActiveTorque
from .measured import (
    AbstractMeasured as AbstractMeasured,
    RelativeStates as RelativeStates,
    SpeedError as SpeedError,
    TwistOf as TwistOf,
)
from .neural import NeuralController as NeuralController
from .sampled import SampledTorque as SampledTorque
from .switched import SwitchedDamper as SwitchedDamper
