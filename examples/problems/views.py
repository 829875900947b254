"""Views of a scene in known poses: their pictures, and the job that has them.

A problem's make.py imports this file where the pictures are of a shape that no value of the job's parameters gives.
"""

import math
import os
import pathlib
import subprocess

DRT = os.environ.get("DRT", str(pathlib.Path(__file__).resolve().parents[2] / "target/release/drt"))
"""The program that renders."""
THREADS = os.environ.get("DRT_THREADS", "0")
"""Its threads; 0 for all cores."""


def is_newer(file, *others):
    """True of a file that is there and was written after the others."""
    time = pathlib.Path(file).stat().st_mtime if pathlib.Path(file).exists() else 0.0
    return all(time > pathlib.Path(other).stat().st_mtime for other in others)


def render(scene, output, spp, defines=(), sensor=None, more=()):
    """Renders a picture to a file, unless a file is there that is newer than the scene."""
    if is_newer(output, scene):
        return
    words = [DRT, "render", scene, "--quiet", "--threads", THREADS, "--seed", "1", "--spp", spp, "--output", output, *more]
    words += ["--sensor", sensor] if sensor else []
    words += [word for name, value in dict(defines).items() for word in ("-D", f"{name}={value}")]
    subprocess.run([str(w) for w in words], check=True)


def write(path, text):
    """Writes a file where that changes it, so that it is no newer than what was made of it."""
    if not path.exists() or path.read_text() != text:
        path.write_text(text)


def effect(target, change, amount=1.0):
    """A known effect of a view: on which element, what it does as a job says it, and how much of it."""
    return target, change, amount


def rotation(target, axis, degrees, pivot):
    """The effect that turns a shape."""
    return effect(target, f"rotate = {{ axis = {list(axis)}, pivot = {list(pivot)} }}", math.radians(degrees))


def pose(scene, effects):
    """A job whose scene has these effects, to be rendered."""
    parts = [f'scene = "{scene}"\n']
    for k, (target, change, amount) in enumerate(effects):
        parts.append(f'[[parameter]]\nname = "pose-{k}"\nvalue = {amount!r}\n[[parameter.effect]]\ntarget = "{target}"\n{change}\n')
    return "".join(parts)


def view(picture, effects=(), sensor=None):
    """A view of a job: its picture, and the known pose that its scene has there."""
    sees = f'sensor = "{sensor}"\n' if sensor else ""
    known = "".join(f'[[view.effect]]\ntarget = "{target}"\n{change}\namount = {amount!r}\n' for target, change, amount in effects)
    return f'[[view]]\ntarget = "{picture}"\n{sees}{known}'


def write_job(source, output, views):
    """The job with its views appended."""
    pathlib.Path(output).write_text(pathlib.Path(source).read_text() + "\n" + "\n".join(views))
