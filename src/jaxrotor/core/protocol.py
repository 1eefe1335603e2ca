"""What an element offers. A class inherits the abilities it has and nothing else.

A *station* has six coordinates `q = (x, y, z, psi, theta, phi)` and their rates `v`, SI units,
angles 1-2-3 (see `kinematics`). A *motion* is the pair `(q, v)`. A *generalized force*
`Q = (Fx, Fy, Fz, Q_psi, Q_theta, Q_phi)` is conjugate to q and acts ON the station.

What has mass (`AbstractInertia`, `Ported`, `Massive` energies) is given phi itself. What acts (connectors,
attachments) is given chi = phi + psi theta/2 in its place, and its sixth force is conjugate to chi: the
turning that does not depend on how the axes across were laid. (In the paper's machines, whose shafts say
`twist="paper"`, it is given phi.)

Everything here is written for ONE station or connection: the machine stacks the elements of one
kind and maps over them. Elements know no names and no node numbers, or they would not stack.
"""

import abc
import functools
from typing import Any, ClassVar, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .part import Part

Vec6 = Float[Array, "6"]
Motion = tuple[Vec6, Vec6]


class AbstractElement(Part):
    """Any part of a machine."""


class AbstractStation(AbstractElement):
    """A part that has a place in the line and six coordinates there."""


class AbstractInertia(AbstractStation):
    """A station with mass, whose coordinates are found by the simulation."""

    # True where the equations are linear in the angles: they are then given chi, as force laws are.
    small_tilts: ClassVar[bool] = False
    # True where nothing but phi moves: the machine holds the rest.
    turns_only: ClassVar[bool] = False
    # True where `weight` only adds gravity to x'', y'' and z'', as to a rigid body, wherever its mass
    # centre is: it is then added to these.
    falls_freely: ClassVar[bool] = False

    @abc.abstractmethod
    def acceleration(self, q: Vec6, v: Vec6, Q: Vec6) -> Vec6:
        """The second derivatives of `q` under the generalized force `Q`, in closed form."""

    @abc.abstractmethod
    def kinetic_energy(self, q: Vec6, v: Vec6) -> Float[Array, ""]:
        """J. Written from the motion of the mass, not from `acceleration`."""

    @abc.abstractmethod
    def weight(self, q: Vec6, gravity: Float[Array, "3"]) -> Vec6:
        """Generalized force of gravity (m/s², a vector that points down)."""

    @abc.abstractmethod
    def height_energy(self, q: Vec6, gravity: Float[Array, "3"]) -> Float[Array, ""]:
        """Potential energy in gravity, J, zero in the design position of an ideal part."""


class AbstractPrescribed(AbstractStation):
    """A station whose motion is given; what it takes to move it so is its `reaction`."""

    # True where every coordinate but phi stays zero.
    spin_only: eqx.AbstractClassVar[bool]

    @abc.abstractmethod
    def motion(self, t: Float[Array, ""]) -> Vec6:
        """The coordinates at time `t`; their rates follow by differentiation."""


class Acting(AbstractElement):
    """Has a force law: on two stations (elastic), on named ones (attachment), or on itself."""

    @abc.abstractmethod
    def forces(
        self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any
    ) -> tuple[Vec6, ...] | None:
        """Generalized forces ON each station, in the order of `motions`.

        Whatever `matrices` describes is left out here; `None` says that nothing else is there.
        """


class AbstractConnector(AbstractElement):
    """Stands between two stations (or ports of stations), in the order of the line."""


class AbstractElastic(AbstractConnector, Acting):
    """Joins two stations by a force law."""


class Parts(NamedTuple):
    """What a composite is made of. Elements come stacked: every array has one more axis, the last,
    of length `count`.

    - `stations`: (stacked element, count) of each kind of inner station, numbered through from 0.
    - `connectors`: (label, stacked element, ends) of each kind; `ends` has, for each end, `count`
      places: the number of an inner station, or `LEFT` or `RIGHT`, the composite's own ends.
    """

    stations: tuple[tuple[AbstractElement, int], ...]
    connectors: tuple[tuple[str, AbstractElement, tuple[tuple[int, ...], ...]], ...]


LEFT, RIGHT = -1, -2


class Composite(AbstractConnector):
    """Stands for several elements with stations of its own between them.

    Inner station k (from 1) of a composite `shaft` is `"shaft.k"` to the user.
    """

    @property
    @abc.abstractmethod
    def inner(self) -> int:
        """How many stations it makes."""

    @abc.abstractmethod
    def parts(self) -> Parts:
        """The elements, made anew in each solve, so that derivatives pass through."""


class AbstractAttachment(Acting):
    """Acts at one station or more, against the ground, against each other, or from outside."""


class Linear(AbstractElement):
    """Has a constant linear part, which the machine assembles once a solve."""

    @abc.abstractmethod
    def matrices(self) -> tuple[Float[Array, "n n"], Float[Array, "n n"]]:
        """Stiffness K and damping C (n = 6 for each station): the force is `-K q - C v`."""


