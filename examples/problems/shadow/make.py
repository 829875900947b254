#!/usr/bin/env python3
"""Makes the smoke whose shadow is seen: its density and its colour."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import assets


def density(x, y, z):
    """A plume that lies on its side: it rises along x."""
    return (assets.smoke(y, x, z),)


def albedo(x, y, z):
    """The smoke goes from red through yellow to blue along x, and the borders between the colours are ragged."""
    t = x + 0.4 * (assets.billows(3 * x, 3 * y, 3 * z, 2) - 0.5)
    a, b = assets.smoothstep(0.2, 0.5, t), assets.smoothstep(0.45, 0.8, t)
    colours = ((0.99, 0.3, 0.2), (0.99, 0.9, 0.2), (0.15, 0.5, 0.99))
    weights = (1 - a, a * (1 - b), a * b)
    return tuple(sum(w * c[k] for w, c in zip(weights, colours)) for k in range(3))


run = assets.run_folder(__file__)
assets.write_vol(run / "density.vol", 48, 1, density)
assets.write_vol(run / "albedo.vol", 16, 3, albedo)
