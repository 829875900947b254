#!/usr/bin/env python3
"""Makes the body, the sphere that the fit starts with, 50 pictures of the body in the glass, and the job that has them as views."""

import math
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import assets  # noqa: E402
import views  # noqa: E402

VIEWS, SPP, LEVELS = 50, 256, 5


def body(p):
    """Where a point of the unit sphere is on the body, which is twisted and has a waist, a head and three ridges."""
    x, y, z = p
    turn = 0.9 * y
    x, z = x * math.cos(turn) + z * math.sin(turn), z * math.cos(turn) - x * math.sin(turn)
    around = math.atan2(z, x)
    wide = 0.58 + 0.17 * math.cos(3.2 * y + 0.6) + 0.1 * math.cos(3 * around) * (1 - y * y)
    return (x * wide, 0.8 * y + 0.06 * math.sin(4 * x), z * wide)


def main():
    run = HERE / "run"
    run.mkdir(exist_ok=True)
    points, faces = assets.icosphere(LEVELS)
    assets.write_ply(run / "start.ply", [tuple(0.45 * c for c in p) for p in points], faces)
    assets.write_ply(run / "truth.ply", [body(p) for p in points], faces)
    poses = []
    for k in range(VIEWS):
        up = math.degrees(math.asin(0.9 - 1.8 * (k + 0.5) / VIEWS))
        around = (k * 137.508) % 360.0
        picture = run / f"view-{k:02}.exr"
        views.render(HERE / "scene.xml", picture, SPP, {"mesh": run / "truth.ply", "up": up, "around": around})
        turns = [views.rotation("camera", axis, angle, (0, 0, 0)) for axis, angle in (((-1, 0, 0), up), ((0, 1, 0), around))]
        poses.append(views.view(picture.name, turns))
    views.write_job(HERE / "job.toml", run / "job.toml", poses)


main()
