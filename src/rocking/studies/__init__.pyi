from .file import TEMPLATE, StudyFile, read_study
from .fragility import BlockFragilities
from .refine import Refinement
from .results import FragilityPlan, ReportPlan, SpectrumPlan
from .run import RunReport
from .spectrum import StudySpectrum
from .state import Running, Status
from .study import Study, study

__all__ = [
    "TEMPLATE",
    "BlockFragilities",
    "FragilityPlan",
    "Refinement",
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
