"""What `jaxrotor check` looks at beyond the study file itself."""

from ..core.errors import InputError, JaxrotorError
from ..study.study import Study


def check_study(study: Study) -> None:
    """Raises `InputError` with all that `identify` and `sweep` refuse before they run anything, files that
    their sections name among it. What `optimize` refuses `load` has refused already."""
    # what no section asks for is not loaded: most studies are checked in a second
    problems: list[str] = []
    checks = []
    if study.identify is not None:
        from .identify import check_identify

        checks.append(check_identify)
    if study.sweep is not None:
        from .sweep import check_sweep

        checks.append(check_sweep)
    for check in checks:
        try:
            check(study)
        except JaxrotorError as error:
            problems += error.problems
    if problems:
        raise InputError(*problems)
