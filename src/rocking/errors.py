"""Exceptions of the package: one base class, one subclass per kind of bad input.

Every message is one sentence that says what is wrong, where, and how to mend it.
"""


class RockingError(Exception):
    """Base of every error that the package raises on purpose."""


class InvalidBlock(RockingError):
    """The block's sizes or parameters cannot describe a block that stands and rocks."""


class InvalidMotion(RockingError):
    """The ground motion's samples, step or parameters are not usable."""


class UnreadableRecord(RockingError):
    """A record file could not be read; the message names the file and, where there is one, the line."""


class InvalidOption(RockingError):
    """An argument of an analysis (model, chattering treatment, duration, ...) is not usable."""


class Unfinished(RockingError):
    """Simulations were given up after too many steps, so that an analysis has no answer."""


class OutsideFit(UserWarning):
    """A fitted formula was asked for values beyond those it was fitted to."""


class OutputError(RockingError):
    """Results could not be written where they were asked for."""
