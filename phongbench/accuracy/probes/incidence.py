"""Probe `incidence`: how far each formula of reflectance is from the exact one, over all angles of incidence.

Whatever the exponent, a highlight's colour is ks times this; so it is asked once for each material, not for each cell.
In the processor's own precisions only: each other one would be a kernel more to compile for every formula.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from phongbench.accuracy.probes.probe import ProbeContext
from phongbench.compiler.lowering import FLOAT32, FLOAT64, Precision
from phongbench.compiler.precisions import Array
from phongbench.formulas.fresnel.catalogue import KINDS
from phongbench.formulas.fresnel.reflectance import CHANNELS
from phongbench.inputs.optical_constants import EXACT, in_terms_of
from phongbench.inputs.plan import Plan
from phongbench.results.schema import INCIDENCE

#: angles from 0 to 90 degrees
ANGLES = 1801
#: one step of an 8-bit channel
CODE = 1 / 255


def measure(context: ProbeContext) -> Mapping[str, pd.DataFrame]:
    """The table incidence: a row for each material, formula, precision and channel."""
    return {"incidence": INCIDENCE.frame(rows(native(context.plan)))}


def seconds(plan: Plan, jobs: int) -> float:
    """Measured: loops are loaded, and a few thousand angles computed."""
    return 0.3


def native(plan: Plan) -> list[Precision]:
    """The precisions of a plan that the processor computes in; float32 without any."""
    return [precision for precision in (FLOAT32, FLOAT64) if precision.name in plan.precisions] or [FLOAT32]


def rows(precisions: Sequence[Precision]) -> list[dict[str, Any]]:
    """What each formula that a material can be told in makes of it."""
    degrees = np.linspace(0.0, 90.0, ANGLES)
    found = []
    for precision in precisions:
        cosines = np.cos(np.radians(degrees)).astype(precision.carrier)
        for material, exact in EXACT.items():
            # the plain bodies: compiling the exact one in float64, too, would take longer
            truth = np.array([[exact.bound(c)(v) for c in range(len(CHANNELS))] for v in cosines.tolist()])
            key = {"material": material, "precision": precision.name}
            for fresnel in filter(None, (in_terms_of(exact, kind) for kind in KINDS)):
                errors = np.abs(fresnel.at(cosines, precision).astype(np.float64) - truth)
                found += [key | {"reflectance": fresnel.kind} | row for row in _channels(errors, degrees)]
    return found


def _channels(errors: Array, degrees: Array) -> Iterator[dict[str, Any]]:
    """What is told of the errors (n, 3) of the three channels at these angles."""
    for channel, error in zip(CHANNELS, errors.T, strict=True):
        yield {
            "channel": channel,
            "samples": ANGLES,
            "max_abs": float(error.max()),
            "worst_degrees": float(degrees[error.argmax()]),
            "mean_abs": float(error.mean()),
            "codes_8bit": float(error.max() / CODE),
            "within_degrees": _within(error, degrees),
            "error_60": float(np.interp(60.0, degrees, error)),
            "error_85": float(np.interp(85.0, degrees, error)),
        }


def _within(error: Array, degrees: Array) -> float:
    """The incidence up to which no error exceeds a code; 90 if none does anywhere, 0 if one does in front."""
    beyond = np.flatnonzero(error > CODE)
    return float(degrees[max(beyond[0] - 1, 0)]) if len(beyond) else 90.0
