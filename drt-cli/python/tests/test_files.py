"""Image files, also those that other programs read."""

import subprocess
import sys

import numpy as np
import pytest

import drt


def test_exr_files(tmp_path):
    image = np.random.default_rng(6).normal(size=(5, 7, 3)).astype(np.float32)
    path = tmp_path / "image.exr"
    drt.write_exr(path, image)
    layers = drt.read_exr(path)
    assert list(layers) == [""] and layers[""].dtype == np.float32
    assert (layers[""] == image).all()
    with pytest.raises(drt.Error, match="missing.exr"):
        drt.read_exr(tmp_path / "missing.exr")
    with pytest.raises(drt.Error, match="cannot write"):
        drt.write_exr(tmp_path / "missing" / "image.exr", image)
    with pytest.raises(drt.Error, match="expected rows x columns x 3"):
        drt.write_exr(path, image[..., 0])


def test_pictures(tmp_path):
    image = np.random.default_rng(7).random((5, 7, 3))
    path = tmp_path / "image.png"
    drt.write_png(path, image)
    drt.write_png(path, {"start": image, "d_x": image - 0.5}, exposure=None)
    assert path.read_bytes().startswith(b"\x89PNG")
    with pytest.raises(drt.Error, match="2 sizes"):
        drt.write_png(path, {"a": image, "b": image[1:]})


def test_arrays_of_numpy_are_targets_and_adjoints_of_the_program(tmp_path, box):
    (tmp_path / "job.toml").write_text(
        'scene = "box.xml"\n[[parameter]]\nname = "light"\n'
        'effect = [{ target = "sky", property = "radiance", multiply = 1.0 }]\n'
    )
    np.save(tmp_path / "image.npy", np.full((8, 10, 3), 0.5, np.float32))
    np.save(tmp_path / "flat.npy", np.ones(5))

    def grad(option, file):
        command = [sys.executable, "-m", "drt", "grad", "job.toml", "--quiet", "--spp", "2"]
        command += [option, file, "-o", "gradient.npy"]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)

    for option in ("--loss", "--adjoint"):
        assert grad(option, "image.npy").returncode == 0
        assert np.load(tmp_path / "gradient.npy").shape == (1,)
    done = grad("--adjoint", "flat.npy")
    assert done.returncode == 2 and "rows x columns x 3" in done.stderr
