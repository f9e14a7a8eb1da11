"""A slender museum piece under the 2019 Ridgecrest earthquake: from a shipped record to a verdict and a figure."""

from pathlib import Path

import rocking

OUT = Path("out")


def main() -> None:
    """Simulate, print a short table, write the figure."""
    statue = rocking.Block(half_width=0.12, half_height=0.55)
    motion = rocking.records.load("ridgecrest-clc-090")
    response = rocking.simulate(statue, motion)
    print(response.summary())
    OUT.mkdir(exist_ok=True)
    response.plot(longest_sequence=True).savefig(OUT / "demo.png", dpi=160)
    print(f"\nfigure written to {OUT / 'demo.png'}")


if __name__ == "__main__":
    main()
