"""Parameters: names, shapes, what can be set, and what is refused in which words."""

import numpy as np
import pytest

import drt


def test_a_scene_has_all_of_its_vertices_voxels_and_texels(box, cloud):
    scene = drt.load(box)
    assert {name: scene.params[name].shape for name in scene.params} == {
        "floor.vertices": (4, 3),
        "cube.vertices": (8, 3),
        "painted.reflectance": (2, 3, 3),
    }
    expected = np.linspace(0.2, 0.8, 18).reshape(2, 3, 3).astype(np.float32)
    assert (scene.params["painted.reflectance"] == expected).all()
    assert set(drt.load(cloud).params) == {"bounds.vertices", "smoke.sigma_t"}


def test_values_are_read_only_and_not_copied(box):
    params = drt.load(box).params
    assert params["cube.vertices"] is params["cube.vertices"]
    with pytest.raises(ValueError, match="read-only"):
        params["cube.vertices"][0] = 0
    with pytest.raises(ValueError, match="read-only"):
        params["cube.vertices"] += 1
    given = params["cube.vertices"].copy()
    params["cube.vertices"] = given
    given[:] = 0
    assert (params["cube.vertices"] != 0).any()


def test_what_is_set_counts(box):
    scene = drt.load(box)
    start = scene.params["cube.vertices"]
    before, _ = scene.render(spp=4)
    scene.params["cube.vertices"] = start + [0.3, 0, 0]
    moved, _ = scene.render(spp=4)
    assert (before != moved).any()
    scene.params["cube.vertices"] = start
    after, _ = scene.render(spp=4)
    assert before.tobytes() == after.tobytes()


def test_kinds_of_numbers(box):
    params = drt.load(box).params
    start = params["painted.reflectance"]
    for kind in (np.float32, np.float64, np.int8, np.bool_):
        params["painted.reflectance"] = np.ones(start.shape, kind)
        assert params["painted.reflectance"].dtype == np.float64
    params["painted.reflectance"] = np.asfortranarray(start)
    params["painted.reflectance"] = start[::-1][::-1]
    params["painted.reflectance"] = start.tolist()
    frozen = start.copy()
    frozen.flags.writeable = False
    params["painted.reflectance"] = frozen
    assert (params["painted.reflectance"] == start).all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda v: v[1:], r"`painted.reflectance` has the shape \(1, 3, 3\); expected \(2, 3, 3\)"),
        (lambda v: v.ravel(), r"has the shape \(18,\)"),
        (lambda v: v + 1j, "has the type complex128; expected real numbers"),
        (lambda v: v.astype(str), "expected real numbers"),
        (lambda v: np.where(v == v.max(), np.nan, v), r"is nan at \[1, 2, 2\]; expected finite"),
        (lambda v: np.where(v == v.max(), np.inf, v), r"is inf at \[1, 2, 2\]"),
        (lambda v: v - 1, r"reflectance"),
    ],
)
def test_what_cannot_be_set_changes_nothing(box, change, message):
    scene = drt.load(box)
    before, _ = scene.render(spp=2)
    params = scene.params
    start = params["painted.reflectance"]
    with pytest.raises(drt.Error, match=message):
        params.update(
            {"cube.vertices": params["cube.vertices"] + 1, "painted.reflectance": change(start)}
        )
    assert params["painted.reflectance"] is start
    after, _ = scene.render(spp=2)
    assert before.tobytes() == after.tobytes()


def test_names_that_are_not_there(box):
    scene = drt.load(box)
    with pytest.raises(KeyError, match="no parameter `cone`; there are floor.vertices, "):
        scene.params["cone"]
    with pytest.raises(KeyError, match="cone"):
        scene.params["cone"] = 1
    with pytest.raises(KeyError, match="cone"):
        scene.gradient(np.ones((8, 10, 3)), ["cone"])
    with pytest.raises(KeyError, match="cone"):
        scene.derivatives(["cone"])
    with pytest.raises(drt.Error, match="`cube.vertices` is a group"):
        scene.derivatives(["cube.vertices"])
    with pytest.raises(drt.Error, match="`nobody`"):
        scene.render(sensor="nobody")
    with pytest.raises(TypeError, match="taken away"):
        del scene.params["cube.vertices"]
    assert "cone" not in scene.params


