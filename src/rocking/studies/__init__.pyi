from .file import TEMPLATE, StudyFile, read_study
from .results import BlockTable
from .study import RunReport, Status, Study, study

__all__ = [
    "TEMPLATE",
    "BlockTable",
    "RunReport",
    "Status",
    "Study",
    "StudyFile",
    "read_study",
    "study",
]
