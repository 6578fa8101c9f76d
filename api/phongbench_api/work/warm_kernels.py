"""Kernels compiled before the server is ready, and the predicted cost of requests."""

import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT32, FLOAT64, Precision
from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.formulas.kernel import known_values, needs_gate
from phongbench.formulas.registry import REGISTRY, example
from phongbench.formulas.spec import Approximation
from phongbench.scenes.requests import RenderRequest
from phongbench.shading.requests import ShadingRequest, shading_request
from phongbench_api.models import GAMMA_VALUES
from phongbench_api.work import evaluation, render_cost
from phongbench_api.work.evaluation import Lobe

#: predicted seconds of compiling one kernel; measured 0.15 to 0.3 on an empty cache, 0.005 from a full one
COMPILE_SECONDS = 0.3
#: seconds a pair beyond the kernel's own: reading, checking and writing it
MOVING = 4e-9
_CALIBRATION_PAIRS = 1 << 15
#: predicted seconds of compiling the loops of a shading request of a new kind
SHADING_COMPILE_SECONDS = 1.0


class Kernels:
    """Which kernels are compiled, and how long each formula takes for a pair.

    A kernel that is not yet compiled costs COMPILE_SECONDS more, so it is never compiled on the event loop.
    """

    def __init__(self) -> None:
        self._ready: set[object] = set()
        self._compiling = threading.Lock()
        self._seconds: dict[str, float] = {}
        self._shading = 2e-8
        self._drawing = 1.0

    def pairs_cost(self, lobe: Lobe, precision: Precision, pairs: int, *, compare: bool = False) -> float:
        """Predicted seconds of the highlights of so many pairs."""
        rate = self._seconds.get(lobe.spec.name, 1e-7) * (1 if precision is FLOAT32 else 4) + MOVING
        rate += 4 * self._seconds.get("phong", 1e-7) + 10 * MOVING if compare else 0.0
        missing = self.pairs_key(lobe, precision) not in self._ready
        return pairs * rate + 2e-5 + COMPILE_SECONDS * missing

    def curve_cost(self, lobe: Lobe, points: int, precision: Precision = FLOAT64) -> float:
        """Predicted seconds of a curve."""
        missing = self.curve_key(lobe, precision) not in self._ready
        return 1e-4 + 2e-7 * points + COMPILE_SECONDS * missing

    @staticmethod
    def pairs_key(lobe: Lobe, precision: Precision) -> object:
        """What one compiled loop over pairs serves."""
        s = lobe.setting
        gated = needs_gate(lobe.spec, lobe.form, s)
        return (lobe.spec.name, lobe.form, lobe.formula.normalise, precision.name, known_values(lobe.spec, s), gated)

    @staticmethod
    def curve_key(lobe: Lobe, precision: Precision = FLOAT64) -> object:
        """What one compiled loop over coordinates serves."""
        return (lobe.spec.name, known_values(lobe.spec, lobe.setting), precision.name)

    def compile_pairs(self, lobe: Lobe, precision: Precision) -> None:
        """Compile a loop over pairs unless it is; one at a time, since compilation holds the interpreter."""
        key = self.pairs_key(lobe, precision)
        if key not in self._ready:
            with self._compiling:
                one = np.zeros((1, 3), precision.carrier)
                evaluation.values(lobe, one, one, precision)
            self._ready.add(key)

    def compile_curve(self, lobe: Lobe, precision: Precision = FLOAT64) -> None:
        """Compile a loop over coordinates unless it is, and in float64 what lays out vectors of wrong length."""
        key = self.curve_key(lobe, precision)
        if key not in self._ready:
            with self._compiling:
                evaluation.curve(lobe, np.zeros(1), precision, length_error=0.01, perturbation="a")
            self._ready.add(key)

    def shading_cost(self, request: ShadingRequest) -> float:
        """Predicted seconds of a shading request."""
        pairs, points = request.pairs, len(request.points)
        rate = self._shading * (1 if request.points.dtype == np.float32 else 2)
        missing = shading_key(request) not in self._ready
        return 4e-4 + pairs * rate + points * MOVING + SHADING_COMPILE_SECONDS * missing

    def compile_shading(self, request: ShadingRequest) -> None:
        """Compile the loops of a request unless they are, by shading its first point."""
        key = shading_key(request)
        if key not in self._ready and len(request.points):
            with self._compiling:
                replace(request, points=request.points[:1], normals=request.normals[:1]).shade()
            self._ready.add(key)

    def render_cost(self, request: RenderRequest) -> float:
        """Predicted seconds of a picture; this machine's speed is measured when the kernels are warmed."""
        missing = not render_cost.kinds(request) <= self._ready
        return self._drawing * render_cost.seconds(request) + SHADING_COMPILE_SECONDS * missing

    def compile_rendering(self, request: RenderRequest) -> None:
        """Compile the loops of a picture unless they are, by drawing it very small."""
        kinds = render_cost.kinds(request)
        if not kinds <= self._ready:
            with self._compiling:
                render_cost.smallest(request).draw(threads=1)
            self._ready |= kinds

    def warm(self, stopped: Callable[[], bool]) -> bool:
        """Compile what is requested most, and time it: every curve, every formula and lambda form in float32, shading,
        pictures.

        Exact Phong in float64 is what others are compared with. On a cold cache a second process compiles the shading
        meanwhile. False if it was stopped.
        """
        helper = _helper()
        work: list[Callable[[], object]] = [partial(self.compile_curve, lobe) for lobe in curves()]
        work += [partial(self._prepare, lobe) for lobe in loops()]
        work += [partial(self.compile_pairs, lobe, FLOAT64) for lobe in loops() if lobe.spec.kind == "exact"]
        work += [partial(self.compile_rendering, request) for request in render_cost.usual()]
        work += [helper.wait] if helper else []
        work += [partial(self.compile_shading, request) for request in shadings()]
        work += [self._calibrate_shading, self._calibrate_rendering]
        try:
            for step in work:
                if stopped():
                    return False
                step()
        finally:
            if helper and helper.poll() is None:
                helper.kill()
                helper.wait()
        return True

    def _prepare(self, lobe: Lobe) -> None:
        self.compile_pairs(lobe, FLOAT32)
        self._calibrate(lobe)

    def _calibrate(self, lobe: Lobe) -> None:
        draw = np.random.default_rng(1).normal(size=(2, _CALIBRATION_PAIRS, 3)).astype(np.float32)
        times = []
        for _ in range(3):
            started = time.perf_counter()
            evaluation.values(lobe, draw[0], draw[1], FLOAT32)
            times.append(time.perf_counter() - started)
        rate = min(times) / _CALIBRATION_PAIRS
        self._seconds[lobe.spec.name] = max(rate, self._seconds.get(lobe.spec.name, 0.0))

    def _calibrate_shading(self) -> None:
        request = _shading(REGISTRY["phong"], "position", _CALIBRATION_PAIRS)
        started = time.perf_counter()
        request.shade()
        self._shading = (time.perf_counter() - started) / request.pairs

    def _calibrate_rendering(self) -> None:
        self._drawing = render_cost.measured()


