"""The peak rotation of a block as a function that PyTorch differentiates: four sines are made gentler step by step.

Needs PyTorch (``pip install torch``).
"""

import numpy as np
import torch

import rocking

BLOCK = rocking.Block(width=0.24, height=1.1)
STEP = 0.02


class Peak(torch.autograd.Function):
    """Peak rotation, rad, of a record's samples in m/s^2."""

    @staticmethod
    def forward(context, samples):
        """Simulate; keep the derivatives for the way back."""
        response = rocking.simulate(
            BLOCK,
            rocking.Motion.from_samples(samples.detach().cpu().numpy(), STEP),
        )
        found = rocking.gradient(response)
        context.save_for_backward(
            torch.as_tensor(
                found.samples, dtype=samples.dtype, device=samples.device
            )
        )
        return samples.new_tensor(found.value)

    @staticmethod
    def backward(context, change):
        """Take a change with the peak to one with the samples."""
        (slopes,) = context.saved_tensors
        return change * slopes


def record(parts):
    """Sum four sines, of 1 to 3 Hz, that fade in and out over 4 s, m/s^2."""
    time = STEP * torch.arange(201, dtype=torch.float64)
    frequencies = torch.tensor([1.0, 1.5, 2.0, 3.0], dtype=torch.float64)
    waves = torch.sin(2.0 * torch.pi * frequencies[:, None] * time)
    return torch.sin(torch.pi * time / 4.0) ** 2 * (parts @ waves)


def main():
    """Print derivatives beside differences, and a descent; return them, and the peaks along it."""
    parts = torch.tensor(
        [0.5, 1.4, 2.4, -1.0], dtype=torch.float64, requires_grad=True
    )
    height = Peak.apply(record(parts))
    (found,) = torch.autograd.grad(height, parts)
    h = 1e-5
    differences = [
        (
            Peak.apply(record(parts.detach() + h * e))
            - Peak.apply(record(parts.detach() - h * e))
        ).item()
        / (2.0 * h)
        for e in torch.eye(4, dtype=torch.float64)
    ]
    print(f"peak rotation {height.item():.6f} rad")
    for slope, difference in zip(found, differences, strict=True):
        print(
            f"by an amplitude: {slope:+.8f} rad per m/s^2, by differences {difference:+.8f}"
        )

    optimiser = torch.optim.SGD([parts], lr=1.0)
    peaks = []
    for _ in range(4):
        optimiser.zero_grad()
        height = Peak.apply(record(parts))
        height.backward()
        optimiser.step()
        peaks.append(height.item())
    print(
        "a descent along the gradient, peaks in rad:",
        ", ".join(f"{each:.5f}" for each in peaks),
    )
    return found.numpy(), np.array(differences), peaks


if __name__ == "__main__":
    main()
