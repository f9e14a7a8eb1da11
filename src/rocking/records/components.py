"""Components of one station and event, from files, archives and shipped records."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rocking.core.progress import note
from rocking.core.tables import format_count, format_reasons
from rocking.errors import MotionError, RecordError, escape_braces
from rocking.motion.description import Origin
from rocking.motion.motion import Motion
from rocking.records import catalogue, formats
from rocking.records.formats.channel import Channel
from rocking.records.formats.source import Request
from rocking.records.named import correct_motion, expand_record_names, is_shipped, make_names_unique, split_factor


@dataclass(frozen=True)
class Components:
    """Components of one station and event.

    Attributes
    ----------
    station, event : str
        Station (or file, if it states none) and event.
    horizontals : tuple of Motion
        Horizontal components in the order of the files.
    vertical : Motion or None
        Vertical component.

    See Also
    --------
    rocking.records.group_components : Group the components of files and archives.
    rocking.Motion.rotated : Compute the component along an azimuth.

    Examples
    --------
    >>> import rocking
    >>> (station,) = rocking.records.group_components("el-centro-meloland-*")
    >>> [motion.name for motion in station.pair], station.vertical.name
    (['el-centro-meloland-360', 'el-centro-meloland-270'], 'el-centro-meloland-up')
    """

    station: str
    event: str
    horizontals: tuple[Motion, ...]
    vertical: Motion | None = None

    @property
    def pair(self) -> tuple[Motion, Motion]:
        """The two horizontal components.

        Raises
        ------
        RecordError
            If there are not two.
        """
        if len(self.horizontals) != 2:
            names = ", ".join(motion.name for motion in self.horizontals) or "none"
            text = f"{self.station} has {format_count(len(self.horizontals), 'horizontal component')}, not two: {names}"
            raise RecordError(escape_braces(text))
        return self.horizontals[0], self.horizontals[1]


def group_components(
    names: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
    *,
    keep_going: bool = True,
    **options: Any,
) -> tuple[Components, ...]:
    """Read all channels of records and group those of one station and event.

    Parameters
    ----------
    names : str, path, or iterable of these
        Files, folders, patterns, ZIP archives and shipped records.
    keep_going : bool
        Whether files that cannot be read are skipped with a note. Otherwise the first one raises its error.
    **options : optional
        Options of `rocking.read`: dt and units for files that do not state them, baseline and highpass.

    Returns
    -------
    tuple of Components
        Components in the order of the files. Channels at different places of a building or depths of a borehole, and
        files in different formats, steps or with different factors, are separate.

    Raises
    ------
    RecordError
        If no file can be read.

    See Also
    --------
    rocking.read : Read one channel as a motion.
    rocking.Motion.rotated : Combine two components along an azimuth.

    Examples
    --------
    >>> [group.station for group in group_components("ridgecrest-*")]
    ['CI.CLC China Lake, G2 Tower Rd.', 'CI.TOW2 Tower 2']
    """
    groups, reasons = _read_groups(names, Request.create(**options, are_defaults=True), keep_going=keep_going)
    note_skipped(reasons)
    return groups


def _read_groups(names: Any, request: Request, *, keep_going: bool) -> tuple[tuple[Components, ...], dict[str, str]]:
    """Return the components of `group_components`, and for each file that cannot be read the reason."""
    groups, reasons = dict[tuple[object, ...], list[Motion]](), dict[str, str]()
    single = [names] if isinstance(names, (str, os.PathLike)) else names
    for record in expand_record_names([os.fspath(name) for name in single]):
        try:
            for place, motion in _read_components(record, request):
                origin = motion.description.origin or Origin()
                key = (origin.station or record, origin.event, origin.format, motion.dt, place, split_factor(record)[1])
                groups.setdefault(key, []).append(motion)
        except (RecordError, MotionError) as error:
            if not keep_going:
                raise
            reasons[record] = str(error).removeprefix(error.path or "").lstrip(",: ")
    if not groups:
        first = ": ".join(next(iter(reasons.items()), ()))
        raise RecordError(f"no record could be read; the first: {escape_braces(first)}")
    created = []
    for (station, event, *_), motions in groups.items():
        verticals = [motion for motion in motions if (motion.description.origin or Origin()).is_vertical]
        horizontals = tuple(motion for motion in motions if motion not in verticals)
        created.append(Components(str(station), str(event), horizontals, next(iter(verticals), None)))
    return tuple(created), reasons


def _read_components(record: str, request: Request) -> Iterator[tuple[str, Motion]]:
    """Yield the motions of all channels of a record, with the place of the channel."""
    name, factor = split_factor(record)
    channels: Sequence[Channel | None] = [None] if is_shipped(name) else formats.read_content(name, request)[1]
    for channel in channels:
        if channel is None:
            place, motion = "", correct_motion(record, catalogue.load(name), request)
        else:
            place, label = channel.name.partition(" b")[2], f"{record}, channel {channel.label}"
            place += channel.metadata.get("location", "")
            motion = correct_motion(label, channel.motion("none"), request, is_raw=channel.is_raw)
        yield place, motion if factor == 1.0 else motion.scaled(factor)


def load_pairs(
    names: str | os.PathLike[str] | Iterable[str | os.PathLike[str]], *, with_vertical: bool = False, **options: Any
) -> tuple[Motion, ...]:
    """Read the pairs of horizontal components of stations, for intensity measures of pairs.

    Parameters
    ----------
    names : str, path, or iterable of these
        As for `group_components`.
    with_vertical : bool
        Whether the motions have the vertical component of their station.
    **options : optional
        Options of `group_components`: dt, units, baseline, highpass and keep_going.

    Returns
    -------
    tuple of Motion
        Two motions for each station and event, each with the other as orthogonal component. Stations without two
        horizontal components (or without the required vertical one) are skipped with a note.

    Raises
    ------
    RecordError
        If there is no pair.

    See Also
    --------
    rocking.Measure : Intensity measures of pairs, for example RotD50.
    rocking.fragility : Count only the larger response of each pair.

    Examples
    --------
    >>> import rocking
    >>> first, second = rocking.records.load_pairs("ridgecrest-clc-*")
    >>> first.name, first.orthogonal.name
    ('ridgecrest-clc-090', 'ridgecrest-clc-360')
    """
    motions, reasons = collect_pairs(names, with_vertical=with_vertical, **options)
    note_skipped(reasons)
    return motions


def note_skipped(reasons: Mapping[str, str]) -> None:
    """Report the records that are not used."""
    for text in format_reasons(reasons):
        note(f"skipped: {escape_braces(text)}")


def collect_pairs(
    names: Any, *, with_vertical: bool, includes_singles: bool = False, keep_going: bool = True, **options: Any
) -> tuple[tuple[Motion, ...], dict[str, str]]:
    """Return the motions of `load_pairs`, and the reason for each file and station without them.

    With `includes_singles`, components of stations without exactly two horizontal ones are separate motions, and so are
    vertical ones unless `with_vertical`.
    """
    groups, reasons = _read_groups(names, Request.create(**options, are_defaults=True), keep_going=keep_going)
    motions = list[Motion]()
    for group in groups:
        is_single = includes_singles and len(group.horizontals) != 2
        try:
            motions += group.horizontals if is_single else _pair_components(group, with_vertical=with_vertical)
        except (RecordError, MotionError) as error:
            reasons[group.station] = str(error).removeprefix(f"{group.station} ")
        if includes_singles and not with_vertical and group.vertical is not None:
            motions.append(group.vertical)
    if not motions:
        reason = ": ".join(next(iter(reasons.items()), ("there are no records",)))
        raise RecordError(f"no station has a pair of horizontal components: {escape_braces(reason)}")
    return tuple(motions), reasons


def _pair_components(group: Components, *, with_vertical: bool) -> tuple[Motion, Motion]:
    """Return both horizontal components with each other as orthogonal component, optionally with the vertical one."""
    (first, second), vertical = group.pair, group.vertical if with_vertical else None
    if with_vertical and vertical is None:
        raise RecordError(f"{escape_braces(group.station)} has no vertical component")
    pair = first.with_orthogonal(second), second.with_orthogonal(first)
    return pair[0].with_vertical(vertical), pair[1].with_vertical(vertical)


def separate_verticals(
    motions: Mapping[str, Motion], exempt: Collection[str] = (), *, keep_going: bool
) -> tuple[dict[str, Motion], dict[str, str]]:
    """Return the motions without vertical ones, except exempt ones, and the reason for each vertical one by name.

    Raises `RecordError` for one without a horizontal component of its station and event, unless `keep_going`.
    """
    origins = {name: motion.description.origin or Origin() for name, motion in motions.items()}
    verticals = [name for name, origin in origins.items() if origin.is_vertical and name not in exempt]
    stations = {(origin.station, origin.event) for name, origin in origins.items() if name not in verticals}
    reasons = {name: f"this record is vertical (channel {origins[name].channel!r})" for name in verticals}
    for name in verticals:
        if not keep_going and (origins[name].station, origins[name].event) not in stations:
            advice = "add a horizontal record of its station, for which this one can be {}"
            raise RecordError(f"{escape_braces(reasons[name])}; {advice}", "vertical", path=name)
    return {name: motion for name, motion in motions.items() if name not in verticals}, reasons


def name_components(motions: Sequence[Motion]) -> list[str]:
    """Return the file of each motion, with the channel if several are in it, or the name without a file."""
    origins = [motion.description.origin or Origin() for motion in motions]
    counts = Counter(origin.file for origin in origins)
    names = [
        f"{origin.file}, {origin.channel}" if origin.file and counts[origin.file] > 1 else origin.file or motion.name
        for origin, motion in zip(origins, motions, strict=True)
    ]
    return make_names_unique(names)
