"""The process that holds the device: python -m phongbench.targets.webgpu.worker, questions on stdin, answers on stdout.

A driver that crashes, hangs or writes to stdout takes nothing with it: answers go out through a descriptor of their
own. Only `session` talks to it.
"""

import os
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from phongbench.targets.webgpu import device as devices
from phongbench.targets.webgpu import rounds
from phongbench.targets.webgpu.clock import Passes
from phongbench.targets.webgpu.device import Device, Pass, Program
from phongbench.targets.webgpu.messages import receive, send
from phongbench.targets.webgpu.rounds import Timed, Times

#: threads of timed programs: enough to fill a GPU; and a software adapter, where what is done once a thread, such as
#: laying out the constants of every call, weighs the less the more often each thread repeats its calls
THREADS, SOFTWARE_THREADS = 1 << 16, 1 << 12
#: letters of what a driver says
_LONGEST = 300


def adapter() -> dict[str, Any] | None:
    """What the adapter here says of itself; None where there is none."""
    one = devices.adapter()
    return None if one is None else devices.facts(one)


def timed(things: Sequence[Timed], seconds: float, seed: int) -> Times:
    """Times of these, in rounds; see `rounds.measure`."""
    about = adapter()
    threads = SOFTWARE_THREADS if about and about["software"] else THREADS
    device, refused = _device(_directions(threads, seed)), {}
    pairs: list[tuple[Timed, rounds.Pair]] = []
    for one in things:
        try:
            programs = [device.program(text, one.copied) for text in one.texts[: 1 if one.copied else 2]]
        except Exception as problem:  # noqa: BLE001  a program that is refused concerns itself alone
            refused[one.name] = _words(problem)
        else:
            pairs.append((one, _Pair(device, programs, one)))

    found = rounds.measure(pairs, device.threads, clocks=device.clocks, seconds=seconds, seed=seed)
    return replace(found, refused=refused)


def _directions(threads: int, seed: int) -> NDArray[np.float32]:
    """Three unit vectors for each thread."""
    drawn = np.random.default_rng(seed).normal(size=(threads, 3, 4))
    drawn[..., 3] = 0.0
    return np.asarray(drawn / np.linalg.norm(drawn, axis=-1, keepdims=True), np.float32)


@dataclass(frozen=True)
class _Pair:
    """Both programs of something timed; a copy's is one, dispatched as often as its calls."""

    device: Device
    programs: Sequence[Program]
    one: Timed

    def run(self, repeats: int, places: Sequence[int]) -> Passes:
        """Run the shorter and the longer in this order."""
        threads = self.one.threads(self.device.threads)
        if self.one.copied:
            passes = [Pass(self.programs[0], threads, 1, repeats * self.one.calls[place]) for place in places]
        else:
            passes = [Pass(self.programs[place], threads, repeats) for place in places]
        return self.device.run(passes)


def values(texts: Sequence[str], given: NDArray[np.float32]) -> list[NDArray[np.float32] | str]:
    """What each program gives for these vectors, float32 (n, 3, 4); what the device says of one that it refuses."""
    device = _holding(given)
    found: list[NDArray[np.float32] | str] = []
    for text in texts:
        if text not in _kept:
            try:
                _kept[text] = device.program(text)
            except Exception as problem:  # noqa: BLE001  as above
                found.append(_words(problem))
                continue
        device.run([Pass(_kept[text], len(given))])
        found.append(device.results(len(given)))
    return found


#: the device that evaluates, and its programs by their text: a search asks for the same ones again
_evaluating: list[Device] = []
_kept: dict[str, Program] = {}


def _holding(given: NDArray[np.float32]) -> Device:
    """The device that evaluates, holding these vectors."""
    if _evaluating and _evaluating[0].threads >= len(given):
        _evaluating[0].give(given)
        return _evaluating[0]
    _kept.clear()
    _evaluating[:] = [_device(given)]
    return _evaluating[0]


def _device(given: NDArray[np.float32]) -> Device:
    one = devices.adapter()
    if one is None:
        raise RuntimeError("there is no adapter")
    return Device(one, given)


def _words(problem: Exception) -> str:
    """What it says, in a line of reasonable length."""
    return " ".join(str(problem).split())[:_LONGEST] or type(problem).__name__


QUESTIONS: Mapping[str, Callable[..., Any]] = {"adapter": adapter, "timed": timed, "values": values}


def main() -> None:
    """Answer until stdin ends."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever a driver prints
    while True:
        try:
            question, arguments = receive(sys.stdin.buffer)
        except EOFError:
            return
        try:
            answer: Any = QUESTIONS[question](**arguments)
        except Exception as problem:  # noqa: BLE001  whatever a driver raises is an answer too
            send(answers, (False, _words(problem)))
        else:
            send(answers, (True, answer))


if __name__ == "__main__":
    main()
