"""Strong-motion records shipped with the package.

It contains every channel of three stations: China Lake and Tower 2 in the 2019 Ridgecrest earthquake (M 7.1), and the
free field of the Meloland overpass in El Centro in the 1979 Imperial Valley earthquake, whose 270 degree channel has a
near-fault pulse. The values are exactly those published.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from importlib import resources
from typing import Any, Final

import numpy as np

from rocking.core import checks
from rocking.core.arrays import Integers
from rocking.errors import RecordError
from rocking.motion.description import Description, Origin
from rocking.motion.motion import Motion
from rocking.records.units import choose_unit

_DATA_FOLDER: Final = resources.files("rocking.records") / "data"


@dataclass(frozen=True)
class ShippedRecord:
    """Metadata of a shipped record.

    Attributes
    ----------
    name : str
        Name for `load`.
    title : str
        Place and year of the event, station and direction.
    event, station : str
        Earthquake and place.
    direction : str
        Direction of positive acceleration, degrees clockwise from north, or "up".
    state : str
        Whether and how the record was corrected.
    dt, samples : float, int
        Sampling step, s, and number of samples.
    units, denominator : str, int
        Unit of the published numbers, which are integer multiples of 1/`denominator`.
    source, terms : str
        Institution that recorded and processed the motion, and terms of use.

    See Also
    --------
    rocking.records.load : load a shipped record as a motion.

    Examples
    --------
    >>> import rocking
    >>> record = rocking.records.info("ridgecrest-clc-090")
    >>> record.title, record.dt
    ('Ridgecrest 2019, China Lake, 090', 0.01)
    """

    name: str
    archive: str
    title: str
    event: str
    station: str
    direction: str
    state: str
    dt: float
    samples: int
    units: str
    denominator: int
    source: str
    terms: str


def names() -> tuple[str, ...]:
    """Return the names of the shipped records.

    Returns
    -------
    tuple of str
        Names for `load` and `info`.

    See Also
    --------
    rocking.records.load : load a shipped record as a motion.

    Examples
    --------
    >>> names()[:3]
    ('ridgecrest-clc-090', 'ridgecrest-clc-360', 'ridgecrest-clc-up')
    """
    return tuple(_read_catalogue())


def info(name: str) -> ShippedRecord:
    """Return the metadata of a shipped record: event, station, direction, step, source and terms.

    Parameters
    ----------
    name : str
        One of `names`.

    Returns
    -------
    Record
        Metadata, without the samples.

    See Also
    --------
    rocking.records.load : load a shipped record as a motion.

    Examples
    --------
    >>> record = info("ridgecrest-clc-090")
    >>> record.dt, record.samples, record.units, record.terms
    (0.01, 31932, 'g', 'CC0 1.0')
    """
    catalogue = _read_catalogue()
    if checks.text(name, "name of a shipped record", RecordError) not in catalogue:
        hint = suggest_records(name, f"there are {', '.join(catalogue)}")
        raise RecordError(f"no shipped record is named {name!r}; {hint}")
    return ShippedRecord(name=name, **catalogue[name])


def suggest_records(name: str, otherwise: str, prefix: str = "") -> str:
    """Return a hint on an unknown name: similar records, horizontal unless "-up", or the other text."""
    vertical = name.endswith(("-u", "-up"))
    records = [record for record, facts in _read_catalogue().items() if (facts["direction"] == "up") == vertical]
    completions = [record for record in records if len(name) > 2 and record.startswith(name)]
    if completions:
        return f"did you mean {prefix}{' or '.join(completions)}?"
    return checks.suggest(name, {record: f"{prefix}{record}" for record in records}, otherwise)


def load(name: str) -> Motion:
    """Load a shipped record as a motion, linear between samples, with the published values in m/s^2.

    The Ridgecrest records are uncorrected. Their mean is zero, but the baseline of the instruments moves by some mm/s^2
    during the shaking, so the displacement drifts by metres. This does not affect a rocking block. To remove the drift,
    use::

        rocking.records.load("ridgecrest-clc-090").processed(baseline=0, band_pass=(0.05, None))

    Parameters
    ----------
    name : str
        One of `names`.

    Returns
    -------
    Motion
        Ground motion, whose `description` contains source and terms.

    See Also
    --------
    rocking.records.names : return the names of the shipped records.
    rocking.read : read a motion from a record file.

    Examples
    --------
    >>> motion = load("ridgecrest-clc-090")
    >>> print(f"{motion.duration:.2f} s, {motion.pga / 9.80665:.3f} g")
    319.31 s, 0.344 g
    """
    record = info(name)
    published = np.cumsum(np.cumsum(read_differences(record))) / record.denominator
    facts = (record.event, record.station, f"direction {record.direction}", record.state, record.source)
    text = f"{'; '.join(facts)}; terms: {record.terms}"
    azimuth = float(record.direction) if record.direction.isdecimal() else None
    origin = Origin("", "", record.event, record.station, record.direction, azimuth=azimuth, units=record.units)
    description = Description("record", text=text, origin=origin)
    samples = choose_unit(record.units).to_si(published)
    return Motion.from_samples(samples, record.dt, name=name, description=description)


def read_differences(record: ShippedRecord) -> Integers:
    """Read the second differences of the published integers of a record."""
    with (_DATA_FOLDER / record.archive).open("rb") as file, np.load(file, allow_pickle=False) as archive:
        differences: Integers = archive[record.direction].astype(np.int64)
    return differences


def _read_catalogue() -> dict[str, dict[str, Any]]:
    catalogue: dict[str, dict[str, Any]] = json.loads((_DATA_FOLDER / "catalogue.json").read_text("utf-8"))
    return catalogue
