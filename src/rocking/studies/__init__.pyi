from .file import TEMPLATE, StudyFile, read_study
from .run import RunReport
from .study import Status, Study, study

__all__ = ["TEMPLATE", "RunReport", "Status", "Study", "StudyFile", "read_study", "study"]
