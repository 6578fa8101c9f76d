"""Which tries are made: each fault at each call to the disk, or kills at random moments."""

import random
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import cycle, islice, zip_longest
from typing import TypeVar

from soaking.disk_tries import Bench, Tries
from soaking.faulty_disk import FAULTS, Fault, call

KILLED_COMMANDS = ("run", "run --resume", "merge", "report")
T = TypeVar("T")


@dataclass(frozen=True)
class Extent:
    """How many tries are made: so many, and no new one after so many minutes, or SIGTERM; drawn by a seed."""

    count: int | None
    minutes: float
    seed: int

    def of(self, tries: Iterable[T], say: Callable[[str], None]) -> Iterator[T]:
        """The first tries; each is told."""
        end, stopped = time.monotonic() + 60 * self.minutes, threading.Event()
        signal.signal(signal.SIGTERM, lambda *_: stopped.set())
        for number, one in enumerate(islice(tries, self.count), 1):
            if time.monotonic() > end or stopped.is_set():
                return
            say(f"try {number}")
            yield one


def every_fault(bench: Bench, in_turn: bool, extent: Extent, say: Callable[[str], None]) -> dict[str, Tries]:
    """Each fault at each call of each command, or one of them in turn at each; shuffled, the commands by turns."""
    rng, found, kinds = random.Random(extent.seed), {name: Tries() for name in bench.commands}, list(FAULTS)
    tries: list[list[tuple[str, Fault]]] = []
    for name, command in bench.commands.items():
        folder = bench.ready(command)
        found[name].calls = dict(call(command.words(folder), folder).calls)
        points = range(1, sum(found[name].calls.values()) + 1)
        pairs = [(kind, at) for at in points for kind in (kinds[at % len(kinds)],) * in_turn or kinds]
        rng.shuffle(pairs)
        tries.append([(name, Fault(*pair)) for pair in pairs])
    by_turns = (one for round_ in zip_longest(*tries) for one in round_ if one is not None)
    for name, fault in extent.of(by_turns, say):
        bench.tried(bench.commands[name], found[name], fault)
    return found


def random_kills(bench: Bench, extent: Extent, say: Callable[[str], None]) -> dict[str, Tries]:
    """Kills at random moments of KILLED_COMMANDS, in turn, up to a tenth after the command's usual end."""
    rng, found, longest = random.Random(extent.seed), {name: Tries() for name in KILLED_COMMANDS}, {}
    for name in found:
        folder, started = bench.ready(bench.commands[name]), time.monotonic()
        call(bench.commands[name].words(folder), folder)
        longest[name] = 1.1 * (time.monotonic() - started)
    for name in extent.of(cycle(found), say):
        bench.tried(bench.commands[name], found[name], seconds=rng.uniform(0.0, longest[name]))
    return found
