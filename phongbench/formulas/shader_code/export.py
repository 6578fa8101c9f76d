"""A formula as source text for a shader or a C program: what was measured, ready to be pasted."""

import shlex
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from phongbench import __version__
from phongbench.compiler.precisions import FLOAT32
from phongbench.formulas.curves import lobe
from phongbench.formulas.formula import Formula, Registry
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.shader_code.function import DIRECTIONS, written
from phongbench.formulas.shader_code.languages import LANGUAGES, Language, language_named
from phongbench.formulas.spec import Approximation, Setting

__all__ = ["ANGLES", "LANGUAGES", "Shader", "language_named", "shader"]

#: angles at which the largest error is looked for; their squares are evenly spaced, since highlights are narrow
ANGLES = 16_384


@dataclass(frozen=True)
class Shader:
    """A formula in a language.

    text       its source: functions, the last of which is `highlight`, of two directions
    max_error  its largest error against exact Phong on unit vectors up to 90 degrees, at ANGLES angles, in float32
    """

    language: str
    text: str
    max_error: float

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {"language": self.language, "text": self.text, "max_error": self.max_error}


def shader(
    formula: Formula, alpha: float, language: str = "glsl", *, files: Iterable[str] = (), registry: Registry = REGISTRY
) -> Shader:
    """The source of a function `highlight` of two directions, and of what it calls.

    formula, alpha  what it computes
    language        one of LANGUAGES
    files           names of files that added the user's own formulas, for the command in the comment at the top
    registry        the approximations that the formula may name
    returns         Shader; float32 throughout. It computes what the kernels compute, operation by operation, but for
                    powers, exponentials, roots and arc cosines, which are the language's own
    Raises UnknownNameError or InputError for what does not exist, KernelError for a body that has no spelling.
    """
    chosen = language_named(language)
    text = source(formula, alpha, chosen, registry)
    spec = formula.spec(registry)
    error = _largest_error(spec, formula.lambda_form, formula.setting(alpha))
    head = _head(spec, formula, alpha, error, _command(formula.spelled(registry), alpha, chosen.name, files))
    return Shader(chosen.name, f"{head}\n\n{text}\n", error)


def source(formula: Formula, alpha: float, language: Language, registry: Registry = REGISTRY) -> str:
    """The code alone, without what is said of it; arguments and errors as for `shader`."""
    formula.check(alpha, registry)
    spec, setting = formula.spec(registry), formula.setting(alpha)
    return written(spec, formula.lambda_form, setting, language)


def _largest_error(spec: Approximation, form: str, setting: Setting) -> float:
    degrees = 90.0 * np.linspace(0.0, 1.0, ANGLES) ** 2
    value, exact = lobe(spec, form, setting, degrees, precision=FLOAT32)
    return float(np.abs(value - exact).max())


def _command(spelling: str, alpha: float, language: str, files: Iterable[str]) -> str:
    """The command that makes the same again."""
    words = ["phongbench", "shader", spelling, "--alpha", repr(alpha).removesuffix(".0")]
    words += [word for file in files for word in ("--with", file)]
    return shlex.join([*words, "--language", language])


def _head(spec: Approximation, formula: Formula, alpha: float, error: float, made_by: str) -> str:
    words = [f"alpha = {alpha:g}"]
    words += [f"gamma = {formula.gamma}"] if formula.gamma is not None else []
    words += [f"lambda form {formula.lambda_form}"] if formula.lambda_form != "none" else []
    words += [f"slope {formula.slope}"] if formula.slope != "none" else []
    lines = [
        f"{spec.title}: {spec.formula}",
        ", ".join(words),
        f"largest error against exact Phong, unit vectors up to 90 degrees: {error:.3g}, {255 * error:.2g} of 255",
        DIRECTIONS[formula.space][2],
        spec.source.citation,
        f"phongbench {__version__}: {made_by}",
    ]
    return "\n".join(f"// {line}" for line in lines)
