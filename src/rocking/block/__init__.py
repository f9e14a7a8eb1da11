"""What rocks: one block, or many as a struct of arrays; free, or held back."""

from rocking.block.many import Blocks
from rocking.block.restrained import RestrainedBlock, RestrainedBlocks, one_sided_restitution
from rocking.block.restraints import Damper, Load, Restraint, Spring, Tendon, Thrust
from rocking.block.single import Block, Side, housner_restitution, one_block

__all__ = [
    "Block",
    "Blocks",
    "Damper",
    "Load",
    "RestrainedBlock",
    "RestrainedBlocks",
    "Restraint",
    "Side",
    "Spring",
    "Tendon",
    "Thrust",
    "housner_restitution",
    "one_block",
    "one_sided_restitution",
]
