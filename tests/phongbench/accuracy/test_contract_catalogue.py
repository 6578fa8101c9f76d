"""Every formula of the catalogue has a bound on all conforming devices, or a reason why it has none that is true of it.

`make soak` looks at all of them, some run here.
"""

import math
import os
from collections.abc import Callable, Iterator, Mapping

import numpy as np
import pytest
from catalogue import everything
from device_search import worst_found

from phongbench.accuracy.enclosures import contract
from phongbench.accuracy.enclosures.bounds import NotEnclosedError
from phongbench.compiler.precisions import precision_named
from phongbench.formulas.formula import Formula

ALPHA = 50.0
#: why a formula has no bound on all pairs, or on any
REASONS: Mapping[str, Callable[[Formula, bool], bool]] = {
    "vanishes at a right angle": lambda f, half: f.lambda_form == "tan2",
    "vanishes where they are opposite": lambda f, half: f.recipe == "halfway",
    "leave the range of float16": lambda f, half: half and f.normalise != "none",
    "is a trick of processors": lambda f, half: f.normalise in ("fast", "estimate"),
    "whose bits could be read": lambda f, half: half and f.approximation == "bit-trick",
    "whose bits could be written": lambda f, half: half and f.approximation == "gaussian-quadratic",
}


def known(formula: Formula, precision: str, domain: str, budget: float | None) -> float | None:
    """On which side of a budget the bound is; None where there is none, with a reason that is true of it."""
    spec, setting, format_ = formula.spec(), formula.setting(ALPHA), precision_named(precision)
    try:
        bound = contract.largest(spec, formula, setting, format_, domain=domain, budget=budget)
    except NotEnclosedError:
        bound = math.inf
    if math.isfinite(bound):
        return bound
    reason = contract.why_not(spec, formula, setting, format_)
    fits = [true for words, true in REASONS.items() if words in reason]
    assert len(fits) == 1, (str(formula), reason)
    assert fits[0](formula, precision == "float16"), (str(formula), reason)
    return None


def chosen() -> Iterator[Formula]:
    """Every formula of a pair with its first slope, and of those from raw vectors every fifth, or all in a soak."""
    first = [formula for formula in everything() if formula.slope == formula.spec().slopes[0]]
    yield from (formula for formula in first if not formula.raw)
    yield from [formula for formula in first if formula.raw][:: 1 if "PHONGBENCH_SOAK" in os.environ else 5]


@pytest.mark.parametrize("precision", ["float32", "float16"])
def test_every_formula_has_a_bound_that_no_device_breaks_or_a_reason_why_not(precision: str) -> None:
    """In float32 all but those that divide by nothing at a right angle, and they have one short of it."""
    rng, bounded, without = np.random.default_rng(11), 0, list[Formula]()
    for formula in chosen():
        if contract.unwritten(formula.spec(), formula, formula.setting(ALPHA), precision_named(precision)):
            assert known(formula, precision, contract.UNIT, 1.0) is None
            continue
        for domain, most in ((contract.UNIT, 1.2), (contract.SHORT, 0.82)):
            found = worst_found(formula, ALPHA, precision, rng, limited=True, count=128, most=most)
            # told as soon as it is known on which side of what was found it is
            bound = known(formula, precision, domain, found)
            if bound is not None:
                assert bound >= found, str(formula)
                bounded += 1
                break
        else:
            without.append(formula)
    assert bounded > (70 if precision == "float32" else 40)
    assert precision == "float16" or without == []


def test_what_has_no_bound_on_all_pairs_has_one_short_of_right_angles() -> None:
    for spelling in ("lyon:tan2:8", "gaussian:tan2", "blinn@halfway/once"):
        formula = Formula.parse(spelling)
        assert known(formula, "float32", contract.UNIT, 1.0) is None
        short = known(formula, "float32", contract.SHORT, None)
        assert short is not None
        assert short < 0.05
