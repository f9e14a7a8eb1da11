from .basin_maps import Basins, basins
from .bifurcation import BifurcationDiagram, LyapunovExponents, bifurcation_diagram, lyapunov_exponents
from .bodies import BouncingBall, EquationOfMotion, ImpactOscillator, InvertedPendulum, LinearBodies, Response, simulate
from .branches import Bifurcation, Branch
from .continuation import continue_orbit
from .maps import PeriodOutcome, StroboscopicMap, stroboscopic_map
from .orbits import PeriodicOrbit, periodic_orbits

__all__ = [
    "Basins",
    "Bifurcation",
    "BifurcationDiagram",
    "BouncingBall",
    "Branch",
    "EquationOfMotion",
    "ImpactOscillator",
    "InvertedPendulum",
    "LinearBodies",
    "LyapunovExponents",
    "PeriodOutcome",
    "PeriodicOrbit",
    "Response",
    "StroboscopicMap",
    "basins",
    "bifurcation_diagram",
    "continue_orbit",
    "lyapunov_exponents",
    "periodic_orbits",
    "simulate",
    "stroboscopic_map",
]
