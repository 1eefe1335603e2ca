"""Which jaxrotor this is."""

from importlib.metadata import PackageNotFoundError, version


def installed_version() -> str:
    try:
        return version("jaxrotor")
    except PackageNotFoundError:
        return "(not installed)"
