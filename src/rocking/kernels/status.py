"""Integer codes that kernels return; the edges translate them, once, into words or exceptions."""

from typing import Final

# What ended one Taylor step.
STEP: Final = 0
IMPACT: Final = 1
OVERTURN: Final = 2
UNDECIDED: Final = 5

# Kinds of event in a response.
UPLIFT: Final = 0
REST: Final = 1
TOPPLED: Final = 2

# How a sequence of impacts is brought to rest.
CERTIFIED: Final = 0
VELOCITY: Final = 1
INTERVAL: Final = 2
TIME: Final = 3

# How a march ended. GOING, FULL and PAUSED ones can be taken on.
DONE: Final = 0
FELL: Final = 1
BALANCED: Final = 2
FULL: Final = 3
GOING: Final = 4
PAUSED: Final = 5
UNFINISHED: Final = 6
