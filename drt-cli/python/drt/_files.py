"""Image files."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._arrays import sized_image


def read_exr(path: str | os.PathLike[str]) -> dict[str, NDArray[np.float32]]:
    """The layers of an OpenEXR file by name, each rows × columns × 3 of single precision.

    The image is the layer `""`; `drt` calls its standard error `"stderr"`, and derivatives `"d_NAME"` and `"d_NAME_stderr"`.
    """
    return _core.read_exr(os.fspath(path))


def write_exr(path: str | os.PathLike[str], pixels: Any) -> None:
    """Writes an image, rows × columns × 3, as OpenEXR of single precision."""
    pixels, size = sized_image("image", pixels)
    _core.write_exr(os.fspath(path), list(size), pixels)


def write_png(
    path: str | os.PathLike[str],
    pixels: Any,
    *,
    exposure: float | None = 0.0,
) -> None:
    """Writes a picture to look at, of an image or of several of one size by name.

    Light is shown with this exposure in stops, at 0 of which radiance 1 is white; `None` takes what the image needs. What has negative
    values, and images whose name begins with `d_`, go from blue through white, which is zero, to red.
    """
    layers = pixels if isinstance(pixels, Mapping) else {"": pixels}
    checked = {name: sized_image(name or "image", layer) for name, layer in layers.items()}
    sizes = {size for _, size in checked.values()}
    if len(sizes) != 1:
        raise _core.Error(f"the images have {len(sizes)} sizes; expected images of one size")
    shown = [(name, layer) for name, (layer, _) in checked.items()]
    _core.write_png(os.fspath(path), list(sizes.pop()), shown, exposure)