def shading_key(request: ShadingRequest) -> object:
    """What decides which loops a shading request takes: formula, model, type, and kinds of lights and viewer."""
    arguments = request.arguments
    lights, fresnel = arguments["lights"], arguments["material"].fresnel
    kinds = frozenset((light.direction is None, max(light.ambient) > 0) for light in lights)
    specular, viewer = arguments["specular"], arguments["viewer"].direction is None
    name = render_cost.loops_of(specular, arguments["material"])
    kind = fresnel and fresnel.kind
    return (name, arguments["model"], request.points.dtype.str, kinds, viewer, kind)


def shadings() -> Iterator[ShadingRequest]:
    """Every formula with lights of both kinds, in float32, and exact Phong in float64."""
    for viewer in ("direction", "position"):
        for spec in REGISTRY.values():
            yield _shading(spec, viewer, 1)
    yield _shading(REGISTRY["phong"], "direction", 1, precision="float64")


def _shading(spec: Approximation, viewer: str, points: int, **more: Any) -> ShadingRequest:
    setting, white = example(spec), [1.0, 1.0, 1.0]
    formula = {"approximation": spec.name} | ({"gamma": setting.gamma} if setting.gamma else {})
    lights = [{"direction": [0, 0, 1]}, {"position": [1, 2, 3]}]
    material = {"ambient": white, "diffuse": white, "specular": white, "shininess": setting.alpha}
    bulk = {"points": [[0, 0, 0]] * points, "normals": [[0, 0, 1]] * points}
    document = {"specular": formula, "lights": lights, "material": material, "viewer": {viewer: [0, 0, 1]}}
    return shading_request(document | bulk | more)


def curves() -> Iterator[Lobe]:
    """One formula for every compiled curve there is: each approximation, at each gamma it takes."""
    for spec in REGISTRY.values():
        for gamma in GAMMA_VALUES if spec.uses_gamma else (None,):
            formula = Formula.of(spec.name, gamma=gamma)
            alpha = next((a for a in (example(spec).alpha, 1000.0) if _takes(formula, a)), None)
            if alpha is not None:
                yield Lobe(formula, alpha)


def loops() -> Iterator[Lobe]:
    """Every approximation in each of its forms, at its example setting."""
    for spec in REGISTRY.values():
        for form in spec.lambda_forms:
            setting = example(spec)
            yield Lobe(Formula.of(spec.name, form, setting.gamma), setting.alpha)


def _takes(formula: Formula, alpha: float) -> bool:
    try:
        formula.check(alpha)
    except InputError:
        return False
    return True


def _helper() -> "subprocess.Popen[bytes] | None":
    """A process that compiles the loops of shading into the cache, if that is cold.

    Compilation holds the interpreter, so threads cannot share it (see phongbench.study.precompile).
    """
    if jit.DISABLED or any(jit.cache_folder().rglob("*shade_tiles*")):
        return None
    quiet = subprocess.DEVNULL
    return subprocess.Popen(
        [sys.executable, "-m", "phongbench_api.work.warm_kernels"], stdin=quiet, stdout=quiet, stderr=quiet
    )


if __name__ == "__main__":
    here = Kernels()
    for one in shadings():
        here.compile_shading(one)
