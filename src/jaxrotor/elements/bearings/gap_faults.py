"""What no thin gap between a journal and its bore can be."""

from collections.abc import Iterator

from jaxtyping import Array


def wide_gap(clearance: Array, diameter: Array, most: float) -> Iterator[str]:
    """The fault of a gap for which the flow is not thin: beyond the part `most` of the diameter."""
    if float(clearance) >= most * float(diameter):
        yield (
            f"clearance must be far smaller than the diameter (it is the radial one), but is "
            f"{float(clearance):g} m of {float(diameter):g} m"
        )
