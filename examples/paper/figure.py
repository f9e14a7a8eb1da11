"""A figure of the paper, redrawn: the block and the sine that it shows, its data, and what the paper states of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from rocking import pulses
from rocking.block import Block
from rocking.chattering.duration import chattering_time, critical_amplitude
from rocking.chattering.expansions import (
    check_frequency,
    check_lifting_amplitude,
    check_lossy_restitution,
    check_slenderness,
    require_scalar,
)
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.tables import write_figure
from rocking.engine.schemes import ChatteringScheme
from rocking.errors import OptionError
from rocking.motion.motion import Motion
from rocking.response import Response
from rocking.simulation.simulate import simulate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Columns of equal length by name; a name ends in its unit where there is one.
Columns = Mapping[str, NDArray[np.generic]]

_DOTS_PER_INCH: Final = 200

#: The paper's case. Its Fig. 11 has an amplitude of its own, and Fig. 3 two cases.
A: Final = 1.03
OMEGA: Final = 2.0
ETA: Final = 0.92
P: Final = 1.0
ALPHA: Final = 0.2

#: The excitation lasts so many periods.
CYCLES: Final = 2.5

_EVEN_TIMES: Final = 2001
_POINTS_PER_ARC: Final = 16

_SYMBOLS: Final = {"a": "$a$", "omega": r"$\omega$", "eta": r"$\eta$", "p": "$p$", "alpha": r"$\alpha$"}
_UNITS: Final = {"p": " rad/s", "alpha": " rad"}


@dataclass(frozen=True)
class BlockUnderSine:
    """One slender block (p in rad/s, alpha in rad) that lifts off under one sine that starts at phase zero."""

    a: float = A
    omega: float = OMEGA
    eta: float = ETA
    p: float = P
    alpha: float = ALPHA

    def __post_init__(self) -> None:
        check_lifting_amplitude(self.a, excludes_one=True)
        require_scalar(check_frequency(self.omega), "omega")
        require_scalar(check_lossy_restitution(self.eta), "eta")
        checks.positive(self.p, "p", OptionError, "rad/s")
        require_scalar(check_slenderness(self.alpha), "alpha")

    @property
    def period(self) -> float:
        """Period of the excitation, s."""
        return 2.0 * math.pi / (self.omega * self.p)

    @property
    def critical(self) -> float:
        """Critical amplitude, over g alpha."""
        return float(critical_amplitude(self.omega, self.eta))

    @property
    def rest(self) -> float:
        """Chattering time over the period; NaN where chattering is incomplete."""
        return float(chattering_time(self.a, self.omega, self.eta)) * self.omega / (2.0 * math.pi)

    def block(self) -> Block:
        """Return the block."""
        return Block.from_parameters(p=self.p, alpha=self.alpha, restitution=self.eta)

    def excitation(self) -> Motion:
        """Return the sine."""
        return pulses.sine(self.a * self.block().gravity * self.alpha, 1.0 / self.period, cycles=CYCLES)

    def simulated(self, scheme: str | ChatteringScheme) -> Response:
        """Response of the linear model over the duration of the excitation; the block must not overturn."""
        motion = self.excitation()
        response = simulate(self.block(), motion, model="linear", chattering=scheme, duration=motion.duration)
        if response.overturned:
            raise OptionError(f"the block overturns under a sine of {{}} = {self.a:g}: take a smaller one", "a")
        if not len(response.impacts):
            raise OptionError(
                f"the block does not rock visibly under a sine of {{}} = {self.a!r}: take a larger one", "a"
            )
        return response

    def words(self, *names: str) -> str:
        """Parameters of these names and their values: "a = 1.03, p = 1 rad/s"."""
        return describe_parameters({name: value for name, value in asdict(self).items() if name in names})

    def symbols(self, *names: str) -> str:
        """Return the same with the symbols of a figure's title."""
        return in_symbols({name: value for name, value in asdict(self).items() if name in names})


def describe_parameters(parameters: Mapping[str, float]) -> str:
    """Parameters and their values: "omega = 2, eta = 0.92"."""
    return ", ".join(f"{name} = {value:.12g}{_UNITS.get(name, '')}" for name, value in parameters.items())


def in_symbols(parameters: Mapping[str, float]) -> str:
    """Return the same with the symbols of a figure's title."""
    return ", ".join(f"{_SYMBOLS[name]} = {value:g}{_UNITS.get(name, '')}" for name, value in parameters.items())


def yes_or_no(truth: bool) -> str:
    """Return a verdict as statements write it."""
    return "yes" if truth else "no"


