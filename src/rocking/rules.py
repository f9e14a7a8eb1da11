"""Rules of thumb for rocking and overturning, as demand and capacity, and their check by simulations.

Every demand is proportional to the motion: at a ratio of 0.5 the rule permits twice the motion.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import wraps
from types import MappingProxyType
from typing import Any, Final, NamedTuple

import numpy as np

from rocking.analysis.incremental import incremental_dynamic_analysis
from rocking.analysis.levels import compute_intensities
from rocking.analysis.survey import RuleComparison
from rocking.block import Block, Blocks
from rocking.block.friction import Friction
from rocking.block.single import require_block
from rocking.core import checks
from rocking.core.arrays import Floats
from rocking.core.constants import Model
from rocking.core.progress import Progress
from rocking.core.tables import format_count, format_range
from rocking.errors import BlockError, OptionError
from rocking.inputs.inventory import find_friction
from rocking.motion.motion import Motion
from rocking.motion.scaling import Measure
from rocking.records.named import Motions, index_motions, list_motions
from rocking.response import Response
from rocking.simulation.simulate import simulate

__all__ = [
    "RULES",
    "Rating",
    "RuleComparison",
    "apply_rules",
    "asce_43_05",
    "compare_rules",
    "housner",
    "ishiyama",
    "priestley",
    "west",
]

#: Ratios of rotation to slenderness for the comparison with a spectrum, from stiff oscillators to a rocking period of
#: 30/p.
_ROTATION_SHARES: Final = np.append(np.geomspace(1e-3, 0.5, 30, endpoint=False), np.linspace(0.5, 0.999, 26))

#: Ratio of damping to -ln e^2 (Makris and Konstantinidis 2003).
_DAMPING_FACTOR: Final = 0.34

#: Relative width of the bracket of the lowest level that overturns.
_BRACKET_WIDTH: Final = 1e-4


@dataclass(frozen=True, eq=False)
class Rating:
    """Demand and capacity of n blocks under one motion by a rule.

    Attributes
    ----------
    rule : str
        Name of the rule.
    demand, capacity : ndarray, shape (n,)
        Demand and capacity of the weaker side of each block.
    unit : str
        Unit of demand and capacity, "1" if dimensionless.

    See Also
    --------
    rocking.rules.apply_rules : Apply several rules.
    """

    rule: str
    demand: Floats
    capacity: Floats
    unit: str

    def __repr__(self) -> str:
        unit = "" if self.unit == "1" else f" {self.unit}"
        demand, capacity, ratio = map(format_range, (self.demand, self.capacity, self.ratio))
        count = format_count(len(self.demand), "block")
        return f"<Rating: {self.rule}, {count}; demand {demand}{unit}, capacity {capacity}{unit}, ratio {ratio}>"

    @property
    def ratio(self) -> Floats:
        """Ratio of demand to capacity, shape (n,)."""
        return np.asarray(self.demand / self.capacity)

    @property
    def overturns(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Whether the block may overturn by the rule (a ratio of 1 or more), shape (n,)."""
        return np.asarray(self.ratio >= 1.0)


Rule = Callable[[Blocks | Block | Iterable[Block], Motion], Rating]

#: Demand and capacity of the sides of blocks, shape (n, 2).
Comparison = Callable[[Blocks, Motion], tuple[Any, Floats]]

_rules_by_name: dict[str, Rule] = {}

#: Rules by name.
RULES: Final[Mapping[str, Rule]] = MappingProxyType(_rules_by_name)

#: Common sections of the docstrings of all rules.
_DOCSTRING: Final = """{}

    Parameters
    ----------
    blocks : Blocks, Block or iterable of Block
        n blocks.
    motion : Motion
        Ground motion.

{}

    Examples
    --------
    >>> import rocking
    >>> tombstone = rocking.Block(width=0.3, height=0.9)
    >>> record = rocking.records.load("el-centro-meloland-270")
    >>> f"{{rocking.rules.{}(tombstone, record).ratio[0]:.3f}}"
    '{}'
    """


