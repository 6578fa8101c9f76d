"""A stored run in a line, by its manifest alone."""

from dataclasses import replace
from typing import Any

from phongbench.inputs.plan import PRESETS
from phongbench.results.runs import Run


def listed(run: Run) -> dict[str, Any]:
    """A run in a line, as plain data.

    study   the preset, or `custom` where the plan differs from it in what it measures
    timed   whether it has times
    bytes   of its tables
    """
    plan, files = run.plan, run.manifest["files"]
    usual = PRESETS.get(plan.preset)
    same = usual is not None and replace(plan, seed=usual.seed) == usual.validated()
    return {
        "run": run.id,
        "state": run.manifest["state"],
        "preset": plan.preset,
        "path": str(run.path),
        "study": plan.preset if same else "custom",
        "alphas": list(plan.alphas),
        "precisions": list(plan.precisions),
        "timed": bool(files.get("timing.parquet", {}).get("rows", 0)),
        "bytes": sum(file["bytes"] for file in files.values()),
    }
