"""Whole calls beside their rooflines: shading as the service computes it, and pictures of the shipped scenes.

On one thread, by its processor time, interleaved with plain NumPy's sweep as the yardstick, which no change of our
loops moves.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from phongbench.accuracy import sweep
from phongbench.benchmarks import numpy_sweep, rooflines
from phongbench.benchmarks.rooflines import Asked
from phongbench.scenes.render import Rendered, render
from phongbench.scenes.scene import Scene
from phongbench.scenes.scene_files import examples, read_scene
from phongbench.shading.lighting import Light, Material, Viewer
from phongbench.shading.shade import Shaded, shade
from phongbench.shading.specular_term import EXACT
from phongbench.support.progress import Progress
from phongbench.timing.interleaved import THREAD_CLOCK, Times, clocked, interleaved
from phongbench.timing.machine_lock import machine_lock
from phongbench.timing.statistics import MIN_ROUNDS

YARDSTICK = "plain NumPy's sweep"
#: samples of the yardstick: a tenth of a second or so
FEW = 1 << 11
#: points of a large request, and numbers of lights
POINTS, LIGHTS = 1_000_000, (1, 8)
#: pixels of a picture
SIZE = (640, 360)
_MATERIAL = Material((0.1, 0.1, 0.1), (0.6, 0.5, 0.4), (0.5, 0.5, 0.5), 50.0)
_SILENT = Progress()


def yardstick(clock: Callable[[], float] = time.perf_counter) -> Callable[[], float]:
    """A call of the yardstick, and its seconds by this clock."""
    prepared = sweep.prepare(numpy_sweep.plan_of_bench(FEW))
    return clocked(lambda: numpy_sweep.numpy_sweep(prepared), clock)


def measure(
    ceilings: Mapping[str, Mapping[str, float]],
    *,
    points: int = POINTS,
    size: tuple[int, int] = SIZE,
    rounds: int = MIN_ROUNDS,
    progress: Progress = _SILENT,
) -> tuple[list[dict[str, Any]], list[str]]:
    """A row for each call, and why some take longer than their rooflines.

    ceilings  of `kernel_bench.bench`
    points    of a request that is shaded
    size      of pictures
    rows      part, "shading" or "scene"; name, place; rounds, seconds and the ratio over the yardstick, see
              `Times.row`; tracing and shading, the shares of a picture's time; the columns of `rooflines.columns`
    Raises LockedError while another timing runs.
    """
    calls: dict[str, Any] = {f"shade, {n} light{'s' * (n > 1)}": _Shading(n, points) for n in LIGHTS}
    calls |= {f"picture of {name}": _Drawing(name, size) for name in examples()}
    progress.stage("shading and drawing", (1 + len(calls)) * (rounds + 1))
    timed = {YARDSTICK: yardstick(THREAD_CLOCK), **{name: call.once for name, call in calls.items()}}
    with machine_lock():
        times = interleaved(timed, rounds=rounds, warm=1, step=progress.advance)
    rows = [_row(name, call, times, ceilings) for name, call in calls.items()]
    told = (rooflines.excuse(row, getattr(call, "scene", None)) for row, call in zip(rows, calls.values(), strict=True))
    return rows, [text for text in told if text]


def _row(name: str, call: Any, times: Times[str], ceilings: Mapping[str, Mapping[str, float]]) -> dict[str, Any]:
    told = times.row(name, YARDSTICK)
    limits = rooflines.columns(call.asked(), told["seconds"], ceilings)
    return {"part": call.part, "name": name, "place": call.place, **told, **call.shares(), **limits}


class _Shading:
    """What POST /v1/shade computes of a large request, under lights at positions."""

    part = "shading"
    done: Shaded

    def __init__(self, lights: int, points: int) -> None:
        rng = np.random.default_rng(1)
        self.points = rng.uniform(-1, 1, (points, 3)).astype(np.float32)
        self.normals = rng.normal(size=(points, 3)).astype(np.float32) + np.array([0, 0, 3], np.float32)
        self.lights = [Light(position=(np.cos(i), np.sin(i), 4.0)) for i in range(lights)]
        self.out = np.empty_like(self.points)
        self.place = f"{points} points"
        self.once = clocked(self._shade, THREAD_CLOCK)

    def _shade(self) -> None:
        self.done = shade(
            self.points,
            self.normals,
            material=_MATERIAL,
            lights=self.lights,
            viewer=Viewer(position=(0.0, 0.0, 5.0)),
            out=self.out,
        )

    def asked(self) -> Asked:
        return rooflines.of_shaded(self.done, rooflines.term(EXACT), placed=True)

    def shares(self) -> dict[str, float]:
        return {"tracing": 0.0, "shading": 1.0}


class _Drawing:
    """A picture of a shipped scene as it is drawn, but on one thread."""

    part = "scene"
    done: Rendered

    def __init__(self, name: str, size: tuple[int, int]) -> None:
        scene = read_scene(name)
        self.scene: Scene = replace(scene, picture=replace(scene.picture, size=size))
        self.place = f"{size[0]}x{size[1]}"
        self.once = clocked(self._draw, THREAD_CLOCK)

    def _draw(self) -> None:
        self.done = render(self.scene, threads=1)

    def asked(self) -> Asked:
        return rooflines.of_picture(self.scene, self.done)

    def shares(self) -> dict[str, float]:
        seconds = self.done.seconds
        return {name: seconds[name] / seconds["total"] for name in ("tracing", "shading")}
