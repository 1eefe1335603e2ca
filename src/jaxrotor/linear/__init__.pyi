from .buckling import buckling_factor as buckling_factor
from .campbell import Campbell as Campbell, campbell as campbell
from .cluster import Cluster as Cluster, decay_rate as decay_rate, pole_cluster as pole_cluster
from .convergence import Convergence as Convergence, convergence as convergence
from .critical import critical_modes as critical_modes, critical_speeds as critical_speeds
from .eigen import split_derivatives as split_derivatives
from .linearise import LinearModel as LinearModel, linearize as linearize
from .loops import ControlLoops as ControlLoops, control_loops as control_loops
from .matrix_equations import lyapunov as lyapunov, riccati as riccati
from .matched import matched_eigenvalue as matched_eigenvalue, matched_modes as matched_modes
from .modal_damping import with_modal_damping as with_modal_damping
from .modes import Mode as Mode, modes as modes
from .norms import (
    h2_norm as h2_norm,
    h_infinity_norm as h_infinity_norm,
    response_peaks as response_peaks,
)
from .orders import (
    OrderResponse as OrderResponse,
    order_response as order_response,
    unbalance_response as unbalance_response,
)
from .peak import Peak as Peak, unbalance_peak as unbalance_peak
from .regulator import (
    LQG as LQG,
    Regulator as Regulator,
    closed_loop_cost as closed_loop_cost,
    lqg as lqg,
    lqr as lqr,
)
from .response import (
    FrequencyResponse as FrequencyResponse,
    frequency_response as frequency_response,
)
from .supports import CriticalSpeedMap as CriticalSpeedMap, critical_speed_map as critical_speed_map
from .threshold import stability_threshold as stability_threshold
from .torsion import (
    Interference as Interference,
    TorsionalMode as TorsionalMode,
    holzer_table as holzer_table,
    interferences as interferences,
    torsional as torsional,
    torsional_modes as torsional_modes,
)
from .transfer import Peaks as Peaks
