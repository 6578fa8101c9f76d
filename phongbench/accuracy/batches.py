"""Batches: which cells of a plan see the same pairs, and which strata each cell is measured in."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from phongbench.compiler.lowering import Precision, precision_named
from phongbench.compiler.precisions import Array
from phongbench.formulas.formula import Formula
from phongbench.formulas.lambda_forms import cutoff_deficit
from phongbench.formulas.normalising import NORMALISE
from phongbench.formulas.recipes import PAIR, RECIPES
from phongbench.formulas.spec import Approximation
from phongbench.inputs import raw_formulas
from phongbench.inputs.configurations import configurations
from phongbench.inputs.length_errors import ANY
from phongbench.inputs.pairs import HOSTILE_PAIRS, pairs
from phongbench.inputs.plan import Cell, Plan
from phongbench.inputs.strata import STRATA, Stratum


@dataclass(frozen=True)
class Batch:
    """Cells that see the same pairs.

    cells              positions in the plan's list of cells
    scale              what the stratum's deficits are scaled by
    recipe, normalise  of the cells' formulas; those of (N, H) see configurations by MADE_UNIT
    """

    index: int
    precision: Precision
    space: str
    stratum: Stratum
    scale: float
    cells: tuple[int, ...]
    samples: int
    recipe: str = PAIR
    normalise: str = "none"

    @property
    def raw(self) -> bool:
        """True if its cells remove lengths or make their pair."""
        return self.recipe != PAIR or self.normalise != "none"

    @property
    def truths(self) -> int:
        """Rows per cell: one truth on unit vectors, both where lengths are wrong and nothing is done about them."""
        return 2 if self.stratum.unnormalised and not self.raw else 1

    @property
    def half_space_truth(self) -> bool:
        """True if the truth is that of twice the pair's angle; of a recipe it is that of (R, V) itself."""
        return self.space == "half" and self.recipe == PAIR

    @property
    def evaluations(self) -> int:
        """(sample, cell) pairs."""
        return self.samples * len(self.cells)

    def pairs(self, seed: int, start: int, count: int) -> tuple[Array, Array]:
        """Pairs start .. start + count of the batch: a and b, each (3, count) in the precision's carrier.

        Of a recipe N, and V above L as (6, count).
        """
        if self.recipe != PAIR:
            return configurations(self.stratum, self.precision, seed=seed, start=start, count=count, scale=self.scale)
        half = self.space == "half"
        return pairs(
            self.stratum, self.precision, seed=seed, start=start, count=count, scale=self.scale, half_space=half
        )


def batches(plan: Plan, cells: Sequence[Cell], registry: Mapping[str, Approximation]) -> list[Batch]:
    """The batches of a plan's cells, in the order of its precisions and spaces, then by stratum and scale."""
    groups: dict[tuple[Any, ...], list[int]] = {}
    places: dict[tuple[Any, ...], list[tuple[int, ...]]] = {}
    for position, cell in enumerate(cells):
        alike, spec = _alike(cell), registry[cell.approximation]
        if alike not in places:
            places[alike] = list(_places(plan, cell))
        for place in places[alike]:
            scale = _scale(cell, STRATA[place[-1]], spec)
            if scale is not None:
                groups.setdefault((*place, scale), []).append(position)
    return [
        Batch(
            index=index,
            precision=precision_named(plan.precisions[key[0]]),
            space=plan.spaces[key[1]],
            stratum=STRATA[key[4]],
            scale=key[5],
            cells=tuple(groups[key]),
            samples=_samples(plan, STRATA[key[4]], raw=any(key[2:4])),
            recipe=(PAIR, *RECIPES)[key[2]],
            normalise=_WAYS[key[3]],
        )
        for index, key in enumerate(sorted(groups))
    ]


def _alike(cell: Cell) -> tuple[Any, ...]:
    """What decides where a cell is measured: few of them stand for all cells."""
    f = cell.formula
    return f.recipe, f.normalise, f.space, cell.precision, cell.gated


def _places(plan: Plan, cell: Cell) -> Iterator[tuple[int, ...]]:
    """Where batches of such cells stand in order: precision, space, recipe, way to remove lengths, stratum."""
    f = cell.formula
    for order, stratum in enumerate(STRATA):
        if _sees(plan, cell, stratum):
            recipe, way = MADE_UNIT if _made(f, stratum) else (f.recipe, f.normalise)
            made = (PAIR, *RECIPES).index(recipe)
            yield plan.precisions.index(cell.precision), plan.spaces.index(f.space), made, _WAYS.index(way), order


_WAYS = tuple(NORMALISE)
#: how N and H of a configuration are made for formulas that are given them: H = L/|L| + V/|V|, and both made unit
MADE_UNIT = ("halfway", "each")
#: the share of a plan's samples that raw formulas get: where lengths are removed, little is left that varies
RAW_SHARE = 1 / 32


def _samples(plan: Plan, stratum: Stratum, raw: bool) -> int:
    """Pairs of a stratum: hostile ones are as many as there are, causes and raw formulas get a share."""
    if stratum.name == "hostile":
        return HOSTILE_PAIRS
    return max(1, int(plan.samples * (RAW_SHARE if raw else stratum.share)))


def _sees(plan: Plan, cell: Cell, stratum: Stratum) -> bool:
    """True if the cell is measured in the stratum.

    Ungated ones only where the gate matters, lengths only in the spaces asked for; what starts from N, L and V only in
    configurations, and what removes lengths only where there are highlights, wrong lengths or hostile vectors.
    Formulas of (N, H) see coplanar pairs, whose angle tells that of (R, V), and configurations, where it does not.
    """
    formula = cell.formula
    if _made(formula, stratum):
        told = stratum.perturbation == "none" and cell.gated and cell.precision in raw_formulas.precisions(plan)
        return told and stratum.name in plan.strata
    if stratum.name not in plan.strata or (formula.recipe != PAIR) != (stratum.name == "configurations"):
        return False
    if stratum.perturbation == ANY.name and formula.normalise == "none":
        return False  # any length is any value
    if formula.recipe != PAIR:
        return True
    if formula.normalise != "none" and stratum.name not in ("highlight", "lengths", "hostile"):
        return False
    if not (cell.gated or stratum.reaches_back):
        return False
    return stratum.name != "lengths" or cell.formula.space in plan.length_spaces


def _made(formula: Formula, stratum: Stratum) -> bool:
    """True of a formula of (N, H) in configurations: its pair is made there, though it is given one."""
    return stratum.name == "configurations" and formula.space == "half" and not formula.raw


def _scale(cell: Cell, stratum: Stratum, spec: Approximation) -> float | None:
    """What the stratum's deficits are scaled by for this cell; None if the cell has no place in it.

    Scales are deficits between (R, V): a half-space pair at half the angle is made from them by the sampler.
    """
    if stratum.scale == "none":
        return 1.0
    if stratum.scale == "alpha":
        return 1 / cell.alpha
    if spec.cutoff is None:
        return None
    deficit = cutoff_deficit(cell.lambda_form, spec.cutoff(cell.setting))
    if deficit is None:
        return None
    if cell.formula.space == "half":
        deficit = 2 * deficit * (2 - deficit) if deficit < 1 else 2.5
    return deficit if deficit < 2 else None
