"""What `jaxrotor check` looks at beyond the study file itself."""

from ..core.errors import InputError, JaxrotorError
from ..study.study import Study
from .identify import check_identify
from .sweep import check_sweep


def check_study(study: Study) -> None:
    """Raises `InputError` with all that `identify` and `sweep` refuse before they run anything, files that
    their sections name among it. What `optimize` refuses `load` has refused already."""
    problems: list[str] = []
    for section, check in ((study.identify, check_identify), (study.sweep, check_sweep)):
        if section is None:
            continue
        try:
            check(study)
        except JaxrotorError as error:
            problems += error.problems
    if problems:
        raise InputError(*problems)
