"""A formula as source text for a shader or a program: what was measured, ready to be pasted."""

import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

from phongbench import __version__
from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.formula import Formula, Registry
from phongbench.formulas.recipes import PAIR
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.shader_code.function import written
from phongbench.formulas.shader_code.language import FLOAT16, FLOAT32, MEDIUMP, Language
from phongbench.formulas.shader_code.languages import LANGUAGES, language_named
from phongbench.formulas.shader_code.measured import ANGLES, largest_error
from phongbench.formulas.shader_code.raw_vectors import DIRECTIONS, FROM_N_L_V
from phongbench.formulas.spec import Approximation, Setting

__all__ = ["ANGLES", "LANGUAGES", "Options", "Shader", "language_named", "shader"]

#: what vectors longer than 1 give: no more than 1, or what the formula says
OVER_LONG = ("clamp", "keep")
#: lengths may be wrong by less than this
LARGEST_LENGTH_ERROR = 0.5


@dataclass(frozen=True)
class Options:
    """How code is written, and what is said of it.

    language      one of LANGUAGES
    precision     float32, float16 or mediump, if the language has it
    over_long     of OVER_LONG: whether vectors longer than 1 give no more than 1 on GPUs, which limit a result for
                  nothing, or as much as the formula says
    length_error  how much longer or shorter than 1 the directions may be, relative
    targets       whose costs are told, for the command in the comment at the top
    files         that added the user's own formulas, likewise
    """

    language: str = "glsl"
    precision: str = FLOAT32
    over_long: str = OVER_LONG[0]
    length_error: float = 0.0
    targets: tuple[str, ...] = ()
    files: tuple[str, ...] = ()

    def checked(self) -> Language:
        """The language in its precision; UnknownNameError or InputError for what there is not."""
        language = language_named(self.language).in_precision(self.precision)
        if self.over_long not in OVER_LONG:
            raise UnknownNameError("way with over-long vectors", self.over_long, OVER_LONG, "over_long")
        if not 0 <= self.length_error < LARGEST_LENGTH_ERROR:
            fix = f"give a number from 0 to below {LARGEST_LENGTH_ERROR}, e.g. 0.01 for 1 %"
            raise InputError(f"lengths cannot be wrong by {self.length_error}", "length_error", fix)
        return language

    def command(self, spelling: str, alpha: float) -> str:
        """The command that makes the same again."""
        words = ["phongbench", "shader", spelling, "--alpha", repr(alpha).removesuffix(".0")]
        words += [word for file in self.files for word in ("--with", file)]
        words += ["--language", self.language]
        words += [] if self.precision == FLOAT32 else ["--precision", self.precision]
        words += [] if self.over_long == OVER_LONG[0] else ["--over-long", self.over_long]
        words += ["--length-error", f"{self.length_error:g}"] if self.length_error else []
        words += ["--target", ",".join(self.targets)] if self.targets else []
        return shlex.join(words)


