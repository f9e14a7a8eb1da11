"""The promises of docs/reliability.md, a module each: a `Promise` made of parts that can be judged one by one."""

from promises import chattering, containment, cross_code, events, one_answer

ALL = {each.PROMISE.name: each.PROMISE for each in (containment, events, chattering, cross_code, one_answer)}
