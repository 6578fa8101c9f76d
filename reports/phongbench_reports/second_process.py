"""A second process that makes some parts of a report: drawing is Python, which runs on one core at a time.

It begins while the first process makes the answers, and gives the same parts, byte for byte. Where it fails, the first
process makes them itself, and meets the same failure if there is one.
"""

from __future__ import annotations

import pickle
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from phongbench.support.process import seldom_collected

if TYPE_CHECKING:  # what draws takes two seconds of a core to import: the other process begins before
    from phongbench.analysis.rows import Rows
    from phongbench_reports.table import Part

#: not `-m`: what is pickled would be of __main__, which is another module over here
_CHILD = f"import sys; from {__name__} import serve; serve(sys.argv[1], sys.stdin, sys.stdout.buffer)"
#: name of a part -> what it became
Made = Mapping[str, "Drawn"]
Process = subprocess.Popen[bytes]


@dataclass(frozen=True)
class Drawn:
    """A part as the page takes it.

    content  what its section shows
    pair     of a figure its SVG for light and for dark pages
    """

    content: Any
    pair: tuple[bytes, bytes] | None


def drawn(study: Rows, entry: Part) -> Drawn:
    """One part of a study; call it inside `ink`."""
    from phongbench_reports.plots import Plate, svg_pair

    content = entry.make(study)
    return Drawn(content, svg_pair(content.figure, entry.name) if isinstance(content, Plate) else None)


class Shared:
    """Parts that two processes make, each the next one that is left: this one from the front, the other from the end.

    names    of the parts, in the order in which this process would make them
    process  the other one, see `serve`
    """

    @property
    def left(self) -> int:
        """How many parts neither process has begun."""
        return len(self._left)

    def __init__(self, names: Iterable[str], process: Process) -> None:
        self._left = deque(names)
        self._theirs: dict[str, Drawn] = {}
        self._thread = threading.Thread(target=self._ask, args=(process,), daemon=True)
        self._thread.start()

    def mine(self) -> Iterator[str]:
        """The parts for this process to make; each is handed out when it is asked for."""
        while self._left:
            with suppress(IndexError):  # the other process was quicker
                yield self._left.popleft()

    def theirs(self) -> Made:
        """Waits for what the other process makes; only what came, if it failed."""
        self._thread.join()
        return self._theirs

    def _ask(self, process: Process) -> None:
        if process.stdin is None or process.stdout is None:
            return
        while self._left:
            with suppress(IndexError, OSError, EOFError, pickle.UnpicklingError):
                name = self._left.pop()
                process.stdin.write(f"{name}\n".encode())
                process.stdin.flush()
                self._theirs[name] = pickle.load(process.stdout)
                continue
            return


@contextmanager
def begun(path: Path | None) -> Iterator[Process | None]:
    """While it lasts there is a process for parts of the report of this run, for `beside`; none without a folder."""
    if path is None:
        yield None
        return
    words = [sys.executable, "-c", _CHILD, str(path)]
    pipe = subprocess.PIPE
    process = subprocess.Popen(words, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL)
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


@contextmanager
def beside(process: Process, names: Iterable[str]) -> Iterator[Shared]:
    """While it lasts, that process makes some of these parts; it ends with it."""
    shared = Shared(names, process)
    try:
        yield shared
    finally:
        process.kill()
        shared.theirs()


@seldom_collected()
def serve(path: str, asked: Iterable[str], out: IO[bytes]) -> None:
    """What the other process does: it makes parts of the report of the run in this folder as they are asked for.

    asked  lines, each the name of a part
    out    receives each one, pickled
    """
    from matplotlib.figure import Figure

    from phongbench.analysis.rows import Rows
    from phongbench.results import runs
    from phongbench_reports.parts import ALL
    from phongbench_reports.plots import Plate, ink

    study = Rows(runs.load(Path(path)))
    with ink():
        for line in asked:
            one = drawn(study, ALL[line.strip()])
            # the figure itself is large, and nobody needs it once it is SVG
            bare = replace(one.content, figure=Figure()) if isinstance(one.content, Plate) else one.content
            pickle.dump(replace(one, content=bare), out)
            out.flush()
