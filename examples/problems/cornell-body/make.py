#!/usr/bin/env python3
"""Makes the body, the small ball that the fit starts with, the pictures of 40 poses, and the job that has them as views."""

import math
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import assets  # noqa: E402
import views  # noqa: E402

VIEWS, SPP, LEVELS = 40, 64, 5


def body(x, y, z):
    """Negative inside of a round creature with two long ears, a nose and a tail."""
    def ball(cx, cy, cz, r, stretch=1.0):
        return math.hypot(x - cx, (y - cy) / stretch, z - cz) - r

    ears = [math.hypot(x - s * (0.17 + 0.45 * (y - 0.2)), 0.5 * (y - 0.38), z) - 0.12 for s in (-1, 1)]
    parts = [ball(0, -0.05, 0, 0.36, 0.92), *ears, ball(0, 0, 0.33, 0.12), ball(0.05, -0.2, -0.3, 0.14)]
    return assets.smooth_union(parts, 0.04)


def main():
    run = HERE / "run"
    run.mkdir(exist_ok=True)
    points, faces = assets.icosphere(LEVELS)
    assets.write_ply(run / "start.ply", [tuple(0.3 * c for c in p) for p in points], faces)
    assets.write_ply(run / "truth.ply", assets.star_shaped(points, body, 1.5), faces)
    poses = []
    for k in range(VIEWS):
        # Seen from the body, the camera goes over a sphere at golden angles, so that each part of the body is in view, and at its outline in some picture.
        # Besides, the body rolls: its lower side is in shadow and nearly as bright as the wall behind it, so that each part has to be above in some picture.
        turn, tilt, roll = (k * 137.508) % 360.0, math.degrees(math.asin((2 * k + 1) / VIEWS - 1.0)), (k * 271.756) % 360.0
        picture = run / f"view-{k:02}.exr"
        pose = {"mesh": run / "truth.ply", "turn": turn, "tilt": tilt, "roll": roll}
        views.render(HERE / "scene.xml", picture, SPP, pose, more=("--sampling", "bidirectional"))
        turns = [views.rotation("body", axis, angle, (0, 0, 0)) for axis, angle in (((0, 1, 0), turn), ((1, 0, 0), tilt), ((0, 0, 1), roll))]
        poses.append(views.view(picture.name, turns))
    views.write_job(HERE / "job.toml", run / "job.toml", poses)


main()
