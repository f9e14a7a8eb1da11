"""The factor on the speed at an impact where it varies: it falls with the speed, or is drawn anew at each impact.

A factor that is drawn depends on the seed of the body and on the number of the impact alone, so that one simulation and
many, in whatever order, draw the same.
"""

from rocking.kernels.compiled import inlined, shared
from rocking.kernels.state import Record

#: Philox 2x32 with ten rounds (Salmon, Moraes, Dror and Shaw 2011): its multiplier, and what is added to its key.
_MULTIPLIER = 0xD256D193
_WEYL = 0x9E3779B9
_ROUNDS = 10
_WORD = 0xFFFFFFFF


@inlined
def factor(block: Record, side: int, speed: float, number: int) -> float:
    """Factor on the speed of an impact that leaves a side; ``number`` of them came before."""
    if block.variable_restitution:
        return varying_factor(block, side, speed, number)
    return float(block.restitution[side])


@shared
def varying_factor(block: Record, side: int, speed: float, number: int) -> float:
    """`factor` where it varies."""
    least, largest = block.min_restitution[side], block.restitution[side]
    if is_drawn(block):
        return min(largest, least + (largest - least) * uniform(int(block.seed), int(number)))
    return max(least, largest - block.restitution_slope[side] * speed)


@inlined
def is_drawn(block: Record) -> bool:
    """Whether the factor is drawn at each impact."""
    return bool(block.variable_restitution and block.seed >= 0)


@inlined
def relative_slope(block: Record, side: int, speed: float, e: float) -> float:
    """Return the derivative of the speed after an impact by that before it, over the factor e: 1 for a constant one."""
    if block.variable_restitution and block.seed < 0 and e > block.min_restitution[side]:
        return 1.0 - block.restitution_slope[side] * speed / e
    return 1.0


@inlined
def least_factor(block: Record, side: int, fastest: float) -> float:
    """Least factor of all impacts up to a speed; the largest is ``block.restitution``."""
    if not block.variable_restitution:
        return float(block.restitution[side])
    if block.seed >= 0:
        return float(block.min_restitution[side])
    return max(block.min_restitution[side], block.restitution[side] - block.restitution_slope[side] * fastest)


@inlined
def middle_factor(block: Record, side: int, fastest: float) -> float:
    """Middle of the factors of all impacts up to a speed."""
    return 0.5 * (least_factor(block, side, fastest) + block.restitution[side])


@shared
def uniform(seed: int, number: int) -> float:
    """Draw from [0, 1): a multiple of 2^-53 that depends on a seed below 2^63 and a number below 2^32 alone.

    Only the lower half of what is added or multiplied counts but for one product, of which the upper half of 64 bits is
    the same whether a machine's integers wrap around or Python's grow.
    """
    a, b, key = number & _WORD, (seed >> 32) & _WORD, seed & _WORD
    for _ in range(_ROUNDS):
        product = _MULTIPLIER * a
        a, b = ((product >> 32) & _WORD) ^ key ^ b, product & _WORD
        key = (key + _WEYL) & _WORD
    return ((a >> 5) * 67108864.0 + (b >> 6)) * 2.0**-53
