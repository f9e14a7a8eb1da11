from .run import RunReport
from .study import Status, Study, study

__all__ = ["RunReport", "Status", "Study", "study"]
