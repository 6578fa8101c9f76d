"""Interrupts: a Ctrl-C is heard even if whatever it hit swallowed it."""

import contextlib
import os
import signal
import threading

import pytest

from phongbench.errors import InterruptedStudyError
from phongbench.study.run import run_study
from phongbench.support.process import cores, heeded
from phongbench.support.progress import Progress


@pytest.fixture
def default_handler():
    """Python's own handler, whatever the shell that started the tests set."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


class Swallower(Progress):
    """Interrupts the sweep once, at a place that swallows it."""

    def __init__(self):
        self.steps = 0

    def advance(self, steps=1):
        self.steps += 1
        if self.steps == 3:
            with contextlib.suppress(KeyboardInterrupt):
                signal.raise_signal(signal.SIGINT)


@pytest.mark.usefixtures("default_handler")
def test_a_swallowed_interrupt_ends_a_study_at_its_next_step(small_plan, tmp_path):
    progress = Swallower()
    with pytest.raises(InterruptedStudyError):
        run_study(small_plan, tmp_path / "run", progress=progress, jobs=1)
    assert progress.steps == 3


@pytest.mark.usefixtures("default_handler")
def test_the_handler_before_is_restored():
    with heeded() as check:
        check()
        assert signal.getsignal(signal.SIGINT) is not signal.default_int_handler
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.usefixtures("default_handler")
def test_a_handler_of_the_host_program_stays():
    mine = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with heeded() as check:
            signal.raise_signal(signal.SIGINT)
            check()
            assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, mine)


@pytest.mark.usefixtures("default_handler")
def test_other_threads_leave_the_handler_alone():
    seen = []

    def enter():
        with heeded():
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=enter)
    thread.start()
    thread.join()
    assert seen == [signal.default_int_handler]


def test_cores_are_those_of_this_process_and_one_where_nobody_knows(monkeypatch):
    assert 1 <= cores() <= (os.cpu_count() or 1)
    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    for counted, expected in ((None, 1), (3, 3)):
        monkeypatch.setattr(os, "cpu_count", lambda counted=counted: counted)
        assert cores() == expected
