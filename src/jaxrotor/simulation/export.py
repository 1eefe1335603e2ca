"""A response as an `xarray.Dataset`, with units and with how it was made."""

import re
import unicodedata
from collections.abc import Container
from importlib import metadata

import jax
import numpy as np
import xarray

from ..core.kinematics import COORDINATES
from .response import ConnectorResponse, Response, StationResponse

_MOTION = {
    "position": "m, rad",
    "velocity": "m/s, rad/s",
    "acceleration": "m/s^2, rad/s^2",
    "reaction": "N, N*m",
}


_UNITS = ("m", "m", "m", "rad", "rad", "rad")


def versions() -> dict[str, str]:
    """Of everything that the numbers depend on."""
    names = ("jaxrotor", "jax", "jaxlib", "diffrax", "equinox", "numpy")
    found = {}
    for name in names:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "not installed as a package"
    return found


def to_xarray(response: Response) -> xarray.Dataset:
    names = list(response.machine.wiring.stations)
    # of composites the inner stations; their many elements can be asked for one by one
    own = {*names, *response.lineup.wiring.connectors}
    parts = {name: response[name] for name in response.machine.wiring.order if name in own}
    first = parts[names[0]]
    assert isinstance(first, StationResponse)
    whole = first._evaluation()
    dims = ("time", "station", "coordinate")
    arrays = dict(zip(_MOTION, (whole.q, whole.v, whole.a, whole.reaction)))
    data = {
        name: xarray.DataArray(np.asarray(values), dims=dims, attrs={"units": _MOTION[name]})
        for name, values in arrays.items()
    }
    speeds = np.stack([np.asarray(response[n].speed) for n in names], axis=1)  # pyright: ignore
    data["speed"] = xarray.DataArray(
        speeds,
        dims=("time", "station"),
        attrs={"units": "rad/s", "long_name": "speed about the shaft's own axis"},
    )
    data["mass_centre"] = xarray.DataArray(
        np.stack([np.asarray(response[n].mass_centre) for n in names], axis=1),  # pyright: ignore
        dims=("time", "station", "axis"),
        attrs={"units": "m"},
    )

    def add(part: str, quantity: str, values: np.ndarray, unit: str, *extra: str) -> None:
        about = {"long_name": f"{part}: {quantity.replace('_', ' ')}", "units": unit}
        data[_variable(part, quantity, data)] = xarray.DataArray(
            values, dims=("time", *extra), attrs={**about, "element": part, "quantity": quantity}
        )

    q = np.asarray(whole.q)
    for i, name in enumerate(names):
        for k, (coordinate, unit) in enumerate(zip(COORDINATES, _UNITS)):
            add(name, coordinate, q[:, i, k], unit)
        add(name, "speed", speeds[:, i], "rad/s")
    for name, part in parts.items():
        for signal, unit in part.signals().items():
            values = np.asarray(getattr(part, signal))
            extra = ("axis",) if values.ndim == 2 and values.shape[1] == 3 else ()
            extra = extra or tuple(f"{signal}_{i}" for i in range(values.ndim - 1))
            add(name, signal, values, unit, *extra)
        if isinstance(part, ConnectorResponse):
            values = np.asarray(part.forces)
            add(name, "forces", values, "N, N*m", f"end_{values.shape[1]}", "coordinate")
    parameters = {
        path: np.asarray(value).tolist() for path, value in response.machine.parameters().items()
    }
    return xarray.Dataset(
        data,
        coords={
            "time": ("time", np.asarray(response.t), {"units": "s"}),
            "station": names,
            "coordinate": list(COORDINATES),
            "axis": ["x", "y", "z"],
        },
        attrs={
            "convention": "SI; angles 1-2-3, phi is the spin; forces act on the station",
            **{f"run_{k}": v for k, v in response.stats.items()},
            **{f"version_{k}": v for k, v in versions().items()},
            "platform": jax.default_backend(),
            "parameters": str(parameters),
        },
    )


def _variable(part: str, quantity: str, taken: Container[str]) -> str:
    """`part_quantity` as Python can write it behind a dot: `ds.shaft_2_torque`. Where two parts would share a
    name ("a b" and "a_b"), or a dataset has it for itself, a number behind tells them apart."""
    name = re.sub(r"\W", "_", unicodedata.normalize("NFKC", f"{part}_{quantity}"))
    if not name.isidentifier():  # it begins with a digit
        name = f"part_{name}"
    free, k = name, 2
    while free in taken or hasattr(xarray.Dataset, free):
        free, k = f"{name}_{k}", k + 1
    return free
