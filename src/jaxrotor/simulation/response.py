"""The result of a run, by the names of the machine's parts."""

import os
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..core.arguments import names, path
from ..core.doors import plot_door, through
from ..core.errors import InputError
from ..core.files import written_whole
from ..core.gate import takes
from ..core.kinematics import spin_speed, to_turning
from ..core.parameter import numbers
from ..core.protocol import Ported, Signalling
from ..core.quick import lightly_compiled
from ..machine.field import Evaluation, evaluate, initial_states, n_free, station_motions
from ..machine.layout import turns_by_chi
from ..machine.lineup import Lineup, structure_of
from ..machine.machine import Machine
from ..machine.system import System, assemble
from ..machine.wiring import unknown
from .assembling import system_of
from .named_parts import forces_on_ends, inner_element, part_of
from .run_info import RunInfo

if TYPE_CHECKING:
    import xarray


class Response(eqx.Module):
    """Samples of a run; `response["main"].x` and so on.

    - `t`: (nt,), s.
    - `y`: (nt, d), the solver's own state at the samples.
    - `machine`: the machine that ran.
    - `response["name"]`: a `StationResponse` or a `ConnectorResponse`.
    - `stats`: how it was made: solver, step (s), the error that the pilot saw, seconds spent; `error`, the
      run's own estimate, as part of each coordinate's peak.

    A pytree: it can be returned from `jit` and `vmap`. A batch has a leading axis everywhere:
    `response.member(i)` takes one out.
    """

    machine: Machine
    t: Float[Array, " nt"]
    y: Float[Array, "nt d"]
    info: RunInfo

    plot = plot_door()

    def __repr__(self) -> str:
        return through("simulation.response_text", "response_text")(self)

    def __getitem__(self, name: str) -> "StationResponse | ConnectorResponse":
        if self.t.ndim != 1:
            raise InputError("this is a batch of responses: take one out with `response.member(i)`")
        wiring = self.lineup.wiring
        if name in wiring.stations:
            return StationResponse(self, name)
        if name in wiring.connectors:
            return ConnectorResponse(self, name)
        own = [k for k in (*wiring.stations, *wiring.connectors) if k.startswith(f"{name}.")]
        if name in wiring.order and own:
            raise InputError(
                f"`{name}` is made of several parts: name one, " + ", ".join(f"`{k}`" for k in own)
            )
        raise InputError(unknown("element", name, (*wiring.order, *own)))

    @cached_property
    def lineup(self) -> Lineup:
        """All parts by name, those inside composites too; shapes in place of numbers."""
        return structure_of(self.machine)

    @cached_property
    def _system(self) -> System:
        """What ran; a traced run brings its own along."""
        return system_of(self.machine)

    @cached_property
    def evaluation(self) -> Evaluation:
        """Every sample evaluated, once for all parts: accelerations, reactions, nodes."""
        return _evaluate_all(self._system, self.t, self.y)

    @cached_property
    def motion(self) -> tuple[Float[Array, "nt n 6"], Float[Array, "nt n 6"]]:
        """Coordinates of all stations, and their rates, at every sample."""
        return _motion(self._system, self.t, self.y)

    def member(self, i: int) -> "Response":
        """Response i of a batch."""
        return jax.tree.map(lambda x: x[i], self)

    @property
    def stats(self) -> dict[str, Any]:
        found = {name: getattr(self.info, name) for name in RunInfo.__dataclass_fields__}
        return {
            name: value.item() if hasattr(value, "item") and np.ndim(value) == 0 else value
            for name, value in found.items()
            if value is not None
        }

    def failed_at(self) -> int | None:
        """Index of the first sample that is not finite, or `None`."""
        bad = ~np.all(np.isfinite(numbers(self.y)), axis=-1)
        return int(np.argmax(bad)) if bad.any() else None

    def until(self, sample: int) -> "Response":
        """The samples before `sample`."""
        return eqx.tree_at(lambda r: (r.t, r.y), self, (self.t[:sample], self.y[:sample]))

    def to_xarray(self) -> "xarray.Dataset":
        """An `xarray.Dataset`: `position`, `velocity`, `acceleration` and `reaction` (time, station,
        coordinate), `speed` and `mass_centre`; and one by one, as `part_quantity`, each station's
        coordinates and speed, the elements' own signals and what each exerts: `ds.main_x`,
        `ds.rubber_torque`, `ds.rubber_forces`. What no name may hold becomes `_` (`"shaft 2"`:
        `ds.shaft_2_torque`); where two would be the same, the later has a number behind. Units, long names,
        `element` and `quantity` are attributes, and so is how it was run.
        """
        return through("simulation.export", "to_xarray")(self)

    @takes(path=path, names=names)
    def to_csv(
        self, path: str | os.PathLike[str], names: str | Sequence[str] | None = None
    ) -> Path:
        """Writes time and quantities as a table, whole or not at all: a line of names (`"t"`, `"main.x"`,
        ...), a line of units, then a line for each sample with all digits. `read_record` reads it.

        `names`: `"main.x"`, `"main.speed"`, `"shaft.torque"` and what else a study's figures may show (of
        vectors their size); left out, the coordinates and the speed of each station and the elements' own
        signals. Raises `InputError` for a batch and for what the machine has not.
        """
        return through("study.table", "save_csv")(self, path, names)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Writes netCDF, whole or not at all."""
        # by way of memory: HDF5 crashes the program when it closes a file for which the disk has no room
        data = self.to_xarray().to_netcdf(engine="h5netcdf", invalid_netcdf=False)
        with written_whole(Path(path)) as part:
            part.write_bytes(data)
        return Path(path)


@lightly_compiled
def _motion(system: System, t: Array, y: Array) -> tuple[Array, Array]:
    both = jax.vmap(lambda t, y: station_motions(t, y, system))(t, y)
    order = np.array(system.layout.internal)
    q, v = (jnp.swapaxes(x, 1, 2)[:, order] for x in both)
    return q, v


@lightly_compiled
def _evaluate_all(system: System, t: Array, y: Array) -> Evaluation:
    """Every sample, in the machine's order of stations: arrays (nt, n, 6); nodes stay internal."""

    def one(t, y):
        ev = evaluate(t, y, system)
        return ev, ev.angles(system.layout.invariant)

    ev, (q, v, a) = jax.vmap(one)(t, y)
    order = np.array(system.layout.internal)

    def sort(x):
        return jnp.swapaxes(x, 1, 2)[:, order]

    return Evaluation(
        sort(q),
        sort(v),
        sort(a),
        ev.nodes,
        ev.loads,
        sort(ev.reaction),
        ev.states,
        ev.rates,
        ev.answer,
    )


