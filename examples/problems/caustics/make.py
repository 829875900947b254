#!/usr/bin/env python3
"""Writes the cage: a box around the body of glass."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import assets

run = assets.run_folder(__file__)
assets.write_obj(run / "cage.obj", *assets.box_cage((-0.5, 0.65, -0.65), (0.5, 1.75, 0.6)))
