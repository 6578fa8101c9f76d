"""An adapter of this machine in a study: what its formulas cost there, and how far it is off.

A GPU that is there is used, for some seconds, by every study that times; `--target gpu` asks for all that is known to
ask, and for a software adapter too, which is none and tells of no GPU. What goes wrong on a device becomes a note.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from phongbench.accuracy import device_errors
from phongbench.accuracy.probes.exhaustive import exponents, nearest_to
from phongbench.accuracy.sweep import Sweep
from phongbench.errors import InputError, LockedError, MeasurementError
from phongbench.formulas.formula import Formula
from phongbench.inputs.plan import Plan
from phongbench.results.schema import BASELINE, GPU
from phongbench.study.target_costs import named
from phongbench.support.progress import Progress
from phongbench.targets.code_shapes import Code, code
from phongbench.targets.webgpu.measure import LANGUAGE, GpuTimes, Measured
from phongbench.targets.webgpu.measure import measure as time_codes
from phongbench.targets.webgpu.programs import Context
from phongbench.targets.webgpu.session import Adapter, Session, why_not
from phongbench.timing.machine_lock import machine_lock
from phongbench.timing.timed_kernels import ALPHA

__all__ = ["LANGUAGE", "OnGpu", "measure", "wanted"]

#: seconds of the rounds of a study that did not ask for a GPU, and of one that did
SECONDS, SECONDS_ASKED = 3.0, 10.0
#: pairs of a stratum likewise
SAMPLES, SAMPLES_ASKED = 1 << 12, 1 << 14
#: formulas that are timed inside other work, the first that a study has of each
AROUND = ("phong", "gaussian:dot", "lyon:dot:8", "lyon:cross:8")
#: a formula and the exponent that its code is written for
_Codes = Mapping[tuple[Formula, float], Code]


@dataclass(frozen=True)
class OnGpu:
    """What a study found on an adapter.

    facts   what the manifest says of it
    rows    of costs.parquet
    errors  of accuracy.parquet
    """

    facts: Mapping[str, Any]
    rows: Sequence[Mapping[str, Any]]
    errors: pd.DataFrame


def wanted(plan: Plan) -> bool:
    """Whether a study looks for an adapter: it was asked for, or the study times, on whatever there is."""
    return GPU in plan.targets or (plan.timing and not plan.targets and why_not() is None)


def measure(sweep: Sweep, codes: _Codes, progress: Progress) -> OnGpu | None:
    """Times and errors on this machine's adapter; None where there is none, or only software that was not asked for."""
    asked = GPU in sweep.plan.targets
    try:
        with Session() as session:
            adapter = session.adapter()
            if adapter is None:
                raise InputError("there is no adapter", GPU, "install the driver of a GPU; the others go on")
            if adapter.software and not asked:
                return None
            progress.stage("measuring the GPU" if not adapter.software else "measuring the software adapter")
            return _measured(session, adapter, sweep, codes, progress)
    except (InputError, LockedError, MeasurementError) as problem:
        if asked or isinstance(problem, MeasurementError):
            progress.note(f"the GPU was not measured: {problem.what}")
        return None


def _measured(session: Session, adapter: Adapter, sweep: Sweep, codes: _Codes, progress: Progress) -> OnGpu:
    asked, plan = GPU in sweep.plan.targets, sweep.plan
    progress.note(f"gpu: {adapter.title}")
    stands = _stands(codes, every=asked)
    around = [one for name, one in stands.items() if name.rsplit(" ", 1)[0] in AROUND] if asked else []
    with machine_lock():
        seconds = SECONDS_ASKED if asked else SECONDS
        times = time_codes(session, adapter, list(stands.values()), around, seconds=seconds, seed=plan.seed)
    for name, why in times.refused.items():
        progress.note(f"the GPU refuses {name}: {why}")
    if times.twin != "unresolved":
        progress.note("the GPU told exact Phong from its twin: its times are not to be trusted")
    progress.stage("errors on the GPU")
    alphas = exponents(plan) if asked else nearest_to(plan.alphas)[-1:]
    samples = SAMPLES_ASKED if asked else SAMPLES
    errors = device_errors.measure(sweep, session, adapter, alphas, samples, thorough=asked)
    facts = {
        "adapter": adapter.title,
        "software": adapter.software,
        "tool": times.tool,
        "tool_version": times.tool_version,
        "rounds": times.rounds,
        "twin": times.twin,
        "refused": dict(times.refused),
    }
    return OnGpu(facts, list(rows(codes, times)), errors)


def _stands(codes: _Codes, *, every: bool) -> dict[str, Code]:
    """One code for each shape, by its name; without `every` only those on a pair of unit vectors by their cosine."""
    found: dict[str, Code] = {code(Formula(), ALPHA, LANGUAGE).shape: code(Formula(), ALPHA, LANGUAGE)}
    for (formula, _), one in codes.items():
        if every or (formula.lambda_form in ("none", "dot") and not formula.raw):
            found.setdefault(one.shape, one)
    return {one.name: one for one in list(found.values())[1:]}  # exact Phong is timed anyway


def rows(codes: _Codes, times: GpuTimes) -> Iterator[dict[str, Any]]:
    """Rows of costs.parquet: a row for each formula whose code was timed and context, then for what stands beside."""
    stands = {code(Formula(), ALPHA, LANGUAGE).shape: BASELINE}
    formulas: dict[str, list[dict[str, Any]]] = {}
    for (formula, alpha), one in codes.items():
        formulas.setdefault(stands.setdefault(one.shape, one.name), []).append(named(formula, alpha))
    for (name, context), timed in times.rows.items():
        ceiling = {**named(Formula(), ALPHA), "approximation": name}
        for about in formulas.get(name, [ceiling]):
            yield {**about, **_row(times, context, timed)}


def _row(times: GpuTimes, context: Context, timed: Measured) -> dict[str, Any]:
    return {
        "target": GPU,
        "cost_kind": "measured",
        "context": context.multiply_adds,
        "reads": context.reads,
        "unit": "ns",
        "cost": timed.ns,
        "over_dot": timed.over_dot,
        **timed.ratio.columns(),
        "tool": times.tool,
        "tool_version": times.tool_version,
    }
