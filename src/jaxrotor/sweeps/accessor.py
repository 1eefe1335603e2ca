"""What a sweep's dataset offers beside what xarray does: `found.jaxrotor`."""

import xarray as xr

from ..core.doors import plot_door


@xr.register_dataset_accessor("jaxrotor")
class SweepAccessor:
    """`found.jaxrotor.plot`: pictures of a sweep, also of a store that still grows (`xarray.open_zarr`),
    and of what `rank_regression` and `sobol_indices` give. There once `jaxrotor.sweeps` is loaded."""

    def __init__(self, found: xr.Dataset):
        self.dataset = found

    plot = plot_door()
