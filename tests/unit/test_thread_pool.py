"""The pool of threads in which the eigensolver shares out its work."""

import time
from functools import partial
from threading import Barrier, active_count, current_thread, local

import pytest

from sid.eigen.threads import ThreadPool


@pytest.mark.parametrize("threads", [1, 2, 4])
def test_results_come_in_order_also_of_pieces_that_share_pieces(threads):
    def row(i):
        return pool.share(partial(lambda j: (i, j), j) for j in range(5))

    with ThreadPool(threads) as pool:
        table = pool.share(partial(row, i) for i in range(7))
    assert table == [[(i, j) for j in range(5)] for i in range(7)]


def test_an_idle_thread_takes_what_is_offered_while_the_other_does_something_else():
    begun = Barrier(2)
    with ThreadPool(2) as pool:
        offer = pool.offer([begun.wait])
        begun.wait(60)  # passed only where the other thread is at the piece
        assert len(pool.finish(offer)) == 1


def test_a_thread_that_waits_takes_no_piece_from_outside_of_its_own():
    """A slice must not begin within another one: the memory of both would be held."""
    inside = local()

    def outer():
        assert not getattr(inside, "yes", False)
        inside.yes = True
        pool.share([partial(time.sleep, 1e-3 * i) for i in range(4)])
        inside.yes = False

    with ThreadPool(3) as pool:
        pool.share([outer] * 12)


def test_a_thread_that_waits_helps_with_what_was_offered_later():
    helped = []
    together = Barrier(2)

    def late():
        together.wait(60)  # passed only where both threads are at such a piece
        helped.append(current_thread())

    with ThreadPool(2) as pool:
        both = Barrier(2)

        def short():
            both.wait(60)

        def long():
            both.wait(60)
            pool.share([late, late])

        pool.share([short, long])
    assert len(set(helped)) == 2


@pytest.mark.parametrize("threads", [1, 2])
def test_an_error_of_a_piece_is_raised_where_they_are_waited_for_and_ends_the_others(threads):
    done = []

    def fail():
        raise ValueError("planted")

    before = active_count()
    with pytest.raises(ValueError, match="planted"), ThreadPool(threads) as pool:
        pool.share([fail, *[partial(done.append, i) for i in range(100)]])
    assert threads > 1 or not done
    assert pool.closed and active_count() == before
