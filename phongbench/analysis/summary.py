"""What a stored run holds, in short, as plain data."""

import math
from typing import Any

import pandas as pd

from phongbench.analysis.front import records
from phongbench.analysis.lobes import beside_phong
from phongbench.analysis.mesh_edges import in_words, reaches
from phongbench.results.runs import FINISH, Run, unfinished

#: the exponent at which a fact on raw normals is given, or the measured one nearest to it
_EDGES_ALPHA = 128.0


def summarise(run: Run) -> dict[str, Any]:
    """What a run holds, and its most accurate formulas, as plain data.

    facts       what it measured
    precision   that `best` is of
    best        for each exponent the most accurate formula of kind approximation
    mesh_edges  how wide a mesh's edges may be if its normals stay raw (see `mesh_edges.reaches`)
    lobes       what each formula's lobe sends off over Phong's (see `lobes.beside_phong`)
    """
    plan, manifest, frame = run.plan, run.manifest, run.accuracy
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
        "accuracy rows": len(frame),
        "timing rows": len(run.timing),
        "seconds": manifest.get("seconds", {}),
    }
    facts |= {"note": f"{lacking}; {FINISH}"} if (lacking := unfinished(run)) else {}
    edges = [] if run.meshes.empty else records(reaches(run.meshes))
    precision = "float32" if "float32" in plan.precisions else plan.precisions[-1]
    best = _best(frame[frame["precision"] == precision])
    return {
        "facts": facts | _raw_normals(edges),
        "precision": precision,
        "best": best,
        "mesh_edges": edges,
        "lobes": beside_phong(run.moments),
    }


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


def _best(frame: pd.DataFrame) -> list[dict[str, Any]]:
    meant = (frame["stratum"] == "highlight") & (frame["approximation"] != "phong") & (frame["nonfinite"] == 0)
    rows = frame[meant & frame["gated"]].sort_values(["alpha", "max_abs"], kind="stable").drop_duplicates("alpha")
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
        for row in records(rows)
    ]