class Massive(AbstractElement):
    """Carries inertia that couples the accelerations of its stations: consistent mass.

    Its kinetic energy is `v' M v/2` with M constant and v the rates of each station's coordinates,
    phi' replaced by the spin `w = phi' + psi' sin theta`: so gyroscopic moments come from the same
    energy, and the books close.
    """

    # False where gravity does not pull on it: what flows through a seal.
    weighs: ClassVar[bool] = True

    @abc.abstractmethod
    def mass_matrix(self) -> Float[Array, "n n"] | None:
        """M, n = 6 for each station; symmetric. `None` says that this one carries no inertia."""

    @abc.abstractmethod
    def kinetic_energy(self, motions: tuple[Motion, ...]) -> Float[Array, ""]:
        """J; written without `mass_matrix`."""

    @abc.abstractmethod
    def height_energy(
        self, motions: tuple[Motion, ...], gravity: Float[Array, "3"]
    ) -> Float[Array, ""]:
        """Potential energy in gravity, J; linear in the coordinates."""


class Inertial(AbstractElement):
    """Answers to the acceleration of its first station with a force `-E a` there, E a matrix that may change
    with the motion: a seal's inertia over the speed, an unbalance stuck on a shaft.

    Of the accelerations, the sixth is that of the spin `w` of `Massive`.
    """

    # Coordinates that E couples; its other rows and columns are not looked at.
    answers: ClassVar[tuple[int, ...]] = (0, 1, 2, 3, 4)

    @abc.abstractmethod
    def inertia(
        self, t: Float[Array, ""], motions: tuple[Motion, ...]
    ) -> Float[Array, "6 6"] | None:
        """E; `None` says that this one has none."""


class Condensable(Massive, Linear, Acting):
    """A piece of circular shaft between two stations, linear but for its turning. Where nothing else acts on
    a station between two such pieces, the station may follow those beside it (machine/condensed.py).

    Bending in two planes, stretching and twisting do not couple in `matrices` and `mass_matrix`; its
    `forces` are `core.turning.turning_forces` of what `turning` tells, and its stations' own weight,
    momentum and states are none.
    """

    @abc.abstractmethod
    def turning(self) -> tuple[Float[Array, "12 12"], Float[Array, "12 12"] | None]:
        """G, skew: the gyroscopic moments per rad/s of spin less what the spin's momentum gives at the ends;
        and what of the damping turns with the shaft, `None` where none does."""


class Carrying(AbstractConnector):
    """Gives inertia to the stations beside it; nothing need be lumped to them."""


class Carried(AbstractStation):
    """A station that may have no inertia of its own, or not in all coordinates: shafts with mass
    that adjoin it make up for what is missing."""

    @abc.abstractmethod
    def own_mass(self) -> Float[Array, "6 6"] | None:
        """Its constant inertia, which may be singular; `None` where it needs nobody's help."""


class Geared(AbstractElement):
    """Joins two lines that turn at different speeds; as a station, two of its ports do."""

    @abc.abstractmethod
    def ratio(self) -> Float[Array, ""]:
        """Speed of the second station over that of the first."""


class Epicyclic(Geared):
    """Three stations on one axis of which two speeds make the third. Its `ratio` is that of the first two
    where the third stands still."""

    @abc.abstractmethod
    def balance(self) -> Float[Array, "3"]:
        """What the speeds of its stations are multiplied by so that the sum is nothing (Willis)."""


class Prepared(AbstractElement):
    """Has work to do once a solve, before any step: a flow to be found, curves to be drawn."""

    @abc.abstractmethod
    def prepared(self) -> AbstractElement:
        """What acts in its place, at the same stations; derivatives pass through."""


