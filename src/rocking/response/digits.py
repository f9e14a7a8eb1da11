"""How many digits of a response are known, where what drives the block is known as records print it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from rocking.response.response import Response

#: What drives a block (the motion, or the initial state) is taken to be known to this part of itself, about what the
#: usual record formats print: digits of times and of the peak that it would change are not shown.
KNOWN: Final = 1e-6

#: Decimals of a time, and digits of a peak, at most.
MOST_DECIMALS: Final = 9
_MOST_DIGITS: Final = 6

#: Decimals of a time in a table, and of one beside others in a summary.
_BRIEF: Final = 2
_SHORT: Final = 4

#: From so much on, s, the unknown part of a time is told with it.
TOLD: Final = 1e-3


def time_text(time: float, change: float) -> str:
    """Time in s, as far as it is known where what drives the block is known to `KNOWN` of itself.

    Parameters
    ----------
    change : float
        Change of the time per relative change of what drives the block, s.

    Examples
    --------
    >>> time_text(230.726244377, 0.0), time_text(230.726244377, 3.0), time_text(230.726244377, 4e5)
    ('230.726244377 s', '230.72624 s', '230.7 +- 0.4 s')
    """
    unknown = KNOWN * change
    text = f"{time:.{decimals(unknown)}f}"
    if unknown < TOLD:
        return f"{text} s"
    return f"{text} +- {unknown:.1g} s" if unknown < 0.5 * time else f"about {text} s"


def overturn_text(response: Response) -> str:
    """Time at which the block overturns, as far as it is known."""
    return time_text(response.overturn_time, _change_of_fall(response))


def brief_overturn_text(response: Response) -> str:
    """Time at which the block overturns, to a hundredth of a second, or as far as it is known."""
    known = decimals(KNOWN * _change_of_fall(response)) >= _BRIEF
    return f"{response.overturn_time:.{_BRIEF}f} s" if known else overturn_text(response)


def tipping_text(response: Response) -> str:
    """Time at which the block tips, as far as it is known: it falls as late or as early as it tips."""
    return _short_text(response.tipping_time, KNOWN * _change_of_fall(response) if response.overturned else 0.0)


def peak_text(response: Response) -> str:
    """Peak rotation, as far as it is known."""
    return f"{response.peak_rotation:.{_peak_digits(response)}g} rad"


def ratio_text(response: Response) -> str:
    """Peak rotation over slenderness, to the digits that are known."""
    return f"{response.peak_over_slenderness:.{min(_peak_digits(response), 4)}g}"


def _peak_digits(response: Response) -> int:
    return digits_of(response.peak_rotation, response.sensitivity.driving()[0])


def digits_of(value: float, change: float) -> int:
    """Digits that are known of a value, which changes so much per relative change of what drives the block."""
    if not math.isfinite(change):
        return 1
    if not (change > 0.0 and value > 0.0):
        return _MOST_DIGITS
    return min(max(math.floor(-math.log10(KNOWN * change / value)), 1), _MOST_DIGITS)


def peak_time_text(response: Response) -> str:
    """Time of the peak: that of a swing which is uncertain by a share of itself, by this share of its duration."""
    if response.overturned:
        return _short_text(response.peak_time, KNOWN * _change_of_fall(response))
    change = response.sensitivity.driving()[0]
    bend = response.peak_rotation * abs(float(response.angular_acceleration(response.peak_time)))
    return _short_text(response.peak_time, KNOWN * change / math.sqrt(bend) if bend > 0.0 else 0.0)


def decimals(unknown: float) -> int:
    """Decimals of a number of which so much is unknown: of what is told, the one that is uncertain as well."""
    if not math.isfinite(unknown):
        return 0
    if unknown <= 0.0:
        return MOST_DECIMALS
    known = -math.log10(unknown)
    return min(max(math.ceil(known) if unknown >= TOLD else math.floor(known), 0), MOST_DECIMALS)


def _short_text(time: float, unknown: float) -> str:
    """Time to four decimals at most, of which so much is unknown, s."""
    about = "" if unknown < TOLD else "about "
    return f"{about}{time:.{min(decimals(unknown), _SHORT)}f} s"


def _change_of_fall(response: Response) -> float:
    """Change of the time at which the block overturns per relative change of what drives it, s."""
    return float(response.sensitivity.driving()[1][-1])
