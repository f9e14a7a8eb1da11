from .file import TEMPLATE, StudyFile, read_study
from .report import BlockFragilities, FragilityPlan, ReportPlan, SpectrumPlan, StudySpectrum
from .run import Running, RunReport, Status
from .study import Study, study

__all__ = [
    "TEMPLATE",
    "BlockFragilities",
    "FragilityPlan",
    "ReportPlan",
    "RunReport",
    "Running",
    "SpectrumPlan",
    "Status",
    "Study",
    "StudyFile",
    "StudySpectrum",
    "read_study",
    "study",
]
