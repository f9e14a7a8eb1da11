from .catalogue import Record, info, load, names
from .formats import channels, identify, read
from .formats.channel import Channel, Identification
from .named import Contents, contents, shipped

__all__ = [
    "Channel",
    "Contents",
    "Identification",
    "Record",
    "channels",
    "contents",
    "identify",
    "info",
    "load",
    "names",
    "read",
    "shipped",
]
