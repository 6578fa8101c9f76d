"""What is asked of a formula: how wrong it may be, at which exponents, in which precision, on which vectors."""

import math
from dataclasses import dataclass
from fractions import Fraction

from phongbench.accuracy.enclosures.devices import PRECISIONS as STATED
from phongbench.analysis.exponents import Exponents
from phongbench.compiler.precisions import precision_named
from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.spec import SPACES


@dataclass(frozen=True)
class Budget:
    """An error budget, and where it must hold.

    alpha         exponents of exact Phong
    max_error     largest absolute error allowed, > 0; 1/255 is one 8-bit code
    length_error  how wrong the vectors' lengths may be, relative, >= 0: 0.01 is up to 1 % too long or too short
    precision     a name that `precision_named` knows
    space         reflect (R, V), or half (N, H), which is judged over all configurations of N, L and V
    working_set   whose times count: l1, l2 or memory
    contract      whether it must hold on every device that keeps the accuracies of WGSL and Vulkan, not just here
    """

    alpha: Exponents
    max_error: float
    length_error: float = 0.0
    precision: str = "float32"
    space: str = "reflect"
    working_set: str = "l1"
    contract: bool = False

    @staticmethod
    def of(
        alpha: Exponents | float | str,
        max_error: float | str,
        length_error: float | str | None = None,
        precision: str = "float32",
        space: str = "reflect",
        working_set: str = "l1",
        *,
        contract: bool = False,
    ) -> "Budget":
        """The budget of these values, numbers or text; InputError or UnknownNameError names the wrong one."""
        most, size = number(max_error, "max_error"), number(length_error or 0.0, "length_error")
        if not (math.isfinite(most) and most > 0):
            raise InputError(f"the error budget must be above 0, not {most:g}", "max_error", "one 8-bit code is 1/255")
        if not (math.isfinite(size) and size >= 0):
            fix = "0.01 allows lengths up to 1 % wrong"
            raise InputError(f"a length error of {size:g} is not one", "length_error", fix)
        precision_named(precision)
        if space not in SPACES:
            raise UnknownNameError("space", space, SPACES)
        if contract and precision not in STATED:
            fix = f"give {' or '.join(STATED)}, or leave contract out"
            raise InputError(f"WGSL and Vulkan state no accuracies of {precision}", "precision", fix)
        return Budget(Exponents.of(alpha), most, size, precision, space, working_set, contract)


def length_error_of(mesh_angle: float | str, length_error: float | str | None) -> float:
    """How much too short a normal is that is interpolated along an edge, at most: 1 - cos(angle / 2).

    mesh_angle    degrees between the unit normals at its ends, 0 .. 180
    length_error  what was given beside it, which must be nothing
    """
    if length_error is not None:
        raise InputError("a mesh angle and a length error were both given", "mesh_angle", "the one gives the other")
    angle = number(mesh_angle, "mesh_angle")
    if not 0 <= angle < 180:
        raise InputError(f"a mesh angle of {angle:g} degrees", "mesh_angle", "give 0 up to 180, e.g. 10")
    return 1 - math.cos(math.radians(angle / 2))


def edge_words(mesh_angle: float | str) -> str:
    """What a mesh angle means as a length error, in a sentence; arguments and errors as for `length_error_of`."""
    angle, wrong = number(mesh_angle, "mesh_angle"), length_error_of(mesh_angle, None)
    return (
        f"normals interpolated between two that are {angle:g} degrees apart are up to {100 * wrong:.3g} % too short, "
        f"1 - cos({angle / 2:g} degrees): lengths wrong by {wrong:.3g}"
    )


def too_wrong(most: float, budget: Budget) -> str:
    """That lengths as wrong as the budget's were not measured, but up to `most`, in words."""
    angle = math.degrees(2 * math.acos(max(1 - most, -1.0)))
    measured = f"{most:g}, as at a mesh angle of {angle:.3g} degrees"
    return f"the wrongest lengths measured are {measured}, not {budget.length_error:.4g}"


def number(value: float | str, name: str) -> float:
    """A number, or text such as 0.004, 1e-3 or 1/255; InputError names the option where it is neither."""
    try:
        return float(Fraction(value.replace(" ", ""))) if isinstance(value, str) else float(value)
    except (ValueError, ZeroDivisionError, OverflowError) as problem:
        raise InputError(f"{value!r} is not a number", name, "write 0.004 or 1/255") from problem
