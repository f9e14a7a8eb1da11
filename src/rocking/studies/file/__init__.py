"""A study as a text file."""

from rocking.studies.file.reading import TEMPLATE, StudyFile, read_study

__all__ = ["TEMPLATE", "StudyFile", "read_study"]
