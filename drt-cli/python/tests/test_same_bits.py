"""What Python gets is what the program writes, to the last bit of its files."""

import os
import subprocess
import sys

import numpy as np
import pytest
from conftest import ROOT

import drt

EXAMPLE = ROOT / "examples/surface-box"
SIZE = (20, 16)


def program(*arguments):
    done = subprocess.run(
        [sys.executable, "-m", "drt", *map(str, arguments), "--quiet"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr


def same(found, stored):
    assert found.astype(np.float32).tobytes() == np.ascontiguousarray(stored).tobytes()


def test_an_image(tmp_path):
    out = tmp_path / "image.exr"
    program("render", EXAMPLE / "scene.xml", "-o", out, "--size", "20x16", "--spp", 4, "--seed", 7)
    scene = drt.load(EXAMPLE / "scene.xml")
    scene.resize(*SIZE)
    scene.render(spp=2, seed=1)
    image, stderr = scene.render(spp=4, seed=7)
    layers = drt.read_exr(out)
    same(image, layers[""])
    same(stderr, layers["stderr"])
    other, _ = scene.render(spp=4, seed=8)
    assert (other.astype(np.float32) != layers[""]).any()


@pytest.mark.parametrize("kind", ["auto", "path-space", "finite-difference"])
def test_derivatives(tmp_path, kind):
    out = tmp_path / "grad.exr"
    options = ["--size", "20x16", "--spp", 4, "--seed", 7, "--set", f"estimator.kind={kind}"]
    value = "parameter.cube-x.value=0.1"
    program("grad", EXAMPLE / "job.toml", "-o", out, *options, "--set", value)
    job = drt.Job.load(EXAMPLE / "job.toml", set={"estimator.kind": kind})
    job.resize(*SIZE)
    # A preparation at other values is left before.
    job.params["cube-x"] = 0.1
    found = job.derivatives(spp=4, seed=7)
    assert list(found) == ["cube-x", "cube-turn", "lamp-x", "lamp-power"]
    layers = drt.read_exr(out)
    for name, (derivative, stderr) in found.items():
        same(derivative, layers[f"d_{name}"])
        same(stderr, layers[f"d_{name}_stderr"])


def test_gradients(tmp_path, box):
    path = tmp_path / "job.toml"
    path.write_text(
        """scene = "box.xml"
        [estimator]
        spp = 4
        [[parameter]]
        name = "up"
        value = 0.2
        effect = [{ target = "cube", translate = [0, 1, 0] }]
        [[parameter_group]]
        target = "cube"
        vertices = "all"
        [[parameter_group]]
        target = "floor"
        property = "reflectance"
        texels = "all"
        """
    )
    adjoint = np.random.default_rng(2).normal(size=(8, 10, 3))
    np.save(tmp_path / "adjoint.npy", adjoint)
    out = tmp_path / "gradient.npy"
    program("grad", path, "--adjoint", tmp_path / "adjoint.npy", "-o", out, "--seed", 5)
    job = drt.Job.load(path)
    found = job.gradient(adjoint, seed=5)
    assert list(found) == ["up", "cube", "floor"]
    assert found["cube"].shape == (8, 3) and found["floor"].shape == (2, 3, 3)
    assert np.concatenate([g.ravel() for g in found.values()]).tobytes() == np.load(out).tobytes()
    # By a loss, whose image and gradient have seeds of their own.
    target = np.full((8, 10, 3), 0.25)
    np.save(tmp_path / "target.npy", target)
    program("grad", path, "--loss", tmp_path / "target.npy", "-o", out, "--seed", 5)
    found = job.gradient(drt.Loss(target), seed=5)
    assert np.concatenate([g.ravel() for g in found.values()]).tobytes() == np.load(out).tobytes()
    assert found.loss == pytest.approx(((found.image - target) ** 2).sum())


def test_values_that_were_set_are_those_of_a_file(tmp_path, box):
    """Images after many changes are those of a scene that was read with the last values."""
    scene = drt.load(box)
    painting = scene.params["painted.reflectance"]
    for factor in (0.5, 0.25, 0.75):
        scene.params["painted.reflectance"] = (factor * painting).astype(np.float32)
        image, _ = scene.render(spp=4)
    drt.write_exr(tmp_path / "painting.exr", 0.75 * painting)
    expected, _ = drt.load(box).render(spp=4)
    assert image.tobytes() == expected.tobytes()


def test_threads_do_not_matter(box):
    images = []
    for threads in (1, 2, 5):
        code = f"""
import drt
scene = drt.load({str(box)!r})
print(scene.render(spp=4)[0].tobytes().hex())
"""
        environment = {**os.environ, "RAYON_NUM_THREADS": str(threads)}
        done = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, env=environment
        )
        assert done.returncode == 0, done.stderr
        images.append(done.stdout)
    assert images[0] == images[1] == images[2]