class _Part:
    """What stations and connectors have in common: signals of their own."""

    def __init__(self, response: Response, name: str):
        self._response, self._name = response, name
        self._element = _element(response, name)

    def __repr__(self) -> str:
        return through("simulation.response_text", "part_text")(self)

    def _evaluation(self) -> Evaluation:
        return self._response.evaluation

    def signals(self) -> dict[str, str]:
        """name -> unit of the element's own quantities, each an attribute here."""
        return self._element.signals if isinstance(self._element, Signalling) else {}

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name not in self.signals():
            known = [k for k in dir(type(self)) if not k.startswith("_")] + list(self.signals())
            raise AttributeError(f"`{self._name}`: {unknown('result', name, known)}")
        r = self._response
        return _signal(r.machine, r._system, r.t, self._evaluation(), self._name, name)


@lightly_compiled
def _signal(
    machine: Machine, system: System, t: Array, ev: Evaluation, name: str, signal: str
) -> Array:
    element, nodes, states = part_of(machine, system, name)

    def one(t, q, v, z):
        motions = tuple((q[:, i], v[:, i]) for i in nodes)
        return getattr(element, signal)(t, motions, z[states] if states.size else None)

    return jax.vmap(one)(t, *ev.nodes, ev.states)


def _element(response: Response, name: str) -> Any:
    """The element of a name; one from inside a composite has the numbers of this machine."""
    machine = response.machine
    if name in machine.wiring.order:
        return machine[name]
    return inner_element(machine, name)


