"""The generated parts of README.md as Markdown: tables, picture and sentences of a run, by the report's own code."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import pandas as pd

from phongbench.analysis.claims import judge
from phongbench.analysis.claims.claim import UNMEASURED
from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.formulas.shader_code import export
from phongbench.inputs.plan import preset
from phongbench.results.runs import Run
from phongbench_reports.cuts import CEILINGS, HEADLINE_ALPHA, TWIN, Absent, Study, nearest
from phongbench_reports.figures import front as front_figure
from phongbench_reports.figures import speed as speed_figure
from phongbench_reports.plots import Plate, ink, svg_pair
from phongbench_reports.readme.markdown import picture, slim, table
from phongbench_reports.tables.verdict import verdict as verdict_table
from phongbench_reports.text import BUDGETS, number, records

#: exponents of the verdict table, the nearest ones of the run; the report has them all
ALPHAS = (10.0, 20.0, 50.0, 100.0, 200.0, 1000.0)
_CACHES = (("L1", "l1"), ("L2", "l2"), ("last level", "last"))
_PACKAGES = ("Python", "NumPy", "numba", "llvmlite", "phongbench")


@dataclass(frozen=True)
class _Cut:
    """A run with other accuracy rows: the attributes of phongbench.results.runs.Run that figures read."""

    path: Path
    manifest: Mapping[str, Any]
    accuracy: pd.DataFrame
    timing: pd.DataFrame
    worst: pd.DataFrame


def verdict(study: Study) -> str:
    """The report's verdict table within 1/255, at a few exponents."""
    budget, name = BUDGETS[0]
    found = verdict_table(study, study.precision, budget, name)
    if isinstance(found, Absent) or study.timing.empty:
        raise InputError(
            "the run has no timing", str(study.run.path), "the README needs a run made without --no-timing"
        )
    wanted = {nearest(study.alphas, alpha) for alpha in ALPHAS}
    rows = [row for row, alpha in zip(found.rows, found.data["alpha"], strict=True) if alpha in wanted]
    shown = table(found.headings, rows, right=sorted(found.numeric))
    return f"{shown}\n\n{found.takeaway}\n({found.basis}.)"


def shader(study: Study) -> str:
    """The verdict for one exponent as shader code."""
    found = verdict_table(study, study.precision, *BUDGETS[0])
    alpha = nearest(study.alphas, HEADLINE_ALPHA)
    best = {} if isinstance(found, Absent) else records(found.data[found.data["alpha"] == alpha])[0]
    if not best.get("approximation"):
        return f"No formula is within {BUDGETS[0][1]} at α = {alpha:g}."
    written = export.shader(Formula.of_row(best), alpha)
    return f"```glsl\n{written.text}```"


def claims(run: Run) -> str:
    """The textbook claims that the run judges, with verdict and reason; how many it does not."""
    judged = judge(run)
    lines = [(f"{j.claim.key}) {j.claim.title}", j.verdict, j.because) for j in judged if j.verdict != UNMEASURED]
    left = len(judged) - len(lines)
    rest = f"\n\n{left} more take what this run did not measure." if left else ""
    return f"{table(('claim', 'verdict', 'what was found'), lines)}{rest}"


def front(study: Study) -> tuple[str, dict[str, bytes]]:
    """The front at one exponent as a picture for light and dark pages, and the two files it shows."""
    alpha = nearest(study.alphas, HEADLINE_ALPHA)
    run = study.run
    rows = study.accuracy[study.accuracy["alpha"] == alpha]
    with ink():
        plate = front_figure.draw(Study(cast(Run, _Cut(run.path, run.manifest, rows, run.timing, run.worst))))
        if isinstance(plate, Absent):
            raise InputError(plate.reason.rstrip("."), str(run.path), plate.fix.rstrip("."))
        light, dark = map(slim, svg_pair(plate.figure, "front"))
    files = {"front.svg": light, "front-dark.svg": dark}
    return picture("front", plate), files


def speed(study: Study) -> str:
    """Times as ratios to exact Phong for each working set; of most formulas the cheapest lambda form only."""
    rows = speed_figure.rows_of(study)
    rows = rows[~rows["approximation"].isin(CEILINGS)]
    rows = rows[rows["lambda_form"].isin(["dot", "none"]) | (rows["approximation"] == "lyon")]
    kernel = ["approximation", "lambda_form", "gamma", "working_set"]
    # lyon on (N, H) runs the code of lyon on (R, V) and was timed once
    rows = rows.sort_values(["space"], ascending=False, kind="stable").drop_duplicates(kernel)
    sets = [name for name in speed_figure.SETS if (rows["working_set"] == name).any()]
    ratios = {(row["label"], row["working_set"]): _interval(row) for row in records(rows)}
    first = rows[rows["working_set"] == sets[0]].sort_values(["ratio", "label"], kind="stable")
    names = [speed_figure.SETS[name] for name in sets]
    headings = (
        "formula",
        f"ns, {names[0]}",
        *(f"/ exact Phong, {name}" for name in names),
        f"/ dot product, {names[0]}",
    )
    lines = [
        (
            row["label"],
            number(row["ns_min"]),
            *(ratios.get((row["label"], s), "–") for s in sets),
            number(row["dot_ratio"]),
        )
        for row in records(first)
    ]
    with ink():
        plate = speed_figure.draw(study)
    told = plate.takeaway if isinstance(plate, Plate) else plate.reason
    basis = plate.basis if isinstance(plate, Plate) else ""
    shown = table(headings, lines, right=range(1, len(headings)))
    return f"{shown}\n\n{told} {_twin(study)}\n({study.precision}, {basis}; in brackets the interval of the ratio.)"


def _twin(study: Study) -> str:
    """How the baseline compared with itself: what an interval of this run is worth."""
    twins = study.at(study.timing, approximation=TWIN, precision=study.precision, working_set=study.working_set)
    found = " and ".join(f"{_interval(row)}: {row['verdict']}" for row in records(twins))
    return f"The A/A twin, exact Phong once more under another name, came out at {found}."


def _interval(row: Mapping[str, Any]) -> str:
    if row["approximation"] == "phong":
        return "1"
    return f"{number(row['ratio'])} ({number(row['ratio_low'])} to {number(row['ratio_high'])})"


def machine(run: Run) -> str:
    """Machine, versions and plan of the run, in one paragraph."""
    manifest, plan = run.manifest, run.plan
    m, versions, flags = (manifest["provenance"][key] for key in ("machine", "versions", "flags"))
    caches = ", ".join(f"{name} {_bytes(m['caches'][key])}" for name, key in _CACHES)
    kind = "a virtual machine" if m["hypervisor"] else "no virtual machine"
    packages = ", ".join(f"{name} {versions[name.lower()]}" for name in _PACKAGES)
    changed = "" if plan == preset(plan.preset).validated() else ", changed by options"
    return (
        f"{m['cpu']} ({m['architecture']}, {kind}), {m['cores']} cores, {m['threads']} threads, caches {caches}, "
        f"{flags['vector_bits']}-bit vectors, {m['system']}. {packages}. Preset {plan.preset}{changed}: "
        f"{len(plan.alphas)} exponents, {number(plan.samples)} pairs for each cell and stratum, seed {plan.seed}, "
        f"code {manifest['code']}."
    )


def _bytes(size: int) -> str:
    return f"{size >> 20} MiB" if size >= 1 << 20 else f"{size >> 10} KiB"
