#!/usr/bin/env python3
"""Writes the lamp: a star whose five arms differ in length, so that it looks like itself only after a whole turn."""

import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import assets

(HERE / "run").mkdir(exist_ok=True)
assets.write_ply(HERE / "run/star.ply", *assets.star([1.5, 0.6, 0.9, 0.55, 0.75], 0.25))
