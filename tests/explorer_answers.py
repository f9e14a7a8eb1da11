"""Answers of the explorer to requests of the page, for tests."""

from rocking.explorer.core import Query


def page_answer(explorer, name, texts, window=None, **others):
    """Answer of an explorer to a request of the page on a case, in a window (s)."""
    ends = {} if window is None else {"from": repr(window[0]), "to": repr(window[1])}
    return explorer.answers[name](Query({**texts, **ends, **others}))
