"""Fits the texture of a painting and the shape of a vase to an image of them, with the package `drt` and NumPy.

    pip install ./drt-cli/python
    python examples/python/fit.py --picture fit.png

Every iteration renders the scene and asks for the gradient of the loss by all vertices and texels at once, which costs what it
costs by a few. What comes after is ordinary Python: the vase's vertices depend on the radii of its rings, its texels on nothing.
The known answer, which the target is rendered from, is `Unknowns.answer()`. fit_torch.py does the same by PyTorch.
"""

import argparse
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import drt

HERE = Path(__file__).resolve().parent
SECTORS = 24
# Of the vase's rings.
HEIGHTS = np.linspace(0.02, 1.5, 9)
ROWS, COLUMNS = 10, 16
# Seeds that no iteration has.
TARGET, LAST = 1 << 32, 2 << 32


@dataclass
class Unknowns:
    """Radii of the vase's rings, and the reflectance of the painting from its first row."""

    radii: np.ndarray
    painting: np.ndarray

    @staticmethod
    def start():
        return Unknowns(np.full(len(HEIGHTS), 0.36), np.full((ROWS, COLUMNS, 3), 0.4))

    @staticmethod
    def answer():
        radii = 0.36 + 0.17 * np.sin(2 * np.pi * HEIGHTS / 1.5 - 0.4) * (1.15 - 0.4 * HEIGHTS)
        y, x = np.mgrid[:ROWS, :COLUMNS]
        sun = (x - 11.5) ** 2 + (y - 3.0) ** 2 < 5.5
        hills = y > 6.2 + 1.6 * np.sin(0.55 * x)
        painting = np.empty((ROWS, COLUMNS, 3))
        painting[:] = [0.35, 0.5, 0.7]
        painting[sun] = [0.85, 0.55, 0.15]
        painting[hills] = [0.2, 0.45, 0.15]
        # The first row is the lowest one on the wall.
        return Unknowns(radii, painting[::-1])


ANGLES = 2 * np.pi * np.arange(SECTORS) / SECTORS
CIRCLE = np.stack([np.cos(ANGLES), np.zeros(SECTORS), np.sin(ANGLES)], axis=1)


def vertices(radii):
    """Of all rings, and the middle of the bottom."""
    rings = radii[:, None, None] * CIRCLE + np.array([0, 1, 0]) * HEIGHTS[:, None, None]
    return np.concatenate([rings.reshape(-1, 3), [[0, HEIGHTS[0], 0]]])


def radii_gradient(by_vertices):
    """The transposed derivative of `vertices`."""
    rings = by_vertices[:-1].reshape(len(HEIGHTS), SECTORS, 3)
    return np.einsum("rsc,sc->r", rings, CIRCLE)


def load(folder, size, unknowns):
    """The scene at these values, from files that are written into the folder."""
    lines = ["v {:.9g} {:.9g} {:.9g}".format(*v) for v in vertices(unknowns.radii)]
    for s in range(SECTORS):
        t, middle = (s + 1) % SECTORS, len(HEIGHTS) * SECTORS + 1
        lines.append(f"f {middle} {s + 1} {t + 1}")
        for ring in range(len(HEIGHTS) - 1):
            a, b = ring * SECTORS + 1, (ring + 1) * SECTORS + 1
            lines.append(f"f {a + s} {b + s} {b + t} {a + t}")
    (folder / "vase.obj").write_text("\n".join(lines) + "\n")
    drt.write_exr(folder / "painting.exr", unknowns.painting)
    return drt.Job.load(HERE / "job.toml", defaults={"folder": folder, "resolution": size})


def image(scene, unknowns, spp, seed):
    """What the scene looks like at these values."""
    scene.params.update({"vase": vertices(unknowns.radii), "wall": unknowns.painting})
    return scene.render(spp, seed)[0]


class Adam:
    """Steps of Kingma and Ba (2015); what hardly matters for the loss hardly moves."""

    def __init__(self, rate):
        self.rate, self.mean, self.square, self.count = rate, 0.0, 0.0, 0

    def step(self, value, gradient):
        self.count += 1
        self.mean = 0.9 * self.mean + 0.1 * gradient
        self.square = 0.99 * self.square + 0.01 * gradient**2
        mean = self.mean / (1 - 0.9**self.count)
        square = self.square / (1 - 0.99**self.count)
        rate = self.rate / (1 + 0.02 * self.count)
        return value - rate * mean / (np.sqrt(square) + 1e-5)


def picture(path, scene, target, start, found):
    """The target, the start and what was found, and below their paintings."""

    def panel(unknowns, image):
        zoom = image.shape[1] // COLUMNS
        painting = unknowns.painting[::-1].repeat(zoom, axis=0).repeat(zoom, axis=1)
        return np.concatenate([image, np.ones((4, image.shape[1], 3)), painting])

    shown = [image(scene, unknowns, 256, LAST) for unknowns in (start, found)]
    all = [(Unknowns.answer(), target), (start, shown[0]), (found, shown[1])]
    panels = [panel(*one).repeat(3, axis=0).repeat(3, axis=1) for one in all]
    gap = np.ones((len(panels[0]), 8, 3))
    drt.write_png(path, np.concatenate([panels[0], gap, panels[1], gap, panels[2]], axis=1))


def arguments():
    parser = argparse.ArgumentParser()
    parser.add_argument("--iterations", type=int, default=120)
    parser.add_argument(
        "--size", type=int, default=64, help="of the image, in pixels; a multiple of 16"
    )
    parser.add_argument("--spp", type=int, default=16, help="samples per pixel")
    parser.add_argument("--picture", type=Path, help="a PNG of target, start and result")
    return parser.parse_args()


def report(iteration, loss, unknowns, answer):
    print(
        f"{iteration:4} loss {loss:.3e}  radii off by {np.abs(unknowns.radii - answer.radii).mean():.4f}"
        f"  painting by {np.abs(unknowns.painting - answer.painting).mean():.4f}",
        flush=True,
    )


def fit(scene, target, unknowns, iterations, spp, answer):
    """Minimises the mean squared difference from the target."""

    def loss(seen):
        difference = seen - target
        return np.mean(difference**2), 2 * difference / difference.size

    radii, painting = Adam(0.02), Adam(0.04)
    for iteration in range(iterations):
        scene.params.update({"vase": vertices(unknowns.radii), "wall": unknowns.painting})
        gradient = scene.gradient(loss, spp=spp, seed=iteration)
        if iteration % 10 == 0 or iteration == iterations - 1:
            report(iteration, gradient.loss, unknowns, answer)
        unknowns = Unknowns(
            np.clip(radii.step(unknowns.radii, radii_gradient(gradient["vase"])), 0.05, 0.9),
            np.clip(painting.step(unknowns.painting, gradient["wall"]), 0, 1),
        )
    return unknowns


def main(fit=fit):
    options = arguments()
    answer, start = Unknowns.answer(), Unknowns.start()
    with tempfile.TemporaryDirectory() as folder:
        scene = load(Path(folder), options.size, start)
        target = image(scene, answer, 1024, TARGET)
        found = fit(scene, target, start, options.iterations, options.spp, answer)
        reached = np.mean((image(scene, found, 256, LAST) - target) ** 2)
        report(options.iterations, reached, found, answer)
        if options.picture:
            picture(options.picture, scene, target, start, found)


if __name__ == "__main__":
    main()
