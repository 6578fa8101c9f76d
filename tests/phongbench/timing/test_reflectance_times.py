"""Times of reflectances: what is timed is what is used, and every formula stands beside both exact ones."""

import numpy as np
import pytest

from phongbench.compiler import jit
from phongbench.compiler.lowering import FLOAT32
from phongbench.formulas.fresnel.catalogue import KINDS
from phongbench.results.schema import INCIDENCE_TIMES
from phongbench.timing import reflectance_times

pytestmark = pytest.mark.skipif(jit.DISABLED, reason="plain Python has no time of its own")


def test_every_formula_is_compared_with_both_exact_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reflectance_times, "ROUNDS", 8)
    monkeypatch.setattr(reflectance_times, "PASSES", 2)
    rows = INCIDENCE_TIMES.frame(reflectance_times.measure(FLOAT32, 1))
    assert not rows.duplicated(INCIDENCE_TIMES.key).any()
    assert set(rows["against"]) == {"dielectric", "conductor"}
    assert set(rows["reflectance"]) == {*KINDS, reflectance_times.TWIN}
    assert (rows["ns"] > 0).all()
    assert (rows["rounds"] == 8).all()
    itself = rows[rows["reflectance"] == rows["against"]]
    assert (itself[["ratio", "ratio_low", "ratio_high"]] == 1).all(axis=None)


def test_a_pass_computes_reflectances() -> None:
    fresnel = reflectance_times.in_terms_of(reflectance_times.EXACT["copper"], "f82")
    assert fresnel is not None
    cosines = np.linspace(0.01, 1, 100, dtype=np.float32)
    out = np.empty_like(cosines)
    address = jit.address(fresnel.loop(FLOAT32))
    reflectance_times._passes(address, 3, cosines, fresnel.rows(FLOAT32)[2], out)
    assert out.tolist() == fresnel.at(cosines, FLOAT32)[:, 2].tolist()
