"""What every lobe sends where, and where it is cut off: of the formula itself, in float64 on unit vectors.

Moments are those of `formulas.lobe_moments` for every formula and exponent of the study. Cuts are looked for at small
exponents, whatever those of the study are: a lobe that is still bright at the angle from which its value is 0 shows an
edge there.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.compiler.precisions import Array
from phongbench.errors import InputError
from phongbench.formulas import curves, lobe_laws, lobe_moments
from phongbench.formulas.formula import Formula
from phongbench.formulas.lobe_moments import Moments
from phongbench.formulas.registry import guarded
from phongbench.formulas.spec import Approximation
from phongbench.inputs.plan import Plan
from phongbench.results.schema import CUTS, MOMENTS

#: of the light, in degrees from the normal: along it, and towards the angles where the horizon cuts every lobe
INCIDENCES = (0.0, 30.0, 60.0, 75.0, 85.0, 89.0)
#: exponents at which cuts are looked for
CUT_ALPHAS = (0.0, 0.1, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0, 20.0)
#: angles of a degree between R and V at which a cut is looked for
_PER_DEGREE = 8
#: how far a law and the quadrature may differ, relatively: ten times what panels with a corner inside are off
_AGREED = 1e-4


def measure(context: ProbeContext) -> Mapping[str, pd.DataFrame]:
    """The tables `moments` and `cuts`."""
    cells = [cell for position, cell in enumerate(context.sweep.cells) if position not in context.sweep.failures]
    # how lengths are removed, and how a pair is made, changes nothing on unit vectors
    pairs = dict.fromkeys((c.formula, c.alpha) for c in cells if not c.formula.raw)
    studied = [pair for pair in pairs if takes(*pair, context.registry)]
    known: dict[Any, Moments] = {}
    rows: list[dict[str, Any]] = []
    for formula, alpha in studied:
        spec = context.registry[formula.approximation]
        # on unit vectors both forms are the same number
        form = "dot" if formula.lambda_form == "difference" and "dot" in spec.lambda_forms else formula.lambda_form
        key = (formula.approximation, form, formula.gamma, formula.slope, formula.space, alpha)
        if key not in known:
            with guarded(spec):
                known[key] = lobe_moments.moments(spec, form, formula.setting(alpha), INCIDENCES)
        rows += moment_rows(formula, spec, alpha, INCIDENCES, known[key])
        context.advance(0.8 / len(studied))
    context.violations += disagreements(rows)
    cuts = [row for formula in first_forms(f for f, _ in studied) for row in cut_rows(formula, context.registry)]
    context.advance(0.2)
    return {"moments": MOMENTS.frame(rows), "cuts": CUTS.frame(cuts)}


def takes(formula: Formula, alpha: float, registry: Mapping[str, Approximation]) -> bool:
    """False for an exponent outside the formula's range, at which a sweep may measure it all the same."""
    try:
        formula.check(alpha, registry)
    except InputError:
        return False
    return True


def moment_rows(
    formula: Formula, spec: Approximation, alpha: float, incidences: tuple[float, ...], found: Moments
) -> Iterator[dict[str, Any]]:
    """The rows of a lobe: one for each incidence, the closed forms beside those of light along the normal."""
    setting, measured = formula.setting(alpha), lobe_moments.beside_exact(found, alpha, incidences)
    own = columns(formula, alpha) | {"beta": float(spec.coefficients(setting).get("beta", math.nan))}
    laws = lobe_laws.of(spec, formula.lambda_form, setting)
    for k, degrees in enumerate(incidences):
        energy_law, momentum_law = laws if degrees == 0 else (math.nan, math.nan)
        row = own | {name: column[k] for name, column in measured.items()}
        yield row | {"incidence_degrees": degrees, "energy_law": energy_law, "momentum_law": momentum_law}


def disagreements(rows: Iterable[Mapping[str, Any]]) -> list[str]:
    """Sentences on rows whose integrals are not those of their closed forms."""
    return [
        f"{name} of {row['approximation']} ({row['lambda_form']}) at alpha {row['alpha']:g} is {row[name]:.9g} by "
        f"quadrature and {row[f'{name}_law']:.9g} by its closed form"
        for row in rows
        for name in ("energy", "momentum")
        if abs(row[name] / row[f"{name}_law"] - 1) > _AGREED
    ]


def first_forms(formulas: Iterable[Formula]) -> list[Formula]:
    """Of formulas that differ in their lambda form or slope only, the first."""
    first: dict[Any, Formula] = {}
    for formula in formulas:
        first.setdefault((formula.approximation, formula.gamma, formula.space), formula)
    return list(first.values())


def cut_rows(formula: Formula, registry: Mapping[str, Approximation]) -> Iterator[dict[str, Any]]:
    """Where the lobe ends at each of CUT_ALPHAS that the formula takes, and how bright it is a degree before."""
    spec = registry[formula.approximation]
    for alpha in CUT_ALPHAS:
        try:
            with guarded(spec):
                formula.check(alpha, registry)
                values = curves.curve(spec, formula.lambda_form, formula.setting(alpha), circle())
        except InputError:  # the study did not ask for this exponent: a formula may well refuse it, or fail
            continue
        end, step = cut(values)
        yield columns(formula, alpha) | {
            "cut_degrees": end,
            "step": step,
            "codes": 255 * step,
            "at_90": float(values[90 * _PER_DEGREE]),
        }


def circle() -> Array:
    """Cosines of the angles between R and V from 0 to 180 degrees, exactly 0 at 90."""
    cosine = np.cos(np.radians(np.arange(180 * _PER_DEGREE + 1) / _PER_DEGREE))
    cosine[90 * _PER_DEGREE] = 0.0
    return cosine


def cut(values: Array) -> tuple[float, float]:
    """The angle in degrees from which the values of `circle` are 0, and the value a degree before; NaN if it is 180."""
    lit = np.flatnonzero(values != 0)
    end = int(lit[-1]) + 1 if len(lit) else 0
    if end >= len(values) - 1:
        return math.nan, math.nan
    return end / _PER_DEGREE, float(values[max(0, end - _PER_DEGREE)])


def columns(formula: Formula, alpha: float) -> dict[str, Any]:
    """What identifies a formula at an exponent in the tables of probes."""
    return {
        "approximation": formula.approximation,
        "lambda_form": formula.lambda_form,
        "space": formula.space,
        "beta_policy": str(formula.slope),
        "alpha": alpha,
        "gamma": formula.gamma,
    }


def seconds(plan: Plan, jobs: int) -> float:
    """Measured: 0.27 ms a formula and exponent; every form is a cell twice, in each precision."""
    return 2.7e-4 * sum(1 for _ in plan.cells()) / (2 * len(plan.precisions))
