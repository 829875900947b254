"""Views of a scene in known poses: their pictures, and the job that has them.

A problem's make.py imports this file where the pictures are of a shape that no value of the job's parameters gives.
"""

import math
import os
import pathlib
import subprocess

DRT = os.environ.get("DRT", str(pathlib.Path(__file__).resolve().parents[2] / "target/release/drt"))
"""The program that renders."""


def is_newer(file, *others):
    """True of a file that is there and was written after the others."""
    time = pathlib.Path(file).stat().st_mtime if pathlib.Path(file).exists() else 0.0
    return all(time > pathlib.Path(other).stat().st_mtime for other in others)


def render(scene, output, spp, defines=(), sensor=None, more=()):
    """Renders a picture to a file, unless a file is there that is newer than the scene."""
    if is_newer(output, scene):
        return
    words = [DRT, "render", scene, "--quiet", "--seed", "1", "--spp", spp, "--output", output, *more]
    words += ["--sensor", sensor] if sensor else []
    words += [word for name, value in dict(defines).items() for word in ("-D", f"{name}={value}")]
    subprocess.run([str(w) for w in words], check=True)


def rotation(target, axis, degrees, pivot):
    """The effect of a job that turns a shape."""
    rotate = f"{{ axis = {list(axis)}, pivot = {list(pivot)} }}"
    return f'[[view.effect]]\ntarget = "{target}"\nrotate = {rotate}\namount = {math.radians(degrees)!r}\n'


def view(picture, effects=(), sensor=None):
    """A view of a job: its picture, and the known pose that its scene has there."""
    sees = f'sensor = "{sensor}"\n' if sensor else ""
    return f'[[view]]\ntarget = "{picture}"\n{sees}' + "".join(effects)


def write_job(source, output, views):
    """The job with its views appended."""
    pathlib.Path(output).write_text(pathlib.Path(source).read_text() + "\n" + "\n".join(views))
