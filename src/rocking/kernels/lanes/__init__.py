"""Many blocks through one evenly sampled record: together where nothing happens, one by one where something does.

A lane is one block. Over each sample all lanes step together, in loops that vectorise; a lane in which the step may
hold an event (an impact, a new peak, an overturning) is left where it was, and `march` takes the block through that
sample. What may hold an event is decided by bounds, never by sampling (`steps.is_event_free`). A lane's arithmetic
depends on its block and the motion alone, never on the other lanes.
"""
