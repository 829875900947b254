#!/usr/bin/env python3
"""Writes a ball, the cage around it, and the density inside: layers that are thick and thin by turns."""

import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import assets


def density(x, y, z):
    return (0.55 + 0.45 * math.sin(14 * y + 5 * x * math.cos(4 * z)),)


run = assets.run_folder(__file__)
assets.write_ply(run / "ball.ply", *assets.icosphere(2))
assets.write_obj(run / "cage.obj", *assets.box_cage((-1.2, 0.0, -1.2), (1.2, 2.4, 1.2)))
assets.write_vol(run / "density.vol", 20, 1, density)
