"""What the numbers in universal files stand for. Sources: the format's description by the SDRL, University of
Cincinnati (data sets 58 with its table of unit exponents, 164)."""

from collections.abc import Mapping
from typing import Any

DATASETS = {
    15: "nodes",
    18: "coordinate systems",
    55: "mode shapes or other data at nodes",
    56: "data at elements",
    57: "data at nodes of elements",
    58: "functions",
    82: "trace lines",
    151: "header",
    164: "units",
    1858: "qualifiers of functions",
    2400: "model header",
    2411: "nodes",
    2412: "elements",
    2414: "analysis results",
    2420: "coordinate systems",
    2429: "groups",
    2467: "groups",
}
# What says something about signals, or about the file, and holds none.
BESIDE = (151, 164, 1858)
FUNCTIONS = (
    "general function",
    "time response",
    "auto spectrum",
    "cross spectrum",
    "frequency response function",
    "transmissibility",
    "coherence",
    "auto correlation",
    "cross correlation",
    "power spectral density",
    "energy spectral density",
    "probability density",
    "spectrum",
    "cumulative frequency distribution",
    "peaks and valleys",
    "stress over cycles",
    "strain over cycles",
    "orbit",
    "mode indicator function",
    "force pattern",
    "partial power",
    "partial coherence",
    "eigenvalue",
    "eigenvector",
    "shock response spectrum",
    "impulse response of a filter",
    "multiple coherence",
    "order function",
    "phase compensation",
)
AXES = {17: "time", 18: "frequency", 19: "rpm", 20: "order"}
_DIRECTIONS = ("", "X", "Y", "Z", "RX", "RY", "RZ")
# Of a kind of ordinate: exponents of length and force, and what follows; along an axis, about one.
_KINDS = {
    2: ((-2, 1), (-1, 1), ""),
    8: ((1, 0), (0, 0), ""),
    9: ((0, 1), (1, 1), ""),
    11: ((1, 0), (0, 0), "/s"),
    12: ((1, 0), (0, 0), "/s^2"),
    13: ((0, 1), (1, 1), ""),
    15: ((-2, 1), (-1, 1), ""),
}
_ACCELERATION = 12
# Units a metre, a newton.
_LENGTHS = {1.0: "m", 100.0: "cm", 1000.0: "mm", 39.37008: "inch", 3.28084: "ft"}
_FORCES = {1.0: "N", 1000.0: "mN", 0.001: "kN", 0.2248089: "lbf", 0.1019716: "kgf"}


def place_of(node: int, direction: int) -> str:
    """12+X, 3-RZ; a scalar has a node alone."""
    axis = _DIRECTIONS[abs(direction)] if abs(direction) < len(_DIRECTIONS) else ""
    return f"{node}{'-' if direction < 0 else '+'}{axis}" if axis else str(node)


def unit_of(head: Mapping[str, Any], factors: Mapping[str, Any]) -> str:
    """The unit of a function 58: its label, else that of its kind in the units of data set 164, else ""."""
    label, kind = head["ordinate_axis_units_lab"].strip(), head["ordinate_spec_data_type"]
    if label.upper() not in ("", "NONE"):
        return "g_0" if kind == _ACCELERATION and label.lower() in ("g", "gn", "g's") else label
    length = _nearest(factors.get("length"), _LENGTHS)
    force = _nearest(factors.get("force"), _FORCES)
    if kind not in _KINDS or not length or not force:
        return ""
    turns = abs(head["rsp_dir"]) > 3
    (of_length, of_force), then = _KINDS[kind][turns], _KINDS[kind][2]
    above = ([force] if of_force else []) + ([length] if of_length > 0 else [])
    below = f"/{length}^{-of_length}" if of_length < 0 else ""
    return ("*".join(above) or "rad") + below + then


def _nearest(factor: float | None, known: Mapping[float, str]) -> str:
    if factor is None:
        return ""
    return next((unit for size, unit in known.items() if abs(factor / size - 1) < 1e-4), "")