def _rule(unit: str, example: str) -> Callable[[Comparison], Rule]:
    """Create a rule from a comparison, the unit of its results, and the ratio in its example."""

    def decorate(comparison: Comparison) -> Rule:
        @wraps(comparison, assigned=("__module__", "__name__", "__qualname__"))
        def rule(blocks: Blocks | Block | Iterable[Block], motion: Motion) -> Rating:
            demand, capacity = np.broadcast_arrays(*comparison(_combine_free_blocks(blocks), list_motions([motion])[0]))
            weaker = np.arange(len(demand)), np.argmax(demand / capacity, axis=1)
            return Rating(name, demand[weaker], capacity[weaker], unit)

        name = comparison.__name__
        first, _, sections = (comparison.__doc__ or "").partition("\n\n")
        rule.__doc__ = _DOCSTRING.format(first, sections.rstrip(), name, example)
        del rule.__wrapped__  # the comparison has other arguments than the rule
        _rules_by_name[name] = rule
        return rule

    return decorate


def _combine_free_blocks(blocks: Blocks | Block | Iterable[Block]) -> Blocks:
    """Combine blocks, or raise an error if they have restraints."""
    combined = Blocks.from_bodies(blocks)
    for block in combined if combined.terms else ():
        require_block(block)
    return combined


@_rule("m/s^2", "0.895")
def west(blocks: Blocks, motion: Motion) -> tuple[Any, Floats]:
    """Compare the peak acceleration with the static threshold g tan(alpha): West's formula.

    Returns
    -------
    Rating
        Demand PGA and capacity g tan(alpha), m/s^2.

    See Also
    --------
    rocking.rules.ishiyama : Criteria with the peak velocity.

    Notes
    -----
    The threshold is the uplift acceleration, which is necessary for overturning but not sufficient.

    References
    ----------
    Milne, J. and Omori, F. (1893). On the overturning and fracturing of brick and other columns by horizontally applied
    motion. Seismological Journal of Japan 1, 59-86; the formula is attributed to C. D. West.
    """
    return motion.pga, blocks.gravity * np.tan(blocks.alpha)


@_rule("1", "0.895")
def ishiyama(blocks: Blocks, motion: Motion) -> tuple[Any, Floats]:
    """Compare peak acceleration and peak velocity with their limits: Ishiyama's criteria.

    Returns
    -------
    Rating
        Demand min(PGA/(g tan(alpha)), PGV/(0.4 V)) and capacity 1.

    See Also
    --------
    rocking.rules.west : Criterion without the peak velocity.

    Notes
    -----
    V = 2 g sin(alpha/2)/(p cos(alpha)) is the sudden velocity of the ground after which a block at rest just reaches
    its balance point. For a rectangle it equals Ishiyama's V^2 = 8 g R (1 - cos(alpha))/(3 cos(alpha)^2), and 0.4 V is
    close to 10 B/sqrt(H) cm/s, with width B and height H in cm. The factor 0.4 comes from his simulations. Both
    criteria are lower limits.

    References
    ----------
    Ishiyama, Y. (1982). Motions of rigid bodies and criteria for overturning by earthquake excitations. Earthquake
    Engineering and Structural Dynamics 10(5), 635-650.
    """
    acceleration = motion.pga / (blocks.gravity * np.tan(blocks.alpha))
    velocity = motion.pgv / (0.4 * overturning_velocity(blocks))
    return np.minimum(acceleration, velocity), np.ones_like(velocity)


def overturning_velocity(blocks: Blocks) -> Floats:
    """Compute the ground velocity jump after which a block at rest just reaches balance, m/s, shape (n, 2)."""
    return np.asarray(2.0 * blocks.gravity * np.sin(0.5 * blocks.alpha) / (blocks.p * np.cos(blocks.alpha)))


@_rule("rad", "1.840")
def housner(blocks: Blocks, motion: Motion) -> tuple[Any, Floats]:
    """Compare energies: a block may overturn from alpha = S_v sqrt(m R/(g I)) = p S_v/g on (Housner).

    Returns
    -------
    Rating
        Demand p S_v/g and capacity alpha, rad.

    See Also
    --------
    rocking.rules.compare_rules : Compare rules of thumb with simulations.

    Notes
    -----
    The mean energy of a block under white noise is equated to m g R alpha^2/2, its energy at the balance point. Housner
    concluded that half of such blocks overturn. Simulated white noise contradicts this: among 300 noises (p = 2 rad/s,
    alpha = 0.2, restitution 0.925), 1 % overturn the block at a ratio of 1, 28 % at 1.5 and 80 % at 2. S_v is the mean
    of 2 pi S_d/T over periods T of 0.1 to 2.5 s, Housner's spectrum intensity divided by its range.

    References
    ----------
    Housner, G. W. (1963). The behavior of inverted pendulum structures during earthquakes. Bulletin of the
    Seismological Society of America 53(2), 403-417.

    Housner, G. W. (1952). Spectrum intensities of strong-motion earthquakes. Symposium on Earthquake and Blast Effects
    on Structures, 20-36.
    """
    return blocks.p * mean_spectral_velocity(motion) / blocks.gravity, blocks.alpha


