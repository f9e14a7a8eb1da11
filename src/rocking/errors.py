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


class StudyError(RockingError):
    """A study is damaged, held by another process, or not the one that is meant."""


class DamagedStudy(StudyError):
    """A unit of a study is damaged, and can be computed again.

    Attributes
    ----------
    fault : str
        Which unit it is, and what is wrong with it.
    """

    def __init__(self, fault: str) -> None:
        super().__init__(fault)
        self.fault = fault

    def __str__(self) -> str:
        """Say how it is mended, too."""
        return f"{self.fault}: the study's verify(repair=True) computes it again"


class OutsideFit(UserWarning):
    """A fitted formula was asked for values beyond those it was fitted to."""


class OutputError(RockingError):
    """Results could not be written where they were asked for."""
