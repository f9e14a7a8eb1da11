"""`rocking paper`: the paper's figures, redrawn from computation."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Group, Parameter

from rocking.chattering.paper import FIGURES, paper_figure
from rocking.cli import batch
from rocking.cli.options import OUTPUT, QuietOptions
from rocking.errors import InvalidOption
from rocking.quantities import angle

_CASE = Parameter(name="*", group=Group("Other parameters than the paper's, for one figure", sort_key=1))


@dataclass(frozen=True)
class _CaseOptions:
    """Block and excitation that one figure is drawn for."""

    a: Annotated[float | None, Parameter(help="Amplitude of the ground acceleration over g alpha.")] = None
    omega: Annotated[float | None, Parameter(help="Its frequency (rad/s) over the block's p.")] = None
    eta: Annotated[float | None, Parameter(help="Coefficient of restitution.")] = None
    p: Annotated[float | None, Parameter(help="The block's frequency parameter, rad/s.")] = None
    alpha: Annotated[str | None, Parameter(help="Its slenderness, 12deg or 0.2 (rad).")] = None

    def chosen(self) -> dict[str, float]:
        """Return what is given, as arguments."""
        slenderness = None if self.alpha is None else angle(self.alpha, "--alpha")
        given = {"a": self.a, "omega": self.omega, "eta": self.eta, "p": self.p, "alpha": slenderness}
        return {name: value for name, value in given.items() if value is not None}


def paper(
    *,
    out: Path,
    figure: int | None = None,
    case: Annotated[_CaseOptions, _CASE] = _CaseOptions(),
    output: Annotated[QuietOptions, OUTPUT] = QuietOptions(),
) -> None:
    """Redraw the paper's figures from computation: PDF, PNG, the data as CSV, and what the paper states in numbers.

    Parameters
    ----------
    out
        Folder for the files.
    figure
        Number of one figure; all of them by default.
    """
    parameters = case.chosen()
    if parameters and figure is None:
        options = " and ".join(f"--{name}" for name in parameters)
        raise InvalidOption(f"with {options} one figure is drawn: say which with --figure")
    with batch.output_folder(out) as folder:
        for number in FIGURES if figure is None else [figure]:
            drawn = paper_figure(number, **parameters)
            print(drawn.summary())
            for path in drawn.write(folder):
                print(f"  {path}")