def dense_times(impacts: Floats, end: float, *, shortest: float = 0.0) -> Floats:
    """Lay times from 0 to the end: even ones, and some within each arc that is not shorter than the shortest."""
    marks = np.concatenate([[0.0], impacts[impacts < end], [end]])
    lengths = np.diff(marks)
    long = lengths >= shortest
    fractions = np.arange(_POINTS_PER_ARC) / _POINTS_PER_ARC
    arcs = marks[:-1][long, np.newaxis] + fractions * lengths[long, np.newaxis]
    return np.unique(np.concatenate([np.linspace(0.0, end, _EVEN_TIMES), arcs.ravel()]))


@dataclass(frozen=True)
class Statement:
    """What the paper states, and what is computed here; ``print`` it for a line.

    Attributes
    ----------
    claim : str
        What is stated.
    paper : float, str or None
        The paper's number or words, or what its formula gives for these parameters; None where it says nothing of them.
    here : float or str
        Ours.
    digits : int
        Significant digits worth writing.
    formula : str
        The formula of the paper that gives its number or words, "Eq. 76"; empty where they stand in the paper.
    """

    claim: str
    paper: float | str | None
    here: float | str
    digits: int = 7
    formula: str = ""

    @property
    def difference(self) -> float | None:
        """Ours minus the paper's; None where one of them is in words or the paper has none."""
        if isinstance(self.paper, float | int) and isinstance(self.here, float | int):
            return self.here - self.paper
        return None

    def __str__(self) -> str:
        _, here, difference = self.cells
        if self.paper is None:
            return here
        source = f"by {self.formula}" if self.formula else "in the paper"
        return f"{self._written(self.paper)} {source}, {here} here{difference and f', {difference}'}"

    @property
    def cells(self) -> tuple[str, str, str]:
        """Paper, here and difference as texts; the first is empty where the paper says nothing."""
        paper = "" if self.paper is None else self._written(self.paper)
        difference = "" if self.difference is None else f"{self.difference:+.2g}"
        return f"{paper}, {self.formula}" if self.formula else paper, self._written(self.here), difference

    def _written(self, value: float | str) -> str:
        return value if isinstance(value, str) else f"{value:.{self.digits}g}"


@dataclass(frozen=True, eq=False)
class PaperFigure:
    """One figure of the paper, computed; from `paper_figure`.

    Attributes
    ----------
    number : int
        Its number in the paper.
    title : str
        What it shows.
    conditions : str
        The parameters that it is drawn for, with their values; empty where it depends on none.
    tables : mapping of str to mapping of str to ndarray
        All that is drawn: tables by name, and their columns; a name ends in its unit where there is one.
    statements : tuple of Statement
        What the paper states about it in numbers, beside ours.
    drawings : mapping of str to callable
        What draws it, by name; the first is what `draw` draws by default.
    """

    number: int
    title: str
    conditions: str
    tables: Mapping[str, Columns]
    statements: tuple[Statement, ...]
    drawings: Mapping[str, Callable[[], Figure]]

    def summary(self) -> str:
        return "\n".join([self.caption, *(f"  {statement.claim}: {statement}" for statement in self.statements)])

    @property
    def caption(self) -> str:
        """Number, title and conditions."""
        return f"Fig. {self.number}: {self.title}{self.conditions and f'; {self.conditions}'}"

    def draw(self, drawing: str | None = None) -> Figure:
        """Return a new figure of one of its `drawings`, by default of the first."""
        return self.drawings[next(iter(self.drawings)) if drawing is None else drawing]()

    def write(self, folder: Path) -> tuple[Path, ...]:
        """Write all drawings as PDF and PNG, and the tables as CSV, into a folder that exists; returns the files."""
        import pandas as pd

        paths: list[Path] = []
        for k, name in enumerate(self.drawings):
            stem = f"figure-{self.number}-{name}" if k else f"figure-{self.number}"
            pdf, png = folder / f"{stem}.pdf", folder / f"{stem}.png"
            drawn = self.draw(name)
            # Without a date the files of two runs are the same.
            write_figure(pdf, drawn, metadata={"CreationDate": None})
            write_figure(png, drawn, dpi=_DOTS_PER_INCH)
            paths += [pdf, png]
        for name, columns in self.tables.items():
            paths.append(folder / f"figure-{self.number}-{name}.csv")
            pd.DataFrame(dict(columns)).to_csv(paths[-1], index=False, float_format="%.12g", na_rep="nan")
        return tuple(paths)
