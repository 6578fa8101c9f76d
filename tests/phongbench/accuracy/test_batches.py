"""Batches: which cells see the same pairs."""

import pytest

from phongbench.accuracy import batches
from phongbench.formulas.registry import REGISTRY
from phongbench.inputs.plan import preset
from phongbench.inputs.strata import STRATA


@pytest.mark.parametrize("name", ["quick", "standard"])
def test_every_cell_is_in_the_batches_of_the_strata_that_it_sees(name: str) -> None:
    plan = preset(name).validated()
    cells = list(plan.cells(REGISTRY))
    made = batches.batches(plan, cells, REGISTRY)
    assert [batch.index for batch in made] == list(range(len(made)))
    strata: dict[int, set[int]] = {}
    for batch in made:
        for position in batch.cells:
            cell = cells[position]
            assert (cell.precision, cell.formula.space) == (batch.precision.name, batch.space)
            strata.setdefault(position, set()).add(id(batch.stratum))
    for position in range(0, len(cells), 101 if name == "standard" else 1):  # asked of each cell, not of those alike
        cell = cells[position]
        spec = REGISTRY[cell.approximation]
        seen = [s for s in STRATA if batches._sees(plan, cell, s) and batches._scale(cell, s, spec) is not None]
        assert strata.get(position, set()) == {id(stratum) for stratum in seen}
