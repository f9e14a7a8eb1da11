"""Figs 2, 3, 5, 6 and 7: a chattering sequence, the ratios of its intervals, its duration, the critical amplitude."""

from __future__ import annotations

import math
from functools import partial
from typing import Final

import amplitudes
import numpy as np
from figure import (
    ALPHA,
    ETA,
    OMEGA,
    A,
    BlockUnderSine,
    P,
    PaperFigure,
    Statement,
    dense_times,
    describe_parameters,
    in_symbols,
    yes_or_no,
)
from histories import Ratios, chattering_figure, ratio_figure

from rocking.chattering.duration import (
    chattering_sequence,
    chattering_time,
    choose_impact_counts,
    critical_amplitude,
    interval_ratios,
)
from rocking.chattering.expansions import check_lossy_restitution, first_impact_speed, first_interval, require_scalar
from rocking.core.arrays import Floats
from rocking.core.bisection import bisect
from rocking.errors import OptionError

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
    case = BlockUnderSine(omega=omega, eta=eta)
    critical = case.critical
    inside = 1.0 + (critical - 1.0) * np.sin(np.linspace(0.0, 0.5 * math.pi, _AMPLITUDES)) ** 2
    a = np.concatenate([inside, np.linspace(critical, 1.0 + _BEYOND * (critical - 1.0), 32)[1:]])
    methods = {"exact": "exact", "asymptotic": "asymptotic (Eq. 65)", "semianalytical": "semi-analytical (Eq. 75)"}
    durations = {name: _over_half_period(a, case, name) for name in methods}
    return PaperFigure(
        5,
        "chattering time against amplitude",
        case.words("omega", "eta"),
        {"durations": {"a": a, **{f"{name}_over_half_period": time for name, time in durations.items()}}},
        _duration_statements(case),
        {
            "durations": partial(
                amplitudes.duration_figure,
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
        Statement("a_cr rises as eta falls, at every omega", "yes", yes_or_no(rising)),
        Statement("the influence of omega falls as eta rises", "yes", yes_or_no(bool((np.diff(spread) < 0.0).all()))),
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
            "contours": partial(
                amplitudes.contour_figure, omega=_FREQUENCIES, eta=_RESTITUTIONS, exact=exact, fitted=fitted
            ),
            "surface": partial(
                amplitudes.surface_figure, omega=_FREQUENCIES, eta=_RESTITUTIONS, exact=exact, fitted=fitted
            ),
        },
    )


def figure_7(*, eta: float = ETA) -> PaperFigure:
    """Critical amplitude against frequency: exact, Eq. 76 and Eq. 77."""
    require_scalar(check_lossy_restitution(eta), "eta")
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
        describe_parameters({"eta": eta}),
        {"critical": {"omega": _FREQUENCIES, **critical}},
        statements,
        {
            "critical": partial(
                amplitudes.frequency_figure,
                omega=_FREQUENCIES,
                critical={label: critical[name] for name, label in labels.items()},
                title=in_symbols({"eta": eta}),
            )
        },
    )


