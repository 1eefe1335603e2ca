"""Stiff one way, soft the other."""

from ...core.parameter import parameter
from ...core.protocol import NonSmooth
from .law import AbstractLaw, Scalar, States
from .touch import area, pressed, pressed_lost


class Bilinear(AbstractLaw, NonSmooth):
    """`stiffness x` for x > 0 and `other_stiffness x` for x < 0, with a damper beside each: two faces
    without play between them, each of which pushes or, where its damper would hold on, does nothing
    (`Backlash` says more; its `hysteresis` is here too, one for both).

    A pedestal with loose bolts pressed down (y < 0) stands on its foot, and lifted (y > 0) hangs on what
    its bolts still hold: `LawSupport(y=Bilinear(stiffness=loose, other_stiffness=firm))`. A stop on one
    side has `other_stiffness=0`. `smoothing` (m or rad): both give way to each other over this distance to
    either side of zero; with it the damping is continuous too. Source: Goldman & Muszynska, J. Eng. Gas
    Turbines Power 113 (1991) 567, "Analytical and experimental simulation of loose pedestal dynamic effects".
    """

    stiffness: Scalar = parameter("N*m/rad", nonnegative=True)
    other_stiffness: Scalar = parameter("N*m/rad", nonnegative=True)
    damping: Scalar = parameter("N*m*s/rad", nonnegative=True, default=0.0)
    other_damping: Scalar = parameter("N*m*s/rad", nonnegative=True, default=0.0)
    smoothing: Scalar = parameter("rad", nonnegative=True, default=0.0)
    hysteresis: Scalar = parameter("s/rad", nonnegative=True, default=0.0)

    def _how(self) -> tuple[tuple[Scalar, ...], tuple[Scalar, ...]]:
        both = self.hysteresis, self.smoothing
        return (
            (self.stiffness, self.damping, *both),
            (self.other_stiffness, self.other_damping, *both),
        )

    def force(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> Scalar:
        one, other = self._how()
        return pressed(x, v, *one) - pressed(-x, -v, *other)

    def energy(self, t: Scalar, x: Scalar, state: States) -> Scalar:
        w = self.smoothing
        return self.stiffness * area(x, w) + self.other_stiffness * area(-x, w)

    def power_lost(self, t: Scalar, x: Scalar, v: Scalar, state: States) -> Scalar:
        one, other = self._how()
        return pressed_lost(x, v, *one) + pressed_lost(-x, -v, *other)
