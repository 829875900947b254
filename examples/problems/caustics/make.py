#!/usr/bin/env python3
"""Writes the cage: a box around the body of glass."""

import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import assets

(HERE / "run").mkdir(exist_ok=True)
assets.write_obj(HERE / "run/cage.obj", *assets.box_cage((-0.5, 0.65, -0.65), (0.5, 1.75, 0.6)))
