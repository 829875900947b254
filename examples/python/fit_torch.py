"""The same as fit.py by PyTorch: `drt` as a function that autograd differentiates through.

    DRT=target/release/drt python3 examples/python/fit_torch.py --picture fit.png
"""

import numpy as np
import torch

import fit


class Render(torch.autograd.Function):
    """From vertices and texels to an image. In the backward pass one run gives the gradient by all of them."""

    @staticmethod
    def forward(ctx, scene, radii, vertices, texels):
        ctx.scene, ctx.unknowns = scene, fit.Unknowns(radii, texels.detach().numpy())
        # Only what a caller may change passes gradients on; the vertices are those of the radii.
        return torch.as_tensor(scene.image(ctx.unknowns), dtype=vertices.dtype)

    @staticmethod
    def backward(ctx, adjoint):
        by_vertices, by_texels = ctx.scene.gradient(ctx.unknowns, adjoint.numpy())
        return None, None, torch.from_numpy(by_vertices), torch.from_numpy(by_texels)


CIRCLE = torch.from_numpy(fit.CIRCLE)
UP = torch.tensor([0.0, 1.0, 0.0], dtype=torch.float64)
HEIGHTS = torch.from_numpy(fit.HEIGHTS)


def vertices(radii):
    """As fit.vertices."""
    rings = radii[:, None, None] * CIRCLE + HEIGHTS[:, None, None] * UP
    return torch.cat([rings.reshape(-1, 3), HEIGHTS[0] * UP[None]])


def by_torch(scene, target, unknowns, iterations, answer):
    """Minimises the mean squared difference from the target."""
    radii = torch.tensor(unknowns.radii, requires_grad=True)
    painting = torch.tensor(unknowns.painting, requires_grad=True)
    target = torch.as_tensor(target, dtype=torch.float64)
    groups = [{"params": [radii], "lr": 0.02}, {"params": [painting], "lr": 0.04}]
    optimizer = torch.optim.Adam(groups, betas=(0.9, 0.99), eps=1e-5)
    decay = torch.optim.lr_scheduler.LambdaLR(optimizer, lambda k: 1 / (1 + 0.02 * (k + 1)))
    for iteration in range(iterations):
        optimizer.zero_grad()
        image = Render.apply(scene, radii.detach().numpy().copy(), vertices(radii), painting)
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
