"""What a plan would take, from a short trial of the real sweep; nothing is stored."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from phongbench.accuracy import probes, sweep
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Approximation
from phongbench.inputs.plan import Plan
from phongbench.study.target_costs import checked
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
        return asdict(self) | {"seconds": {stage: round(value, 1) for stage, value in self.seconds.items()}}


def forecast(
    plan: Plan,
    registry: Mapping[str, Approximation] = REGISTRY,
    jobs: int | None = None,
    progress: Progress | None = None,
) -> Forecast:
    """Cells, bytes and seconds of a plan, the latter from a short trial of the real sweep on this machine.

    The trial compiles what the run will then find in the cache, so the seconds are those of a run on a warm cache.
    """
    checked(plan.targets)
    progress, jobs = progress or Progress(), jobs or cores()
    prepared = sweep.prepare(plan, registry)
    rows = sum(len(batch.cells) * batch.truths for batch in prepared.batches)
    progress.stage("compiling", 1.0)
    loaded = sweep.compile_kernels(prepared, progress.share)
    progress.stage("trying every stratum")
    rates = sweep.trial_rates(prepared)
    sweeping = sum(batch.evaluations / rates[batch.stratum.name] for batch in prepared.batches) / jobs
    seconds = {
        "accuracy": LOAD_SECONDS * loaded + sweeping + ROW_SECONDS * rows,
        "stability": sum(probe.seconds(plan, jobs) for probe in probes.chosen(plan)),
        "timing": plan.timing_budget if plan.timing else 0.0,
    }
    return Forecast(len(prepared.cells), rows, prepared.evaluations, 90 * rows + 200_000, seconds)
