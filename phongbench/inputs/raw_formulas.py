"""Formulas for raw vectors that presets measure: ways of removing lengths, and recipes from N, L and V."""

import re
from collections.abc import Iterable, Sequence
from typing import Protocol

from phongbench.errors import InputError
from phongbench.formulas.formula import Formula, Registry

#: what is measured of each way to normalise, where a pair of any lengths is given
NORMALISED = (
    "phong/each",
    "phong/once",
    "phong/squared",
    "phong/fast",
    "phong/estimate",
    "gaussian:dot:minimax/each",
    "gaussian:dot:minimax/once",
    "gaussian:difference:minimax/each",
    "gaussian:cross:minimax/once",
    "lyon:dot:8:minimax/each",
    "lyon:dot:8:minimax/once",
    "lyon:difference:8:minimax/each",
    "lyon:cross:8:minimax/each",
    "lyon:cross:8:minimax/once",
    "lyon:cross:8:minimax/fast",
    "lyon:cross:8:minimax/estimate",
    "lyon:dot:32:minimax/once",
    "lyon:cross:32:minimax/each",
    "lyon:cross:32:minimax/once",
    "lyon-quadratic:dot:8/each",
    "lyon-quadratic:dot:8/once",
    "lyon-quadratic:cross:8/once",
    "blinn:minimax/each",
    "blinn:minimax/once",
    "blinn:minimax/squared",
)
#: what is measured of each recipe
FROM_N_L_V = (
    "phong@reflect",
    "phong@reflect/each",
    "phong@reflect/once",
    "phong@reflect/squared",
    "phong@lengthwise",
    "phong@lengthwise/each",
    "phong@lengthwise/once",
    "phong@lengthwise/squared",
    "gaussian:dot:minimax@reflect",
    "gaussian:dot:minimax@lengthwise",
    "gaussian:dot:minimax@lengthwise/once",
    "lyon:dot:8:minimax@reflect",
    "lyon:dot:8:minimax@lengthwise",
    "lyon:difference:8:minimax@lengthwise",
    "lyon:cross:8:minimax@lengthwise",
    "lyon:dot:8:minimax@lengthwise/once",
    "lyon:cross:8:minimax@lengthwise/once",
    "lyon:cross:32:minimax@lengthwise",
    "lyon:cross:32:minimax@lengthwise/once",
    "lyon-quadratic:dot:8@lengthwise/once",
    "lyon-quadratic:cross:8@lengthwise/once",
    "blinn:minimax@halfway/each",
    "blinn:minimax@halfway/once",
    "blinn:minimax@halfway/squared",
    "lyon:dot:8:minimax@halfway/once",
    "lyon:cross:8:minimax@halfway/once",
)
#: all of them: what standard and full measure
RAW = (*NORMALISED, *FROM_N_L_V)
#: what quick measures: each way and recipe, of the formulas that answer most often
QUICK_RAW = (
    "phong/each",
    "phong/once",
    "phong/squared",
    "phong/fast",
    "phong/estimate",
    "gaussian:dot:minimax/once",
    "lyon:dot:8:minimax/once",
    "lyon:cross:8:minimax/each",
    "lyon:cross:8:minimax/once",
    "lyon:cross:8:minimax/fast",
    "lyon:cross:32:minimax/once",
    "lyon-quadratic:dot:8/once",
    "phong@reflect",
    "phong@reflect/each",
    "phong@lengthwise",
    "phong@lengthwise/once",
    "phong@lengthwise/squared",
    "gaussian:dot:minimax@lengthwise/once",
    "lyon:dot:8:minimax@lengthwise",
    "lyon:cross:8:minimax@lengthwise",
    "lyon:dot:8:minimax@lengthwise/once",
    "lyon:cross:8:minimax@lengthwise/once",
    "lyon:cross:32:minimax@lengthwise/once",
    "lyon-quadratic:dot:8@lengthwise/once",
    "blinn:minimax@halfway/once",
    "blinn:minimax@halfway/squared",
)


class Axes(Protocol):
    """The axes of a plan that its raw formulas must lie on."""

    @property
    def raw(self) -> Sequence[str]: ...  # noqa: D102
    @property
    def approximations(self) -> Sequence[str]: ...  # noqa: D102
    @property
    def gammas(self) -> Sequence[int]: ...  # noqa: D102
    @property
    def lambda_forms(self) -> Sequence[str]: ...  # noqa: D102
    @property
    def slopes(self) -> Sequence[str]: ...  # noqa: D102
    @property
    def spaces(self) -> Sequence[str]: ...  # noqa: D102
    @property
    def precisions(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def raw_precisions(self) -> Sequence[str]: ...  # noqa: D102


def of(plan: Axes, registry: Registry) -> list[Formula]:
    """The plan's raw formulas that lie on its axes; those of approximations that it does not hold are not read."""
    mine = [spelling for spelling in plan.raw if re.split("[:@/]", spelling)[0] in plan.approximations]
    return [
        f
        for f in (Formula.parse(spelling, registry) for spelling in mine)
        if f.gamma in (None, *plan.gammas)
        and f.lambda_form in ("none", *plan.lambda_forms)
        and f.slope in ("none", *plan.slopes)
        and f.space in plan.spaces
    ]


def precisions(plan: Axes) -> tuple[str, ...]:
    """Those of a plan in which raw formulas, and configurations of N, L and V, are measured."""
    return tuple(name for name in plan.precisions if name in plan.raw_precisions) or plan.precisions


def check(spellings: Iterable[str], registry: Registry) -> None:
    """InputError or UnknownNameError names a spelling that is none, or that takes its pair as it is."""
    for spelling in spellings:
        if not Formula.parse(spelling, registry).raw:
            fix = "write e.g. phong/each or lyon:cross:8@lengthwise; the axes hold the others"
            raise InputError(f"{spelling} neither removes lengths nor starts from N, L and V", "raw", fix)
