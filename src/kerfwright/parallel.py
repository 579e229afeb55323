"""The same work on many things, on two cores.

Threads, for NumPy, OpenCV and GEOS let go of the interpreter while they compute. What comes out does not depend on how
many there are: every piece of work stands for itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

__all__ = ["THREADS", "each"]

THREADS = 2

Item = TypeVar("Item")
Result = TypeVar("Result")


def each(work: Callable[[Item], Result], items: Iterable[Item], threads: int = THREADS) -> list[Result]:
    """[work(item) for item in items], by several threads; raises what the first item that fails raises."""
    with ThreadPoolExecutor(max(1, threads)) as pool:
        return list(pool.map(work, items))
