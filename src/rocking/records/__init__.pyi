from .catalogue import ShippedRecord, info, load, names
from .components import Components, group_components, load_pairs
from .formats import channels, identify, read
from .formats.channel import Channel, Identification
from .named import Contents, contents, shipped

__all__ = [
    "Channel",
    "Components",
    "Contents",
    "Identification",
    "ShippedRecord",
    "channels",
    "contents",
    "group_components",
    "identify",
    "info",
    "load",
    "load_pairs",
    "names",
    "read",
    "shipped",
]
