"""Every other format: MiniSEED, SAC, GSE2 and the rest that ObsPy reads, if it is installed."""

from __future__ import annotations

import io
import warnings
from typing import Any

import numpy as np

from rocking.motion.formats.channel import Channel, to_acceleration
from rocking.motion.formats.identification import Identification
from rocking.motion.formats.request import Request
from rocking.motion.formats.source import Source
from rocking.motion.formats.units import Unit

#: PICKLE runs what a file tells it to; the other two open further files that a file names.
_REFUSED = frozenset({"PICKLE", "CSS", "NNSA_KB_CORE"})


def installed() -> bool:
    """Return whether ObsPy can be imported."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            import obspy  # noqa: F401
        except ImportError:
            return False
    return True


def recognise(source: Source) -> Identification | None:
    """Return the format if one of ObsPy's readers claims the file."""
    name = _format_name(source)
    if name is None:
        return None
    return Identification(f"{name} (through ObsPy)", f"ObsPy's {name} reader recognises it")


def read(source: Source, request: Request) -> list[Channel]:
    """Return all traces of the file, times their calibration factor.

    Raises
    ------
    UnreadableRecord
        If ObsPy fails, a trace is not of finite numbers, or units are not given.
    """
    name = _format_name(source)
    unit = request.units(source, None, None)
    traces = _traces(source, name)
    return [_channel(source, request, unit, trace, f"trace {number}", number) for number, trace in enumerate(traces, 1)]


def _channel(source: Source, request: Request, unit: Unit, trace: Any, label: str, number: int) -> Channel:
    stats = trace.stats
    try:
        with np.errstate(all="ignore"):
            values = np.asarray(trace.data, dtype=np.float64) * float(stats.calib)
        dt, station = float(stats.delta), f"{stats.network}.{stats.station}".strip(".")
    except (TypeError, ValueError) as error:
        raise source.error(f"{label} does not hold plain numbers; choose another file") from error
    if values.ndim != 1 or np.ma.is_masked(trace.data):
        raise source.error(f"{label} has gaps; get a record without gaps")
    return Channel(
        name=str(stats.channel) or label,
        number=number,
        acceleration=to_acceleration(source, None, values, unit),
        dt=request.step(source, dt, None),
        units=unit.name,
        station=station,
        metadata={"format": f"{stats.get('_format', '')} (through ObsPy)", "file": source.file},
    )


def _format_name(source: Source) -> str | None:
    if not installed():
        return None
    from obspy.core.util.base import ENTRY_POINTS

    return next(
        (str(name) for name in ENTRY_POINTS["waveform"] if name not in _REFUSED and _claims(name, source)),
        None,
    )


def _claims(name: str, source: Source) -> bool:
    from obspy.core.util.misc import buffered_load_entry_point

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            claims = buffered_load_entry_point("obspy", f"obspy.plugin.waveform.{name}", "isFormat")
            return bool(claims(io.BytesIO(source.raw)))
        except Exception:
            # A reader that stumbles over foreign bytes (they raise anything) does not claim them.
            return False


def _traces(source: Source, name: str | None) -> Any:
    import obspy

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            traces = obspy.read(io.BytesIO(source.raw), format=name)
        except Exception as error:
            # ObsPy's readers raise whatever their parsing ran into.
            reason = " ".join(str(error).split())[:200] or type(error).__name__
            raise source.error(f"ObsPy's {name} reader cannot read this ({reason}); get the record again") from error
    if not len(traces):
        raise source.error(f"ObsPy's {name} reader finds no trace in this file; get the record again")
    return traces
