"""Fragility models in OpenQuake's NRML 0.5.

The shape is that of the OpenQuake engine's manual ("Fragility Models"): a fragilityModel with a description,
limitStates and fragilityFunctions, continuous (shape logncdf: mean and stddev of the intensity itself) or discrete
(imls and poes).
"""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path
from typing import Final, Literal, NamedTuple, get_args

import numpy as np

from rocking import checks
from rocking.analysis.intensity import Measure
from rocking.block import Block, Blocks
from rocking.constants import STANDARD_GRAVITY
from rocking.errors import InvalidOption
from rocking.model import Model
from rocking.tables import write_text

NAMESPACE: Final = "http://openquake.org/xmlns/nrml/0.5"

LossCategory = Literal["structural", "nonstructural", "contents", "business_interruption"]
Format = Literal["continuous", "discrete"]

_NAME: Final = re.compile(r"[A-Za-z0-9_-]{1,100}")
#: Intensities of a discrete function.
_LEVELS: Final = 40
#: Range of intensities over the lowest, at least: they are written with eight digits.
_NARROWEST: Final = 1e-5


class Header(NamedTuple):
    """What a fragility model says about itself."""

    model_id: str
    asset_category: str
    loss_category: LossCategory
    description: str


class Lognormal(NamedTuple):
    """A limit state's curve: median, in the measure's units, and dispersion."""

    limit_state: str
    median: float
    dispersion: float


class Scale(NamedTuple):
    """An intensity measure type of OpenQuake, and what to multiply a measure by to get it."""

    imt: str
    factor: float


def write(path: str | Path, function: ET.Element, limit_states: Sequence[str], header: Header) -> None:
    """Write a model with one fragility function.

    Raises
    ------
    InvalidOption
        If a name has a character that NRML does not allow, or the loss category is none of OpenQuake's.
    OutputError
        If the file cannot be written.
    """
    checks.one_of(header.loss_category, "loss_category", InvalidOption, get_args(LossCategory))
    root = ET.Element("nrml", {"xmlns": NAMESPACE})
    model = ET.SubElement(
        root,
        "fragilityModel",
        {
            "id": _name(header.model_id, "model_id"),
            "assetCategory": header.asset_category,
            "lossCategory": header.loss_category,
        },
    )
    # The manual asks for a brief string in ASCII.
    ET.SubElement(model, "description").text = header.description.encode("ascii", "replace").decode("ascii")
    ET.SubElement(model, "limitStates").text = " ".join(_name(state, "a limit state") for state in limit_states)
    model.append(function)
    ET.indent(root)
    write_text(path, f"<?xml version='1.0' encoding='UTF-8'?>\n{ET.tostring(root, encoding='unicode')}\n")


def fragility_function(
    curves: Sequence[Lognormal],
    scale: Scale,
    valid: tuple[float, float],
    no_damage: float | None,
    taxonomy: str,
    kind: Format,
) -> ET.Element:
    """Fragility function, all intensities in OpenQuake's units.

    Parameters
    ----------
    curves : sequence of Lognormal
        One for each limit state.
    scale : Scale
        From `scale_of`.
    valid : (float, float)
        Range of intensities, in SI units, that the data cover.
    no_damage : float or None
        Intensity, in OpenQuake's units, below which nothing can happen.
    taxonomy : str
        Identifier.
    kind : {"continuous", "discrete"}
        Format.

    Raises
    ------
    InvalidOption
        If the format is neither, the identifier not allowed, or a dispersion too wide for a mean and a deviation.
    """
    checks.one_of(kind, "format", InvalidOption, get_args(Format))
    low, high = (scale.factor * end for end in valid)
    low = max(low, no_damage or 0.0)
    if not high > low * (1.0 + _NARROWEST):
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
    levels = np.geomspace(low, high, _LEVELS + 1)[1:]
    ET.SubElement(function, "imls", measure).text = _listed(levels)
    for curve in curves:
        probabilities = ndtr(np.log(levels / (scale.factor * curve.median)) / curve.dispersion)
        ET.SubElement(function, "poes", {"ls": curve.limit_state}).text = _listed(probabilities)
    return function


def scale_of(measure: Measure, block: Block | None, model: Model) -> Scale:
    """OpenQuake's type for a measure, and the factor from SI units or the block's own: PGA and SA in g, PGV in cm/s.

    Raises
    ------
    InvalidOption
        If the measure counts in a block's own unit, and there is no block.
    """
    if measure.units != "1":
        own = 1.0
    elif block is not None:
        own = float(measure.unit_of(Blocks.of([block]), model)[0])
    else:
        raise InvalidOption(f"{measure.name} counts in a block's own unit; give block= to write it as PGA or PGV")
    if measure.of_motion == "pgv":
        return Scale("PGV", 100.0 * own)
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
            f'a dispersion of {dispersion:.3g} is too wide for the mean and stddev of NRML; use format="discrete"'
        )
    return mean, deviation


def _listed(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> str:
    return " ".join(f"{value:.8g}" for value in values)


def _name(text: str, what: str) -> str:
    if not _NAME.fullmatch(checks.text(text, what, InvalidOption)):
        raise InvalidOption(
            f"{what} of NRML may have letters, digits, dashes and underscores, and 100 of them at most, not {text!r}"
        )
    return text
