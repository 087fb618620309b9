"""How many threads there may be, and a pool of them that share pieces of work."""

import os
from collections.abc import Callable, Iterable
from numbers import Integral
from threading import Condition, Thread
from typing import Any


def processors() -> int:
    """Processors that this process may run on.

    Returns
    -------
    int

    Examples
    --------
    >>> processors() >= 1
    True
    """
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def check_threads(threads: int | None) -> int:
    """A number of threads that this process can use.

    Parameters
    ----------
    threads : int, optional
        None stands for all there are.

    Returns
    -------
    int

    Raises
    ------
    ValueError
        If it is no whole number from 1 to `processors`.

    Examples
    --------
    >>> check_threads(1), check_threads(None) == processors()
    (1, True)
    """
    there = processors()
    if threads is None:
        return there
    if isinstance(threads, bool) or not isinstance(threads, Integral) or not 1 <= threads <= there:
        raise ValueError(f"threads is {threads}; here it must be a whole number from 1 to {there}")
    return int(threads)


class Offer:
    """Pieces of work that any thread of a pool may take.

    Parameters
    ----------
    pieces : iterable of callable

    Attributes
    ----------
    waiting : list of (int, callable)
        Pieces that no thread has taken yet, the next one last, and their places.
    running : int
        Pieces that threads are at.
    results : list
        What each has returned.
    error : BaseException or None
        That of a piece, after which no more are taken.

    Examples
    --------
    >>> offer = Offer([lambda: 1, lambda: 4])
    >>> len(offer.waiting), offer.done
    (2, False)
    """

    def __init__(self, pieces: Iterable[Callable[[], Any]]):
        self.waiting = list(enumerate(pieces))[::-1]
        self.running = 0
        self.results: list = [None] * len(self.waiting)
        self.error: BaseException | None = None

    @property
    def done(self) -> bool:
        """Whether all pieces have returned, or one has failed."""
        return self.error is not None or not (self.waiting or self.running)


class ThreadPool:
    """Threads that share pieces of work; one that waits for others helps them meanwhile.

    The thread that makes the pool is one of them. Where the machine gives no more threads, those that there
    are do the work. A piece may offer pieces of its own.

    Parameters
    ----------
    threads : int

    Attributes
    ----------
    closed : bool
        Whether nobody waits any more for what its threads do; a long piece of work should look at it.

    Examples
    --------
    >>> with ThreadPool(2) as pool:
    ...     squares = pool.share([lambda: 1, lambda: 4, lambda: 9])
    >>> squares
    [1, 4, 9]
    >>> alone = ThreadPool(1)
    >>> offer = alone.offer([lambda: 1])  # a thread that is idle would begin
    >>> alone.finish(offer) == alone.share([lambda: 1])
    True
    """

    def __init__(self, threads: int):
        self._threads = threads
        self._helpers: list[Thread] = []
        self._offers: list[Offer] = []
        self._changed = Condition()
        self.closed = False

    def __enter__(self) -> "ThreadPool":
        for _ in range(self._threads - 1):
            helper = Thread(target=self._work, args=(lambda: self.closed,), daemon=True)
            try:
                helper.start()
            except RuntimeError:  # "can't start new thread"
                break
            self._helpers.append(helper)
        return self

    def __exit__(self, *_: object) -> None:
        with self._changed:
            self.closed = True
            self._changed.notify_all()
        for helper in self._helpers:
            helper.join()

    def share(self, pieces: Iterable[Callable[[], Any]]) -> list:
        """What pieces of work return, in their order; this thread and those that are idle do them."""
        return self.finish(self.offer(pieces))

    def offer(self, pieces: Iterable[Callable[[], Any]]) -> Offer:
        """Let idle threads begin with pieces of work, which this thread will `finish` later."""
        offer = Offer(pieces)
        with self._changed:
            self._offers.append(offer)
            self._changed.notify_all()
        return offer

    def finish(self, offer: Offer) -> list:
        """What the pieces of an offer return; this thread does those that no other has taken.

        While others are at the last ones it helps with what was offered later, but not with what was offered
        before, which may be long.

        Raises
        ------
        BaseException
            That of a piece; others may still be running.
        """
        try:
            self._work(lambda: offer.done, offer)
        finally:
            with self._changed:
                self._offers.remove(offer)
        if offer.error is not None:
            raise offer.error
        return offer.results

    def _work(self, until: Callable[[], bool], oldest: Offer | None = None) -> None:
        """Do pieces as they come until something is so."""
        while task := self._take(until, oldest):
            offer, place, piece = task
            try:
                offer.results[place] = piece()
            except BaseException as error:
                offer.error = error
                offer.waiting.clear()
            del task, piece  # and what they hold, before this thread waits
            with self._changed:
                offer.running -= 1
                self._changed.notify_all()

    def _take(
        self, until: Callable[[], bool], oldest: Offer | None
    ) -> tuple[Offer, int, Callable[[], Any]] | None:
        """A piece of the newest offer that has one, as soon as there is one; None when something is so."""
        with self._changed:
            while not until():
                first = self._offers.index(oldest) if oldest else 0
                for offer in reversed(self._offers[first:]):
                    if offer.waiting:
                        offer.running += 1
                        return offer, *offer.waiting.pop()
                self._changed.wait()
        return None
