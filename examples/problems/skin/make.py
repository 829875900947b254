#!/usr/bin/env python3
"""Makes the body in the skin: a dark ball, dented and longer than wide."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import assets

points, faces = assets.icosphere(4)
points = [(1.5 * x + 0.4 * z * z, 0.7 * y, z * (1 + 0.5 * x)) for x, y, z in points]
assets.write_ply(assets.run_folder(__file__) / "body.ply", points, faces)
