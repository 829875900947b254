"""Scenes, jobs and their parameters."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, MutableMapping
from typing import Any

import numpy as np

from . import _core
from ._arrays import Array, array, image

Progress = Callable[[float], object]
"""Called with the part of a call that is done, from 0 to 1, at most twenty times a second. What it raises ends the call."""


def load(path: str | os.PathLike[str], /, **defaults: object) -> Scene:
    """Reads a scene (Mitsuba XML), or a job (`.toml`).

    `defaults` are values of the scene's `<default>` names, as the command's `-D NAME=VALUE`.

    Raises `Error`, which names the file, the line and what was expected.
    """
    path = os.fspath(path)
    if path.lower().endswith(".toml"):
        return Job.load(path, defaults=defaults)
    return Scene(_core.Scene.load(path, _texts(defaults), []))


class Scene:
    """A scene that is prepared once and sampled again and again, at other values of its parameters.

    Every call takes these keywords:

    `spp`
        Samples per pixel; default: what the job or the scene's sampler says.
    `seed`
        Seed of the random numbers; the same seed gives the same numbers.
    `sensor`
        Id of the sensor, or kind and order such as `"sensor[1]"`; default: the job's, or the first.
    `progress`
        Called with the part that is done, from 0 to 1, from time to time.

    Other threads of Python run meanwhile, those that use the same scene wait. Ctrl-C raises `KeyboardInterrupt`; the scene
    can be used afterwards.
    """

    def __init__(self, core: _core.Scene) -> None:
        self._core = core
        self._params = Parameters(core)
        for warning in core.warnings():
            warnings.warn(warning, stacklevel=3)

    @property
    def params(self) -> Parameters:
        """All parameters by name."""
        return self._params

    @property
    def sensors(self) -> list[str]:
        """The names of all sensors."""
        return self._core.sensors()

    def size(self, sensor: str | None = None) -> tuple[int, int]:
        """Columns and rows of the image."""
        columns, rows = self._core.size(sensor)
        return columns, rows

    def resize(self, columns: int, rows: int, sensor: str | None = None) -> None:
        """Gives the image another size, in pixels, as the command's `--size` does."""
        self._core.resize(sensor, [columns, rows])

    def render(
        self,
        spp: int | None = None,
        seed: int | None = None,
        *,
        sensor: str | None = None,
        progress: Progress | None = None,
    ) -> tuple[Array, Array]:
        """The image and its standard error, each rows × columns × 3."""
        return self._core.render(spp, seed, sensor, progress)

    def derivatives(
        self,
        wrt: str | Iterable[str] | None = None,
        spp: int | None = None,
        seed: int | None = None,
        *,
        sensor: str | None = None,
        progress: Progress | None = None,
    ) -> dict[str, tuple[Array, Array]]:
        """The derivative of the image with respect to parameters that are numbers, and its standard error, by name.

        Each is rows × columns × 3, per unit of the parameter. Without `wrt` the result has all parameters that are numbers.
        With respect to vertices, voxels and texels there are only gradients of losses.
        """
        numbers, groups = self._core.unknowns()
        names = _names(numbers if wrt is None else wrt)
        for name in names:
            if name in groups:
                raise _core.Error(
                    f"`{name}` is a group, which has a gradient, but no derivative images"
                )
            if name not in numbers:
                raise KeyError(_unknown(name, numbers))
        if not names:
            return {}
        _, found = self._core.derivatives(spp, seed, sensor, progress)
        by_name = dict(found)
        return {name: by_name[name] for name in names}

    def gradient(
        self,
        loss: Any,
        wrt: str | Iterable[str] | None = None,
        spp: int | None = None,
        seed: int | None = None,
        *,
        sensor: str | None = None,
        progress: Progress | None = None,
    ) -> Gradient:
        """The gradient of a loss with respect to parameters of any kind, by name; without `wrt` with respect to all of them.

        `loss` is one of

        - an array of rows × columns × 3, ∂loss/∂image. The image that it comes from must have another seed: with the same
          one, the errors of both are correlated and the gradient is biased.
        - a function of the image that returns the loss and ∂loss/∂image, such as a `Loss`. It is given the image with `seed`,
          and the gradient takes samples that are independent of it.
        - a dict with one of these for each of several sensors by name; their losses are added.

        Each entry has the shape of its parameter, and the unit of the loss per unit of the parameter.
        """
        names = _names(self._params if wrt is None else wrt)
        losses = loss if isinstance(loss, Mapping) else {sensor: loss}
        if sensor is not None and losses is loss:
            raise _core.Error("`sensor` does not go with a loss for each sensor")
        total = Gradient({name: np.zeros(self._params[name].shape) for name in names})
        for k, (name, one) in enumerate(losses.items()):
            part = _part(progress, k / len(losses), (k + 1) / len(losses))
            self._add_gradient(total, one, spp, seed, name, part)
        return total

    def _add_gradient(
        self,
        total: Gradient,
        loss: Any,
        spp: int | None,
        seed: int | None,
        sensor: str | None,
        progress: Progress | None,
    ) -> None:
        if callable(loss):
            seed = self._core.samples()[1] if seed is None else seed
            seen, _ = self.render(spp, seed, sensor=sensor, progress=_part(progress, 0.0, 0.3))
            value, loss = loss(seen)
            total.loss = (total.loss or 0.0) + float(value)
            total.images[sensor] = seen
            seed, progress = _core.independent_seed(seed), _part(progress, 0.3, 1.0)
        adjoint = image("adjoint", loss, self.size(sensor))
        found = self._core.gradient(list(total), adjoint, spp, seed, sensor, progress)
        for name, part in zip(total, found):
            total[name] += part


