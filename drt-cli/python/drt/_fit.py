"""Losses, and how parameters are fitted by them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _core
from ._arrays import Array, array, image, sized_image
from ._scene import Gradient, Scene

LossFunction = Callable[[Array], tuple[float, Any]]
"""A function of an image that returns a loss and ∂loss/∂image."""


class Loss:
    """A distance from a target image: `value, adjoint = loss(image)`, where `adjoint` is ∂value/∂image.

    `target`
        Rows × columns × 3, linear.
    `kind`
        `"l2"` is the sum of d² over pixels and channels, d being the difference; `"l1"` the sum of |d|; `"rmse"` the root of the mean of d²;
        `"pyramid-l2"` the sum over `levels` of `weight`ⁱ times the `"l2"` of images halved i times.
    `mask`
        Rows × columns; factors of the differences.
    """

    def __init__(
        self,
        target: Any,
        kind: str = "l2",
        *,
        mask: Any = None,
        levels: int = 10,
        weight: float = 4.0,
    ) -> None:
        pixels, self._size = sized_image("target", target)
        columns, rows = self._size
        if mask is not None:
            mask = array("mask", mask, (rows, columns))
        self._core = _core.Loss(pixels, [columns, rows], kind, mask, levels, weight)

    def __call__(self, seen: Any) -> tuple[float, Array]:
        """The loss of an image, and ∂loss/∂image."""
        return self._core(image("image", seen, self._size))


@dataclass
class Fit:
    """What `optimize` has found."""

    losses: list[float]
    """The loss at the start of each iteration."""
    values: dict[str, Array]
    """The values reached, which the scene has, too."""


def optimize(
    scene: Scene,
    loss: LossFunction | Mapping[str, LossFunction],
    wrt: str | Iterable[str] | None = None,
    *,
    iterations: int = 100,
    learning_rate: float = 0.05,
    steps: Mapping[str, Mapping[str, Any]] | None = None,
    spp: int | None = None,
    seed: int = 0,
    callback: Callable[[int, Gradient], object] | None = None,
) -> Fit:
    """Fits parameters by Adam, so that a loss of the image becomes small. The scene has the values reached at any time.

    `loss`
        A function of the image that returns the loss and ∂loss/∂image, such as a `Loss`, or one for each of several sensors by
        name, whose losses are added.
    `steps`
        By name, how a parameter is stepped, with the keys of a job's `[[parameter_group]]`: `learning_rate` (a number, or stages
        `[[0, 0.02], [100, 0.005]]`), `laplacian`, `smooth`, `bounds` and `log`.
    `callback`
        Called with the iteration and its gradient, before the step. It ends the fit when it returns `False`.

    Each iteration has a seed of its own that follows from `seed`. A step that leads to values the scene cannot have is halved,
    up to six times.
    """
    names = [wrt] if isinstance(wrt, str) else list(scene.params if wrt is None else wrt)
    functions = loss.values() if isinstance(loss, Mapping) else [loss]
    if not all(callable(function) for function in functions):
        raise TypeError("`loss` has to be a function of the image, or one for each sensor")
    unknown = [name for name in steps or {} if name not in names]
    if unknown:
        raise _core.Error(f"`steps` has `{unknown[0]}`, which is not among {', '.join(names)}")
    optimizers = {
        name: _core.Steps(scene._core, name, learning_rate, dict((steps or {}).get(name, {})))
        for name in names
    }
    losses = []
    for iteration in range(iterations):
        gradient = scene.gradient(loss, names, spp, _seed(seed, iteration))
        losses.append(float(gradient.loss or 0.0))
        if callback is not None and callback(iteration, gradient) is False:
            break
        values = {n: optimizers[n].step(gradient[n], iteration) for n in names}
        for left in reversed(range(7)):
            try:
                scene.params.update(values)
                break
            except _core.Error:
                if left == 0:
                    raise
                values = {n: optimizers[n].shorten(0.5) for n in names}
    return Fit(losses, {name: scene.params[name] for name in names})


def _seed(seed: int, iteration: int) -> int:
    """Seeds that have nothing to do with those of targets, which are often small numbers."""
    return int(np.random.SeedSequence([seed, iteration]).generate_state(1, np.uint64)[0])
