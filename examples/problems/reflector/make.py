#!/usr/bin/env python3
"""Makes the triangle, and the density and the colour of the smoke that it reflects."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import assets


def colour(x, y, z):
    """The smoke is blue below and orange above, and the border between the two is ragged."""
    t = assets.smoothstep(0.3, 0.7, y + 0.5 * (assets.billows(3 * x, 3 * y, 3 * z, 2) - 0.5))
    return tuple(a + t * (b - a) for a, b in zip((0.4, 0.7, 0.98), (0.99, 0.75, 0.4)))


run = assets.run_folder(__file__)
assets.write_ply(run / "triangle.ply", [(-0.65, -0.1, 0.35), (0.65, 0, -0.3), (0.05, 1.1, 0.0)], [(0, 1, 2)])
assets.write_vol(run / "density.vol", 40, 1, lambda x, y, z: (assets.smoke(x, y, z),))
assets.write_vol(run / "albedo.vol", 16, 3, colour)
