"""Derivatives and gradients against each other, and against differences."""

import numpy as np
import pytest

import drt


def test_the_gradient_is_the_transposed_derivative(box):
    """Exactly so with one estimator and without guiding: the same samples are summed in another order."""
    job = drt.Job(
        folder=box.parent,
        scene=box.name,
        estimator={"kind": "path-space", "guiding": False, "spp": 8},
        parameter=[
            {"name": "x", "effect": [{"target": "cube", "translate": [1, 0, 0]}]},
            {
                "name": "corner",
                "effect": [{"target": "cube", "vertex": {"index": 3, "direction": [0, 1, 0]}}],
            },
        ],
        parameter_group=[{"target": "cube", "vertices": "all"}],
    )
    adjoint = np.random.default_rng(3).normal(size=(8, 10, 3))
    derivatives = job.derivatives(seed=4)
    gradient = job.gradient(adjoint, ["cube"], seed=4)["cube"]
    products = {name: (adjoint * d).sum() for name, (d, _) in derivatives.items()}
    assert gradient[:, 0].sum() == pytest.approx(products["x"], rel=1e-9)
    # A single vertex of the file moves alone.
    assert gradient[3, 1] == pytest.approx(products["corner"], rel=1e-9)
    # A planted fault is seen.
    assert gradient[:, 1].sum() != pytest.approx(products["x"], rel=1e-3)


def test_voxels_against_differences(cloud):
    """With common random numbers, along one direction of all voxels."""
    scene = drt.load(cloud)
    name = "smoke.sigma_t"
    assert scene.params[name].shape == (2, 3, 4)
    start = scene.params[name]
    direction = np.random.default_rng(4).random(start.shape)
    step = 0.1

    def difference(seed):
        images = []
        for sign in (1, -1):
            scene.params[name] = start + sign * step * direction
            images.append(scene.render(spp=600, seed=seed)[0].sum())
        return (images[0] - images[1]) / (2 * step)

    differences = np.array([difference(seed) for seed in range(8)])
    scene.params[name] = start
    ones = np.ones((8, 8, 3))
    gradients = np.array(
        [
            (scene.gradient(ones, [name], spp=600, seed=100 + seed)[name] * direction).sum()
            for seed in range(8)
        ]
    )
    spread = np.sqrt((differences.var(ddof=1) + gradients.var(ddof=1)) / 8)
    assert spread < 0.02 * abs(gradients.mean())
    assert abs(differences.mean() - gradients.mean()) < 4 * spread
    assert abs(1.2 * differences.mean() - gradients.mean()) > 4 * spread


def test_parameters_in_any_choice_and_order(box):
    scene = drt.load(box)
    adjoint = np.ones((8, 10, 3))
    names = ["painted.reflectance", "cube.vertices"]
    found = scene.gradient(adjoint, names, spp=4)
    assert list(found) == names
    assert [found[n].shape for n in names] == [scene.params[n].shape for n in names]
    assert list(scene.gradient(adjoint, "cube.vertices", spp=4)) == ["cube.vertices"]
    assert scene.gradient(adjoint, [], spp=4) == {}
    assert (found["painted.reflectance"] >= 0).all()


def test_several_sensors(box):
    scene = drt.load(box)
    assert scene.sensors == ["front", "above"]
    assert scene.size() == (10, 8) and scene.size("above") == (6, 6)
    front, _ = scene.render(spp=4)
    above, _ = scene.render(spp=4, sensor="above")
    assert above.shape == (6, 6, 3)
    again, _ = scene.render(spp=4, sensor="front")
    assert front.tobytes() == again.tobytes()
    gradient = scene.gradient(np.ones((6, 6, 3)), ["cube.vertices"], spp=4, sensor="sensor[1]")
    assert np.abs(gradient["cube.vertices"]).max() > 0
