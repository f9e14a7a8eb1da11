"""Draw the paper's figures from computation, with their data and what the paper states in numbers.

``python examples/paper`` draws all, ``python examples/paper 9 --eta 0.9`` one with other parameters.
"""

import argparse
import sys
from pathlib import Path

import matplotlib as mpl

mpl.use("agg")  # Figures are written, not shown.

from figures import FIGURES, paper_figure

from rocking import RockingError
from rocking.inputs.quantities import read_angle

PARAMETERS = {
    "a": (float, "amplitude of the ground acceleration over g alpha"),
    "omega": (float, "its frequency (rad/s) over the block's p"),
    "eta": (float, "coefficient of restitution"),
    "p": (float, "the block's frequency parameter, rad/s"),
    "alpha": (lambda text: read_angle(text, "alpha"), "its slenderness, 12deg or 0.2 (rad)"),
}


def main(arguments: list[str] | None = None) -> None:
    """Draw and write figures."""
    parser = argparse.ArgumentParser(prog="python examples/paper", description=__doc__)
    parser.add_argument("figure", type=int, nargs="?", help="number of one figure; by default all are drawn")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for PDF, PNG and CSV files")
    for name, (kind, text) in PARAMETERS.items():
        parser.add_argument(f"--{name}", type=kind, help=text)
    given = vars(parser.parse_args(arguments))
    parameters = {name: given[name] for name in PARAMETERS if given[name] is not None}
    if parameters and given["figure"] is None:
        parser.error("other parameters are for one figure: give its number")
    given["out"].mkdir(parents=True, exist_ok=True)
    try:
        for number in FIGURES if given["figure"] is None else [given["figure"]]:
            drawn = paper_figure(number, **parameters)
            print(drawn.summary())
            for path in drawn.write(given["out"]):
                print(f"  {path}")
    except RockingError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
