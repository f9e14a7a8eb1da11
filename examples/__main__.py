"""Run examples by name, or all, and write their figures: ``python examples [NAME ...]``."""

import runpy
import sys
import warnings
from pathlib import Path

import matplotlib as mpl

mpl.use("agg")  # Figures are written, not shown.

import matplotlib.pyplot as plt

EXAMPLES = {path.stem: path for path in sorted(Path(__file__).parent.glob("[a-z]*.py"))}
OUT = Path("out")


def main(*names: str) -> None:
    """Run these examples; say what each is, and where its figure is."""
    unknown = [name for name in names if name not in EXAMPLES]
    if unknown:
        sys.exit(f"There is no example {unknown[0]!r}; there are: {', '.join(EXAMPLES)}.")
    OUT.mkdir(exist_ok=True)
    warnings.filterwarnings("ignore", "FigureCanvasAgg is non-interactive")
    for name in names or EXAMPLES:
        title = EXAMPLES[name].read_text("utf-8").splitlines()[1]
        print(f"{title} (examples/{name}.py)\n", flush=True)
        runpy.run_path(str(EXAMPLES[name]))
        plt.savefig(OUT / f"{name}.png", dpi=160)
        plt.close("all")
        print(f"\nThe figure is in {OUT / name}.png.")


if __name__ == "__main__":
    main(*sys.argv[1:])
