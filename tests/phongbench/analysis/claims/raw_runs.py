"""Made-up runs of recipes for raw vectors, with their errors and times."""

from pathlib import Path
from typing import ClassVar

from phongbench.formulas.formula import Formula
from phongbench.results.records import Records
from phongbench.results.schema import ACCURACY, TIMING

ALPHA = 50.0


def rows_of(formula, error, ratio, perturbations):
    f = Formula.parse(formula)
    key = {"approximation": f.approximation, "lambda_form": f.lambda_form, "space": f.space, "beta_policy": f.slope}
    key |= {"gamma": f.gamma, "precision": "float32", "recipe": f.recipe, "normalise": f.normalise}
    accuracy = [
        {**key, "alpha": ALPHA, "gated": True, "stratum": "configurations", "perturbation": p, "length_error": e}
        | {"truth": "angle", "samples": 1000, "max_abs": error, "nonfinite": 0, "coverage": "sampled"}
        for p, e in perturbations
    ]
    width = {"ratio": ratio, "ratio_low": 0.99 * ratio, "ratio_high": 1.01 * ratio, "ns_min": ratio / 2}
    timing = {**key, "beta_policy": "none", "working_set": "l1", "threads": 1, **width}
    return accuracy, timing


class MadeUp:
    """A run of made-up rows: recipes with their errors and times."""

    id, path, complete = "made-up", Path("made-up"), True
    manifest: ClassVar = {"provenance": {}}

    def __init__(self, recipes, perturbations=(("none", 0.0), ("both", 0.01), ("both", -0.01), ("any", 999.0))):
        both = [rows_of(name, error, ratio, perturbations) for name, (error, ratio) in recipes.items()]
        filled = {name: 0.0 for name in ACCURACY.names if ACCURACY.types[name] == "float64"}
        counts = {name: 0 for name in ACCURACY.names if ACCURACY.types[name] == "int64"}
        self.accuracy = ACCURACY.frame([filled | counts | row for rows, _ in both for row in rows])
        pairs = [rows_of(name, 0.0, ratio, ())[1] for name, ratio in (("phong", 1.0), ("phong/once", 1.8))]
        empty = {
            name: 0.0 if kind == "float64" else 0 for name, kind in TIMING.types.items() if kind in ("float64", "int64")
        }
        self.timing = TIMING.frame([empty | {"verdict": ""} | row for row in [*(t for _, t in both), *pairs]])

    def records(self, name):
        """As of a stored run."""
        return Records.of(getattr(self, name))
