"""Images that PyTorch differentiates through, where there is PyTorch."""

import pytest

import drt

torch = pytest.importorskip("torch")

import drt.torch  # noqa: E402


def test_the_backward_pass_is_the_gradient(box):
    scene = drt.load(box)
    names = ["painted.reflectance", "cube.vertices"]
    params = {n: torch.tensor(scene.params[n], requires_grad=True) for n in names}
    target = torch.full((8, 10, 3), 0.3, dtype=torch.float64)
    image = drt.torch.render(scene, params, spp=8, seed=3)
    expected, _ = scene.render(spp=8, seed=3)
    assert image.detach().numpy().tobytes() == expected.tobytes()
    # What happens to the scene in between does not matter.
    scene.params["cube.vertices"] = scene.params["cube.vertices"] + 1
    loss = ((image - target) ** 2).sum()
    loss.backward()
    scene.params["cube.vertices"] = params["cube.vertices"].detach().numpy()
    found = scene.gradient(drt.Loss(target.numpy()), names, spp=8, seed=3)
    assert loss.item() == pytest.approx(found.loss)
    for name in names:
        assert params[name].grad.numpy() == pytest.approx(found[name], rel=1e-12, abs=1e-12)


def test_only_what_is_needed_in_single_precision(box):
    scene = drt.load(box)
    texels = torch.tensor(scene.params["painted.reflectance"], dtype=torch.float32)
    vertices = torch.tensor(scene.params["cube.vertices"], dtype=torch.float32)
    texels.requires_grad = True
    params = {"painted.reflectance": texels, "cube.vertices": vertices}
    image = drt.torch.render(scene, params, spp=4)
    assert image.dtype == torch.float32
    image.mean().backward()
    assert texels.grad.dtype == torch.float32 and vertices.grad is None
    assert (texels.grad > 0).any()


def test_an_optimiser_of_pytorch_fits(box):
    scene = drt.load(box)
    name = "painted.reflectance"
    seen, _ = scene.render(spp=1024, seed=1)
    loss, target = drt.Loss(seen), torch.tensor(seen)
    texels = torch.full((2, 3, 3), 0.5, dtype=torch.float64, requires_grad=True)

    def distance():
        scene.params[name] = texels.detach().numpy()
        return loss(scene.render(spp=1024)[0])[0]

    start = distance()
    optimizer = torch.optim.Adam([texels], lr=0.05)
    for iteration in range(30):
        optimizer.zero_grad()
        image = drt.torch.render(scene, {name: texels}, spp=16, seed=100 + iteration)
        ((image - target) ** 2).sum().backward()
        optimizer.step()
    assert distance() < 0.05 * start


def test_the_torch_example(tmp_path):
    from test_examples import losses_of

    losses = losses_of("fit_torch.py", tmp_path)
    assert losses[-1] < 0.5 * losses[0]
