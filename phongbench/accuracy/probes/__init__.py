"""What a study asks beyond the sweep, each question a probe: one module, one line in PROBES.

A probe runs after the sweep and before the timing. It returns rows for tables of its own, or further rows for
accuracy and worst.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import pandas as pd

from phongbench.accuracy.probes import (
    contracts,
    emitted,
    exhaustive,
    hostile_inputs,
    incidence,
    inverse,
    lobes,
    meshes,
    search,
    smoothness,
    truth_check,
)
from phongbench.accuracy.probes.certify import bounds
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.inputs.plan import Plan


@dataclass(frozen=True)
class Probe:
    """One question about numerical behaviour.

    name      what plans and `--probe` call it; one of plan.PROBE_NAMES
    title     what a progress bar says while it runs
    measure   ProbeContext -> {table: rows}, tables of the schema; rows of accuracy and worst follow the sweep's
    seconds   (Plan, jobs) -> seconds that it will take on this machine, for the forecast; compiled and loaded
    """

    name: str
    title: str
    measure: Callable[[ProbeContext], Mapping[str, pd.DataFrame]]
    seconds: Callable[[Plan, int], float]


def _drawn(context: ProbeContext) -> Mapping[str, pd.DataFrame]:
    from phongbench.accuracy.probes import pictures  # late: few plans ask for it, and all that draws comes with it

    return pictures.measure(context)


def _drawing_seconds(plan: Plan, jobs: int) -> float:
    from phongbench.accuracy.probes import pictures

    return pictures.seconds(plan, jobs)


#: in the order in which they run
PROBES: tuple[Probe, ...] = (
    Probe("cosines", "measuring every cosine", exhaustive.measure, exhaustive.seconds),
    Probe("search", "searching for worse", search.measure, search.seconds),
    Probe("certify", "proving bounds", bounds.measure, bounds.seconds),
    Probe("contract", "bounding devices", contracts.measure, contracts.seconds),
    Probe("emitted", "measuring written code", emitted.measure, emitted.seconds),
    Probe("meshes", "measuring interpolated normals", meshes.measure, meshes.seconds),
    Probe("hostile", "hostile inputs", hostile_inputs.measure, hostile_inputs.seconds),
    Probe("smoothness", "smoothness of the lobes", smoothness.measure, smoothness.seconds),
    Probe("incidence", "reflectance against incidence", incidence.measure, incidence.seconds),
    Probe("lobes", "integrating the lobes", lobes.measure, lobes.seconds),
    Probe("inverse", "inverting pictures", inverse.measure, inverse.seconds),
    Probe("scenes", "drawing scenes", _drawn, _drawing_seconds),
    # the last: it looks at the worst inputs that all others left
    Probe("recheck", "checking the truth at 50 digits", truth_check.measure, truth_check.seconds),
)


def chosen(plan: Plan) -> tuple[Probe, ...]:
    """The probes that a plan asks for, in order."""
    return tuple(p for p in PROBES if p.name in plan.probes)
