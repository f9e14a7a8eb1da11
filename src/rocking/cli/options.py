"""What several commands share: reading a motion, a block and a treatment from their options, and writing results."""

from __future__ import annotations

from pathlib import Path

from rocking.block import Block
from rocking.errors import InvalidBlock, InvalidOption, OutputError


def block_from(
    half_width: float | None,
    half_height: float | None,
    p: str | None,
    alpha: str | None,
    restitution: str | None,
) -> Block:
    """Block from its sizes or from its parameters; each parameter is "NUMBER" or "NUMBER,NUMBER"."""
    sizes, parameters = (half_width, half_height), (p, alpha)
    e = None if restitution is None else numbers(restitution, "--restitution")
    if half_width is not None and half_height is not None and parameters == (None, None):
        return Block(half_width, half_height, restitution=e)
    if p is not None and alpha is not None and sizes == (None, None):
        return Block.from_parameters(numbers(p, "--p"), numbers(alpha, "--alpha"), e)
    raise InvalidBlock("a block needs either --half-width and --half-height (m), or --p (rad/s) and --alpha (rad)")


def numbers(text: str, option: str) -> float | list[float]:
    """One number, or a list from numbers with commas between."""
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        raise InvalidOption(
            f"{option} takes a number, or two with a comma between (side +, side -), not {text!r}"
        ) from None
    return values[0] if len(values) == 1 else values


def output_folder(folder: Path) -> Path:
    """Folder for results, made if need be.

    Raises
    ------
    OutputError
        If it cannot be made or written to.
    """
    probe = folder / ".rocking-can-write"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise OutputError(f"{folder} cannot be written to: {error.strerror}; choose another --out") from error
    return folder
