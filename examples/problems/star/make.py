#!/usr/bin/env python3
"""Writes the lamp: a star whose five arms differ in length, so that it looks like itself only after a whole turn."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import assets

run = assets.run_folder(__file__)
assets.write_ply(run / "star.ply", *assets.star([1.5, 0.6, 0.9, 0.55, 0.75], 0.25))
