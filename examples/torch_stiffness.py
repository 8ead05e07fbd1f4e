"""Stiffness along a direction as a function of PyTorch, with cdsm's analytic derivative.

    pip install torch; python examples/torch_stiffness.py

The gradient is that at a fixed posture: a step that keeps the balance has J_Lᵀ ΔF = 0, so steps are
projected on the null space of J_Lᵀ.
"""

from typing import Any

import scipy.linalg
import torch

import cdsm


class Along(torch.autograd.Function):
    """Stiffness k(u; F) [N/m] of an arm at a posture, of tensions F (C,) [N]."""

    @staticmethod
    def forward(ctx: Any, tension: torch.Tensor, pose: cdsm.Posture, direction: str) -> Any:
        """Compute k, and keep ∂k/∂F."""
        K = cdsm.stiffness(pose, tension.detach().numpy())
        ctx.gradient = cdsm.stiffness_gradient(K).along(direction)
        return tension.new_tensor(K.along(direction))

    @staticmethod
    def backward(ctx: Any, *gradients: torch.Tensor) -> Any:
        """Return the gradient of what k is used in."""
        return gradients[0] * torch.tensor(ctx.gradient), None, None


def main() -> None:
    """Pull an arm to 4 N/mm along z by gradient descent, and check the gradient."""
    pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
    start = torch.tensor(cdsm.distribute_tension(pose, minimum=5.0).values, requires_grad=True)
    right = torch.autograd.gradcheck(lambda F: Along.apply(F, pose, "z"), (start,), eps=1e-4)
    print("gradcheck:", right)
    free = torch.tensor(scipy.linalg.null_space(pose.length_jacobian.T))
    amount = torch.zeros(free.shape[1], dtype=torch.double, requires_grad=True)
    optimizer = torch.optim.LBFGS([amount], line_search_fn="strong_wolfe")

    def loss() -> torch.Tensor:
        optimizer.zero_grad()
        error = (1e-3 * Along.apply(start.detach() + free @ amount, pose, "z") - 4.0) ** 2
        error.backward()
        return error

    optimizer.step(loss)
    tension = (start + free @ amount).detach().numpy()
    k = 1e-3 * cdsm.stiffness(pose, tension).along("z")
    print(f"along z: {k:.4f} N/mm with {tension.min():.2f} to {tension.max():.2f} N")


if __name__ == "__main__":
    main()
