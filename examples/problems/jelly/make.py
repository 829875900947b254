#!/usr/bin/env python3
"""Makes the body, the ball that the fit starts with, the jelly and its cage, the pictures of 20 poses, and the job that has them as views."""

import math
import pathlib
import random
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import assets  # noqa: E402
import views  # noqa: E402

VIEWS, SPP, LEVELS = 20, 128, 4
ORIGIN = (0.0, 0.0, 0.0)


def body(x, y, z):
    """Negative inside of a ball with five bumps of different sizes."""
    parts = [math.hypot(x, y, z) - 0.42]
    for a, b, c, r in ((0.45, 0.2, 0.0, 0.25), (-0.3, 0.4, 0.2, 0.22), (0.0, -0.5, 0.15, 0.26), (-0.15, -0.05, 0.5, 0.2), (0.05, 0.1, -0.45, 0.28)):
        parts.append(math.hypot(x - a, y - b, z - c) - r)
    return assets.smooth_union(parts, 0.05)


def main():
    run = HERE / "run"
    run.mkdir(exist_ok=True)
    points, faces = assets.icosphere(LEVELS)
    assets.write_ply(run / "start.ply", [(0.5 * x, 0.5 * y, 0.5 * z) for x, y, z in points], faces)
    assets.write_ply(run / "truth.ply", assets.star_shaped(points, body, 1.5), faces)
    points, faces = assets.icosphere(3)
    assets.write_ply(run / "jelly.ply", [(1.05 * x, 1.05 * y, 1.05 * z) for x, y, z in points], faces)
    assets.write_obj(run / "cage.obj", *assets.box_cage((-1.2, -1.2, -1.2), (1.2, 1.2, 1.2)))
    chance = random.Random(7)
    poses = []
    for k in range(VIEWS):
        effects = [views.effect("jelly", f'cage = {{ mesh = "cage.obj", vertex = {corner}, direction = {[chance.uniform(-1, 1) for _ in range(3)]} }}', 0.35)
                   for corner in chance.sample(range(8), 3)]
        # Seen from the body, the camera goes over a sphere at golden angles.
        turn, tilt = (k * 137.508) % 360.0, math.degrees(math.acos(1.0 - (2 * k + 1) / VIEWS))
        for target in ("jelly", "body"):
            effects += [views.rotation(target, axis, angle, ORIGIN) for axis, angle in (((0, 1, 0), turn), ((0, 0, 1), tilt))]
        picture = run / f"view-{k:02}.exr"
        pose = run / f"view-{k:02}.toml"
        views.write(pose, views.pose("../scene.xml", effects))
        views.render(pose, picture, SPP, {"mesh": run / "truth.ply"})
        poses.append(views.view(picture.name, effects))
    views.write_job(HERE / "job.toml", run / "job.toml", poses)


main()
