"""What may be given for an array, and what is refused."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._core import Error

Array = NDArray[np.float64]


def array(name: str, given: Any, shape: tuple[int, ...]) -> Array:
    """The given numbers as doubles, if they are real, finite and of this shape."""
    found = np.asarray(given)
    if found.dtype.kind not in "fiub":
        raise Error(f"`{name}` has the type {found.dtype}; expected real numbers")
    if found.shape != shape:
        raise Error(f"`{name}` has the shape {found.shape}; expected {shape}")
    numbers = np.ascontiguousarray(found, dtype=np.float64).reshape(shape)
    if not np.isfinite(numbers).all():
        at = tuple(int(i) for i in np.argwhere(~np.isfinite(numbers))[0])
        where = f" at {list(at)}" if at else ""
        raise Error(f"`{name}` is {numbers[at]}{where}; expected finite numbers")
    return numbers


def image(name: str, given: Any, size: tuple[int, int]) -> Array:
    """An image of so many columns and rows."""
    columns, rows = size
    return array(name, given, (rows, columns, 3))


def sized_image(name: str, given: Any) -> tuple[Array, tuple[int, int]]:
    """An image of any size, and its columns and rows."""
    found = np.asarray(given)
    if found.ndim != 3 or found.shape[2] != 3:
        raise Error(f"`{name}` has the shape {found.shape}; expected rows x columns x 3")
    size = (found.shape[1], found.shape[0])
    return image(name, found, size), size
