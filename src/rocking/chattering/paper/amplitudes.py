"""Figs 5, 6 and 7: chattering time against amplitude, and the critical amplitude."""

from __future__ import annotations

import math
from functools import partial
from typing import Final

import numpy as np

from rocking.arrays import Floats
from rocking.chattering.paper.case import ETA, OMEGA
from rocking.chattering.paper.figure import PaperFigure, Statement
from rocking.chattering.theory.amplitude import critical_amplitude
from rocking.chattering.theory.duration import chattering_time
from rocking.plot.amplitudes import duration_figure, frequency_figure, surface_figure

#: Amplitudes of Fig. 5, gathered towards both of its vertical tangents, and how far it goes past the second.
_AMPLITUDES: Final = 201
_BEYOND: Final = 1.15

#: Frequencies over which the paper states a spread, and the restitutions of Fig. 6.
_FREQUENCIES: Final = np.linspace(0.5, 8.0, 76)
_RESTITUTIONS: Final = np.linspace(0.5, 0.97, 48)

#: Restitution from which the paper calls the critical amplitude independent of the frequency.
_PRACTICAL: Final = 0.75

#: Distances from the vertical tangents of Fig. 5, in a, between which its local exponents are taken.
_NEAR: Final = np.array([1e-7, 1e-8])


def figure_5() -> PaperFigure:
    """Chattering time over half a period against amplitude, at omega = 2, eta = 0.92: exact, Eq. 75, Eq. 65."""
    critical = float(critical_amplitude(OMEGA, ETA))
    inside = 1.0 + (critical - 1.0) * np.sin(np.linspace(0.0, 0.5 * math.pi, _AMPLITUDES)) ** 2
    a = np.concatenate([inside, np.linspace(critical, 1.0 + _BEYOND * (critical - 1.0), 32)[1:]])
    methods = {"exact": "exact", "asymptotic": "asymptotic (Eq. 65)", "semianalytical": "semi-analytical (Eq. 75)"}
    durations = {name: _over_half_period(a, name) for name in methods}
    return PaperFigure(
        5,
        "chattering time against amplitude",
        {"durations": {"a": a, **durations}},
        _duration_statements(critical),
        partial(
            duration_figure,
            amplitude=a,
            durations={label: durations[name] for name, label in methods.items()},
            critical=critical,
            title=rf"$\omega$ = {OMEGA:g}, $\eta$ = {ETA:g}",
        ),
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
        Statement("largest error of Eq. 76, %", "none given", 100.0 * float(error[worst]), digits=3),
        Statement(
            f"Eq. 76 there, at omega = {_FREQUENCIES[worst[0]]:g}, eta = {_RESTITUTIONS[worst[1]]:g}",
            float(fitted[worst]),
            float(exact[worst]),
        ),
    )
    grid = np.meshgrid(_FREQUENCIES, _RESTITUTIONS, indexing="ij")
    return PaperFigure(
        6,
        "critical amplitude over frequency and restitution",
        {"surface": {"omega": grid[0].ravel(), "eta": grid[1].ravel(), "exact": exact.ravel(), "eq76": fitted.ravel()}},
        statements,
        partial(surface_figure, omega=_FREQUENCIES, eta=_RESTITUTIONS, exact=exact, fitted=fitted),
    )


def figure_7() -> PaperFigure:
    """Critical amplitude against frequency at eta = 0.92: exact, Eq. 76 and Eq. 77."""
    labels = {"exact": "exact", "eq76": "Eq. 76", "eq77": "Eq. 77"}
    critical = {name: critical_amplitude(_FREQUENCIES, ETA, method=name) for name in labels}
    exact = critical["exact"]
    statements = (
        Statement("spread of a_cr from omega = 0.5 to 8, %", 0.5, float(_spread(exact[:, np.newaxis])[0]), digits=3),
        Statement("a_cr at omega = 0.5 (paper: Eq. 76)", float(critical["eq76"][0]), float(exact[0])),
        Statement("a_cr at omega = 8 (paper: Eq. 76)", float(critical["eq76"][-1]), float(exact[-1])),
        Statement(
            "a_cr at omega = 2 (paper: Eq. 77)", float(critical["eq77"][0]), float(critical_amplitude(OMEGA, ETA))
        ),
    )
    return PaperFigure(
        7,
        "critical amplitude against frequency",
        {"critical": {"omega": _FREQUENCIES, **critical}},
        statements,
        partial(
            frequency_figure,
            omega=_FREQUENCIES,
            critical={label: critical[name] for name, label in labels.items()},
            title=rf"$\eta$ = {ETA:g}",
        ),
    )


def _duration_statements(critical: float) -> tuple[Statement, ...]:
    most = 1.0 + (critical - 1.0) * np.linspace(0.01, 0.9, 90)
    exact = _over_half_period(most, "exact")
    asymptotic, semianalytical = (
        100.0 * float(np.max(np.abs(_over_half_period(most, method) / exact - 1.0)))
        for method in ("asymptotic", "semianalytical")
    )
    starts, ends = 1.0 + _NEAR, critical - _NEAR
    by_frequency = ", ".join(
        f"{float(chattering_time(1.03, omega, ETA)) * omega / math.pi:.4f} at omega = {omega:g}"
        for omega in (0.5, 1.0, 2.0, 5.0)
    )
    return (
        Statement("critical amplitude a_cr", 1.038, critical),
        Statement(
            "vertical asymptote at a = 1: tau_ch goes like a - 1 to the power",
            "below 1",
            _exponent(_over_half_period(starts, "exact")),
            digits=4,
        ),
        Statement(
            "vertical asymptote at a_cr: T/2 - tau_ch goes like a_cr - a to the power",
            "below 1",
            _exponent(1.0 - _over_half_period(ends, "exact")),
            digits=4,
        ),
        Statement(
            "Eq. 65 at a_cr, over T/2 (exact: 1)",
            '"fails"',
            float(_over_half_period(np.array([critical]), "asymptotic")[0]),
        ),
        Statement(
            "largest error of Eq. 65 up to 90 % of the way to a_cr, %", '"almost perfectly"', asymptotic, digits=3
        ),
        Statement("the same of Eq. 75 with 60 impacts resolved, %", '"remarkable agreement"', semianalytical, digits=2),
        Statement("Eq. 65 exceeds the exact time up to a =", "not mentioned", _crossing(critical), digits=5),
        Statement("tau_ch/(T/2) at a = 1.03, eta = 0.92", '"solely on a and eta"', by_frequency),
    )


def _over_half_period(a: Floats, method: str) -> Floats:
    return np.asarray(chattering_time(a, OMEGA, ETA, method=method)) * (OMEGA / math.pi)


def _crossing(critical: float) -> float:
    """Amplitude at which Eq. 65 falls below the exact time, by bisection."""
    low, high = 1.0, critical
    while high - low > 1e-9:
        middle = np.array([0.5 * (low + high)])
        exceeds = _over_half_period(middle, "asymptotic") > _over_half_period(middle, "exact")
        low, high = (float(middle[0]), high) if exceeds[0] else (low, float(middle[0]))
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
