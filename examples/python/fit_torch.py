"""The same as fit.py by PyTorch, which differentiates through the images of `drt`.

python examples/python/fit_torch.py --picture fit.png
"""

import fit
import torch

import drt.torch

CIRCLE = torch.from_numpy(fit.CIRCLE)
UP = torch.tensor([0.0, 1.0, 0.0], dtype=torch.float64)
HEIGHTS = torch.from_numpy(fit.HEIGHTS)


def vertices(radii):
    """As fit.vertices."""
    rings = radii[:, None, None] * CIRCLE + HEIGHTS[:, None, None] * UP
    return torch.cat([rings.reshape(-1, 3), HEIGHTS[0] * UP[None]])


def by_torch(scene, target, unknowns, iterations, spp, answer):
    """Minimises the mean squared difference from the target."""
    radii = torch.tensor(unknowns.radii, requires_grad=True)
    painting = torch.tensor(unknowns.painting, requires_grad=True)
    target = torch.as_tensor(target)
    groups = [{"params": [radii], "lr": 0.02}, {"params": [painting], "lr": 0.04}]
    optimizer = torch.optim.Adam(groups, betas=(0.9, 0.99), eps=1e-5)
    decay = torch.optim.lr_scheduler.LambdaLR(optimizer, lambda k: 1 / (1 + 0.02 * (k + 1)))
    for iteration in range(iterations):
        optimizer.zero_grad()
        params = {"vase": vertices(radii), "wall": painting}
        image = drt.torch.render(scene, params, spp, iteration)
        loss = torch.mean((image - target) ** 2)
        loss.backward()
        if iteration % 10 == 0 or iteration == iterations - 1:
            now = fit.Unknowns(radii.detach().numpy(), painting.detach().numpy())
            fit.report(iteration, loss.item(), now, answer)
        optimizer.step()
        decay.step()
        with torch.no_grad():
            radii.clamp_(0.05, 0.9)
            painting.clamp_(0, 1)
    return fit.Unknowns(radii.detach().numpy(), painting.detach().numpy())


if __name__ == "__main__":
    fit.main(by_torch)
