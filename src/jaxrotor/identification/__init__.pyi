from .balance import (
    Balance as Balance,
    Correction as Correction,
    balance as balance,
    correction as correction,
    influence_coefficients as influence_coefficients,
    modal_balance as modal_balance,
    phasor as phasor,
)
from .bootstrap import Replicas as Replicas, bootstrap as bootstrap
from .candidate_run import CandidateRun as CandidateRun
from .design import experiment_design as experiment_design
from .domain import (
    AbstractDomain as AbstractDomain,
    Frequencies as Frequencies,
    Orders as Orders,
    Time as Time,
)
from .experiment import ExperimentDesign as ExperimentDesign
from .fisher import information as information
from .identification import Identification as Identification
from .found_unbalance import FoundUnbalance as FoundUnbalance
from .identify import Stage as Stage, identify as identify
from .influence import Influence as Influence, influence as influence
from .measured_response import MeasuredResponse as MeasuredResponse
from .read_response import read_response as read_response
from .measured_run import MeasuredRun as MeasuredRun
from .posterior import Posterior as Posterior, posterior as posterior
from .profile import (
    LikelihoodProfile as LikelihoodProfile,
    likelihood_profiles as likelihood_profiles,
)
