"""Images as functions that PyTorch differentiates through.

image = drt.torch.render(scene, {"vase.vertices": vertices}, spp=64, seed=iteration)
loss = ((image - target) ** 2).mean()
loss.backward()
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import torch

from . import _core
from ._scene import Scene


class _Render(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any, scene: Scene, names: list[str], options: dict[str, Any], *values: Any
    ) -> Any:
        ctx.scene, ctx.names, ctx.options = scene, names, options
        ctx.save_for_backward(*values)
        scene.params.update(_arrays(names, values))
        image, _ = scene.render(**options)
        kind = values[0].dtype if values else torch.get_default_dtype()
        return torch.as_tensor(image).to(kind)

    @staticmethod
    def backward(ctx: Any, *adjoints: Any) -> Any:
        values = ctx.saved_tensors
        wanted = [n for n, needed in zip(ctx.names, ctx.needs_input_grad[3:]) if needed]
        # Other images may have been rendered since.
        ctx.scene.params.update(_arrays(ctx.names, values))
        options = {**ctx.options, "seed": _core.independent_seed(ctx.options["seed"])}
        adjoint = adjoints[0].detach().cpu().double().numpy()
        found = ctx.scene.gradient(adjoint, wanted, **options)
        gradients = [
            torch.as_tensor(found[n]).to(v.device, v.dtype) if n in found else None
            for n, v in zip(ctx.names, values)
        ]
        return (None, None, None, *gradients)


def render(
    scene: Scene,
    params: Mapping[str, torch.Tensor],
    spp: int | None = None,
    seed: int = 0,
    *,
    sensor: str | None = None,
) -> torch.Tensor:
    """The image, rows × columns × 3, at these values of parameters, which keep their gradients.

    The backward pass takes other samples than the image, so that the gradients of squared losses are unbiased. Derivatives of
    second order are not supported.
    """
    options = {"spp": spp, "seed": seed, "sensor": sensor}
    return _Render.apply(scene, list(params), options, *params.values())


def _arrays(names: list[str], values: Any) -> dict[str, Any]:
    return {n: v.detach().cpu().double().numpy() for n, v in zip(names, values)}
