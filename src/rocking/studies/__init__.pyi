from .file import TEMPLATE, StudyFile, read_study
from .results import BlockTable
from .study import RunReport, Status, Study, create_study

__all__ = ["TEMPLATE", "BlockTable", "RunReport", "Status", "Study", "StudyFile", "create_study", "read_study"]