def mean_spectral_velocity(motion: Motion) -> float:
    """Compute the mean undamped pseudo-velocity over periods of 0.1 to 2.5 s, m/s (Housner 1952)."""
    periods = np.linspace(0.1, 2.5, 97)
    velocities = motion.spectral_acceleration(periods, 0.0) * periods / (2.0 * np.pi)
    return float(np.trapezoid(velocities, periods) / (periods[-1] - periods[0]))


@_rule("m/s^2", "1.579")
def asce_43_05(blocks: Blocks, motion: Motion) -> tuple[Any, Floats]:
    """Replace the block by an oscillator with its energy and damping: the approximate method of ASCE/SEI 43-05.

    Returns
    -------
    Rating
        Spectral acceleration and the block's capacity at the balance point, m/s^2.

    See Also
    --------
    rocking.rules.priestley : Equivalent oscillator with the period of free rocking.

    Notes
    -----
    For a rotation theta_0, with a = tan(alpha), f_1 = cos(theta_0) + a sin(theta_0) - 1 and C_I = I/(m h^2):

    - capacity 2 g f_1/theta_0, from the work m g h f_1 that raises the block to theta_0, equated to the work of a
      spring;
    - frequency (1/2 pi) sqrt(2 f_1 g/(C_I theta_0^2 h)) = (p/2 pi) sqrt(2 f_1 cos(alpha))/theta_0;
    - damping gamma/sqrt(4 pi^2 + gamma^2), gamma = -2 ln C_R: the oscillator loses in one cycle as much as the block in
      two impacts. C_R is the block's restitution. The standard's 1 - 2 a^2/C_I is Housner's.

    The rocking angle is the largest at which the spectrum equals the capacity. If the spectrum exceeds the capacity at
    the balance point, theta_0 = alpha, the block overturns by this method. The standard's correction for vertical
    motion and its ratio of masses are 1. No factor of safety is applied.

    References
    ----------
    ASCE (2005). Seismic Design Criteria for Structures, Systems, and Components in Nuclear Facilities. ASCE/SEI 43-05,
    Appendix A, section A.2.
    """
    return _compute_min_ratio(blocks, motion, _create_energy_oscillator)


@_rule("m", "1.070")
def priestley(blocks: Blocks, motion: Motion) -> tuple[Any, Floats]:
    """Replace the block by an oscillator with the period of free rocking: Priestley, Evison and Carr, in FEMA 356.

    Returns
    -------
    Rating
        Spectral displacement and displacement of the block's centre of mass, m, at the rotation below the balance point
        with the smallest ratio. The block rocks below a ratio of 1 and otherwise overturns.

    Raises
    ------
    BlockError
        If a restitution is so low (below 0.23) that the damping would be critical.

    See Also
    --------
    rocking.rules.asce_43_05 : Equivalent oscillator with the energy of the block.

    Notes
    -----
    For a rotation theta_0:

    - period (4/p) acosh(1/(1 - theta_0/alpha)), Housner's period of free rocking of a slender block;
    - damping -0.34 ln r, r = e^2, the line that :cite:t:`makris2003` fitted to the decay of free rocking;
    - displacement R (sin(alpha) - sin(alpha - theta_0)), half the width at the balance point, with R = 3 g/(4 p^2) as
      for a rectangular block.

    References
    ----------
    Priestley, M. J. N., Evison, R. J. and Carr, A. J. (1978). Seismic response of structures free to rock on their
    foundations. Bulletin of the New Zealand National Society for Earthquake Engineering 11(3), 141-150.

    Makris, N. and Konstantinidis, D. (2003). The rocking spectrum and the limitations of practical design
    methodologies. Earthquake Engineering and Structural Dynamics 32(2), 265-289.
    """
    lowest, smallest = math.exp(-0.5 / _DAMPING_FACTOR), blocks.restitution.min()
    if smallest <= lowest:
        requirement = f"a restitution above {lowest:.2g}, where its damping is below critical"
        raise BlockError(f"the rule priestley requires {requirement}; got {smallest:g}; omit this rule")
    return _compute_min_ratio(blocks, motion, _create_free_rocking_oscillator)


