"""The stratum `normalised`: vectors as shaders make them, each of four ways, against arithmetic written again."""

from dataclasses import replace

import numpy as np
import pytest
from adversary import Machine

from phongbench.accuracy.enclosures.coordinates import normalised
from phongbench.compiler.precisions import precision_named
from phongbench.inputs.normalising import WAYS, made_unit
from phongbench.inputs.pairs import pairs
from phongbench.inputs.plan import preset
from phongbench.inputs.random_numbers import uniforms
from phongbench.inputs.strata import STRATA

STRATUM = next(s for s in STRATA if s.name == "normalised")
COUNT = 4000


@pytest.mark.parametrize("precision", ["float16", "bfloat16", "float32"])
def test_each_of_four_pairs_in_a_row_goes_its_own_way(precision: str) -> None:
    format_ = precision_named(precision)
    exact = replace(STRATUM, name="highlight")
    raw, _ = pairs(exact, precision_named("float64"), seed=2, start=8, count=COUNT, scale=0.1)
    a, _ = made_unit(format_, raw, raw, seed=2, start=8)
    stretched = raw * np.exp(np.log(4.0) * (2 * uniforms(2 + 0x0A11, 8, COUNT, 2)[0] - 1))
    for way in range(WAYS):
        machine = Machine(precision, fused=way >= 2)
        wanted = machine.unit(stretched[:, way::WAYS], "quotient" if way % 2 else "reciprocal")
        assert np.array_equal(a[:, way::WAYS], wanted)


@pytest.mark.parametrize("precision", ["float16", "bfloat16", "float32", "float64"])
def test_lengths_are_wrong_by_more_than_rounding_a_unit_vector_makes_them(precision: str) -> None:
    format_ = precision_named(precision)
    domain = normalised(format_)
    for v in pairs(STRATUM, format_, seed=1, start=0, count=COUNT, scale=0.1):
        off = np.linalg.norm(v.astype(np.float64), axis=0) - 1
        assert 0.9 * format_.eps < np.abs(off).max() < domain.high - 1


def test_in_fixed_point_vectors_are_only_rounded() -> None:
    format_ = precision_named("q1.15")
    plain = pairs(replace(STRATUM, name="highlight"), format_, seed=1, start=0, count=50, scale=0.1)
    made = pairs(STRATUM, format_, seed=1, start=0, count=50, scale=0.1)
    assert all(np.array_equal(*both) for both in zip(plain, made, strict=True))


def test_a_usual_study_leaves_it_to_proof_and_a_larger_one_samples_it() -> None:
    assert "normalised" not in preset("quick").strata
    assert "normalised" in preset("standard").strata
    assert "normalised" in preset("full").strata