def test_adjoints_that_do_not_fit(box):
    scene = drt.load(box)
    with pytest.raises(
        drt.Error, match=r"`adjoint` has the shape \(10, 8, 3\); expected \(8, 10, 3\)"
    ):
        scene.gradient(np.ones((10, 8, 3)))
    with pytest.raises(drt.Error, match=r"`adjoint` is nan at \[0, 0, 0\]"):
        scene.gradient(np.full((8, 10, 3), np.nan))
    with pytest.raises(drt.Error, match="`spp` is 0"):
        scene.render(spp=0)
    for wrong in (-1, 1.5, "many"):
        with pytest.raises((TypeError, OverflowError)):
            scene.render(spp=wrong)


def test_errors_have_the_words_of_the_program(tmp_path, box):
    import subprocess
    import sys

    (tmp_path / "broken.xml").write_text('<scene version="3.0.0"><shape type="cone"/></scene>')
    (tmp_path / "broken.toml").write_text('scene = "box.xml"\n[[parameter]]\nnme = "x"\n')
    for name in ("broken.xml", "broken.toml", "missing.xml"):
        path = tmp_path / name
        done = subprocess.run(
            [sys.executable, "-m", "drt", "render", path], capture_output=True, text=True
        )
        assert done.returncode == 2
        with pytest.raises(drt.Error) as error:
            drt.load(path)
        assert done.stderr.strip() == f"drt: error: {error.value}"


def test_jobs_from_keys(box):
    keys = {
        "scene": box.name,
        "estimator": {"spp": np.int64(2)},
        "parameter": [
            {
                "name": "shift",
                "value": 0.1,
                "effect": ({"target": "cube", "translate": np.array([1.0, 0, 0])},),
            }
        ],
    }
    job = drt.Job(folder=box.parent, **keys)
    assert job.params["shift"].shape == () and job.params["shift"] == 0.1
    assert "[[parameter.effect]]" in job.text
    job.params["shift"] = 0
    still, _ = job.render()
    assert still.tobytes() == drt.load(box).render(spp=2)[0].tobytes()
    with pytest.raises(drt.Error, match="`shift` is inf"):
        job.params["shift"] = np.inf
    keys["parameter"][0]["effect"][0]["target"] = "cone"
    with pytest.raises(drt.Error, match=r"<job>:\d+:\d+: parameter `shift`: .*cone"):
        drt.Job(folder=box.parent, **keys)
    with pytest.raises(drt.Error, match="unknown field `parameters`"):
        drt.Job(folder=box.parent, scene=box.name, parameters=[])
    with pytest.raises(TypeError, match="`kind` is a object"):
        drt.Job(folder=box.parent, scene=box.name, estimator={"kind": object()})
    with pytest.raises(drt.Error, match="is a scene; expected a job"):
        drt.Job.load(box)


def test_defaults_of_a_scene(box):
    dark, _ = drt.load(box, power=0).render(spp=4)
    bright, _ = drt.load(box, power=10).render(spp=4)
    assert dark.mean() < 0.95 * bright.mean()


def test_values_out_of_range_are_refused_when_they_are_set(box):
    job = drt.Job(
        folder=box.parent,
        scene=box.name,
        parameter=[
            {
                "name": "grey",
                "effect": [{"target": "white", "property": "reflectance", "add": [1] * 3}],
            }
        ],
    )
    before, _ = job.render(spp=2)
    with pytest.raises(drt.Error, match="grey"):
        job.params["grey"] = -5
    assert job.params["grey"] == 0
    after, _ = job.render(spp=2)
    assert before.tobytes() == after.tobytes()
