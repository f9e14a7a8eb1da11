"""Figs 5, 6 and 7: chattering time against amplitude, and the critical amplitude."""

from __future__ import annotations

import math
from functools import partial
from typing import Final

import numpy as np

from rocking.arrays import Floats
from rocking.chattering.paper.case import ETA, OMEGA, Case, in_symbols, in_words, lossy
from rocking.chattering.paper.figure import PaperFigure, Statement
from rocking.chattering.theory.amplitude import critical_amplitude
from rocking.chattering.theory.duration import chattering_time, resolved_by_default
from rocking.plot.amplitudes import contour_figure, duration_figure, frequency_figure, surface_figure

#: Amplitudes of Fig. 5, gathered towards both of its vertical tangents, and how far it goes past the second.
_AMPLITUDES: Final = 201
_BEYOND: Final = 1.15

#: Frequencies over which the paper states a spread, and the restitutions of Fig. 6.
_FREQUENCIES: Final = np.geomspace(0.5, 8.0, 97)
_RESTITUTIONS: Final = np.linspace(0.5, 0.97, 95)

#: Restitution from which the paper calls the critical amplitude independent of the frequency.
_PRACTICAL: Final = 0.75

#: Distances from the vertical tangents of Fig. 5 between which its local exponents are taken, as shares of a_cr - 1.
_NEAR: Final = np.array([3e-6, 3e-7])

#: Frequencies at which Fig. 5 compares the chattering time.
_COMPARED: Final = np.array([0.5, 1.0, 2.0, 5.0])


def figure_5(*, omega: float = OMEGA, eta: float = ETA) -> PaperFigure:
    """Chattering time over half a period against amplitude: exact, Eq. 75, Eq. 65."""
    case = Case(omega=omega, eta=eta)
    critical = case.critical
    inside = 1.0 + (critical - 1.0) * np.sin(np.linspace(0.0, 0.5 * math.pi, _AMPLITUDES)) ** 2
    a = np.concatenate([inside, np.linspace(critical, 1.0 + _BEYOND * (critical - 1.0), 32)[1:]])
    methods = {"exact": "exact", "asymptotic": "asymptotic (Eq. 65)", "semianalytical": "semi-analytical (Eq. 75)"}
    durations = {name: _over_half_period(a, case, name) for name in methods}
    return PaperFigure(
        5,
        "chattering time against amplitude",
        case.words("omega", "eta"),
        {"durations": {"a": a, **durations}},
        _duration_statements(case),
        {
            "durations": partial(
                duration_figure,
                amplitude=a,
                durations={label: durations[name] for name, label in methods.items()},
                critical=critical,
                title=case.symbols("omega", "eta"),
            )
        },
    )


def figure_6() -> PaperFigure:
    """Critical amplitude over frequency and restitution: exact and Eq. 76."""
    omega, eta = _FREQUENCIES[:, np.newaxis], _RESTITUTIONS
    exact, fitted = critical_amplitude(omega, eta), critical_amplitude(omega, eta, method="eq76")
    error = np.abs(fitted / exact - 1.0)
    worst = np.unravel_index(np.argmax(error), error.shape)
    rising = bool((np.diff(exact, axis=1) < 0.0).all())
    spread = _spread(exact)
    practical = spread[_RESTITUTIONS >= _PRACTICAL]
    statements = (
        Statement("a_cr rises as eta falls, at every omega", "yes", _yes(rising)),
        Statement("the influence of omega falls as eta rises", "yes", _yes(bool((np.diff(spread) < 0.0).all()))),
        Statement(
            f"spread of a_cr over omega for eta > {_PRACTICAL:g}, %", '"independent"', float(practical.max()), digits=3
        ),
        Statement("largest error of Eq. 76, %", None, 100.0 * float(error[worst]), digits=3),
        Statement(
            f"a_cr there, at omega = {_FREQUENCIES[worst[0]]:g}, eta = {_RESTITUTIONS[worst[1]]:g}",
            float(fitted[worst]),
            float(exact[worst]),
            formula="Eq. 76",
        ),
    )
    grid = np.meshgrid(_FREQUENCIES, _RESTITUTIONS, indexing="ij")
    return PaperFigure(
        6,
        "critical amplitude over frequency and restitution",
        "",
        {"surface": {"omega": grid[0].ravel(), "eta": grid[1].ravel(), "exact": exact.ravel(), "eq76": fitted.ravel()}},
        statements,
        {
            "contours": partial(contour_figure, omega=_FREQUENCIES, eta=_RESTITUTIONS, exact=exact, fitted=fitted),
            "surface": partial(surface_figure, omega=_FREQUENCIES, eta=_RESTITUTIONS, exact=exact, fitted=fitted),
        },
    )


