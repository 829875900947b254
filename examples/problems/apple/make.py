#!/usr/bin/env python3
"""Makes the apple."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import assets

points, faces = assets.apple()
assets.write_ply(assets.run_folder(__file__) / "apple.ply", points, faces)
