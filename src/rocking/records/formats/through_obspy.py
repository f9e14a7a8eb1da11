"""Other formats: MiniSEED, SAC, GSE2 and the rest that ObsPy reads, if ObsPy is installed."""

from __future__ import annotations

import contextlib
import functools
import importlib.util
import io
import re
import warnings
from collections import Counter
from typing import Any

import numpy as np

from rocking.records.formats.channel import Channel, Identification, Recognised, create_channel
from rocking.records.formats.source import Request, Source
from rocking.records.units import Unit

#: PICKLE executes code from a file. The other two open files named in a file.
_EXCLUDED_READERS = frozenset({"PICKLE", "CSS", "NNSA_KB_CORE"})
_SERIES_TITLE = re.compile(rb"(?m)^TIMESERIES [^\n]*?, (\d{1,12}) samples,")


def is_obspy_installed() -> bool:
    """Return whether ObsPy can be imported."""
    return importlib.util.find_spec("obspy") is not None


def recognise_with_obspy(source: Source) -> Recognised | None:
    """Return the first format whose ObsPy reader claims the file (and, of several, can read it)."""
    claims = _find_claiming_readers(source) if is_obspy_installed() else []
    if not claims:
        return None
    name = min(claims, key=lambda claim: len(claims) > 1 and isinstance(_read_traces(source, claim), str))
    reason = f"ObsPy's {name} reader recognises it"
    return Identification(f"{name} (through ObsPy)", reason), functools.partial(_read_channels, source, name)


def _read_channels(source: Source, name: str, request: Request) -> list[Channel]:
    """Return all traces of the file times their calibration factor."""
    unit = request.resolve_unit(source, None, None)
    if request.max_samples is not None:  # the file states its number of samples before they are unpacked
        headers = _read_traces(source, name, headonly=True)
        samples = sum(int(trace.stats.npts) for trace in headers if not isinstance(trace, str))
        if samples > request.max_samples:
            text = f"{samples} samples, of which at most {request.max_samples} are read here; cut it into smaller files"
            raise source.error(text)
    traces = _read_traces(source, name)
    if isinstance(traces, str):
        raise source.error(f"ObsPy's {name} reader cannot read this file ({traces}); download the record again")
    _reject_truncated(source, traces)
    for trace_id, pieces in Counter(str(trace.id) for trace in traces).most_common(1):
        if pieces > 1:
            raise source.error(f"{trace_id} is in {pieces} pieces, with gaps or overlaps; use a record without gaps")
    return [_convert_trace(source, request, unit, trace, name, number) for number, trace in enumerate(traces, 1)]


def _convert_trace(source: Source, request: Request, unit: Unit, trace: Any, name: str, number: int) -> Channel:
    stats = trace.stats
    if np.ma.is_masked(trace.data) or not np.issubdtype(trace.data.dtype, np.number):
        raise source.error(f"trace {number} has gaps or invalid numbers; use a record without gaps")
    with np.errstate(all="ignore"):
        values = np.asarray(trace.data, dtype=np.float64).reshape(len(trace.data)) * float(stats.calib)
    # SAC states azimuth and angle from the vertical, about 90 degrees if horizontal.
    sac = {"cmpaz": None, "cmpinc": None, **stats.get("sac", {})}
    horizontal = None not in (sac["cmpaz"], sac["cmpinc"]) and abs(sac["cmpinc"] - 90.0) <= 5.0
    return create_channel(
        source,
        f"{name} (through ObsPy)",
        values,
        unit,
        lambda _: None,
        name=str(stats.channel) or f"trace {number}",
        number=number,
        dt=request.check_step(source, float(stats.delta), None),
        azimuth=float(sac["cmpaz"]) % 360.0 if horizontal else None,
        station=f"{stats.network}.{stats.station}".strip("."),
        start=float(stats.starttime.timestamp),
    )


def _reject_truncated(source: Source, traces: Any) -> None:
    """Reject a truncated file if ObsPy reads the rest silently."""
    titles = _SERIES_TITLE.findall(source.data)
    lengths = {int(trace.stats.mseed.record_length) for trace in traces if "mseed" in trace.stats}
    counts = [len(trace.data) for trace in traces]
    is_truncated = len(titles) == len(counts) and [*map(int, titles)] != counts
    if is_truncated or (len(lengths) == 1 and len(source.raw) % lengths.pop()):
        raise source.error("the file does not contain the stated number of values; download the complete file again")


def _find_claiming_readers(source: Source) -> list[str]:
    """Return the names of the formats whose readers claim the file."""
    from obspy.core.util.base import ENTRY_POINTS
    from obspy.core.util.misc import buffered_load_entry_point

    claims = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name in (reader for reader in ENTRY_POINTS["waveform"] if reader not in _EXCLUDED_READERS):
            # A reader that fails on foreign bytes (with any exception) does not claim them.
            with contextlib.suppress(Exception):
                is_format = buffered_load_entry_point("obspy", f"obspy.plugin.waveform.{name}", "isFormat")
                # ObsPy's check for GCF writes to its input.
                if is_format(io.BytesIO(bytearray(source.raw))):
                    claims.append(str(name))
    return claims


def _read_traces(source: Source, name: str, *, headonly: bool = False) -> Any:
    """Return ObsPy's traces (only headers if supported and requested), or the reason for their absence."""
    import obspy
    from obspy.io.mseed import InternalMSEEDWarning

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        # A failure of MiniSEED's own check of its numbers is only a warning.
        warnings.simplefilter("error", InternalMSEEDWarning)
        try:
            traces = obspy.read(io.BytesIO(source.raw), format=name, headonly=headonly)
        except Exception as error:
            # ObsPy's readers raise any exception from their parsing.
            return " ".join(str(error).split())[:200] or type(error).__name__
    return traces if len(traces) else "it holds no trace"
