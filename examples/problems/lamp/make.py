#!/usr/bin/env python3
"""Makes the body, the ball that the fit starts with, the pictures of the shadow in 40 poses, and the job that has them as views."""

import math
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import assets  # noqa: E402
import views  # noqa: E402

HEIGHT = 2.4
VIEWS, SPP, LEVELS = 40, 256, 5


def body(x, y, z):
    """Negative inside of a ball with six arms of different lengths and widths, which lean to one side."""
    parts = [math.hypot(x, y, z) - 0.3]
    for along, aside, lean, length, width in ((x, y, z, 0.75, 0.14), (-x, z, y, 0.6, 0.18), (y, x, z, 0.8, 0.16), (-y, z, x, 0.65, 0.14),
                                              (z, x, y, 0.55, 0.2), (-z, y, x, 0.7, 0.14)):
        middle = 0.5 * length
        parts.append(math.hypot((along - middle) * width / middle, aside, lean - 0.25 * along * along) - width)
    return assets.smooth_union(parts, 0.05)


def lifted(points):
    return [(x, y + HEIGHT, z) for x, y, z in points]


def main():
    run = HERE / "run"
    run.mkdir(exist_ok=True)
    points, faces = assets.icosphere(LEVELS)
    assets.write_ply(run / "start.ply", lifted((0.5 * x, 0.5 * y, 0.5 * z) for x, y, z in points), faces)
    assets.write_ply(run / "truth.ply", lifted(assets.star_shaped(points, body, 1.5)), faces)
    poses = []
    for k in range(VIEWS):
        turn, tilt = (k * 137.508) % 360.0, -95.0 + 190.0 * (k + 0.5) / VIEWS
        picture = run / f"view-{k:02}.exr"
        views.render(HERE / "scene.xml", picture, SPP, {"mesh": run / "truth.ply", "turn": turn, "tilt": tilt})
        turns = [views.rotation("body", axis, angle, (0, HEIGHT, 0)) for axis, angle in (((0, 1, 0), turn), ((0, 0, 1), tilt))]
        poses.append(views.view(picture.name, turns))
    views.write_job(HERE / "job.toml", run / "job.toml", poses)


main()
