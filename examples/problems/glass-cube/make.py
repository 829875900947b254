#!/usr/bin/env python3
"""Makes the duck, the small ball that the fit starts with, 50 pictures of the duck in the glass, and the job that has them as views."""

import math
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import assets  # noqa: E402
import views  # noqa: E402

VIEWS, SPP, LEVELS = 50, 32, 5


def body(x, y, z):
    """Negative inside of a duck, which looks along x and is the same on either side of the plane z = 0."""
    def egg(cx, cy, rx, ry, rz):
        return min(rx, ry, rz) * (math.hypot((x - cx) / rx, (y - cy) / ry, z / rz) - 1.0)

    trunk, tail = egg(0, -0.15, 0.55, 0.36, 0.44), egg(-0.48, 0.05, 0.2, 0.15, 0.18)
    head, beak = egg(0.22, 0.34, 0.3, 0.28, 0.27), egg(0.53, 0.31, 0.17, 0.08, 0.14)
    return assets.smooth_union([trunk, tail, head, beak], 0.05)


def main():
    run = HERE / "run"
    run.mkdir(exist_ok=True)
    points, faces = assets.icosphere(LEVELS)
    assets.write_ply(run / "start.ply", [tuple(0.3 * c for c in p) for p in points], faces)
    assets.write_ply(run / "truth.ply", assets.star_shaped(points, body, 1.5), faces)
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
