"""Short answers from a stored run, and descriptions of the registry, as plain data."""

import math
from typing import Any

import pandas as pd

from phongbench.analysis.mesh_edges import in_words, reaches
from phongbench.results.runs import Run

#: the exponent at which one line tells of raw normals, or the measured one nearest to it
_EDGES_ALPHA = 128.0


def summarise(run: Run) -> dict[str, Any]:
    """What a run holds and found, as plain data.

    facts       what it measured
    best        for each exponent the most accurate formula of kind approximation
    mesh_edges  how wide a mesh's edges may be if its normals stay raw (see `edges.reaches`); empty without such rows
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
    edges = [] if run.meshes.empty else _plain(reaches(run.meshes))
    return {"facts": facts | _raw_normals(edges), "best": _best(run), "mesh_edges": edges}


def _plain(rows: pd.DataFrame) -> list[dict[str, Any]]:
    return [{str(name): value for name, value in row.items()} for row in rows.to_dict("records")]


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


def _best(run: Run) -> list[dict[str, Any]]:
    frame = run.accuracy
    rows = frame[(frame["stratum"] == "highlight") & frame["gated"] & (frame["approximation"] != "phong")]
    rows = rows[rows["precision"] == ("float32" if "float32" in run.plan.precisions else run.plan.precisions[-1])]
    rows = (
        rows[rows["nonfinite"] == 0]
        .sort_values(["alpha", "max_abs"], kind="stable")
        .groupby("alpha", sort=True)
        .head(1)
    )
    return [
        {
            "alpha": float(r["alpha"]),
            "approximation": str(r["approximation"]),
            "lambda": str(r["lambda_form"]),
            "gamma": None if r["gamma"] is None or r["gamma"] != r["gamma"] else int(r["gamma"]),
            "beta policy": str(r["beta_policy"]),
            "max_abs": float(r["max_abs"]),
            "8-bit codes": float(r["codes_8bit"]),
        }
        for r in rows.astype(object).where(rows.notna(), None).to_dict("records")
    ]
