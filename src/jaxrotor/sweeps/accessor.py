"""What a sweep's dataset offers beside what xarray does: `found.jaxrotor`."""

from typing import Any

import xarray as xr

from ..core.doors import through


@xr.register_dataset_accessor("jaxrotor")
class SweepAccessor:
    """`found.jaxrotor.plot`: pictures of a sweep, also of a store that still grows (`xarray.open_zarr`),
    and of what `rank_regression` and `sobol_indices` give. There once `jaxrotor.sweeps` is loaded."""

    def __init__(self, found: xr.Dataset):
        self.dataset = found

    @property
    def plot(self) -> Any:
        """What can be drawn of it: `print(found.jaxrotor.plot)` lists the pictures."""
        return through("plot.doors", "pictures")(self.dataset)