def _duration_statements(case: BlockUnderSine) -> tuple[Statement, ...]:
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
            "vertical tangent at a = 1: tau_ch goes like a - 1 to the power",
            "below 1",
            _exponent(_over_half_period(starts, case, "exact")),
            digits=4,
        ),
        Statement(
            "vertical tangent at a_cr: T/2 - tau_ch goes like a_cr - a to the power",
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
            f"the same of Eq. 75 with {choose_impact_counts(np.array(case.eta))} impacts resolved, %",
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
    return Statement(f"tau_ch/(T/2) at {describe_parameters({'a': a, 'eta': eta})}", '"solely on a and eta"', here)


def _over_half_period(a: Floats, case: BlockUnderSine, method: str) -> Floats:
    return np.asarray(chattering_time(a, case.omega, case.eta, method=method)) * (case.omega / math.pi)


def _crossing(case: BlockUnderSine) -> float | str:
    """Amplitude at which Eq. 65 falls below the exact time, by bisection."""

    def exceeds(a: float) -> bool:
        there = np.array([a])
        return bool(_over_half_period(there, case, "asymptotic") > _over_half_period(there, case, "exact"))

    low, high = 1.0 + 1e-3 * (case.critical - 1.0), case.critical - 1e-3 * (case.critical - 1.0)
    if not exceeds(low):
        return "nowhere"
    if exceeds(high):
        return "a_cr"
    return bisect(low, high, lambda a: not exceeds(a), width=1e-9)[0]


def _exponent(values: Floats) -> float:
    """Local exponent of what has these values at the distances `_NEAR`."""
    return float(np.log(values[0] / values[1]) / np.log(_NEAR[0] / _NEAR[1]))


def _spread(critical: Floats) -> Floats:
    """Largest over smallest along the frequencies (the first axis), minus one, %."""
    spread: Floats = 100.0 * (critical.max(axis=0) / critical.min(axis=0) - 1.0)
    return spread


#: Impact at which the detail of Fig. 2(c) starts, and the one from which the paper calls the ratios of Fig. 3 constant.
_LATE: Final = 60

#: Impacts that Fig. 2(c) shows after that one.
_AFTER: Final = 5

_RATIOS: Final = 100
_CASES: Final = (BlockUnderSine(a=1.01, omega=5.0, eta=0.92), BlockUnderSine(a=1.03, omega=2.0, eta=0.86))
_NAMES: Final = ("a", "omega", "eta")


def figure_2(
    *, a: float = A, omega: float = OMEGA, eta: float = ETA, p: float = P, alpha: float = ALPHA
) -> PaperFigure:
    """Chattering oscillations from uplift to rest."""
    case = BlockUnderSine(a, omega, eta, p, alpha)
    _require_complete(case, 2)
    chattering = chattering_sequence(a, omega, eta)
    response = case.simulated("certified")
    uplift, rest = response.events["time"][:2]
    tau = dense_times(chattering.impacts["time"], chattering.time)
    rotation = response.rotation(uplift + tau / p)
    first = chattering.impacts[0]
    resolved = int(np.sum(response.impacts["time"] <= rest))
    statements = (
        Statement("complete chattering: at rest in finite time", "yes", yes_or_no(chattering.is_complete)),
        Statement("chattering time", '"finite"', chattering.time, digits=13),
        Statement("bracket on it narrower than 2e-12", None, yes_or_no(chattering.upper - chattering.lower < 2e-12)),
        Statement(
            "first interval, p t",
            _eq32_as_printed(a - 1.0, omega),
            float(first["interval"]),
            formula="Eq. 32 as printed",
        ),
        Statement(
            "first interval, p t",
            float(first_interval(a, omega)),
            float(first["interval"]),
            formula="Eq. 32 with its slip corrected",
        ),
        Statement(
            "speed at the first impact",
            float(first_impact_speed(a, omega)),
            float(first["speed_before"]),
            formula="Eq. 34",
        ),
    )
    return PaperFigure(
        2,
        "chattering oscillations",
        case.words(*_NAMES, "p", "alpha"),
        {
            "history": {"tau": tau, "phi": rotation / alpha, "time_s": uplift + tau / p, "rotation_rad": rotation},
            "impacts": {name: chattering.impacts[name] for name in chattering.impacts.dtype.names or ()},
        },
        statements,
        {
            "sequence": partial(
                chattering_figure,
                time=tau,
                rotation=rotation / alpha,
                impact_times=chattering.impacts["time"],
                rest=chattering.time,
                late_impact=max(0, min(_LATE, resolved - _AFTER) - 1),
                title=case.symbols(*_NAMES),
            )
        },
    )


def figure_3(*, a: float | None = None, omega: float | None = None, eta: float | None = None) -> PaperFigure:
    """Ratios of the intervals between every second impact, which tend to eta^2; the paper has two cases."""
    cases = list(
        dict.fromkeys(
            BlockUnderSine(
                case.a if a is None else a, case.omega if omega is None else omega, case.eta if eta is None else eta
            )
            for case in _CASES
        )
    )
    for case in cases:
        _require_complete(case, 3)
    ratios = [interval_ratios(case.a, case.omega, case.eta, _RATIOS) for case in cases]
    if not all(np.isfinite(each).any() for each in ratios):
        raise OptionError("intervals are too short for a ratio of two: take a larger {}", "eta")
    conditions = [case.words(*_NAMES) for case in cases]
    columns = {f"ratio_{'ab'[k]}": values for k, values in enumerate(ratios)}
    return PaperFigure(
        3,
        "ratio of intervals",
        "; ".join(conditions),
        {"ratios": {"n": np.arange(_RATIOS), **columns}},
        tuple(
            statement
            for case, values, words in zip(cases, ratios, conditions, strict=True)
            for statement in _ratio_statements(case, values, words)
        ),
        {
            "ratios": partial(
                ratio_figure,
                [
                    Ratios(values, case.eta**2, case.symbols(*_NAMES))
                    for case, values in zip(cases, ratios, strict=True)
                ],
            )
        },
    )


def _ratio_statements(case: BlockUnderSine, ratios: Floats, words: str) -> list[Statement]:
    """Compare the ratios with their limit; those of intervals below the range of a double are NaN."""
    limit = case.eta**2
    known = np.flatnonzero(np.isfinite(ratios))
    last = int(known[-1])
    statements = [
        Statement(f"{words}: ratio at n = {last}, and its limit", limit, float(ratios[last]), formula="Eq. 73, eta^2")
    ]
    late = ratios[known[known >= _LATE]]
    if late.size:
        apart = float(np.max(np.abs(late / limit - 1.0)))
        statements.append(
            Statement(f"{words}: largest relative distance from it for n >= {_LATE}", '"constant"', apart, digits=2)
        )
    return statements


def _require_complete(case: BlockUnderSine, number: int) -> None:
    if math.isnan(case.rest):
        raise OptionError(
            f"Fig. {number} shows complete chattering: {{}} must be below the critical amplitude "
            f"{case.critical:.9g} at {describe_parameters({'omega': case.omega, 'eta': case.eta})}, not {case.a:.9g}",
            "a",
            value=case.a,
        )


def _eq32_as_printed(eps: float, omega: float) -> float:
    """Eq. 32 with the paper's 32/5, where 32/15 is right: Phi^(6) enters at the same order as Phi^(5)."""
    second = 1.0 - 32.0 * (omega**2 - 1.0) / (5.0 * omega**2)
    return math.sqrt(2.0 * eps) / omega * (4.0 + second * eps)
