#!/usr/bin/env python3
"""Makes the chess piece, the egg that the fit starts with, the pictures of the shadow in 40 poses, and the job that has them as views."""

import math
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import assets  # noqa: E402
import views  # noqa: E402

HEIGHT = 2.4
VIEWS, SPP, LEVELS = 40, 256, 5


def piece(x, y, z):
    """Negative inside of a pawn with a waist, a collar and a head, which stands along y."""
    r = math.hypot(x, z)
    base = max(r - (0.2 + 0.36 * math.exp(-((y + 0.75) ** 2) / 0.12)), abs(y) - 0.85 + 0.4 * r * r)
    collar = math.hypot(max(r - 0.12, 0.0), 1.4 * (y - 0.28)) - 0.2
    head = math.sqrt(r * r + (y - 0.62) ** 2) - 0.32
    return assets.smooth_union([base, collar, head], 0.05)


def lifted(points):
    return [(x, y + HEIGHT, z) for x, y, z in points]


def main():
    run = HERE / "run"
    run.mkdir(exist_ok=True)
    points, faces = assets.icosphere(LEVELS)
    assets.write_ply(run / "start.ply", lifted((0.4 * x, 0.8 * y, 0.4 * z) for x, y, z in points), faces)
    assets.write_ply(run / "truth.ply", lifted(assets.star_shaped(points, piece, 1.5)), faces)
    poses = []
    for k in range(VIEWS):
        # Seen from the piece, the lamp goes over a sphere at golden angles, so that each part of the piece is somewhere at the border of a shadow.
        turn, tilt = (k * 137.508) % 360.0, math.degrees(math.acos(1.0 - (2 * k + 1) / VIEWS))
        picture = run / f"view-{k:02}.exr"
        views.render(HERE / "scene.xml", picture, SPP, {"mesh": run / "truth.ply", "turn": turn, "tilt": tilt})
        turns = [views.rotation("piece", axis, angle, (0, HEIGHT, 0)) for axis, angle in (((0, 1, 0), turn), ((0, 0, 1), tilt))]
        poses.append(views.view(picture.name, turns))
    views.write_job(HERE / "job.toml", run / "job.toml", poses)


main()
