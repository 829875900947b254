#!/usr/bin/env python3
"""Writes the surface of the water, flat, of 12 × 12 vertices."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import assets

run = assets.run_folder(__file__)
assets.write_ply(run / "water.ply", *assets.sheet(12, 2.0))
