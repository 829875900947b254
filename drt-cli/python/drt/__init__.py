"""Renders scenes with surfaces and participating media, and differentiates the images.

    scene = drt.load("scene.xml")
    image, stderr = scene.render(spp=64)
    gradient = scene.gradient(drt.Loss(target), wrt=["cube.vertices"])

Images are arrays of rows × columns × 3 doubles: linear RGB, with the pixel (0, 0) at the top left. Lengths are in
units of the scene. The same seed gives the same numbers, on any number of threads, and those of the command `drt`.
"""

from ._core import Error, __version__
from ._files import read_exr, write_exr, write_png
from ._fit import Fit, Loss, optimize
from ._scene import Gradient, Job, Parameters, Scene, load

__all__ = [
    "Error",
    "Fit",
    "Gradient",
    "Job",
    "Loss",
    "Parameters",
    "Scene",
    "__version__",
    "load",
    "optimize",
    "read_exr",
    "write_exr",
    "write_png",
]
