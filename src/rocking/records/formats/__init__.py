"""Readers of strong-motion records: declared formats with a header, text tables, workbooks, and ObsPy's formats.

The format is recognised from the content, never from the file name. Numbers are converted to m/s^2 (g = 9.80665 m/s^2).
"""

from __future__ import annotations

import os
from typing import BinaryIO

from rocking.core.tables import list_some
from rocking.errors import RecordError, describe_install
from rocking.motion.motion import Motion
from rocking.records.formats import table, through_obspy
from rocking.records.formats.channel import Channel, Identification, Recognised
from rocking.records.formats.declared import load_formats
from rocking.records.formats.source import Request, Source, name_path, open_source

__all__ = ["Channel", "Identification", "channels", "identify", "read"]


def read(
    path: str | os.PathLike[str] | BinaryIO,
    *,
    channel: int | str | None = None,
    dt: float | None = None,
    units: str | None = None,
    baseline: int | str | None = None,
    highpass: float | None = None,
) -> Motion:
    r"""Read one channel of a record file as a motion.

    Parameters
    ----------
    path : str, path or binary file
        File in PEER AT2, CSMIP V1 or V2, COSMOS, GeoNet, BHRC, USC, USGS SMC, K-NET/KiK-net, ESM, CWA, AFAD, UNAM,
        CSMNC, SESAME SAF or NPTS DT format, text table or workbook of one column (accelerations), two (times,
        accelerations) or more named by a heading (times, then channels), rows of accelerations, or any file that ObsPy
        reads if the `formats` extra is installed. The format is recognised from the content. A file in a ZIP archive is
        named archive.zip/file, unless it is the only one.
    channel : int or str, optional
        Number or name of the channel, required only if the file contains several.
    dt : float, optional
        Sampling step, s, required only for one column of accelerations and times with too few digits. Otherwise it must
        agree with the file.
    units : {"g", "m/s2", "cm/s2", "gal", "mm/s2", "mg"}, optional
        Units of the accelerations, which override a heading. Required only if the file does not state them: ObsPy's
        formats, and text tables without a heading such as "acceleration (cm/s2)" or "a_g".
    baseline : int or "none", optional
        Degree of the polynomial in time that is fitted and subtracted. By default the mean of counts with an instrument
        offset, as in K-NET files, is removed, and nothing from other files; "none" keeps the numbers.
    highpass : float, optional
        Corner frequency of a high-pass filter, Hz (`Motion.processed`).

    Returns
    -------
    Motion
        Motion in m/s^2, linear between the samples, from time 0. Its `history` contains the corrections.

    Raises
    ------
    RecordError
        If the file is missing, unreadable or inconsistent, its format is unknown, a number is damaged, or the channel
        is unknown or not specified. The message contains file, line and correction.
    MotionError
        If `dt` is not a positive number, the samples do not form a motion, or `baseline` or `highpass` is invalid.

    See Also
    --------
    rocking.records.group_components : read all components, grouped by station and event.
    rocking.records.channels : return all channels of a file.
    rocking.records.load : load a shipped record.
    rocking.Motion.processed : filter or trim a motion.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> file = Path(tempfile.mkdtemp()) / "pulse.txt"
    >>> _ = file.write_text("time (s), a (g)\n0.00, 0.0\n0.01, 0.5\n0.02, 0.0\n")
    >>> motion = read(file)
    >>> motion.duration, motion.pga
    (0.02, 4.903325)
    """
    return read_channel(path, Request.create(dt, units, channel=channel)).motion(baseline, highpass)


def read_channel(path: str | os.PathLike[str] | BinaryIO, request: Request) -> Channel:
    """Return the requested channel of a record file, or the only one."""
    _, found_channels = read_content(path, request)
    if len(found_channels) > 1:
        text = f"the file contains {len(found_channels)} channels; give {{}} as one of {_list_labels(found_channels)}"
        raise RecordError(text, "channel", path=name_path(path))
    return found_channels[0]


