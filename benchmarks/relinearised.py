"""A candidate for stiff nonlinearity: the exponential method made linear anew at each step."""

from typing import Any, ClassVar

import diffrax
import jax
import jax.numpy as jnp

from jaxrotor.integrators.phi import phi_functions


class ExponentialRosenbrock(diffrax.AbstractAdaptiveSolver):
    """exprb43 of Hochbruck, Ostermann & Schweitzer, SIAM J. Numer. Anal. 47 (2009) 786: order four with an
    estimate of order three, three evaluations, one Jacobian and the phi functions of h J a step. Time is a
    state."""

    term_structure: ClassVar = diffrax.AbstractTerm
    interpolation_cls: ClassVar[Any] = diffrax.ThirdOrderHermitePolynomialInterpolation.from_k

    def order(self, terms):
        return 4

    def init(self, terms, t0, t1, y0, args):
        return None

    def func(self, terms, t0, y0, args):
        return terms.vf(t0, y0, args)

    def step(self, terms, t0, t1, y0, args, solver_state, made_jump):
        h = t1 - t0

        def field(ty):
            value = jnp.concatenate([jnp.ones(1), terms.vf(ty[0], ty[1:], args)])
            return value, value

        start = jnp.concatenate([t0[None], y0])
        J, f = jax.jacfwd(field, has_aux=True)(start)
        half, whole = phi_functions(h * J, 4)

        def rest(y):
            return field(y)[0] - f - J @ (y - start)

        second = rest(start + 0.5 * h * (half[1] @ f))
        third = rest(start + h * (whole[1] @ (f + second)))
        error = h * (whole[4] @ (-48 * second + 12 * third))
        y1 = start + h * (whole[1] @ f + whole[3] @ (16 * second - 2 * third)) + error
        k = jnp.stack([h * f[1:], h * terms.vf(t1, y1[1:], args)])
        return y1[1:], error[1:], dict(y0=y0, y1=y1[1:], k=k), None, diffrax.RESULTS.successful
