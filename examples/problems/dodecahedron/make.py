#!/usr/bin/env python3
"""Makes the dodecahedron, whose corners have a distance of 1 from its middle."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import assets

points, faces = assets.dodecahedron()
assets.write_ply(assets.run_folder(__file__) / "dodecahedron.ply", points, faces)
