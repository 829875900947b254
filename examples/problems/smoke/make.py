#!/usr/bin/env python3
"""Makes the smoke, the even grid that the fit starts with, the pictures of both, and the job that has the pictures as views."""

import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import assets  # noqa: E402
import views  # noqa: E402

SIZE, VIEWS, SPP = 64, 8, 256
EVEN = 0.05


def main():
    run = assets.run_folder(__file__)
    truth, start = run / "truth.vol", run / "start.vol"
    if not views.is_newer(truth, HERE.parent / "assets.py"):
        assets.write_vol(truth, SIZE, 1, lambda x, y, z: (assets.smoke(x, y, z),))
        assets.write_vol(start, SIZE, 1, lambda x, y, z: (EVEN,))
    poses = []
    for k in range(VIEWS):
        picture = run / f"view-{k}.exr"
        views.render(HERE / "scene.xml", picture, SPP, {"grid": truth}, f"view-{k}")
        poses.append(views.view(picture.name, sensor=f"view-{k}"))
    views.write_job(HERE / "job.toml", run / "job.toml", poses)


main()
