"""Work in threads: results in order, the first error, and no thread that waits for ever after an interrupt."""

import itertools
import subprocess
import sys
import threading
import time

import pytest

from rocking.threads import AHEAD, Cancellation, as_done, in_threads


def test_results_come_in_the_order_of_the_items_whichever_is_done_first():
    found = in_threads(lambda each: (time.sleep(0.002 * (each % 3 == 0)), each)[1], range(50), threads=4)
    assert list(found) == [*range(50)]


def test_of_several_errors_that_of_the_first_item_is_raised():
    def work(each):
        if each in (3, 7):
            time.sleep(0.01 * (each == 3))
            raise ValueError(f"item {each}")
        return each

    found = in_threads(work, range(20), threads=4)
    assert list(itertools.islice(found, 3)) == [0, 1, 2]
    with pytest.raises(ValueError, match="item 3"):
        next(found)


def test_items_are_taken_a_few_ahead_of_the_results():
    taken = []
    items = (taken.append(each) or each for each in range(100))
    found = as_done(lambda each: -each, items, 2)
    seen = dict(itertools.islice(found, 10))
    assert all(result == -item for item, result in seen.items()) and len(seen) == 10
    assert len(taken) == 10 + 2 * AHEAD - 1
    found.close()
    assert len(taken) == 10 + 2 * AHEAD - 1


def test_who_leaves_early_cancels_the_work_in_hand_and_waits_for_it():
    cancelled, ended, before = Cancellation(), [], threading.active_count()

    def work(each):
        while each and not cancelled.asked:
            time.sleep(0.001)
        ended.append(each)

    found = as_done(work, iter(range(100)), 3, cancelled=cancelled)
    assert next(found) == (0, None)
    assert not cancelled.asked
    found.close()
    assert cancelled.asked and 0 in ended and len(ended) <= 4
    late = time.monotonic() + 30.0
    while threading.active_count() > before and time.monotonic() < late:
        time.sleep(0.001)
    assert threading.active_count() == before


#: Ctrl-C before every third instruction of what waits for threads, as the command line takes it.
INTERRUPTED = """
import contextlib, signal, sys
from rocking.cli.interrupts import Interrupts
from rocking.threads import as_done
inside = {"threading", "rocking.threads"}
reached = raised = 0
for place in range(1, 4000, 3):
    count = 0
    def trace(frame, event, argument):
        global count
        if frame.f_globals.get("__name__") not in inside:
            return None
        frame.f_trace_opcodes = True
        count += event == "opcode"
        if event == "opcode" and count == place:
            signal.getsignal(signal.SIGINT)(signal.SIGINT, frame)
        return trace
    with Interrupts():
        sys.settrace(trace)
        try:
            for _ in as_done(int, range(6), 2):
                pass
        except KeyboardInterrupt:
            raised += 1
        finally:
            sys.settrace(None)
    if count < place:
        break
    reached += 1
print(reached, raised)
"""


@pytest.mark.thorough
def test_no_interrupt_leaves_a_thread_that_is_waited_for():
    """Where it came between the lines of `concurrent.futures`, the end of the threads was waited for in vain."""
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED], capture_output=True, text=True, check=True, timeout=300.0
    )
    reached, raised = map(int, done.stdout.split())
    assert reached >= 100
    assert raised >= 30