class StationResponse(_Part):
    """One station over time. Displacements in m, angles in rad, along and about x, y, z; the angles
    are 1-2-3 with phi the spin.

    Beside what is listed here, an element's own signals: a bearing's `bearing_force` (nt, 3), N.
    """

    def _index(self) -> int:
        return self._response.lineup.wiring.stations.index(self._name)

    @property
    def position(self) -> Float[Array, "nt 6"]:
        """x, y, z, psi, theta, phi."""
        return self._response.motion[0][:, self._index()]

    @property
    def velocity(self) -> Float[Array, "nt 6"]:
        """Rates of `position`; the last is phi', not `speed`."""
        return self._response.motion[1][:, self._index()]

    @property
    def acceleration(self) -> Float[Array, "nt 6"]:
        """Second derivatives of `position`."""
        return self._evaluation().a[:, self._index()]

    @property
    def reaction(self) -> Float[Array, "nt 6"]:
        """Generalized constraint force ON the station where its motion is given: N, N·m. The last
        entry of a driven end is the drive's torque; 0 for what is free. It does work on the turning chi =
        phi + psi theta/2 (on phi in the paper's machines)."""
        return self._evaluation().reaction[:, self._index()]

    @property
    def power(self) -> Float[Array, " nt"]:
        """Power of `reaction`, W: what the drive puts in."""
        v = self.velocity
        if turns_by_chi(self._response.lineup):
            v = to_turning(self.position.T, v.T)[1].T
        return jnp.sum(self.reaction * v, axis=1)

    @property
    def x(self) -> Float[Array, " nt"]:
        """m"""
        return self.position[:, 0]

    @property
    def y(self) -> Float[Array, " nt"]:
        """m"""
        return self.position[:, 1]

    @property
    def z(self) -> Float[Array, " nt"]:
        """m"""
        return self.position[:, 2]

    @property
    def psi(self) -> Float[Array, " nt"]:
        """rad"""
        return self.position[:, 3]

    @property
    def theta(self) -> Float[Array, " nt"]:
        """rad"""
        return self.position[:, 4]

    @property
    def phi(self) -> Float[Array, " nt"]:
        """rad"""
        return self.position[:, 5]

    @property
    def speed(self) -> Float[Array, " nt"]:
        """Speed about the shaft's own axis, rad/s: phi' + psi' sin theta."""
        return spin_speed(self.position.T, self.velocity.T)

    @property
    def mass_centre(self) -> Float[Array, "nt 3"]:
        """Where the mass centre is, m; the geometric centre for a balanced part."""
        element, q = self._element, self.position
        if isinstance(element, Ported) and "mass_centre" in element.ports:

            def offset(p):
                shift = element.shift("mass_centre", p)
                return jnp.zeros(3) if shift is None else shift[:3]

            return q[:, :3] + jax.vmap(offset)(q)
        return q[:, :3]


class ConnectorResponse(_Part):
    """One shaft, coupling or attachment over time: its own signals, such as a shaft's `torque`
    (nt,), N·m, and the forces that it exerts."""

    @property
    def forces(self) -> Float[Array, "nt ends 6"]:
        """Generalized force ON each of its stations (or ports), in the order of its ends."""
        r = self._response
        return _forces(r.machine, r._system, r.t, self._evaluation(), self._name)


@lightly_compiled
def _forces(machine: Machine, system: System, t: Array, ev: Evaluation, name: str) -> Array:
    element, nodes, states = part_of(machine, system, name)

    def one(t, q, v, z):
        motions = tuple((q[:, i], v[:, i]) for i in nodes)
        return forces_on_ends(element, t, motions, z[states] if states.size else None)

    return jax.vmap(one)(t, *ev.nodes, ev.states)


def blank_run(machine: Machine, t: Float[Array, " nt"]) -> Response:
    """A run whose shapes alone are right: under `eqx.filter_eval_shape` it shows, without a run, whether what
    looks at it finds what it looks for."""
    system = assemble(machine)
    size = 2 * n_free(system) + initial_states(system).size
    return Response(machine, t, jnp.zeros((t.size, size)), RunInfo("none"))
