"""Sources are parsed by threads at once: those of a sweep compile what they meet first."""

import gc
import sys
import threading
from collections.abc import Callable, Iterator

import pytest

from phongbench.compiler.kernel_source import parsed

LINES = "".join(f"    a{i} = x * {i} + 1.0 if x > {i} else -x\n" for i in range(150))
SOURCE = f"def f(x):\n{LINES}    return x\n"


class _Finalized:
    """A cycle whose collection runs Python code, during which another thread may go on."""

    def __init__(self) -> None:
        self.itself = self

    def __del__(self) -> None:
        for _ in range(50):
            pass


@pytest.fixture
def _restless() -> Iterator[None]:
    interval, thresholds = sys.getswitchinterval(), gc.get_threshold()
    sys.setswitchinterval(1e-6)
    gc.set_threshold(20)
    yield
    sys.setswitchinterval(interval)
    gc.set_threshold(*thresholds)


def _deep(depth: int, work: Callable[[], None]) -> None:
    if depth:
        _deep(depth - 1, work)
    else:
        work()


@pytest.mark.usefixtures("_restless")
def test_threads_of_different_depth_parse_at_once() -> None:
    failures: list[SystemError] = []

    def parse() -> None:
        for _ in range(25):
            for _ in range(50):
                _Finalized()
            try:
                parsed(SOURCE)
            except SystemError as problem:
                failures.append(problem)

    threads = [threading.Thread(target=_deep, args=(10 * depth, parse)) for depth in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failures == []
