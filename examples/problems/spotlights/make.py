#!/usr/bin/env python3
"""Draws two beams of light that cross in fog, with soft edges, as a person would draw them with a brush."""

import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import assets

SIZE = 96
BEAMS = (
    # Where a beam begins and ends, half its width at its end, and its colour.
    ((0.19, 0.10), (0.72, 0.95), 0.13, (0.8, 0.2, 0.02)),
    ((0.81, 0.10), (0.24, 0.95), 0.10, (0.03, 0.25, 0.8)),
)


def beam(x, y, start, end, half, colour):
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = math.hypot(dx, dy)
    along = ((x - start[0]) * dx + (y - start[1]) * dy) / length
    aside = abs((x - start[0]) * dy - (y - start[1]) * dx) / length
    wide = half * max(along, 0) / length + 0.012
    strength = assets.smoothstep(1.15, 0.6, aside / wide) * assets.smoothstep(0.06, 0.09, along)
    strength /= 1 + 3 * max(along, 0) / length
    return [strength * c for c in colour]


def srgb(light):
    return 12.92 * light if light < 0.0031308 else 1.055 * light ** (1 / 2.4) - 0.055


def colour(column, row):
    x, y = (column + 0.5) / SIZE, (row + 0.5) / SIZE
    beams = [beam(x, y, *b) for b in BEAMS]
    return [srgb(0.002 + sum(b[k] for b in beams)) for k in range(3)]


run = assets.run_folder(__file__)
assets.write_png(run / "target.png", SIZE, SIZE, colour)
