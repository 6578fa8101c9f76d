"""What each formula of reflectance takes for a channel, interleaved with the exact ones.

From cosines of incidence to reflectances, in the first cache; coefficients are copper's, which time does not depend on.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from phongbench.compiler import jit
from phongbench.compiler.lowering import Precision
from phongbench.compiler.precisions import Array
from phongbench.formulas.coordinate_kernels import values_at
from phongbench.formulas.fresnel.catalogue import KINDS
from phongbench.inputs.optical_constants import EXACT, in_terms_of
from phongbench.timing.interleaved import clocked, interleaved

#: cosines of a pass, passes of an epoch, and rounds
ELEMENTS, PASSES, ROUNDS = 2048, 64, 48
#: the exact formula of conductors once more: it must not be told apart
TWIN = "conductor again"


@jit.driver
def _passes(address: int, count: int, cosines: Array, coefficients: Array, out: Array) -> None:
    """Call the loop at this address so many times; cosines serve as the gate, too, being positive."""
    for _ in range(count):
        values_at(address, cosines)(cosines, cosines, coefficients, cosines[:1], out)


def measure(precision: Precision, seed: int) -> list[dict[str, Any]]:
    """Rows of incidence_times: every formula over each of the exact ones.

    precision  float32 or float64
    """
    calls = {name: clocked(_call(name, precision, seed)) for name in (*KINDS, TWIN)}
    times = interleaved(calls, rounds=ROUNDS, warm=2, seed=seed)
    rows = []
    for base in (name for name, formula in KINDS.items() if formula.exact):
        for name in calls:
            row = times.row(name, base)
            row["ns"] = 1e9 * row.pop("seconds") / PASSES / ELEMENTS
            rows.append(
                {"reflectance": name, "precision": precision.name, "against": base, "elements": ELEMENTS, **row}
            )
    return rows


def _call(name: str, precision: Precision, seed: int) -> Callable[[], object]:
    """Some passes of a formula's loop."""
    kind = "conductor" if name == TWIN else name
    fresnel = in_terms_of(EXACT["copper"], kind) or in_terms_of(EXACT["glass"], kind)
    assert fresnel is not None  # every formula can tell one of them
    cosines = np.random.default_rng(seed).uniform(0.01, 1.0, ELEMENTS).astype(precision.carrier)
    coefficients, out = fresnel.rows(precision)[0], np.empty_like(cosines)
    address = jit.address(fresnel.loop(precision))

    def run() -> None:
        _passes(address, PASSES, cosines, coefficients, out)

    return run
