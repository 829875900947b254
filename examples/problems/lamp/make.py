#!/usr/bin/env python3
"""Makes the bulb, the bird, the ball that the fit starts with, the pictures of the shadow in 40 poses, and the job that has them as views."""

import math
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import assets  # noqa: E402
import views  # noqa: E402

HEIGHT = 1.3
VIEWS, SPP, LEVELS = 40, 64, 5


def bird(x, y, z):
    """Negative inside of a bird with spread wings, which looks along x and is the same on either side of the plane z = 0."""
    def egg(cx, cy, cz, rx, ry, rz):
        return min(rx, ry, rz) * (math.hypot((x - cx) / rx, (y - cy) / ry, (abs(z) - cz) / rz) - 1.0)

    trunk, tail = egg(0, 0, 0, 0.45, 0.24, 0.24), egg(-0.5, 0.02, 0, 0.26, 0.09, 0.2)
    head, beak = egg(0.42, 0.14, 0, 0.2, 0.18, 0.17), egg(0.62, 0.12, 0, 0.16, 0.06, 0.07)
    wing = egg(-0.05, 0.1, 0.42, 0.24, 0.09, 0.42)
    return assets.smooth_union([trunk, tail, head, beak, wing], 0.05)


def lifted(points):
    return [(x, y + HEIGHT, z) for x, y, z in points]


def main():
    run = HERE / "run"
    run.mkdir(exist_ok=True)
    points, faces = assets.icosphere(3)
    assets.write_ply(run / "bulb.ply", [(0.4 * x, 0.4 * y + 4.2, 0.4 * z) for x, y, z in points], faces)
    points, faces = assets.icosphere(LEVELS)
    assets.write_ply(run / "start.ply", lifted(tuple(0.45 * c for c in p) for p in points), faces)
    assets.write_ply(run / "truth.ply", lifted(assets.star_shaped(points, bird, 1.5)), faces)
    poses = []
    for k in range(VIEWS):
        # Seen from the bird, the lamp goes over a sphere at golden angles, so that each part of it is somewhere at the border of a shadow.
        turn, tilt = (k * 137.508) % 360.0, math.degrees(math.acos(1.0 - (2 * k + 1) / VIEWS))
        picture = run / f"view-{k:02}.exr"
        defines = {"mesh": run / "truth.ply", "turn": turn, "tilt": tilt}
        views.render(HERE / "scene.xml", picture, SPP, defines, more=("--sampling", "bidirectional"))
        turns = [views.rotation("bird", axis, angle, (0, HEIGHT, 0)) for axis, angle in (((0, 1, 0), turn), ((0, 0, 1), tilt))]
        poses.append(views.view(picture.name, turns))
    views.write_job(HERE / "job.toml", run / "job.toml", poses)


main()
