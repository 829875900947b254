"""Losses and fits."""

import numpy as np
import pytest

import drt


def test_losses_and_their_derivatives():
    generator = np.random.default_rng(5)
    target, image, change = generator.random((3, 6, 7, 3))
    mask = generator.random((6, 7))
    for kind in ("l2", "l1", "rmse", "pyramid-l2"):
        loss = drt.Loss(target, kind, mask=mask)
        _, adjoint = loss(image)
        h = 1e-6
        difference = (loss(image + h * change)[0] - loss(image - h * change)[0]) / (2 * h)
        assert (adjoint * change).sum() == pytest.approx(difference, rel=1e-6)
        assert loss(target)[0] == 0
    assert drt.Loss(target)(image)[0] == pytest.approx(((image - target) ** 2).sum())


def test_what_is_no_loss():
    target = np.ones((4, 5, 3))
    for make, message in [
        (lambda: drt.Loss(target, "l3"), '`kind` is "l3"; expected "l2"'),
        (lambda: drt.Loss(target[0]), "expected rows x columns x 3"),
        (lambda: drt.Loss(target * np.nan), "nan"),
        (lambda: drt.Loss(target, mask=np.zeros((4, 5))), "mask"),
        (lambda: drt.Loss(target, mask=np.ones((5, 4))), r"`mask` has the shape \(5, 4\)"),
        (lambda: drt.Loss(target)(target[:2]), r"`image` has the shape \(2, 5, 3\)"),
    ]:
        with pytest.raises(drt.Error, match=message):
            make()


def test_texels_and_a_number_are_found(box):
    """From two sensors at once, to the texels and the power that the targets were made with."""
    job = drt.Job(
        folder=box.parent,
        scene=box.name,
        parameter=[
            {
                "name": "power",
                "effect": [
                    {"target": "lamp", "property": "intensity", "multiply": 1.0, "log": True}
                ],
            }
        ],
        parameter_group=[{"target": "floor", "property": "reflectance", "texels": "all"}],
    )
    answer = job.params["floor"]
    losses = {}
    for sensor in job.sensors:
        losses[sensor] = drt.Loss(job.render(spp=1024, seed=1, sensor=sensor)[0])

    def distance():
        return sum(loss(job.render(spp=1024, sensor=s)[0])[0] for s, loss in losses.items())

    job.params.update({"floor": np.full(answer.shape, 0.5), "power": -0.5})
    seen, start = [], distance()
    fit = drt.optimize(
        job,
        losses,
        iterations=80,
        learning_rate=0.05,
        steps={"power": {"learning_rate": [[0, 0.05], [50, 0.01]]}},
        spp=16,
        callback=lambda iteration, gradient: seen.append(gradient.loss),
    )
    assert fit.losses == seen and len(seen) == 80
    assert distance() < 0.02 * start
    assert abs(fit.values["power"]) < 0.05
    assert fit.values["power"] == job.params["power"]
    # What the sensors do not see stays where it was.
    assert np.abs(fit.values["floor"] - answer).mean() < 0.5 * np.abs(0.5 - answer).mean()


def test_the_same_seed_is_the_same_fit(box):
    fits = []
    for seed in (1, 1, 2):
        scene = drt.load(box)
        loss = drt.Loss(np.full((8, 10, 3), 0.3))
        fit = drt.optimize(scene, loss, ["cube.vertices"], iterations=3, spp=4, seed=seed)
        fits.append(fit.values["cube.vertices"].tobytes())
    assert fits[0] == fits[1] != fits[2]


def test_keys_of_steps(box):
    scene = drt.load(box)
    loss = drt.Loss(np.full((8, 10, 3), 0.3))

    def fit(name, **keys):
        return drt.optimize(scene, loss, [name], iterations=2, spp=2, steps={name: keys})

    fit("cube.vertices", laplacian=10.0, learning_rate=0.01, smooth=0.1)
    scene.params["painted.reflectance"] = np.full((2, 3, 3), 0.35)
    bounded = fit("painted.reflectance", bounds=[0.3, 0.4], smooth=1e-3)
    found = bounded.values["painted.reflectance"]
    assert (found >= 0.3).all() and (found <= 0.4).all()
    for keys, message in [
        ({"laplacian": -1.0}, "`cube.vertices`: `laplacian` is -1; expected a number"),
        ({"rate": 1.0}, "`cube.vertices`: unknown field `rate`, expected one of `learning_rate`"),
        ({"bounds": [1.0, 0.0]}, "`bounds`"),
        ({"bounds": [5.0, 6.0]}, "outside of its bounds 5 to 6"),
    ]:
        with pytest.raises(drt.Error, match=message):
            fit("cube.vertices", **keys)
    with pytest.raises(drt.Error, match="`steps` has `cone`"):
        drt.optimize(scene, loss, ["cube.vertices"], steps={"cone": {}})
    with pytest.raises(TypeError, match="loss"):
        drt.optimize(scene, np.ones((8, 10, 3)), ["cube.vertices"])


def test_a_callback_ends_a_fit(box):
    scene = drt.load(box)
    loss = drt.Loss(np.full((8, 10, 3), 0.3))
    fit = drt.optimize(scene, loss, ["cube.vertices"], spp=2, callback=lambda i, g: i < 2)
    assert len(fit.losses) == 3
