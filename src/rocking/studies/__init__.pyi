from .file import TEMPLATE, StudyFile, read_study
from .fragility import BlockFragilities
from .report import FragilityPlan, ReportPlan, SpectrumPlan
from .run import RunReport
from .spectrum import StudySpectrum
from .status import Running, Status
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
