"""The plan that tests of studies change: few cells, so that a study takes a second."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from phongbench.inputs.plan import Plan, preset


@pytest.fixture(scope="session")
def tiny() -> Callable[..., Plan]:
    """One exponent, Lyon beside exact Phong, float32, 1000 pairs, no probes, no timing; each may be given otherwise."""

    def plan(**changes: Any) -> Plan:
        few: dict[str, Any] = {
            "alphas": (10.0,),
            "gammas": (8,),
            "approximations": ("phong", "lyon"),
            "slopes": ("taylor",),
            "spaces": ("reflect",),
            "lambda_forms": ("dot",),
            "precisions": ("float32",),
            "probes": (),
            "samples": 1000,
            "timing": False,
        }
        return replace(preset("quick"), **few | changes).validated()

    return plan
