"""Work in threads: results in order, the first error, and nothing that goes on after whoever asked has left."""

import itertools
import threading
import time

import pytest

from rocking.core.threads import ITEMS_AHEAD_PER_THREAD, map_in_threads, set_options


@pytest.mark.parametrize("threads", [1, 4])
def test_results_come_in_the_order_of_the_items_whichever_is_done_first(threads):
    with set_options(threads=threads):
        found = list(map_in_threads(lambda each: (time.sleep(0.002 * (each % 3 == 0)), each)[1], range(50)))
    assert found == [*range(50)]


@pytest.mark.parametrize("threads", [1, 4])
def test_of_several_errors_that_of_the_first_item_is_raised(threads):
    def work(each):
        if each in (3, 7):
            time.sleep(0.01 * (each == 3))
            raise ValueError(f"item {each}")
        return each

    found = map_in_threads(work, range(20))
    with set_options(threads=threads):
        assert list(itertools.islice(found, 3)) == [0, 1, 2]
    with pytest.raises(ValueError, match="item 3"):
        next(found)


def test_a_system_without_threads_does_the_work_itself(monkeypatch):
    def refused(self):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", refused)
    with set_options(threads=4):
        assert [*map_in_threads(lambda each: -each, range(100))] == [-each for each in range(100)]
        assert [*map_in_threads(lambda each: -each, iter([3]))] == [-3]
        assert [*map_in_threads(lambda each: -each, [])] == []


def test_items_are_taken_a_few_ahead_of_the_results():
    taken = []
    items = (taken.append(each) or each for each in itertools.count())
    found = map_in_threads(lambda each: -each, items)
    with set_options(threads=2):
        assert [*itertools.islice(found, 10)] == [-each for each in range(10)]
    assert len(taken) == 9 + 2 * ITEMS_AHEAD_PER_THREAD
    found.close()
    assert len(taken) == 9 + 2 * ITEMS_AHEAD_PER_THREAD


def test_whoever_leaves_early_cancels_the_work_in_hand_waits_for_it_and_leaves_the_rest():
    cancelled, ended, before = threading.Event(), [], threading.active_count()

    def work(each):
        while each and not cancelled.wait(0.001):
            pass
        ended.append(each)

    found = map_in_threads(work, range(100), cancelled=cancelled)
    with set_options(threads=3):
        next(found)
    assert not cancelled.is_set()
    found.close()
    assert cancelled.is_set() and 0 in ended and len(ended) <= 4
    assert threading.active_count() == before
