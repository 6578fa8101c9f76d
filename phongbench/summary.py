"""Short answers from a stored run, and descriptions of the registry, as plain data."""

from typing import Any

from phongbench.approximations import example
from phongbench.results import Run
from phongbench.spec import Approximation


def describe(spec: Approximation) -> dict[str, Any]:
    """An approximation as plain data: what the command line and the service tell of it."""
    return {
        "name": spec.name,
        "title": spec.title,
        "kind": spec.kind,
        "formula": spec.formula,
        "lambda_forms": list(spec.lambda_forms),
        "spaces": list(spec.spaces),
        "beta_policies": list(spec.slopes),
        "parameters": [
            {"name": p.name, "meaning": p.meaning, "low": p.low, "high": p.high, "unit": p.unit, "whole": p.whole}
            for p in spec.parameters
        ],
        "domain": spec.domain,
        "cost": spec.cost.text,
        "support": _support(spec),
        "source": spec.source.citation,
    }


def _support(spec: Approximation) -> dict[str, Any] | None:
    """Where the formula is exactly 0, by the example of one setting; None where it never is."""
    if spec.cutoff is None:
        return None
    setting = example(spec)
    return {"alpha": setting.alpha, "gamma": setting.gamma, "zero_beyond_lambda": spec.cutoff(setting)}


def summarise(run: Run) -> dict[str, Any]:
    """What a run measured (`facts`), and for each exponent the most accurate formula of kind approximation (`best`)."""
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
    return {"facts": facts, "best": _best(run)}


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
