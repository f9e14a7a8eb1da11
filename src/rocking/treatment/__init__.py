"""How a sequence of impacts is brought to rest: by proof, or by one of the thresholds in use. One module each."""

from rocking.treatment.asymptotic_time import AsymptoticTime
from rocking.treatment.base import Treatment, treatment
from rocking.treatment.certified import Certified
from rocking.treatment.thresholds import IntervalThreshold, VelocityThreshold

__all__ = ["AsymptoticTime", "Certified", "IntervalThreshold", "Treatment", "VelocityThreshold", "treatment"]
