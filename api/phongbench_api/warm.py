"""Kernels compiled before the server says it is ready, and what work is predicted to cost."""

import threading
import time
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from phongbench import kernels
from phongbench.approximations import REGISTRY, example
from phongbench.errors import InputError
from phongbench.lowering import FLOAT32, FLOAT64, Precision
from phongbench.spec import Approximation, Setting
from phongbench_api import highlight
from phongbench_api.highlight import Formula
from phongbench_api.models import GAMMA_VALUES

#: predicted seconds of compiling one kernel; measured 0.15 to 0.3 on an empty cache, 0.005 from a full one
COMPILE_SECONDS = 0.3
#: seconds a pair beyond the kernel's own: reading, checking and writing it
MOVING = 4e-9
_CALIBRATION_PAIRS = 1 << 15


class Kernels:
    """Which kernels are compiled, and how long each formula takes for a pair.

    A kernel that is not yet compiled costs COMPILE_SECONDS more, so it is never compiled on the event loop.
    """

    def __init__(self) -> None:
        self._ready: set[object] = set()
        self._compiling = threading.Lock()
        self._seconds: dict[str, float] = {}

    def pairs_cost(self, formula: Formula, precision: Precision, pairs: int, *, compare: bool = False) -> float:
        """Predicted seconds of the highlights of so many pairs."""
        rate = self._seconds.get(formula.spec.name, 1e-7) * (1 if precision is FLOAT32 else 4) + MOVING
        rate += 4 * self._seconds.get("phong", 1e-7) + 10 * MOVING if compare else 0.0
        missing = self.pairs_key(formula, precision) not in self._ready
        return pairs * rate + 2e-5 + COMPILE_SECONDS * missing

    def curve_cost(self, formula: Formula, points: int, precision: Precision = FLOAT64) -> float:
        """Predicted seconds of a curve."""
        missing = self.curve_key(formula, precision) not in self._ready
        return 1e-4 + 2e-7 * points + COMPILE_SECONDS * missing

    @staticmethod
    def pairs_key(formula: Formula, precision: Precision) -> object:
        """What one compiled loop over pairs serves."""
        s = formula.setting
        gated = kernels.needs_gate(formula.spec, formula.form, s)
        return (formula.spec.name, formula.form, precision.name, kernels.known_values(formula.spec, s), gated)

    @staticmethod
    def curve_key(formula: Formula, precision: Precision = FLOAT64) -> object:
        """What one compiled loop over coordinates serves."""
        return (formula.spec.name, kernels.known_values(formula.spec, formula.setting), precision.name)

    def compile_pairs(self, formula: Formula, precision: Precision) -> None:
        """Compile a loop over pairs unless it is; one at a time, since compilation holds the interpreter."""
        key = self.pairs_key(formula, precision)
        if key not in self._ready:
            with self._compiling:
                highlight.prepared(formula, precision.name)
                one = np.zeros((1, 3), precision.carrier)
                highlight.values(formula, one, one, precision)
            self._ready.add(key)

    def compile_curve(self, formula: Formula, precision: Precision = FLOAT64) -> None:
        """Compile a loop over coordinates unless it is, and in float64 what lays out vectors of wrong length."""
        key = self.curve_key(formula, precision)
        if key not in self._ready:
            with self._compiling:
                highlight.curve(formula, np.zeros(1), precision, length_error=0.01, perturbation="a")
            self._ready.add(key)

    def warm(self, stopped: Callable[[], bool]) -> bool:
        """Compile what is asked for most, and time it: every curve, and every formula and lambda form in float32.

        Exact Phong in float64 is what others are compared with. False if it was told to stop.
        """
        work = [partial(self.compile_curve, formula) for formula in curves()]
        work += [partial(self._prepare, formula) for formula in loops()]
        work += [partial(self.compile_pairs, formula, FLOAT64) for formula in loops() if formula.spec.kind == "exact"]
        for step in work:
            if stopped():
                return False
            step()
        return True

    def _prepare(self, formula: Formula) -> None:
        self.compile_pairs(formula, FLOAT32)
        self._calibrate(formula)

    def _calibrate(self, formula: Formula) -> None:
        draw = np.random.default_rng(1).normal(size=(2, _CALIBRATION_PAIRS, 3)).astype(np.float32)
        times = []
        for _ in range(3):
            started = time.perf_counter()
            highlight.values(formula, draw[0], draw[1], FLOAT32)
            times.append(time.perf_counter() - started)
        rate = min(times) / _CALIBRATION_PAIRS
        self._seconds[formula.spec.name] = max(rate, self._seconds.get(formula.spec.name, 0.0))


def curves() -> Iterator[Formula]:
    """One formula for every compiled curve there is: each approximation, at each gamma it takes."""
    for spec in REGISTRY.values():
        for gamma in GAMMA_VALUES if spec.uses_gamma else (None,):
            setting = _accepted(spec, gamma)
            if setting:
                yield Formula(spec, spec.lambda_forms[0], setting)


def loops() -> Iterator[Formula]:
    """Every approximation in each of its forms, at its example setting."""
    for spec in REGISTRY.values():
        for form in spec.lambda_forms:
            yield Formula(spec, form, example(spec))


def _accepted(spec: Approximation, gamma: int | None) -> Setting | None:
    """A setting with this gamma that the approximation accepts."""
    for alpha in (example(spec).alpha, 1000.0):
        setting = Setting(alpha, gamma, spec.slopes[0], spec.spaces[0])
        try:
            spec.check(setting)
        except InputError:
            continue
        return setting
    return None