class Job(Scene):
    """A scene with named parameters, and what is said of its estimators: all that a job file says, by the same keys.

        drt.Job(
            scene="scene.xml",
            parameter=[{"name": "x", "effect": [{"target": "cube", "translate": [1, 0, 0]}]}],
            parameter_group=[{"target": "fog", "property": "sigma_t", "voxels": "all"}],
        )

    Relative file names start from `folder`, which is the working directory by default. `defaults` are values of the scene's `<default>` names.

    Raises `Error`, whose line and column are those of `text`.
    """

    def __init__(
        self,
        *,
        folder: str | os.PathLike[str] = ".",
        defaults: Mapping[str, object] | None = None,
        **keys: Any,
    ) -> None:
        super().__init__(_core.Scene.from_keys(keys, os.fspath(folder), _texts(defaults or {})))

    @classmethod
    def load(
        cls,
        path: str | os.PathLike[str],
        /,
        *,
        set: Mapping[str, object] | None = None,
        defaults: Mapping[str, object] | None = None,
    ) -> Job:
        """Reads a job file. `set` has values of dotted keys, such as `{"estimator.spp": 16}`, as the command's `--set`."""
        job = cls.__new__(cls)
        core = _core.Scene.load(
            os.fspath(path), _texts(defaults or {}), list(_texts(set or {}).items())
        )
        if core.text() is None:
            raise _core.Error(f"{os.fspath(path)} is a scene; expected a job, a .toml file")
        Scene.__init__(job, core)
        return job

    @property
    def text(self) -> str:
        """The job as TOML."""
        return self._core.text() or ""


class Parameters(MutableMapping[str, Array]):
    """The parameters of a scene by name, as read-only arrays of doubles. What is set counts from the next call on.

    | of | name | shape |
    |---|---|---|
    | a job's `[[parameter]]` | its name | () |
    | vertices | that of the group | vertices × 3, as in the shape's file |
    | a cage | that of the group | vertices of the cage × 3 |
    | voxels | that of the group | z × y × x (× 3), before the medium's scale |
    | texels | that of the group | rows × columns (× 3), linear |

    A scene without a job has groups of all of its vertices (`cube.vertices`), voxels (`fog.sigma_t`) and texels
    (`wall.reflectance`). A job has those that it declares.

    Values are replaced as a whole, `params[name] = params[name] + 1`, or several at once by `update`.
    """

    def __init__(self, core: _core.Scene) -> None:
        self._core = core
        self._names: list[str] | None = None
        self._known: dict[str, Array] = {}

    def _all(self) -> list[str]:
        if self._names is None:
            numbers, groups = self._core.unknowns()
            self._names = [*numbers, *groups]
        return self._names

    def __getitem__(self, name: str) -> Array:
        known = self._known.get(name)
        if known is None:
            known = _frozen(self._core.values(name))
            self._known[name] = known
        return known

    def __setitem__(self, name: str, value: Any) -> None:
        self.update({name: value})

    def update(self, *args: Any, **values: Any) -> None:
        """Sets several parameters at once: all of them, or none if one cannot be set."""
        given: dict[str, Any] = dict(*args, **values)
        new = {name: array(name, value, self[name].shape) for name, value in given.items()}
        # A caller may change what it has given.
        new = {name: _frozen(a.copy() if _shared(a, given[name]) else a) for name, a in new.items()}
        self._core.set(list(new.items()))
        self._known.update(new)

    def __delitem__(self, name: str) -> None:
        raise TypeError("parameters can be set, but not taken away")

    def __iter__(self) -> Iterator[str]:
        return iter(self._all())

    def __len__(self) -> int:
        return len(self._all())

    def __contains__(self, name: object) -> bool:
        return name in self._all()

    def __repr__(self) -> str:
        lines = (f"  {name}: {self[name].shape}" for name in self)
        return "\n".join(["Parameters", *lines])


class Gradient(dict[str, Array]):
    """The gradient of a loss by the names of parameters.

    Where the loss was a function, `loss` is its value and `images` has what it was given, by sensor.
    """

    loss: float | None = None
    images: dict[str | None, Array]

    def __init__(self, by_name: dict[str, Array]) -> None:
        super().__init__(by_name)
        self.images = {}

    @property
    def image(self) -> Array:
        """The image that the loss was a function of, where it was one."""
        (image,) = self.images.values()
        return image


def _texts(values: Mapping[str, object]) -> dict[str, str]:
    """Values as on a command line."""
    plain = {True: "true", False: "false"}
    return {k: plain[v] if isinstance(v, bool) else str(v) for k, v in values.items()}


def _names(wrt: str | Iterable[str]) -> list[str]:
    return [wrt] if isinstance(wrt, str) else list(wrt)


def _unknown(name: str, known: list[str]) -> str:
    return f"there is no parameter `{name}`; there are {', '.join(known) or 'nothing'}"


def _frozen(values: Array) -> Array:
    values.flags.writeable = False
    return values


def _shared(values: Array, given: Any) -> bool:
    base: Any = values
    while base is not None:
        if base is given:
            return True
        base = getattr(base, "base", None)
    return False


def _part(progress: Progress | None, start: float, end: float) -> Progress | None:
    if progress is None:
        return None
    return lambda done: progress(start + (end - start) * done)
