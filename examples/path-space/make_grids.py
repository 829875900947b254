#!/usr/bin/env python3
"""Writes the grids of these scenes: python3 examples/path-space/make_grids.py"""

import math
import pathlib
import struct

HERE = pathlib.Path(__file__).resolve().parent


def write(path, size, channels, value):
    """A Mitsuba .vol file of the unit cube, x fastest; `value` maps the middle of a voxel to numbers."""
    cells = [[(k + 0.5) / n for k in range(n)] for n in size]
    data = [v for z in cells[2] for y in cells[1] for x in cells[0] for v in value(x, y, z)]
    head = b"VOL\x03" + struct.pack("<5i6f", 1, *size, channels, 0, 0, 0, 1, 1, 1)
    path.write_bytes(head + struct.pack(f"<{len(data)}f", *data))


def mist(x, y, z):
    """Drifts, 0.3 to 1, thinner upwards."""
    waves = math.sin(9 * x + 2 * y) * math.cos(7 * z - 3 * y) + 0.5 * math.sin(13 * (x + z))
    return [(0.65 + 0.23 * waves) * (1 - 0.5 * y)]


def marble_density(x, y, z):
    """Veins, 0.4 to 1."""
    return [0.7 + 0.3 * math.sin(11 * x + 3 * math.sin(7 * y) + 5 * z)]


def marble_albedo(x, y, z):
    """From cream to rust along the veins."""
    vein = 0.5 + 0.5 * math.sin(11 * x + 3 * math.sin(7 * y) + 5 * z)
    return [0.985, 0.9 + 0.075 * vein, 0.7 + 0.25 * vein]


def main():
    write(HERE / "branches/mist.vol", [16, 4, 16], 1, mist)
    write(HERE / "bust/density.vol", [12, 12, 12], 1, marble_density)
    write(HERE / "bust/albedo.vol", [12, 12, 12], 3, marble_albedo)


if __name__ == "__main__":
    main()
