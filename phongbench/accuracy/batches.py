"""Batches: which cells of a plan see the same pairs, and which strata each cell is measured in."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from phongbench.compiler.lowering import Precision, precision_named
from phongbench.compiler.precisions import Array
from phongbench.formulas.lambda_forms import cutoff_deficit
from phongbench.formulas.spec import Approximation
from phongbench.inputs.pairs import HOSTILE_PAIRS, pairs
from phongbench.inputs.plan import Cell, Plan
from phongbench.inputs.strata import STRATA, Stratum


@dataclass(frozen=True)
class Batch:
    """Cells that see the same pairs.

    cells  positions in the plan's list of cells
    scale  what the stratum's deficits are scaled by
    """

    index: int
    precision: Precision
    space: str
    stratum: Stratum
    scale: float
    cells: tuple[int, ...]
    samples: int

    @property
    def truths(self) -> int:
        """Rows per cell: one truth on unit vectors, both where lengths are wrong."""
        return 2 if self.stratum.unnormalised else 1

    @property
    def evaluations(self) -> int:
        """(sample, cell) pairs."""
        return self.samples * len(self.cells)

    def pairs(self, seed: int, start: int, count: int) -> tuple[Array, Array]:
        """Pairs start .. start + count of the batch: a and b, each (3, count) in the precision's carrier."""
        half = self.space == "half"
        return pairs(
            self.stratum, self.precision, seed=seed, start=start, count=count, scale=self.scale, half_space=half
        )


def batches(plan: Plan, cells: Sequence[Cell], registry: Mapping[str, Approximation]) -> list[Batch]:
    """The batches of a plan's cells, in the order of its precisions and spaces, then by stratum and scale."""
    groups: dict[tuple[Any, ...], list[int]] = {}
    for position, cell in enumerate(cells):
        for order, stratum in enumerate(STRATA):
            if _sees(plan, cell, stratum):
                scale = _scale(cell, stratum, registry[cell.approximation])
                if scale is not None:
                    key = (plan.precisions.index(cell.precision), plan.spaces.index(cell.formula.space), order, scale)
                    groups.setdefault(key, []).append(position)
    return [
        Batch(
            index=index,
            precision=precision_named(plan.precisions[key[0]]),
            space=plan.spaces[key[1]],
            stratum=STRATA[key[2]],
            scale=key[3],
            cells=tuple(groups[key]),
            samples=_samples(plan, STRATA[key[2]]),
        )
        for index, key in enumerate(sorted(groups))
    ]


def _samples(plan: Plan, stratum: Stratum) -> int:
    """Pairs of a stratum: hostile ones are as many as there are, causes get a share."""
    return HOSTILE_PAIRS if stratum.name == "hostile" else max(1, int(plan.samples * stratum.share))


def _sees(plan: Plan, cell: Cell, stratum: Stratum) -> bool:
    """True if the cell is measured in the stratum.

    Ungated ones only where the gate matters, lengths only in the spaces asked for.
    """
    if stratum.name not in plan.strata or not (cell.gated or stratum.reaches_back):
        return False
    return stratum.name != "lengths" or cell.formula.space in plan.length_spaces


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
