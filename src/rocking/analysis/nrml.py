"""Fragility models in OpenQuake's NRML 0.5.

The shape is that of the OpenQuake engine's manual ("Fragility Models"): a fragilityModel with a description,
limitStates and fragilityFunctions, continuous (shape logncdf: mean and stddev of the intensity itself) or discrete
(imls and poes).
"""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final, Literal, NamedTuple, get_args

import numpy as np

from rocking.analysis.curve import FragilityCurve
from rocking.analysis.levels import units_of
from rocking.block.body import Body
from rocking.core import checks
from rocking.core.constants import STANDARD_GRAVITY, Model
from rocking.core.tables import write_text
from rocking.errors import InvalidOption
from rocking.motion.measures import DAMPING
from rocking.motion.scaling import Measure

NAMESPACE: Final = "http://openquake.org/xmlns/nrml/0.5"

LossCategory = Literal["structural", "nonstructural", "contents", "business_interruption"]
Format = Literal["continuous", "discrete"]


class Scale(NamedTuple):
    """An intensity measure type of OpenQuake, and what to multiply a measure by to get it."""

    imt: str
    factor: float


def write(path: str | Path, function: ET.Element, limit_states: Sequence[str], description: str, **model: str) -> None:
    """Write a model with one fragility function; `model` holds its id, assetCategory and lossCategory."""
    checks.one_of(model["lossCategory"], "loss_category", InvalidOption, get_args(LossCategory))
    root = ET.Element("nrml", {"xmlns": NAMESPACE})
    named = {"id": _name(model["id"], "model_id"), "assetCategory": _name(model["assetCategory"], "asset_category")}
    element = ET.SubElement(root, "fragilityModel", model | named)
    # The manual asks for a brief string in ASCII.
    ET.SubElement(element, "description").text = description.encode("ascii", "replace").decode("ascii")
    ET.SubElement(element, "limitStates").text = " ".join(_name(state, "a limit state") for state in limit_states)
    element.append(function)
    ET.indent(root)
    write_text(path, f"<?xml version='1.0' encoding='UTF-8'?>\n{ET.tostring(root, encoding='unicode')}\n")


def fragility_function(
    curves: Sequence[FragilityCurve],
    scale: Scale,
    valid: tuple[float, float],
    no_damage: float | None,
    taxonomy: str,
    kind: Format,
) -> ET.Element:
    """Fragility function; `valid` is the range (SI) of the data, up to `no_damage` (OpenQuake's unit) nothing moves."""
    checks.one_of(kind, "format", InvalidOption, get_args(Format))
    low, high = (scale.factor * end for end in valid)
    low = max(low, no_damage or 0.0)
    if not high > low * (1.0 + 1e-5):
        raise InvalidOption(
            f"a fragility model needs a range of intensities, not {low:.6g} to {high:.6g}: the data are all at one "
            "intensity, or below the one that lifts the block"
        )
    function = ET.Element("fragilityFunction", {"id": _name(taxonomy, "taxonomy"), "format": kind})
    measure = {"imt": scale.imt} | ({} if no_damage is None else {"noDamageLimit": f"{no_damage:.8g}"})
    if kind == "continuous":
        function.set("shape", "logncdf")
        ET.SubElement(function, "imls", measure | {"minIML": f"{low:.8g}", "maxIML": f"{high:.8g}"})
        for curve in curves:
            mean, deviation = _moments(scale.factor * curve.median, curve.dispersion)
            moments = {"mean": f"{mean:.8g}", "stddev": f"{deviation:.8g}"}
            ET.SubElement(function, "params", {"ls": curve.limit_state} | moments)
        return function
    from scipy.special import ndtr

    # The first level must lie above the limit of no damage.
    levels = np.geomspace(low, high, 40 + 1)[1:]
    ET.SubElement(function, "imls", measure).text = " ".join(f"{value:.8g}" for value in levels)
    for curve in curves:
        probabilities = ndtr(np.log(levels / (scale.factor * curve.median)) / curve.dispersion)
        ET.SubElement(function, "poes", {"ls": curve.limit_state}).text = " ".join(
            f"{value:.8g}" for value in probabilities
        )
    return function


def scale_of(measure: Measure, block: Body | None, model: Model) -> Scale:
    """OpenQuake's type for a measure, and the factor from SI units or the block's own: PGA and SA in g, PGV in cm/s.

    SA(T) does not say its damping: it is that of ground-motion models.
    """
    if block is not None:
        own = float(units_of(block.alone(), measure, model)[0])
    elif not measure.in_block_units:
        own = 1.0
    else:
        raise InvalidOption(
            f"{measure.name} counts in a block's own unit; give {{}} to write it as PGA or PGV", "block"
        )
    if measure.of_motion == "pgv":
        return Scale("PGV", 100.0 * own)
    if measure.damping != DAMPING:
        raise InvalidOption(
            f"the {{}} of OpenQuake's spectral accelerations is {DAMPING:g} of critical, not {measure.damping:g}: fit "
            "the fragility against a measure of that damping",
            "damping",
            value=measure.damping,
        )
    imt = "PGA" if measure.of_motion == "pga" else f"SA({measure.period:g})"
    return Scale(imt, own / STANDARD_GRAVITY)


def _moments(median: float, dispersion: float) -> tuple[float, float]:
    """Mean and standard deviation of a lognormal."""
    try:
        mean = median * math.exp(0.5 * dispersion**2)
        deviation = mean * math.sqrt(math.expm1(dispersion**2))
    except OverflowError:
        deviation = math.inf
    if not math.isfinite(deviation):
        raise InvalidOption(
            f'a dispersion of {dispersion:.3g} is too wide for the mean and stddev of NRML; set {{}} to "discrete"',
            "format",
        )
    return mean, deviation


def check_names(names: Iterable[str], what: str) -> None:
    """Raise an InvalidOption unless NRML allows all these names of something."""
    for name in names:
        _name(name, what)


def _name(text: str, what: str) -> str:
    if not re.compile(r"[A-Za-z0-9_-]{1,100}").fullmatch(checks.text(text, what, InvalidOption)):
        raise InvalidOption(
            f"{{}} of NRML may have letters, digits, dashes and underscores, and 100 of them at most, not {text!r}",
            what,
            value=text,
        )
    return text
