"""What rocks: one block, or many as a struct of arrays."""

from rocking.block.many import Blocks
from rocking.block.single import Block, Side, housner_restitution, one_block

__all__ = ["Block", "Blocks", "Side", "housner_restitution", "one_block"]
