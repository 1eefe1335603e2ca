"""What may be wrong with mounts, in sentences."""

from collections.abc import Iterator
from typing import Any


def mount_faults(points: int, stiffness: Any, damping: Any, prefix: str = "") -> Iterator[str]:
    """Of `points` mounts: as many rows of stiffness and damping, where they are given for each."""
    if not points:
        yield f"{prefix or 'places'} must name one point at least, but names none"
    for name, given in (("stiffness", stiffness), ("damping", damping)):
        if given.ndim == 2 and given.shape[0] != points:
            yield (
                f"{prefix}{name} must be six numbers or a row of six for each of the {points} points, but "
                f"has {given.shape[0]} rows"
            )
