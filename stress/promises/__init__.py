"""The promises of docs/reliability.md, a module each: a `Promise` made of parts that can be judged one by one."""

from promises import (
    chattering,
    containment,
    cross_code,
    events,
    full_disk,
    interrupts,
    one_answer,
    reading,
    rounding,
    serving,
    soak,
)

_MODULES = (
    containment,
    events,
    chattering,
    cross_code,
    one_answer,
    rounding,
    reading,
    serving,
    soak,
    interrupts,
    full_disk,
)

ALL = {each.PROMISE.name: each.PROMISE for each in _MODULES}
