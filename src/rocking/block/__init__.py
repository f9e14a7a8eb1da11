"""Rocking blocks, single or as arrays, free or restrained."""

from rocking.block.bodies import Blocks
from rocking.block.body import Bodies, Body, CoordinateLabels
from rocking.block.restrained import RestrainedBlock
from rocking.block.restraints import Damper, Load, Restitution, Restraint, Spring, Tendon, Thrust
from rocking.block.sides import Side, impact_restitution, one_sided_restitution
from rocking.block.single import Block

#: The same class, because restraints are arrays of terms.
RestrainedBlocks = Blocks

__all__ = [
    "Block",
    "Blocks",
    "Bodies",
    "Body",
    "CoordinateLabels",
    "Damper",
    "Load",
    "Restitution",
    "RestrainedBlock",
    "RestrainedBlocks",
    "Restraint",
    "Side",
    "Spring",
    "Tendon",
    "Thrust",
    "impact_restitution",
    "one_sided_restitution",
]
