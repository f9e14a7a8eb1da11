from .catalogue import ShippedRecord, info, load, names
from .components import Components, group_components, load_pairs
from .formats import channels, identify, read
from .formats.channel import Channel, Identification

__all__ = [
    "Channel",
    "Components",
    "Identification",
    "ShippedRecord",
    "channels",
    "group_components",
    "identify",
    "info",
    "load",
    "load_pairs",
    "names",
    "read",
]
