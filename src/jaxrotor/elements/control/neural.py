"""A small neural network as a controller."""

from collections.abc import Iterator
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float, PRNGKeyArray

from ...core.arguments import whole
from ...core.parameter import parameter
from ...core.part import option
from .controller import AbstractController, States, Values


class NeuralController(AbstractController):
    """`torque_scale` times what a multilayer perceptron (`equinox.nn.MLP`, tanh, no bias at its end) makes of
    the measured values over their `scales`, less what it makes of zeros: at rest it asks for no torque.

    `weights`: all of them in one list, so that they are one parameter of the machine; `start` makes a
    network. `width`, `depth`: neurons in a layer, hidden layers.
    """

    weights: Float[Array, " n"] = parameter(shapes=((None,),))
    scales: Float[Array, " k"] = parameter(
        positive=True, shapes=((None,),), label="size of each measured value"
    )
    torque_scale: Float[Array, ""] = parameter("N*m", positive=True)
    width: int = option(whole(1, 10_000), default=8)
    depth: int = option(whole(0, 100), default=1)

    @classmethod
    def start(
        cls, scales: Any, torque_scale: Any, key: PRNGKeyArray, width: int = 8, depth: int = 1
    ) -> "NeuralController":
        """Random weights, the last layer's a hundredth of the usual: it begins as next to nothing."""
        network = _network(np.size(scales), width, depth, key)
        last = network.layers[-1].weight
        network = eqx.tree_at(lambda n: n.layers[-1].weight, network, 0.01 * last)
        return cls(ravel_pytree(network_arrays(network))[0], scales, torque_scale, width, depth)

    def initial(self) -> States:
        return jnp.zeros(0)

    def torque(self, seen: Values, state: States) -> Float[Array, ""]:
        skeleton = _network(self.scales.shape[0], self.width, self.depth, jax.random.PRNGKey(0))
        arrays, rest = eqx.partition(skeleton, eqx.is_array)
        network = eqx.combine(ravel_pytree(arrays)[1](self.weights), rest)
        return self.torque_scale * (network(seen / self.scales) - network(jnp.zeros_like(seen)))

    def rates(self, seen: Values, state: States, excess: Float[Array, ""]) -> States:
        return jnp.zeros(0)

    def faults(self) -> Iterator[str]:
        count = ravel_pytree(
            network_arrays(
                _network(self.scales.shape[0], self.width, self.depth, jax.random.PRNGKey(0))
            )
        )[0].size
        if self.weights.size != count:
            yield (
                f"weights must be {count} numbers for {self.scales.shape[0]} values, {self.depth} layers of "
                f"{self.width}, but are {self.weights.size}: NeuralController.start makes them"
            )


def network_arrays(network):
    return eqx.filter(network, eqx.is_array)


def _network(inputs: int, width: int, depth: int, key: PRNGKeyArray) -> eqx.nn.MLP:
    return eqx.nn.MLP(
        inputs, "scalar", width, depth, activation=jnp.tanh, use_final_bias=False, key=key, dtype=float
    )  # fmt: skip
