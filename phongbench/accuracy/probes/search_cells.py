"""Which cells are searched, over which lengths of vectors, and what of their samples a search begins with."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from phongbench.accuracy.probes.consistency import VECTORS
from phongbench.accuracy.probes.exhaustive import COSINES, exponents
from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.compiler.lowering import FLOAT32, FLOAT64
from phongbench.compiler.precisions import Array
from phongbench.formulas.recipes import PAIR
from phongbench.inputs.plan import Cell, Plan
from phongbench.results.frames import with_raw

#: domains of formulas that remove lengths: lengths up to so many times 1, or as short; quick takes the last
LONGEST = (2.0, 1000.0)
#: strata that are no samples of unit vectors, lengths first
NOT_UNIT = ("lengths", "hostile", VECTORS)
#: the domain, as `domains` gives it, and positions of cells
Family = tuple[float, Sequence[int]]


def wanted(plan: Plan, cell: Cell, closely: Sequence[float]) -> bool:
    """False for ungated cells, and for float64, whose rounding is the truth's own; quick searches float32 if it can."""
    only = FLOAT32.name if plan.preset == "quick" and FLOAT32.name in plan.precisions else cell.precision
    chosen = cell.alpha in closely and cell.formula.space in plan.length_spaces and cell.formula.recipe == PAIR
    return chosen and cell.gated and cell.precision != FLOAT64.name and cell.precision == only


def domains(plan: Plan, cell: Cell) -> tuple[float, ...]:
    """How many times as long, or short, as 1 the cell's vectors may be; 1 where they must be nearly unit."""
    if not cell.formula.raw:
        return (1.0,)
    return LONGEST[-1:] if plan.preset == "quick" else LONGEST


def families(context: ProbeContext) -> list[Family]:
    """Domains, and positions of the cells that differ in alpha alone, ascending: each is seeded by the one before."""
    members: dict[tuple[Any, ...], list[int]] = {}
    closely = exponents(context.plan)
    for position, cell in enumerate(context.sweep.cells):
        if wanted(context.plan, cell, closely) and position not in context.sweep.failures:
            for longest in domains(context.plan, cell):
                members.setdefault((longest, cell.formula, cell.precision), []).append(position)
    return [(key[0], sorted(family, key=lambda p: context.sweep.cells[p].alpha)) for key, family in members.items()]


def key_of(cell: Cell) -> tuple[Any, ...]:
    """What identifies a cell in the table of worst inputs."""
    f = cell.formula
    own = f.approximation, f.lambda_form, f.space, f.slope, cell.alpha, f.gamma or 0, cell.precision, cell.gated
    return *own, f.normalise


def stored(worst: pd.DataFrame, but: Sequence[str]) -> dict[tuple[Any, ...], list[Array]]:
    """The stored worst inputs, by cell: (error, exact, value, a, b) each; but those of some strata.

    Those of the stratum `cosines` are none of the domain's, but near one: they seed, and count for nothing (-1).
    """
    if worst.empty:
        return {}
    worst = with_raw(worst)
    unit = worst[~worst["stratum"].isin(but) & (worst["truth"] == "angle") & (worst["recipe"] == PAIR)]
    names = ["approximation", "lambda_form", "space", "beta_policy", "alpha", "gamma", "precision", "gated"]
    names.append("normalise")
    keys = zip(*((unit[n].fillna(0) if n == "gamma" else unit[n]).tolist() for n in names), strict=True)
    numbers = np.array(unit[["error", "exact", "value"]], float)
    numbers[(unit["stratum"] == COSINES.name).to_numpy()] = -1.0
    pairs = np.array([[*map(float.fromhex, unit[c].tolist())] for c in ("ax", "ay", "az", "bx", "by", "bz")]).T
    inputs: dict[tuple[Any, ...], list[Array]] = {}
    for key, number, pair in zip(keys, numbers, pairs.reshape(-1, 6), strict=True):
        inputs.setdefault(tuple(key), []).append(np.concatenate([number, pair]))
    return inputs