@dataclass(frozen=True)
class Shader:
    """A formula in a language.

    text       its source: functions, the last of which is `highlight`, of two directions or of n, l and v
    max_error  the largest error of this code against exact Phong up to 90 degrees, at ANGLES angles, in its precision
    bound      what no directions made unit in float32, but for the lengths' error, err beyond on a device that rounds
               as kernels do; None where nothing is promised
    contract   the same on every device that keeps to what WGSL and Vulkan state; None likewise
    precision  of its floats
    costs      what it takes on the targets that were asked for
    """

    language: str
    text: str
    max_error: float
    bound: float | None = None
    contract: float | None = None
    precision: str = FLOAT32
    costs: tuple[Mapping[str, Any], ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {field.name: getattr(self, field.name) for field in fields(self)} | {"costs": [*map(dict, self.costs)]}


def shader(
    formula: Formula,
    alpha: float,
    options: Options = Options(),
    *,
    registry: Registry = REGISTRY,
    bound: float | None = None,
    contract: float | None = None,
    costs: Sequence[Mapping[str, Any]] = (),
    notes: Iterable[str] = (),
) -> Shader:
    """The source of a function `highlight` of two directions, or of n, l and v, and of what it calls.

    formula, alpha  what it computes
    registry        the approximations that the formula may name
    bound           of the kernels' error, from which the comment at the top promises one; without it, it tells
                    samples and promises nothing
    contract        the bound on every device that keeps to what WGSL and Vulkan state, kept and told at the top
    costs, notes    likewise
    returns         Shader. It computes what the kernels compute, with its constants folded; powers, exponentials, roots
                    and arc cosines are the language's own
    Raises UnknownNameError or InputError for what does not exist, KernelError for a body that has no spelling.
    """
    language, limited = options.checked(), options.over_long == OVER_LONG[0]
    text = source(formula, alpha, language, registry, limited=limited)
    spec, setting, wrong = formula.spec(registry), formula.setting(alpha), options.length_error
    error = largest_error(spec, formula, setting, language, limited=limited, length_error=wrong)
    if options.precision != FLOAT32:
        bound = None  # it is one of float32
    if bound is not None:
        bound += folding(setting) * (1 + wrong) ** 2
        bound = min(bound, 1.0) if limited and language.gpu and formula.lambda_form in ("none", "dot") else bound
    told = [_error(spec, formula, error, bound, options)]
    if contract is not None:
        held = "float32" if options.precision == FLOAT32 else "float16"
        device = f"on devices that are as accurate in {held} as WGSL and Vulkan state"
        where = f"{_domain(formula)}, " if formula.normalise != "none" or formula.space == "half" else ""
        told.append(f"errs by at most {contract:.3g} {where}{device}: proven")
    told += [*notes, *([language.note] if language.note else [])]
    head = _head(spec, formula, alpha, told, options.command(formula.spelled(registry), alpha))
    top = "\n".join(f"{language.comment} {line}" for line in head)
    return Shader(language.name, f"{top}\n\n{text}\n", error, bound, contract, options.precision, tuple(costs))


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


def _error(spec: Approximation, formula: Formula, sampled: float, bound: float | None, options: Options) -> str:
    """What is promised of the error, or what was sampled."""
    wrong = f", lengths wrong by up to {options.length_error:.4g}" if options.length_error else ""
    if bound is None:
        held = {FLOAT32: "", FLOAT16: " in float16", MEDIUMP: " in float16, the least that mediump is"}
        plane = " of coplanar vectors" if formula.recipe == "halfway" else ""
        where = f"{ANGLES} angles{plane}{wrong}{held[options.precision]}"
        return f"largest error against exact Phong at {where}: {sampled:.3g}; sampled, not promised"
    terms = " if powers and arcs err by at most 1e-6" if spec.cost.transcendentals else ""
    where = _domain(formula) if formula.raw else f"{_domain(formula)} made unit in float32{wrong}"
    most = f"errs by at most {bound:.3g}, {255 * bound:.2g} of 255, {where}: proven{terms}"
    return f"{most}; {sampled:.3g} was sampled"


def _domain(formula: Formula) -> str:
    """The vectors that a bound holds for."""
    if formula.normalise != "none":
        return "on vectors of lengths from 0.001 to 1000"
    return "on coplanar directions" if formula.space == "half" else "on directions"


def _head(spec: Approximation, formula: Formula, alpha: float, told: Sequence[str], made_by: str) -> list[str]:
    words = [f"alpha = {alpha:g}"]
    words += [f"gamma = {formula.gamma}"] if formula.gamma is not None else []
    words += [f"lambda form {formula.lambda_form}"] if formula.lambda_form != "none" else []
    words += [f"slope {formula.slope}"] if formula.slope != "none" else []
    return [
        f"{spec.title}: {spec.formula}",
        ", ".join(words),
        *told,
        DIRECTIONS[formula.space][2] if formula.recipe == PAIR else FROM_N_L_V,
        spec.source.citation,
        f"phongbench {__version__}: {made_by}",
    ]
