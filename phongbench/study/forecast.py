"""What a plan would take, from a short trial of the real sweep; nothing is stored."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from phongbench.accuracy import probes
from phongbench.accuracy import sweep as engine
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Approximation
from phongbench.inputs.plan import Plan
from phongbench.support.process import cores
from phongbench.support.progress import Progress

#: what a forecast allows for loading a compiled kernel, and for making and writing a row; measured, and rounded up
LOAD_SECONDS, ROW_SECONDS = 0.015, 2e-5


@dataclass(frozen=True)
class Forecast:
    """What a plan would take, told before it is run."""

    cells: int
    rows: int
    evaluations: int
    bytes: int
    seconds: dict[str, float]

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {
            "cells": self.cells,
            "rows": self.rows,
            "evaluations": self.evaluations,
            "bytes": self.bytes,
            "seconds": {k: round(v, 1) for k, v in self.seconds.items()},
        }


def forecast(
    plan: Plan,
    registry: Mapping[str, Approximation] = REGISTRY,
    jobs: int | None = None,
    progress: Progress | None = None,
) -> Forecast:
    """Cells, bytes and seconds of a plan, the latter from a short trial of the real sweep on this machine.

    The trial compiles what the run will then find in the cache, so the seconds are those of a run on a warm cache.
    """
    progress = progress or Progress()
    sweep = engine.prepare(plan, registry)
    rows_expected = sum(len(c.cells) * c.truths for c in sweep.batches)
    progress.stage("compiling", 1.0)
    loaded = engine.compile_kernels(sweep, progress.share)
    progress.stage("trying every stratum")
    rate = engine.trial_rates(sweep)
    sweeping = sum(c.evaluations / rate[c.stratum.name] for c in sweep.batches) / (jobs or cores())
    seconds = {
        "accuracy": LOAD_SECONDS * loaded + sweeping + ROW_SECONDS * rows_expected,
        "stability": sum(p.seconds(plan, jobs or cores()) for p in probes.chosen(plan)),
        "timing": plan.timing_budget if plan.timing else 0.0,
    }
    return Forecast(len(sweep.cells), rows_expected, sweep.evaluations, 90 * rows_expected + 200_000, seconds)
