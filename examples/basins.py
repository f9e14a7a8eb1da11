"""Under a motion without end: where a ball settles as its table shakes harder, and where a block goes, by its start."""

import math
from pathlib import Path

import numpy as np

import rocking
from rocking import dynamics

OUT = Path("out")
RESTITUTION, GRAVITY, FREQUENCY = 0.5, 10.0, 5.0


def first_doubling(e: float) -> float:
    """Peak acceleration over g at which the orbit of one bounce a period doubles (Luck and Mehta 1993)."""
    return math.hypot(math.pi * (1.0 - e) / (1.0 + e), 2.0 * (1.0 + e * e) / (1.0 + e) ** 2)


def main() -> float:
    """Draw a bifurcation diagram and basins; return how far the ball's first doubling is from its closed form."""
    OUT.mkdir(exist_ok=True)
    ball = dynamics.BouncingBall(RESTITUTION, gravity=GRAVITY)
    diagram = dynamics.bifurcation_diagram(
        lambda ratio: (ball, rocking.pulses.sine(GRAVITY * ratio, FREQUENCY, cycles=1)),
        np.linspace(1.05, 1.78, 366),
        [[0.05075, 0.35749], [0.0, 0.0]],
        transient=1500,
        parameter="peak acceleration of the table over g",
    )
    diagram.plot().savefig(OUT / "bifurcation.png", dpi=160)
    below = diagram.changes()[0][0]
    above = float(diagram.value.values[diagram.period.values[0, :, 0] == 2][0])
    exact = first_doubling(RESTITUTION)
    print(f"the period doubles between {below:.3f} and {above:.3f}; closed form {exact:.4f}")

    block = rocking.Block.from_parameters(p=3.0, alpha=0.25, restitution=0.9)
    shaking = rocking.pulses.sine(6.0, 2.5, cycles=1)
    found = dynamics.basins(block, shaking, np.linspace(-0.25, 0.25, 400), np.linspace(-0.75, 0.75, 400))
    found.plot(title="slender block (p = 3 rad/s, α = 0.25, restitution 0.9) under a sine").savefig(
        OUT / "basins.png", dpi=160
    )
    print(found.summary())
    return abs(0.5 * (below + above) - exact)


if __name__ == "__main__":
    main()
