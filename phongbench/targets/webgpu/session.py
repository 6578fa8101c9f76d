"""The worker's process from outside: it is asked, and what it does wrong becomes an error with a way out.

A driver may crash, hang or lose its device: each is a MeasurementError, after which the process is gone and everything
else goes on.
"""

import subprocess
import sys
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from types import TracebackType
from typing import IO, Any

from phongbench.errors import InputError, MeasurementError
from phongbench.targets.webgpu.messages import receive, send

#: seconds that a driver may take to say what adapter there is, and to do what it is asked beyond the time it is given
PATIENCE = 60.0, 300.0
#: lines of what a worker wrote to stderr that an error quotes
_QUOTED = 400
_WORKER = (sys.executable, "-m", "phongbench.targets.webgpu.worker")
#: what a loader of OpenGL and Vulkan complains of the lack of, where nobody sits before a screen
_SCREENLESS = "XDG_RUNTIME_DIR"


@dataclass(frozen=True, slots=True)
class Adapter:
    """An adapter of this machine.

    name      as its driver calls it
    driver    its release
    backend   Vulkan, Metal, D3D12 or OpenGL
    software  whether it runs on the processor, and is no GPU
    features  of timestamp-query and shader-f16, those that it has
    version   of wgpu
    """

    name: str
    driver: str
    backend: str
    software: bool
    features: tuple[str, ...]
    version: str

    @property
    def title(self) -> str:
        """For people: what it is."""
        return f"{self.name}, a software adapter on the processor, no GPU" if self.software else self.name

    @property
    def half(self) -> bool:
        """Whether it computes with numbers of 16 bits."""
        return "shader-f16" in self.features


def why_not() -> str | None:
    """What is missing here to ask for an adapter; None where nothing is."""
    if find_spec("wgpu") is None:
        return "pip install 'phongbench[gpu]' brings WebGPU's binding"
    return None


@cache
def found() -> tuple[Adapter | None, str | None]:
    """The adapter of this machine, looked for once, and why there is none."""
    if (missing := why_not()) is not None:
        return None, missing
    try:
        with Session() as session:
            adapter = session.adapter()
    except MeasurementError as problem:
        return None, problem.what
    return adapter, None if adapter else "there is no adapter: a GPU needs its driver"


class Session:
    """The process that holds the device, for the time of a `with` block.

    command  what starts it
    """

    def __init__(self, command: Sequence[str] = _WORKER, patience: tuple[float, float] = PATIENCE) -> None:
        if command is _WORKER and (missing := why_not()) is not None:
            raise InputError(f"cannot measure a GPU here: {missing}", "gpu", "other targets need none")
        self._command, self._patience = command, patience

    def __enter__(self) -> "Session":
        pipe = subprocess.PIPE
        try:
            self._process = subprocess.Popen(list(self._command), stdin=pipe, stdout=pipe, stderr=pipe)
        except OSError as problem:
            raise MeasurementError(f"the device's process does not start: {problem.strerror}", "gpu") from problem
        self._said: list[bytes] = []
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()
        return self

    def _listen(self) -> None:
        for line in self._pipe(self._process.stderr):
            self._said = [*self._said[-20:], line]

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._process.kill()  # it holds nothing that is worth waiting for
        self._process.wait()
        self._listener.join()
        for pipe in (self._process.stdin, self._process.stdout, self._process.stderr):
            try:
                self._pipe(pipe).close()
            except OSError:  # what it was still to be told
                continue

    def ask(self, question: str, patience: float | None = None, **arguments: Any) -> Any:
        """The answer to one of `worker.QUESTIONS`; MeasurementError where there is none."""
        timer = threading.Timer(patience or self._patience[1], self._give_up)
        timer.start()
        self._late = False
        try:
            send(self._pipe(self._process.stdin), (question, arguments))
            fine, answer = receive(self._pipe(self._process.stdout))
        except (OSError, EOFError) as problem:
            raise MeasurementError(self._what_happened(), "gpu", _FIX) from problem
        finally:
            timer.cancel()
        if not fine:
            raise MeasurementError(f"the device failed: {answer}", "gpu", _FIX)
        return answer

    def adapter(self) -> Adapter | None:
        """The adapter that it would use; None where there is none."""
        found = self.ask("adapter", self._patience[0])
        return None if found is None else Adapter(**{**found, "features": tuple(found["features"])})

    def _give_up(self) -> None:
        self._late = True
        self._process.kill()

    def _what_happened(self) -> str:
        if self._late:
            return "the device did not answer in time, and was given up"
        self._process.wait()
        self._listener.join(1.0)
        lines = [line.decode(errors="replace").strip() for line in self._said if _SCREENLESS.encode() not in line]
        words = next((line for line in reversed(lines) if line), f"exit {self._process.returncode}")
        return f"the device's process ended: {words[:_QUOTED]}"

    @staticmethod
    def _pipe(pipe: Any) -> IO[bytes]:
        """Each of the three is one, since they were asked for."""
        held: IO[bytes] = pipe
        return held


_FIX = "update the driver, or leave this target out; the others go on"