def figure_7(*, eta: float = ETA) -> PaperFigure:
    """Critical amplitude against frequency: exact, Eq. 76 and Eq. 77."""
    lossy(eta)
    labels = {"exact": "exact", "eq76": "Eq. 76", "eq77": "Eq. 77"}
    critical = {name: critical_amplitude(_FREQUENCIES, eta, method=name) for name in labels}
    exact = critical["exact"]
    spread = float(_spread(exact[:, np.newaxis])[0])
    statements = (
        Statement("spread of a_cr from omega = 0.5 to 8, %", 0.5 if eta == ETA else None, spread, digits=3),
        Statement("a_cr at omega = 0.5", float(critical["eq76"][0]), float(exact[0]), formula="Eq. 76"),
        Statement("a_cr at omega = 8", float(critical["eq76"][-1]), float(exact[-1]), formula="Eq. 76"),
        Statement(
            "a_cr at omega = 2", float(critical["eq77"][0]), float(critical_amplitude(OMEGA, eta)), formula="Eq. 77"
        ),
    )
    return PaperFigure(
        7,
        "critical amplitude against frequency",
        in_words({"eta": eta}),
        {"critical": {"omega": _FREQUENCIES, **critical}},
        statements,
        {
            "critical": partial(
                frequency_figure,
                omega=_FREQUENCIES,
                critical={label: critical[name] for name, label in labels.items()},
                title=in_symbols({"eta": eta}),
            )
        },
    )


def _duration_statements(case: Case) -> tuple[Statement, ...]:
    critical = case.critical
    excess = critical - 1.0
    most = 1.0 + excess * np.linspace(0.01, 0.9, 90)
    exact = _over_half_period(most, case, "exact")
    asymptotic, semianalytical = (
        100.0 * float(np.max(np.abs(_over_half_period(most, case, method) / exact - 1.0)))
        for method in ("asymptotic", "semianalytical")
    )
    starts, ends = 1.0 + excess * _NEAR, critical - excess * _NEAR
    papers = (case.omega, case.eta) == (OMEGA, ETA)
    return (
        Statement("critical amplitude a_cr", 1.038 if papers else None, critical),
        Statement(
            "vertical asymptote at a = 1: tau_ch goes like a - 1 to the power",
            "below 1",
            _exponent(_over_half_period(starts, case, "exact")),
            digits=4,
        ),
        Statement(
            "vertical asymptote at a_cr: T/2 - tau_ch goes like a_cr - a to the power",
            "below 1",
            _exponent(1.0 - _over_half_period(ends, case, "exact")),
            digits=4,
        ),
        Statement(
            "Eq. 65 at a_cr, over T/2 (exact: 1)",
            '"fails"',
            float(_over_half_period(np.array([critical]), case, "asymptotic")[0]),
        ),
        Statement(
            "largest error of Eq. 65 up to 90 % of the way to a_cr, %",
            '"almost perfectly"' if papers else None,
            asymptotic,
            digits=3,
        ),
        Statement(
            f"the same of Eq. 75 with {resolved_by_default(np.array(case.eta))} impacts resolved, %",
            '"remarkable agreement"' if papers else None,
            semianalytical,
            digits=2,
        ),
        Statement("Eq. 65 exceeds the exact time up to a =", None, _crossing(case), digits=5),
        _by_frequency(case.eta),
    )


def _by_frequency(eta: float) -> Statement:
    """Chattering time over half a period at one amplitude, at which chattering is complete at all these frequencies."""
    least = float(np.min(critical_amplitude(_COMPARED, eta))) - 1.0
    a = 1.0 + float(f"{0.9 * least:.2g}")
    shares = np.asarray(chattering_time(a, _COMPARED, eta)) * _COMPARED / math.pi
    here = ", ".join(f"{share:.4f} at omega = {omega:g}" for share, omega in zip(shares, _COMPARED, strict=True))
    return Statement(f"tau_ch/(T/2) at {in_words({'a': a, 'eta': eta})}", '"solely on a and eta"', here)


def _over_half_period(a: Floats, case: Case, method: str) -> Floats:
    return np.asarray(chattering_time(a, case.omega, case.eta, method=method)) * (case.omega / math.pi)


def _crossing(case: Case) -> float | str:
    """Amplitude at which Eq. 65 falls below the exact time, by bisection."""

    def exceeds(a: float) -> bool:
        there = np.array([a])
        return bool(_over_half_period(there, case, "asymptotic") > _over_half_period(there, case, "exact"))

    low, high = 1.0 + 1e-3 * (case.critical - 1.0), case.critical - 1e-3 * (case.critical - 1.0)
    if not exceeds(low):
        return "nowhere"
    if exceeds(high):
        return "a_cr"
    while high - low > 1e-9:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if exceeds(middle) else (low, middle)
    return low


def _exponent(values: Floats) -> float:
    """Local exponent of what has these values at the distances `_NEAR`."""
    return float(np.log(values[0] / values[1]) / np.log(_NEAR[0] / _NEAR[1]))


def _spread(critical: Floats) -> Floats:
    """Largest over smallest along the frequencies (the first axis), minus one, %."""
    spread: Floats = 100.0 * (critical.max(axis=0) / critical.min(axis=0) - 1.0)
    return spread


def _yes(truth: bool) -> str:
    return "yes" if truth else "no"