class Energetic(AbstractElement):
    """Can account for its energy; written without using `forces` or `matrices`."""

    @abc.abstractmethod
    def energy(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        """Energy stored, J."""

    @abc.abstractmethod
    def power_lost(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        """Power turned into heat, W; never negative for a passive part."""


class Powered(AbstractElement):
    """Is fed from outside the machine: a motor by its supply, a governor by its actuator.

    For parts that are `Energetic` too (their forces are not counted as a load's work then).
    """

    @abc.abstractmethod
    def power_in(self, t: Float[Array, ""], motions: tuple[Motion, ...], state: Any) -> Array:
        """Power drawn from outside, W."""


class NonSmooth(eqx.Module):
    """Marks an element, or a law inside one, whose force kinks, sticks or stiffens with its state.

    The exponential methods are made for smooth forces: a machine with such a part is run by
    `Rosenbrock` unless its user says otherwise.
    """


class Stateful(AbstractElement):
    """Has internal states of its own: hysteresis, filters, currents."""

    @abc.abstractmethod
    def initial(self) -> Float[Array, " k"]:
        """The states at the start."""

    @abc.abstractmethod
    def rates(
        self,
        t: Float[Array, ""],
        motions: tuple[Motion, ...],
        accelerations: tuple[Vec6, ...],
        state: Float[Array, " k"],
    ) -> Float[Array, " k"]:
        """Time derivatives of the states, evaluated after the accelerations."""


class Settling(Stateful):
    """Its states are a motion that a static start must find at rest too: that of a foundation. At rest their
    `rates` are zero."""


class Sampled(Stateful):
    """Changes some of its states at instants alone, as a sampling controller does; their `rates` are zero."""

    @abc.abstractmethod
    def clocks(self) -> tuple[tuple[float, float], ...]:
        """(period, first instant) of each clock, s: plain numbers, for the solver steps onto the instants."""

    @abc.abstractmethod
    def ticked(
        self,
        clock: int,
        t: Float[Array, ""],
        motions: tuple[Motion, ...],
        state: Float[Array, " k"],
    ) -> Float[Array, " k"]:
        """The states behind an instant of that clock. Where several clocks tick at once, in their order."""


class Timed(AbstractElement):
    """Knows instants at which its force jumps; steps land there and multistep solvers restart."""

    @abc.abstractmethod
    def times(self) -> Float[Array, " n"]:
        """The instants, s."""


# The port that is a point of the body, found by its attitude: given phi. All others are given what force
# laws are given.
MASS_CENTRE = "mass_centre"


class Ported(AbstractStation):
    """A station that can be held at other places than its geometric centre's coordinates."""

    # Names of the ports that may be wired to, beside the centre itself.
    ports: eqx.AbstractClassVar[tuple[str, ...]]

    def turns(self, port: str) -> Float[Array, ""]:
        """How many times as fast as the station `port` turns, where gears stand between: as `shift` says."""
        return jnp.ones(())

    @abc.abstractmethod
    def shift(self, port: str, q: Vec6) -> Vec6 | None:
        """Coordinates of `port` less the station's own; `port` "" is where shafts are fixed.

        `None` says that the port is the station's own centre. Forces on a port reach the station
        with the moments that this map implies (virtual work).
        """


class Ended(Ported):
    """A station of some length: in a line, what adjoins it is wired to its ends."""

    @abc.abstractmethod
    def end(self, side: str) -> str:
        """What to append to its name for its `"left"` or `"right"` end: `".left"`, or nothing."""


class Lumping(AbstractInertia):
    """A station that carries a share of the adjoining shafts where the user gives none."""

    @abc.abstractmethod
    def lumped(self, neighbours: tuple[AbstractElement, ...]) -> "Lumping":
        """The same station with the share filled in, from the elastic elements beside it."""


class Nominal(AbstractElement):
    """Has a balanced form, about which the exponential solvers linearise."""

    # False where what is left out repeats with something else than the turns of its shaft: no order of it.
    once_per_turn: ClassVar[bool] = True

    @abc.abstractmethod
    def nominal(self) -> AbstractElement:
        """The element without what turns with the shaft (unbalance, imperfection)."""


class Tabulated(AbstractElement):
    """Draws on a table over its own motion. Beyond the table's ends the last value is held, and a run that
    goes there says so."""

    # What it says, of the table's ends, where the run goes, and the unit.
    beyond: ClassVar[str] = (
        "its table ends at {first:.6g} and {last:.6g} {unit}, but the run goes to {found} {unit}: its last "
        "value is held there; give it more rows"
    )

    @abc.abstractmethod
    def looked_up(self, motions: tuple[Motion, ...]) -> tuple[Array, Float[Array, " n"], str]:
        """What the table is entered with, its rows, and their unit."""


class Signalling(AbstractElement):
    """Offers quantities of its own in the results, under their method's name."""

    # name -> unit; `getattr(element, name)(t, motions, state)` gives the quantity.
    signals: ClassVar[dict[str, str]] = {}


def is_massive(element: Any) -> bool:
    """Whether it is `Massive` and carries inertia; nothing is computed."""
    if not isinstance(element, Massive):
        return False
    leaves, tree = jax.tree.flatten(jax.eval_shape(lambda: element))
    return _has_mass_matrix(tree, tuple((x.shape, x.dtype) for x in leaves))


@functools.cache  # a machine of many stations has many of a kind
def _has_mass_matrix(tree: Any, leaves: tuple) -> bool:
    element = jax.tree.unflatten(tree, [jax.ShapeDtypeStruct(*x) for x in leaves])
    return jax.eval_shape(lambda e: e.mass_matrix(), element) is not None


def is_inertial(element: Any, ends: int) -> bool:
    """Whether it is `Inertial`, one of `ends` ends, and has an inertia; nothing is computed."""
    six = jax.ShapeDtypeStruct((6,), jnp.float64)
    motions, now = ((six, six),) * ends, jax.ShapeDtypeStruct((), jnp.float64)
    return (
        isinstance(element, Inertial)
        and jax.eval_shape(lambda e, t, m: e.inertia(t, m), element, now, motions) is not None
    )


def first_of(stacked: Any) -> Any:
    """Shapes and options of one of stacked elements."""
    return jax.tree.map(lambda x: jax.ShapeDtypeStruct(x.shape[:-1], x.dtype), stacked)
