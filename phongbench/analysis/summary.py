"""What a stored run holds, in short, as plain data."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from phongbench.analysis import kernel_times
from phongbench.analysis.by_target import PRECISION, answers
from phongbench.analysis.choices import Choices
from phongbench.analysis.lobes import beside_phong
from phongbench.analysis.mesh_edges import in_words, reaches
from phongbench.analysis.target_costs import checked
from phongbench.errors import InputError
from phongbench.results.formula_columns import FORMULA
from phongbench.results.records import Records, Row
from phongbench.results.runs import DEFAULT_ROOT, Run, remedy, require_rows, unfinished
from phongbench.results.schema import BASELINE, CPU

#: the exponent at which a fact on raw normals is given, or the measured one nearest to it
_EDGES_ALPHA = 128.0


#: what `answers` are for: one 8-bit code
BUDGET = 1 / 255


def summarise(run: Run, targets: Sequence[str] = (), root: Path = DEFAULT_ROOT) -> dict[str, Any]:
    """What a run holds, and its most accurate formulas, as plain data.

    targets     whose answers are wanted, too; UnknownNameError for one that is none
    root        the folder of the runs, in which measured targets were added

    facts       what it measured
    precision   that `best` is of
    best        for each exponent the most accurate formula of kind approximation
    mesh_edges  how wide a mesh's edges may be if its normals stay raw (see `mesh_edges.reaches`)
    lobes       what each formula's lobe sends off over Phong's (see `lobes.beside_phong`)
    answers     where targets are named: at each exponent the cheapest formula of each within BUDGET
    """
    wanted = [checked(target, None, root) for target in targets]
    plan, manifest, errors = run.plan, run.manifest, run.records("accuracy")
    facts = {
        "run": run.id,
        "state": manifest["state"],
        "path": str(run.path),
        "preset": plan.preset,
        "seed": plan.seed,
        "samples": plan.samples,
        "alphas": ", ".join(f"{a:g}" for a in plan.alphas),
        "gammas": ", ".join(map(str, plan.gammas)),
        "precisions": ", ".join(plan.precisions),
        "accuracy rows": len(errors),
        "timing rows": len(run.records("timing")),
        "seconds": manifest.get("seconds", {}),
    }
    facts |= {"swept": swept} if (swept := _swept(manifest)) else {}
    facts |= {"gpu": manifest["gpu"]["adapter"]} if "gpu" in manifest else {}
    facts |= {"note": f"{lacking}; {remedy(run)}"} if (lacking := unfinished(run)) else {}
    edges = reaches(run.records("meshes"))
    precision = "float32" if "float32" in plan.precisions else plan.precisions[-1]
    best = _best(errors.at(precision=precision))
    return {
        "facts": facts | _raw_normals(edges),
        "precision": precision,
        "best": best,
        "mesh_edges": edges,
        "lobes": beside_phong(run.records("moments")),
    } | ({"answers": _answers(run, wanted, root)} if wanted else {})


def _swept(manifest: Mapping[str, Any]) -> str | None:
    """By how many the sweep was measured, and how sure it is that they agree; None of one machine's."""
    if "cluster" in manifest:
        of = manifest["cluster"]
        again = f"{of['compared']} measured again by another, the same bits"
        return f"in {of['shards']} shards by {of['workers']} workers; {again}"
    return f"in {len(manifest['merged'])} shards, joined" if "merged" in manifest else None


def _answers(run: Run, targets: list[str], root: Path) -> list[dict[str, Any]]:
    """What to ship where; InputError for a run that has no errors in float32, or no times where they are asked for."""
    choices = Choices.of(require_rows(run))
    if not choices.mirrored.at(precision=PRECISION):
        raise InputError("the run has no errors in float32", run.id, "phongbench run --precision float32")
    if CPU in targets:
        kernel_times.timed(run)
    return [answer.as_dict() for answer in answers(choices, targets, choices.alphas, BUDGET, root)]


def _raw_normals(edges: list[dict[str, Any]]) -> dict[str, str]:
    """One fact on normals that are left raw: the widest edges within one code, in the cross form, at one exponent."""
    cross = [row for row in edges if row["lambda_form"] == "cross"]
    if not cross:
        return {}
    alpha = min((row["alpha"] for row in cross), key=lambda a: abs(math.log(a / _EDGES_ALPHA)))
    ways = {"classic": "R = 2(L.N)N-L", "lengthwise": "R = 2(N.L)N-(N.N)L", "half": "(N, H)"}
    found = {row["pair"]: in_words(row["degrees"], row["relation"]) for row in cross if row["alpha"] == alpha}
    far = ", ".join(f"{found[pair]} with {name}" for pair, name in ways.items() if pair in found)
    return {"raw normals": f"at alpha {alpha:g} change the cross form by one 8-bit code from edges of {far}"}


def _best(errors: Records) -> list[dict[str, Any]]:
    rows = errors.at(stratum="highlight", nonfinite=0, gated=True).rows([*FORMULA, "alpha", "max_abs", "codes_8bit"])
    meant = [row for row in rows if row["approximation"] != BASELINE]
    best: dict[float, Row] = {}
    for row in meant:
        known = best.setdefault(row["alpha"], row)["max_abs"]
        if row["max_abs"] is not None and (known is None or row["max_abs"] < known):
            best[row["alpha"]] = row
    return [
        {
            "alpha": float(row["alpha"]),
            "approximation": str(row["approximation"]),
            "lambda": str(row["lambda_form"]),
            "gamma": None if row["gamma"] is None else int(row["gamma"]),
            "beta policy": str(row["beta_policy"]),
            "max_abs": float(row["max_abs"]),
            "8-bit codes": float(row["codes_8bit"]),
        }
        for _, row in sorted(best.items())
    ]
