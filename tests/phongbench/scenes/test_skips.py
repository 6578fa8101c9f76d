"""What is left out of a scene changes no bit, or no more than it says."""

from dataclasses import fields, replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.scenes.render import Rendered, render
from phongbench.scenes.scene_files import examples, read_scene
from phongbench.scenes.skips import SceneSkips
from phongbench.shading.lighting import Skips

SIZE = (96, 54)
FORMULAS = [Formula(), Formula.of("lyon", "difference", 8)]
EXACT = [f.name for f in fields(SceneSkips) if f.name not in ("cutoff", "shading")]
EXACT_SHADING = [f.name for f in fields(Skips) if f.type is bool and f.name not in ("reach", "dark_tail")]


@cache
def drawn(name: str, formula: int, skips: SceneSkips, depth: int = 3) -> Rendered:
    """A shipped scene, small, with shadows."""
    return render(read_scene(name), size=SIZE, depth=depth, shadows=True, specular=FORMULAS[formula], skips=skips)


def whole(name: str, formula: int = 0, depth: int = 3) -> NDArray[np.float32]:
    """The picture with nothing left out."""
    return drawn(name, formula, SceneSkips.none(), depth).picture


@pytest.mark.parametrize("formula", range(len(FORMULAS)))
@pytest.mark.parametrize("name", examples())
def test_exact_skips_change_no_bit(name: str, formula: int) -> None:
    done = drawn(name, formula, SceneSkips.exact())
    assert np.array_equal(done.picture, whole(name, formula))
    assert sum(line.skipped for line in done.ledger) > 0


@pytest.mark.parametrize("switch", EXACT + EXACT_SHADING)
@pytest.mark.parametrize("name", examples())
def test_every_exact_skip_alone_changes_no_bit(name: str, switch: str) -> None:
    none = SceneSkips.none()
    alone = (
        replace(none, **{switch: True})
        if switch in EXACT
        else replace(none, shading=replace(none.shading, **{switch: True}))
    )
    assert np.array_equal(drawn(name, 0, alone).picture, whole(name))


@pytest.mark.parametrize("depth", [1, 5])
@pytest.mark.parametrize("switch", ["cutoff", "reach", "dark_tail"])
@pytest.mark.parametrize("name", ["chequerboard", "many-lights", "test-card"])
def test_bounded_skips_stay_within_their_bounds(name: str, switch: str, depth: int) -> None:
    none = SceneSkips.none()
    if switch == "cutoff":
        alone = replace(none, cutoff=0.05)
    else:
        alone = replace(none, shading=replace(none.shading, **{switch: True}))
    done = drawn(name, 0, alone, depth)
    line = next(line for line in done.ledger if line.name == {"reach": "out_of_reach"}.get(switch, switch))
    lost = float(np.abs(done.picture - whole(name, 0, depth)).max())
    assert line.kind == "bounded"
    assert lost <= line.bound * (1 + 1e-5) + 2e-6  # and what float32 rounds in sums of a hundred lights


def test_a_ledger_counts_what_it_left_out() -> None:
    on, off = drawn("many-lights", 0, SceneSkips()), drawn("many-lights", 0, SceneSkips.none())
    lines = {line.name: line for line in on.ledger}
    assert all(0 <= line.skipped <= line.of for line in on.ledger)
    assert {line.kind for line in on.ledger} == {"exact", "bounded"}
    assert all(line.bound == 0 for line in on.ledger if line.kind == "exact")
    assert lines["out_of_reach"].skipped > 0.5 * lines["out_of_reach"].of
    assert off.rays - on.rays > 0
    skipped = {line.name: line.skipped for line in off.ledger}
    assert not any(skipped.values())


def test_a_cutoff_is_a_share() -> None:
    with pytest.raises(InputError, match="cutoff"):
        SceneSkips(cutoff=1.5)
