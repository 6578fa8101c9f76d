"""Other people's renderers drawing our scenes: what `phongbench render --bench` compares our tracer with.

Each works in a process of its own: it brings threads, an OpenGL context or a compiler that may end the process when it
does not like the machine, and none of that is to touch the one that measures.
"""

import math
import os
import tempfile
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from importlib import import_module
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from phongbench.benchmarks.kernel_peers import why_absent
from phongbench.compiler.precisions import Array
from phongbench.errors import MeasurementError
from phongbench.scenes.scene import Scene

#: Mitsuba's way of computing: vectorised by LLVM, colours in red, green and blue
VARIANT = "llvm_ad_rgb"
#: squares from the middle of a plane to its end, which peers need and ours has not
BOARD = 10_000
#: VTK takes no larger exponent
SHARPEST = 128.0
#: seconds for one answer: compiling and a large picture on a small machine
PATIENCE = 300.0
#: how different distances may be, as a share: a 24-bit depth buffer is coarse far away
_NEAR_ENOUGH = 0.01


@dataclass(frozen=True)
class Wishes:
    """What a picture is to show, the same for all who draw it: pixels, reflections in a row, shadows."""

    size: tuple[int, int]
    depth: int
    shadows: bool

    def __str__(self) -> str:
        return f"depth {self.depth}, {'shadows' if self.shadows else 'no shadows'}"


@dataclass(frozen=True)
class Drawing:
    """A tool ready to draw one scene; this is what a peer's module makes, by `drawing(scene, wishes)`.

    version    its release
    draw       the picture, (height, width, 3): floats in linear light, or bytes for 0 .. 1
    distances  float (height, width), how far away what each pixel shows is, infinite where there is nothing
    """

    version: str
    draw: Callable[[], Array]
    distances: Callable[[], Array]


@dataclass(frozen=True)
class Entry:
    """A tool that draws spheres and planes, known without importing it; its package has the name of its entry.

    module     which speaks to it
    needs      what it needs beside its package
    mirrors    whether it draws reflections and shadows; where not, ours is drawn without, to compare
    brightest  the largest value its pictures hold
    note       what is compared, in a sentence or two
    """

    module: str
    needs: str
    mirrors: bool
    note: str
    brightest: float = math.inf

    def able(self, wishes: Wishes) -> Wishes:
        """What it can draw of these wishes."""
        return wishes if self.mirrors else replace(wishes, depth=0, shadows=False)


_MITSUBA = (
    f"its camera, textures, rays, shadow rays and film, vectorised by LLVM on every core ({VARIANT}); Phong, lights "
    "and mirrors are an integrator in Python that it compiles into the same kernel, for it ships neither Phong nor "
    "mirrors without noise; one sample in the middle of a pixel, no ray left out, planes end after "
    f"{BOARD} squares; timed: tracing the kernel in Python, running it, and the picture as an array"
)
_PYVISTA = (
    "VTK's rasteriser on the OpenGL that its version names; direct light only, neither shadows nor reflections; "
    f"spheres of triangles, shininess at most {SHARPEST:g}, planes end after {BOARD} squares, colours in 8 bits; "
    "timed: drawing a frame anew and reading its pixels"
)
_LLVM = "a shared LLVM newer than 15, which DRJIT_LIBLLVM_PATH can name"
_OPENGL = "OpenGL without a screen: EGL or OSMesa"

#: package -> what it is
PEERS: Mapping[str, Entry] = MappingProxyType(
    {
        "mitsuba": Entry("phongbench.benchmarks.mitsuba", _LLVM, True, _MITSUBA),
        "pyvista": Entry("phongbench.benchmarks.pyvista", _OPENGL, False, _PYVISTA, brightest=1.0),
    }
)


def agreement(ours: Array, theirs: Array) -> float:
    """The share of pixels that show the same: nothing in both, or something equally far away, to 1 %."""
    nothing = np.isinf(ours) & np.isinf(theirs)
    with np.errstate(invalid="ignore"):
        near = np.abs(ours - theirs) <= _NEAR_ENOUGH * ours
    return float((nothing | (near & np.isfinite(ours))).mean())


class Peer:
    """A tool at work in its process, which has drawn the picture once. Close it."""

    def __init__(self, name: str, entry: Entry, scene: Scene, wishes: Wishes) -> None:
        self.name, self.entry, self.wishes = name, entry, wishes
        talk, place = tempfile.mkstemp(prefix="phongbench-peer-")
        os.close(talk)
        self._talk = Path(place)
        context = get_context("spawn")
        self._line, far = context.Pipe()
        self._process = context.Process(
            target=_serve, args=(far, str(self._talk), name, entry, scene, wishes), daemon=True
        )
        self._process.start()
        far.close()
        try:
            self.version = str(self._answer())
        except BaseException:
            self.close()
            raise

    def draw(self) -> float:
        """Draw once more; seconds, taken there, until the pixels are an array."""
        return float(self._asked("draw"))

    def picture(self) -> Array:
        """What it drew last, in linear light."""
        return np.asarray(self._asked("picture"))

    def distances(self) -> Array:
        """How far away what its pixels show is."""
        return np.asarray(self._asked("distances"))

    def close(self) -> None:
        """End its process."""
        self._line.close()  # it ends when nobody asks any more
        self._process.join(5)
        self._process.kill()
        self._process.join()
        self._talk.unlink(missing_ok=True)

    def _asked(self, what: str) -> Any:
        with suppress(OSError):  # it has ended; the answer tells why
            self._line.send(what)
        return self._answer()

    def _answer(self) -> Any:
        """What it says; MeasurementError, saying why, if it cannot draw, is silent, or has ended."""
        try:
            if not self._line.poll(PATIENCE):
                raise MeasurementError(f"no answer in {PATIENCE:g} s; it needs {self.entry.needs}", self.name)
            good, said = self._line.recv()
        except (EOFError, OSError):
            self._process.join(5)
            ended = f"it ended with exit code {self._process.exitcode}: {self._last_words()}"
            good, said = False, f"cannot be used here: {ended}; it needs {self.entry.needs}"
        if not good:
            raise MeasurementError(said, self.name)
        return said

    def _last_words(self) -> str:
        """The line of what it wrote that tells the error, else its last one."""
        lines = [line.strip() for line in self._talk.read_text(errors="replace").splitlines() if line.strip()]
        problems = [line for line in lines if "rror:" in line or "ERROR" in line] or lines[-1:] or ["silent"]
        return problems[0][:160]


def _serve(line: Connection, talk: str, name: str, entry: Entry, scene: Scene, wishes: Wishes) -> None:
    """Draw when asked, in a process of its own; what the tool says goes to a file."""
    talk_file = os.open(talk, os.O_WRONLY)
    os.dup2(talk_file, 1)
    os.dup2(talk_file, 2)
    try:
        drawing: Drawing = import_module(entry.module).drawing(scene, wishes)
        picture = drawing.draw()  # compiles, and warms up
    except (ImportError, OSError, RuntimeError) as problem:
        missing = isinstance(problem, ModuleNotFoundError)
        line.send((False, why_absent(name, problem) + ("" if missing else f"; it needs {entry.needs}")))
        return
    line.send((True, drawing.version))
    while True:
        try:
            asked = line.recv()
        except EOFError:
            return
        if asked == "draw":
            started = time.perf_counter()
            picture = drawing.draw()
            line.send((True, time.perf_counter() - started))
        elif asked == "picture":
            line.send((True, picture / np.float32(255) if picture.dtype == np.uint8 else picture))
        else:
            line.send((True, drawing.distances()))