def apply_rules(
    blocks: Blocks | Block | Iterable[Block], motion: Motion, rules: Iterable[str] | None = None
) -> dict[str, Rating]:
    """Apply several rules to blocks under a motion.

    Parameters
    ----------
    blocks : Blocks, Block or iterable of Block
        n blocks.
    motion : Motion
        Ground motion.
    rules : iterable of str, optional
        Names in `RULES`, by default all.

    Returns
    -------
    dict of str to Rating
        Ratings by the names of the rules.

    See Also
    --------
    rocking.rules.compare_rules : Compare rules of thumb with simulations.

    Examples
    --------
    >>> import rocking
    >>> record = rocking.records.load("el-centro-meloland-270")
    >>> [*apply_rules(rocking.Block(width=0.3, height=0.9), record, ["west", "ishiyama"])]
    ['west', 'ishiyama']
    """
    requested = [*RULES] if rules is None else checks.items(rules, "rules", OptionError)
    names = [checks.choice(name, "rules", OptionError, [*RULES]) for name in requested]
    combined = _combine_free_blocks(blocks)
    return {name: RULES[name](combined, motion) for name in names}


class _Oscillator(NamedTuple):
    """Equivalent oscillators for one side of a block at several rotations, with demands for a spectrum of 1 m/s^2."""

    periods: Floats
    damping: float
    capacities: Floats
    per_acceleration: Floats


def _create_energy_oscillator(
    p: float, alpha: float, restitution: float, gravity: float, share: float = 1.0
) -> _Oscillator:
    """Create the oscillator of ASCE/SEI 43-05, A.2, at a share of the slenderness, by default the balance point."""
    rotation = np.array([share * alpha])
    # cos(t) + a sin(t) - 1 without cancellation near 1.
    lift = 2.0 * np.sin(0.5 * rotation) * (math.tan(alpha) * np.cos(0.5 * rotation) - np.sin(0.5 * rotation))
    periods = 2.0 * np.pi * rotation / (p * np.sqrt(2.0 * lift * math.cos(alpha)))
    decay = -2.0 * math.log(restitution)
    damping = decay / math.hypot(2.0 * math.pi, decay)
    return _Oscillator(periods, damping, 2.0 * gravity * lift / rotation, np.ones_like(rotation))


def _create_free_rocking_oscillator(p: float, alpha: float, restitution: float, gravity: float) -> _Oscillator:
    """Create the oscillators of Priestley, Evison and Carr (1978) with the period of free rocking."""
    periods = 4.0 / p * np.arccosh(1.0 / (1.0 - _ROTATION_SHARES))
    displacements = 0.75 * gravity / p**2 * (math.sin(alpha) - np.sin(alpha * (1.0 - _ROTATION_SHARES)))
    damping = -2.0 * _DAMPING_FACTOR * math.log(restitution)
    return _Oscillator(periods, damping, displacements, (periods / (2.0 * np.pi)) ** 2)


def _compute_min_ratio(
    blocks: Blocks, motion: Motion, create_oscillator: Callable[[float, float, float, float], _Oscillator]
) -> tuple[Floats, Floats]:
    """Find demand and capacity of the sides of blocks at the rotation with the smallest ratio."""
    sides = np.stack([blocks.p, blocks.alpha, blocks.restitution], axis=-1).reshape(-1, 3)
    distinct, index = np.unique(sides, axis=0, return_inverse=True)
    results = np.empty((len(distinct), 2))
    for k, (p, alpha, restitution) in enumerate(distinct.tolist()):
        oscillator = create_oscillator(p, alpha, restitution, blocks.gravity)
        demands = oscillator.per_acceleration * motion.spectral_acceleration(oscillator.periods, oscillator.damping)
        worst = int(np.argmin(demands / oscillator.capacities))
        results[k] = demands[worst], oscillator.capacities[worst]
    demand, capacity = results[index.reshape(-1)].reshape(len(blocks), 2, 2).transpose(2, 0, 1)
    return demand, capacity


