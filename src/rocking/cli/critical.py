"""`rocking critical`: the critical amplitude of a sine, by every method."""

from __future__ import annotations

import warnings
from typing import Annotated, Any

from cyclopts import Parameter

from rocking.chattering import critical_amplitude
from rocking.errors import InvalidOption, OutsideFit
from rocking.tables import to_json

_METHODS = {
    "exact": "exact",
    "eq76": "Eq. 76",
    "eq77": "Eq. 77",
    "approximation": "Chebyshev expansion",
}


def critical(
    omega: float,
    eta: float,
    *,
    as_json: Annotated[bool, Parameter(name="--json", negative="")] = False,
) -> None:
    """Give the amplitude up to which chattering under a sine is complete, by every method.

    Parameters
    ----------
    omega
        Frequency of the ground acceleration (rad/s) over the block's p.
    eta
        Coefficient of restitution.
    as_json
        Print the result as JSON.
    """
    exact = float(critical_amplitude(omega, eta))
    amplitudes: dict[str, float | None] = {"exact": exact}
    amplitudes |= {method: _amplitude(omega, eta, method) for method in _METHODS if method != "exact"}
    result: dict[str, Any] = {"omega": omega, "eta": eta, "critical_amplitude": amplitudes}
    if as_json:
        print(to_json(result))
        return
    for method, name in _METHODS.items():
        amplitude = amplitudes[method]
        if amplitude is None:
            print(f"{name:<24}none here: it holds for fewer omega and eta")
        elif method == "exact":
            print(f"{name:<24}{amplitude:.14g}")
        else:
            print(f"{name:<24}{amplitude:<16.10g}off by {amplitude - exact:+.2e}")


def _amplitude(omega: float, eta: float, method: str) -> float | None:
    """Amplitude by an approximation; None where it does not hold. The exact method has checked the parameters."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", OutsideFit)
        try:
            return float(critical_amplitude(omega, eta, method=method))
        except (InvalidOption, OutsideFit):
            return None
