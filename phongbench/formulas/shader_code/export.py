"""A formula as source text for a shader or a C program: what was measured, ready to be pasted."""

import shlex
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from phongbench import __version__
from phongbench.compiler.precisions import FLOAT32
from phongbench.errors import UnknownNameError
from phongbench.formulas.curves import lobe
from phongbench.formulas.formula import Formula, Registry
from phongbench.formulas.recipes import PAIR
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.shader_code.function import written
from phongbench.formulas.shader_code.languages import LANGUAGES, Language, language_named
from phongbench.formulas.shader_code.raw_vectors import DIRECTIONS, FROM_N_L_V
from phongbench.formulas.spec import Approximation, Setting

__all__ = ["ANGLES", "LANGUAGES", "Shader", "language_named", "shader"]

#: angles at which the largest error is looked for; their squares are evenly spaced, since highlights are narrow
ANGLES = 16_384
#: what vectors longer than 1 give: no more than 1, or what the formula says
OVER_LONG = ("clamp", "keep")


@dataclass(frozen=True)
class Shader:
    """A formula in a language.

    text       its source: functions, the last of which is `highlight`, of two directions
    max_error  its largest error against exact Phong on unit vectors up to 90 degrees, at ANGLES angles, in float32
    bound      what no pair of directions made unit in float32 errs beyond; None where nothing is promised
    """

    language: str
    text: str
    max_error: float
    bound: float | None = None

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {"language": self.language, "text": self.text, "max_error": self.max_error, "bound": self.bound}


def shader(
    formula: Formula,
    alpha: float,
    language: str = "glsl",
    *,
    files: Iterable[str] = (),
    registry: Registry = REGISTRY,
    bound: float | None = None,
    over_long: str = OVER_LONG[0],
) -> Shader:
    """The source of a function `highlight` of two directions, and of what it calls.

    formula, alpha  what it computes
    language        one of LANGUAGES
    files           names of files that added the user's own formulas, for the command in the comment at the top
    registry        the approximations that the formula may name
    bound           of the kernels' error, from which the comment at the top promises one; without it, it tells
                    samples and promises nothing
    over_long       of OVER_LONG: whether vectors longer than 1 give no more than 1 on GPUs, which limit a result for
                    nothing, or as much as the formula says
    returns         Shader; float32 throughout. It computes what the kernels compute, with its constants folded; powers,
                    exponentials, roots and arc cosines are the language's own
    Raises UnknownNameError or InputError for what does not exist, KernelError for a body that has no spelling.
    """
    chosen = language_named(language)
    if over_long not in OVER_LONG:
        raise UnknownNameError("way with over-long vectors", over_long, OVER_LONG, "--over-long")
    text = source(formula, alpha, chosen, registry, limited=over_long == OVER_LONG[0])
    spec = formula.spec(registry)
    error = _largest_error(spec, formula, formula.setting(alpha))
    made_by = _command(formula.spelled(registry), alpha, chosen.name, files)
    made_by += "" if over_long == OVER_LONG[0] else f" --over-long {over_long}"
    bound = None if bound is None else bound + folding(formula.setting(alpha))
    head = _head(spec, formula, alpha, _error(spec, formula, error, bound), made_by)
    return Shader(chosen.name, f"{head}\n\n{text}\n", error, bound)


def source(
    formula: Formula, alpha: float, language: Language, registry: Registry = REGISTRY, *, limited: bool = True
) -> str:
    """The code alone, without what is said of it; arguments and errors as for `shader`."""
    formula.check(alpha, registry)
    spec, setting = formula.spec(registry), formula.setting(alpha)
    return written(spec, formula, setting, language, limited=limited)


def folding(setting: Setting) -> float:
    """How far folded constants, and a gate that nobody needs, move a value from the kernels', at most.

    A slope s times x plus an offset c, both constants rounded, errs by (|s| + |c| + 1) u, u = 2^-24, and |c| is at most
    s + 1; the power gamma, at slopes of exponent / gamma, makes 2 (exponent + gamma) u of it. What stays lit behind the
    horizon is below u / 2.
    """
    return (2.0 * (setting.exponent + (setting.gamma or 1)) + 0.5) * 2.0**-24


def _largest_error(spec: Approximation, formula: Formula, setting: Setting) -> float:
    degrees = 90.0 * np.linspace(0.0, 1.0, ANGLES) ** 2
    value, exact = lobe(spec, formula.lambda_form, setting, degrees, precision=FLOAT32, normalise=formula.normalise)
    return float(np.abs(value - exact).max())


def _command(spelling: str, alpha: float, language: str, files: Iterable[str]) -> str:
    """The command that makes the same again."""
    words = ["phongbench", "shader", spelling, "--alpha", repr(alpha).removesuffix(".0")]
    words += [word for file in files for word in ("--with", file)]
    return shlex.join([*words, "--language", language])


def _error(spec: Approximation, formula: Formula, sampled: float, bound: float | None) -> str:
    """What is promised of the error, or what was sampled."""
    if bound is None:
        plane = " of coplanar vectors" if formula.recipe == "halfway" else ""
        return f"largest error against exact Phong at {ANGLES} angles{plane}: {sampled:.3g}; sampled, not promised"
    terms = " if powers and arcs err by at most 1e-6" if spec.cost.transcendentals else ""
    plane = "coplanar directions" if formula.space == "half" else "directions"
    where = "on vectors of lengths from 0.001 to 1000" if formula.raw else f"on {plane} made unit in float32"
    most = f"errs by at most {bound:.3g}, {255 * bound:.2g} of 255, {where}: proven{terms}"
    return f"{most}; {sampled:.3g} was sampled"


def _head(spec: Approximation, formula: Formula, alpha: float, error: str, made_by: str) -> str:
    words = [f"alpha = {alpha:g}"]
    words += [f"gamma = {formula.gamma}"] if formula.gamma is not None else []
    words += [f"lambda form {formula.lambda_form}"] if formula.lambda_form != "none" else []
    words += [f"slope {formula.slope}"] if formula.slope != "none" else []
    lines = [
        f"{spec.title}: {spec.formula}",
        ", ".join(words),
        error,
        DIRECTIONS[formula.space][2] if formula.recipe == PAIR else FROM_N_L_V,
        spec.source.citation,
        f"phongbench {__version__}: {made_by}",
    ]
    return "\n".join(f"// {line}" for line in lines)
