"""A bounded pool: work is done ahead by some threads, its results come in order, and memory stays small."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Final, TypeVar

MOST_WORKERS: Final = 4
_AHEAD: Final = 2
"""Tasks that wait or are done beside those at work."""
_T = TypeVar("_T")
_R = TypeVar("_R")


def default_workers() -> int:
    """As many threads as the machine has cores, but not more than bring anything."""
    return min(MOST_WORKERS, os.cpu_count() or 1)


def mapped_ahead(work: Callable[[_T], _R], tasks: Iterable[_T], workers: int) -> Iterator[_R]:
    """``work`` of every task, in order. With one worker nothing is done ahead. Raises what ``work`` raises."""
    if workers <= 1:
        yield from map(work, tasks)
        return
    waiting: deque[Future[_R]] = deque()
    pool = ThreadPoolExecutor(workers, thread_name_prefix="columns")
    try:
        for task in tasks:
            waiting.append(pool.submit(work, task))
            if len(waiting) >= workers + _AHEAD:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
