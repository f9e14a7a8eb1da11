"""Stochastic ground motions: modulated, filtered white noise with a changing frequency."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.constants import STANDARD_GRAVITY
from rocking.errors import OptionError
from rocking.motion.description import Description
from rocking.motion.motion import Motion

#: Fraction of the Arias intensity at the middle, and of the part that is simulated.
_MIDDLE_SHARE: Final = 0.45
_END_SHARE: Final = 0.9999
#: Lowest frequency of the filter, Hz, unless the frequency at the middle is lower.
_LOWEST_FREQUENCY: Final = 0.3
#: Motions in one product of matrices, and its rows. Fixed sizes make results independent of the number of motions.
_GROUP_SIZE: Final = 16
_BATCH_SIZE: Final = 256
_MAX_SAMPLES: Final = 20_000


def synthesize_motions(
    count: int,
    *,
    arias_intensity: float,
    duration: float,
    middle_time: float,
    frequency: float,
    frequency_rate: float = 0.0,
    damping: float = 0.3,
    highpass: float = 0.1,
    dt: float = 0.01,
    seed: int = 0,
) -> tuple[Motion, ...]:
    """Generate stochastic ground motions with the parameters of Rezaeian and Der Kiureghian.

    Parameters
    ----------
    count : int
        Number of motions.
    arias_intensity : float
        Expected Arias intensity, m/s.
    duration : float
        Significant duration D5-95, s.
    middle_time : float
        Time at 45 % of the Arias intensity, s.
    frequency, frequency_rate : float
        Frequency of the filter at the middle, Hz, and its rate of change, Hz/s. It does not decrease below 0.3 Hz (or
        the frequency at the middle, if that is lower).
    damping : float
        Damping ratio of the filter, which controls the bandwidth, between 0 and 1.
    highpass : float
        Corner frequency of the high-pass filter, Hz, a critically damped oscillator; 0 for no filter.
    dt : float
        Sampling step, s.
    seed : int
        Seed. Motion k depends only on the seed, k and the parameters, not on the number of motions.

    Returns
    -------
    tuple of Motion
        Motions that are linear between samples.

    Raises
    ------
    OptionError
        If a parameter is out of range, the duration is too long for the time of the middle, or the step is too long for
        the frequency.

    See Also
    --------
    rocking.Motion.measures : Intensity measures of a motion.
    rocking.pulses : Analytical pulses.

    Notes
    -----
    The process is x(t) = q(t) sum_k s_k(t) w_k with standard normal w_k. The s_k(t) are impulse responses of a linear
    oscillator with the frequency at time k dt, normalised to unit variance at each t, and q(t)^2 is proportional to a
    gamma density with the requested duration and time of the middle :cite:p:`rezaeian2010`. The lower limit of the
    frequency, 0.3 Hz, is a choice of this program. The high-pass filter and the straight lines between samples reduce
    the Arias intensity slightly.

    References
    ----------
    Rezaeian, S. and Der Kiureghian, A. (2010). Simulation of synthetic ground motions for specified earthquake and site
    characteristics. Earthquake Engineering and Structural Dynamics 39(10), 1155-1180.

    Examples
    --------
    >>> parameters = {"arias_intensity": 1.0, "duration": 12.0, "middle_time": 8.0, "frequency": 4.0}
    >>> motions = synthesize_motions(5, **parameters, frequency_rate=-0.1, seed=1)
    >>> again = synthesize_motions(20, **parameters, frequency_rate=-0.1, seed=1)
    >>> len(motions), all(motions[k].pga == again[k].pga for k in range(5))
    (5, True)
    """
    number = checks.integer(count, "count", OptionError, 1)
    first_seed = checks.integer(seed, "seed", OptionError, 0)
    positive_values = {"arias_intensity": arias_intensity, "duration": duration, "middle_time": middle_time, "dt": dt}
    values = {name: checks.positive(value, name, OptionError) for name, value in positive_values.items()}
    values["frequency"] = checks.positive(frequency, "frequency", OptionError, "Hz")
    values["frequency_rate"] = checks.finite(frequency_rate, "frequency_rate", OptionError)
    values["damping"] = checks.fraction(damping, "damping", OptionError)
    values["highpass"] = checks.between(highpass, "highpass", OptionError, 0.0, values["frequency"], "Hz")
    envelope, frequencies = _compute_envelope(values), _compute_frequencies(values)
    tail = 10.0 / (2.0 * math.pi * values["highpass"]) if values["highpass"] else 0.0
    description = Description("stochastic", values | {"seed": float(first_seed)}, "modulated and filtered white noise")
    samples = _generate_samples(values, envelope, frequencies, first_seed, number)
    padded = np.pad(samples, ((0, math.ceil(tail / values["dt"])), (0, 0)))
    return tuple(
        Motion.from_samples(column, values["dt"], name=f"stochastic {first_seed}-{k + 1}", description=description)
        for k, column in enumerate(_filter(padded, values).T)
    )


def _compute_envelope(values: dict[str, float]) -> Floats:
    """Compute the standard deviation of the process, m/s^2, from the middle and the duration."""
    from scipy.optimize import brentq
    from scipy.special import gammaincinv, gammaln

    def compute_ratio(log_shape: float) -> float:
        """Compute the duration divided by the time of the middle, which decreases with the shape."""
        start_time, middle_time, end_time = gammaincinv(math.exp(log_shape), (0.05, _MIDDLE_SHARE, 0.95))
        return float((end_time - start_time) / middle_time)

    ratio, limits = values["duration"] / values["middle_time"], (0.0, math.log(1e4))
    largest, smallest = map(compute_ratio, limits)
    if not smallest < ratio < largest:
        message = f"{{}} must be from {smallest:.2g} to {largest:.2f} times {{}}, not {ratio:.4g} times; change either"
        raise OptionError(message, "duration", "middle_time", value=values["duration"])
    shape = math.exp(brentq(lambda log_shape: compute_ratio(log_shape) - ratio, *limits, xtol=1e-12))
    scale = values["middle_time"] / float(gammaincinv(shape, _MIDDLE_SHARE))
    samples = math.ceil(scale * float(gammaincinv(shape, _END_SHARE)) / values["dt"]) + 1
    if samples > _MAX_SAMPLES:
        message = f"these motions have {samples} samples, and at most {_MAX_SAMPLES} are possible; increase {{}}"
        raise OptionError(message, "dt", value=values["dt"])
    times = values["dt"] * np.arange(samples)
    with np.errstate(divide="ignore"):
        log_density = (shape - 1.0) * np.log(times / scale) - times / scale - gammaln(shape) - math.log(scale)
    variance = 2.0 * STANDARD_GRAVITY / math.pi * values["arias_intensity"] * np.exp(log_density)
    return np.asarray(np.sqrt(variance))


def _compute_frequencies(values: dict[str, float]) -> Floats:
    """Compute the frequency of the filter, Hz, at the time of each sample of the longest motions."""
    times = values["dt"] * np.arange(_MAX_SAMPLES)
    frequencies = values["frequency"] + values["frequency_rate"] * (times - values["middle_time"])
    return np.asarray(np.maximum(frequencies, min(_LOWEST_FREQUENCY, values["frequency"])))


def _generate_samples(values: dict[str, float], envelope: Floats, frequencies: Floats, seed: int, count: int) -> Floats:
    """Generate accelerations before the high-pass filter, m/s^2, shape (samples, count)."""
    step, samples = values["dt"], len(envelope)
    if (highest := frequencies[:samples].max()) > 0.25 / step:
        message = f"{{}} must be at most a quarter of the shortest period of the filter, {0.25 / highest:.2g} s"
        raise OptionError(f"{message}; the frequency reaches {highest:.4g} Hz", "dt", value=step)
    rates = 2.0 * math.pi * frequencies[:samples]
    damped_ratio = math.sqrt(1.0 - values["damping"] ** 2)
    factors = np.exp(step * rates * complex(-values["damping"], damped_ratio))  # of an impulse response in one step
    noise = np.empty((-(-count // _GROUP_SIZE), samples, _GROUP_SIZE))
    for k in range(len(noise) * _GROUP_SIZE):
        noise[k // _GROUP_SIZE, :, k % _GROUP_SIZE] = np.random.default_rng([seed, k]).standard_normal(samples)
    responses, result = np.zeros(samples, dtype=np.complex128), np.empty_like(noise)
    for start in range(0, samples, _BATCH_SIZE):
        rows = np.zeros((_BATCH_SIZE, samples))
        for row in range(min(_BATCH_SIZE, samples - start)):
            time_index = start + row
            responses[:time_index] *= factors[:time_index]
            impulses = rates[:time_index] * responses[:time_index].imag
            norm = math.sqrt(float(impulses @ impulses))
            rows[row, :time_index] = envelope[time_index] / norm * impulses if norm > 0.0 else 0.0
            responses[time_index] = 1.0
        for group, group_noise in zip(result, noise, strict=True):
            group[start : start + _BATCH_SIZE] = (rows @ group_noise)[: samples - start]
    return result.swapaxes(0, 1).reshape(samples, -1)[:, :count]


def _filter(samples: Floats, values: dict[str, float]) -> Floats:
    """Apply the high-pass filter s^2/(s + w)^2, exactly for straight lines between samples."""
    from scipy.signal import cont2discrete, lfilter

    if not values["highpass"]:
        return samples
    corner = 2.0 * math.pi * values["highpass"]
    system = np.array([1.0, 0.0, 0.0]), np.array([1.0, 2.0 * corner, corner**2])
    numerator, denominator, _ = cont2discrete(system, values["dt"], method="foh")
    return np.asarray(lfilter(np.ravel(numerator), np.ravel(denominator), samples, axis=0))
