"""Generated parts as Markdown: tables, picture and sentences of a run, by the report's own code."""

from collections.abc import Mapping
from typing import Any

from phongbench.analysis.by_target import targets_of
from phongbench.analysis.claims import judge
from phongbench.analysis.claims.claim import UNMEASURED
from phongbench.analysis.ready_code import ready_code
from phongbench.analysis.rows import Rows, at, nearest
from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.inputs.plan import preset
from phongbench.results.runs import Run
from phongbench.results.schema import BASELINE, CEILINGS, TWIN
from phongbench_reports.figures import speed as speed_figure
from phongbench_reports.glossary import WORDS, chips, names
from phongbench_reports.plots import Plate, ink
from phongbench_reports.readme.markdown import table
from phongbench_reports.table import Absent
from phongbench_reports.tables.by_target import by_target as by_target_table
from phongbench_reports.tables.verdict import verdict as verdict_table
from phongbench_reports.text import BUDGETS, INTERVAL, alpha_is, number, ratio, records

#: targets of the first table: this machine, and one of each kind of chip that is compiled for
TARGETS = ("cpu", "gcn4", "rdna2", "sm89", "cortex-m7")
#: exponents of the verdict table, the nearest ones of the run; the report has them all
ALPHAS = (10.0, 20.0, 50.0, 100.0, 200.0, 1000.0)
_CACHES = (("L1", "l1"), ("L2", "l2"), ("last level", "last"))
_PACKAGES = ("Python", "NumPy", "numba", "llvmlite", "phongbench")


def by_target(study: Rows) -> str:
    """What to ship within 1/255 on TARGETS, as many as the run has costs of."""
    targets = [target for target in TARGETS if target in targets_of(study.choices)]
    content = by_target_table(study, *BUDGETS[0], targets)
    if isinstance(content, Absent):
        return f"{content.reason} {content.fix}"
    rows = [(alpha, *(_as_code(cell) for cell in cells)) for alpha, *cells in content.rows]
    return f"{table(content.headings, rows, right=content.numeric)}\n\n{content.takeaway}\n({content.basis}.)"


def _as_code(cell: str) -> str:
    """A cell with its formula as code."""
    name, comma, ratio = cell.partition(", ")
    return f"`{name}` {ratio}" if comma else cell


def verdict(study: Rows) -> str:
    """The report's verdict table, times on this machine, at a few exponents."""
    budget, name = BUDGETS[0]
    content = verdict_table(study, study.precision, budget, name)
    if isinstance(content, Absent) or study.timing.empty:
        raise InputError(
            "the run has no timing", str(study.run.path), "the README needs a run made without --no-timing"
        )
    wanted = {nearest(study.alphas, alpha) for alpha in ALPHAS}
    rows = [row for row, alpha in zip(content.rows, content.data["alpha"], strict=True) if alpha in wanted]
    return f"{table(content.headings, rows, right=content.numeric)}\n\n{content.takeaway}\n({content.basis}.)"


def shader(study: Rows) -> str:
    """The verdict for one exponent as shader code."""
    content = verdict_table(study, study.precision, *BUDGETS[0])
    best = {} if isinstance(content, Absent) else records(at(content.data, alpha=study.alpha))[0]
    if not best.get("approximation"):
        return f"No formula is within {BUDGETS[0][1]} at {alpha_is(study.alpha)}."
    formula = Formula.of_row(best)
    return f"```glsl\n{ready_code(formula, study.alpha).text}```"


def claims(run: Run) -> str:
    """The textbook claims that the run judges, with verdict and reason, and how many it leaves open."""
    judged = judge(run)
    lines = [(f"{j.claim.key}) {j.claim.title}", j.verdict, j.because) for j in judged if j.verdict != UNMEASURED]
    left = len(judged) - len(lines)
    rest = f"\n\n{left} more need what this run did not measure." if left else ""
    return f"{table(('claim', 'verdict', 'result'), lines)}{rest}"


def glossary(study: Rows) -> str:
    """The words of the first screen, with the names of formulas and targets that its table holds."""
    content = by_target_table(study, *BUDGETS[0], TARGETS)
    named: Any = {} if isinstance(content, Absent) else content.data
    formulas = names(name for name in named.get("name", ()) if name)
    rows = [*WORDS.items(), ("names", formulas), ("chips", chips(dict.fromkeys(named.get("target", ()))))]
    return table(("word", "meaning"), [row for row in rows if row[1]])


def speed(study: Rows) -> str:
    """Times as ratios to exact Phong for each working set; of most formulas the cheapest lambda form only."""
    rows = speed_figure.rows_of(study)
    rows = rows[~rows["approximation"].isin(CEILINGS)]
    rows = rows[rows["lambda_form"].isin(["dot", "none"]) | (rows["approximation"] == "lyon")]
    kernel = ["approximation", "lambda_form", "gamma", "working_set"]
    # lyon on (N, H) runs the code of lyon on (R, V) and was timed once
    rows = rows.sort_values("space", ascending=False, kind="stable").drop_duplicates(kernel)
    sets = [name for name in speed_figure.SETS if (rows["working_set"] == name).any()]
    ratios = {(row["label"], row["working_set"]): _ratio(row) for row in records(rows)}
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
    sentence, basis = (plate.takeaway, plate.basis) if isinstance(plate, Plate) else (plate.reason, "")
    shown = table(headings, lines, right=range(1, len(headings)))
    note = f"{study.precision}, {basis}; in brackets the {INTERVAL} of the ratio."
    return f"{shown}\n\n{sentence} {_twin(study)}\n({note})"


def _twin(study: Rows) -> str:
    """How the baseline compared with itself: what an interval of this run is worth."""
    twins = at(study.timing, approximation=TWIN, precision=study.precision, working_set=study.working_set)
    results = " and ".join(f"{_ratio(row)}: {row['verdict']}" for row in records(twins))
    return f"The A/A twin, exact Phong once more under another name, came out at {results}."


def _ratio(row: Mapping[str, Any]) -> str:
    return "1" if row["approximation"] == BASELINE else ratio(row)


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
