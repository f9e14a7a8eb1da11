from .catalogue import Record, info, load, names
from .components import Components, group_components
from .formats import channels, identify, read
from .formats.channel import Channel, Identification
from .named import Contents, contents, shipped

__all__ = [
    "Channel",
    "Components",
    "Contents",
    "Identification",
    "Record",
    "channels",
    "contents",
    "group_components",
    "identify",
    "info",
    "load",
    "names",
    "read",
    "shipped",
]