def compare_rules(
    block: Block | Sequence[Block],
    motions: Motions,
    *,
    rules: Iterable[str] | None = None,
    model: Model = "nonlinear",
    friction: Friction | None = None,
) -> RuleComparison:
    """Apply rules of thumb to one or more blocks under motions, and compare with simulations.

    Parameters
    ----------
    block : Block or sequence of Block
        One block, or several, each of which is compared.
    motions : Motion, sequence of Motion, or mapping of str to Motion
        m motions. The table shows the keys of a mapping, or otherwise the names of the motions.
    rules : iterable of str, optional
        Names in `RULES`, by default all.
    model : {"nonlinear", "linear"}
        Equation of motion of the simulations.
    friction : optional
        Friction of the simulations, as for `simulate`, of blocks without a label ``friction``. The rules assume that
        the block does not slide.

    Returns
    -------
    RuleComparison
        Ratio of demand to capacity by each rule, and the simulated margin.

    Raises
    ------
    OptionError
        If there is no motion, a rule does not exist, or the block never comes to rest (restitution 1).

    See Also
    --------
    rocking.rules.apply_rules : Apply several rules without simulations.
    rocking.incremental_dynamic_analysis : Find the levels that overturn each block.

    Notes
    -----
    The simulated margin comes from `incremental_dynamic_analysis` with levels 5 % apart. A thinner band of levels that
    overturn may therefore lie below it.

    Examples
    --------
    >>> import rocking
    >>> tombstone = rocking.Block(width=0.3, height=0.9)
    >>> records = {name: rocking.records.load(name) for name in ["el-centro-meloland-270", "el-centro-meloland-360"]}
    >>> comparison = compare_rules(tombstone, records, rules=["west", "ishiyama"])
    >>> for row in comparison.rows():
    ...     print(f"{row['west']:.2f} {row['ishiyama']:.2f} {row['simulated']:.2f} {row['verdict']}")
    0.90 0.90 0.71 does not move in 5 of 5 (3e-6), 11 of 11 (0.1 %)
    0.93 0.93 0.64 does not move in 5 of 5 (3e-6), 11 of 11 (0.1 %)
    """
    named_motions = index_motions(motions)
    names = None if rules is None else checks.items(rules, "rules", OptionError)
    # Raise errors before the simulations.
    compute_intensities([*named_motions.values()], Measure("pga"))
    blocks = [*block] if isinstance(block, Sequence) else [block]
    ratings = [apply_rules(block, motion, names) for motion in named_motions.values()]
    ratios = [
        {name: float(rating.ratio[k]) for name, rating in by_name.items()}
        for k in range(len(blocks))
        for by_name in ratings
    ]
    responses, margins = [], []
    with Progress("checking", total=len(ratios)) as bar:
        for body, motion in itertools.product(blocks, named_motions.values()):
            coefficient = find_friction(body, friction)
            responses.append(simulate(body, motion, model=model, friction=coefficient))
            margins.append(_compute_margin(responses[-1], body, motion, model, coefficient))
            bar.advance()
    return RuleComparison(block, tuple(named_motions) * len(blocks), tuple(responses), tuple(ratios), tuple(margins))


def _compute_margin(response: Response, block: Block, motion: Motion, model: Model, friction: Friction | None) -> float:
    """Compute the reciprocal of the lowest factor that overturns the block, consistent with the response."""
    analysis = incremental_dynamic_analysis(block, motion, model=model, rtol=_BRACKET_WIDTH, friction=friction)
    margin = motion.pga / float(analysis.data.overturning_level[0, 0])
    if response.overturned:
        return float(np.fmax(margin, 1.0))  # the factor may be beyond all simulated levels
    # The level is the midpoint of a bracket. If this contains the motion itself, which stands, the change is above.
    is_near = 1.0 <= margin <= 1.0 + _BRACKET_WIDTH and not response.unfinished
    return float(np.nextafter(1.0, 0.0)) if is_near else margin