def read_content(path: str | os.PathLike[str] | BinaryIO, request: Request) -> tuple[Identification, list[Channel]]:
    """Return the format of a file, and its acceleration channels or the requested one."""
    source = open_source(path)
    identification, read_channels = _recognise_format(source)
    found_channels = read_channels(request)
    if request.channel is not None and not (request.are_defaults and len(found_channels) == 1):
        found_channels = [find_channel(source.path, found_channels, request.channel)]
    return identification, found_channels


def channels(path: str | os.PathLike[str], *, dt: float | None = None, units: str | None = None) -> tuple[Channel, ...]:
    r"""Return all acceleration channels of a record file.

    Parameters
    ----------
    path : str or path
        Record file.
    dt, units : float, str, optional
        As for `read`.

    Returns
    -------
    tuple of Channel
        Channels in the order of the file.

    See Also
    --------
    rocking.read : read one channel as a motion.
    rocking.records.identify : identify the format of a file.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> file = Path(tempfile.mkdtemp()) / "pair.txt"
    >>> _ = file.write_text("time (s), NS (g), EW (g)\n0.00, 0.0, 0.1\n0.01, 0.5, -0.2\n")
    >>> [channel.name for channel in channels(file)]
    ['NS', 'EW']
    """
    return tuple(read_content(path, Request.create(dt, units))[1])


def identify(path: str | os.PathLike[str]) -> Identification:
    r"""Identify the format of a file.

    Parameters
    ----------
    path : str or path
        Record file.

    Returns
    -------
    Identification
        Format, and reason for the identification.

    Raises
    ------
    RecordError
        If the file is missing or unreadable, or its format is unknown.

    See Also
    --------
    rocking.read : read one channel as a motion.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> file = Path(tempfile.mkdtemp()) / "samples.dat"
    >>> _ = file.write_text("# cm/s2 at 100 Hz\n0.1\n0.3\n-0.2\n")
    >>> identify(file)
    Identification(format='text table', reason='from line 2 on each line holds one number')
    """
    return _recognise_format(open_source(path))[0]


def _recognise_format(source: Source) -> Recognised:
    # The last ones accept content without a recognised header.
    others = (table.recognise_table, through_obspy.recognise_with_obspy, table.recognise_wrapped)
    recognisers = (*(form.recognise for form in load_formats()), *others)
    recognised = next((recognised for recognise in recognisers if (recognised := recognise(source)) is not None), None)
    if recognised is None:
        raise _unknown_format_error(source)
    return recognised


def _unknown_format_error(source: Source) -> RecordError:
    text = f"the format of this text is unknown: none of its first {table.HEADING_LINES} lines contains only numbers"
    advice = "use the complete file, with times in seconds"
    if source.is_binary:
        text, advice = "the format of this binary file is unknown", "unpack an archive, save a sheet as CSV"
    if not through_obspy.is_obspy_installed():
        advice += f", or if it is MiniSEED, SAC or another format that ObsPy reads, {describe_install('formats')}"
    return source.error(f"{text}; {advice}")


def find_channel(path: str, channels: list[Channel], query: int | str, kind: str = "channel") -> Channel:
    """Return the channel of a file with that name, else number, else first word of the name (a number first)."""
    text = str(query).casefold().split()
    by_number = [channel for channel in channels if [str(channel.number)] == text]
    by_name = [channel for channel in channels if channel.name.casefold().split() == text]
    by_word = [channel for channel in channels if channel.name.casefold().split()[:1] == text]
    matching = by_name or by_number or by_word if isinstance(query, str) else by_number or by_name or by_word
    if not matching:
        raise RecordError(f"there is no {kind} {query!r}; give one of {_list_labels(channels)}", path=path)
    if len(matching) > 1:
        message = (
            f"{len(matching)} channels are called {query!r}; give another name or number of {_list_labels(channels)}"
        )
        raise RecordError(message, path=path)
    return matching[0]


def _list_labels(channels: list[Channel]) -> str:
    return list_some([channel.label for channel in channels], 30)
