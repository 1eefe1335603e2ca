"""What `jaxrotor check` looks at beyond the study file itself."""

from ..errors import InputError
from .identified import check_identify
from .study import Study
from .swept import check_sweep


def check_study(study: Study) -> None:
    """Raises `InputError` with all that `identify` and `sweep` refuse before they run anything, files that
    their sections name among it. What `optimize` refuses `load` has refused already."""
    problems: list[str] = []
    for section, check in ((study.identify, check_identify), (study.sweep, check_sweep)):
        if section is None:
            continue
        try:
            check(study)
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(*problems)
