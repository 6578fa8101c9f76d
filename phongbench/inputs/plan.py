"""What a study measures: a frozen plan, its presets, and the cells it consists of."""

import hashlib
import json
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from itertools import product
from typing import Any

from phongbench.compiler.precisions import in_order, precision_named
from phongbench.errors import InputError, UnknownNameError
from phongbench.formulas.formula import Formula
from phongbench.formulas.lambda_forms import LAMBDA_FORMS
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import ALPHA, GAMMA, SPACES, Approximation, Setting
from phongbench.inputs import raw_formulas
from phongbench.inputs.meshes import TESSELLATIONS
from phongbench.inputs.obj_files import load
from phongbench.inputs.raw_formulas import QUICK_RAW, RAW
from phongbench.inputs.strata import STRATUM_NAMES, USUAL_STRATA

#: questions beyond the sweep; phongbench.accuracy.probes answers them
PROBE_NAMES: tuple[str, ...] = (
    "cosines", "search", "certify", "contract", "emitted", "meshes", "hostile", "smoothness", "incidence", "lobes",
    "inverse", "scenes", "recheck",
)  # fmt: skip
#: those of a study that does not ask for others: pictures, inverted or drawn, and bounds by contract take minutes;
#: a header tells how wrong written code is
USUAL_PROBES = tuple(name for name in PROBE_NAMES if name not in ("contract", "emitted", "inverse", "scenes"))
#: what must not be empty
_AXES = (
    "alphas", "gammas", "lambda_forms", "approximations", "slopes", "spaces", "length_spaces", "precisions", "strata",
)  # fmt: skip
#: what the quick preset leaves to the others: near kin of what it has, and many cells
LEFT_TO_STANDARD = ("gaussian-quadratic",)
ALL_SLOPES = ("taylor", "minimax", "energy")
#: real exponents (materials, file formats) and the non-powers of two that expose what powers of two hide
QUICK_ALPHAS = (5.0, 10.0, 20.0, 32.0, 50.0, 64.0, 100.0, 128.0, 200.0, 256.0, 512.0, 1000.0)
STANDARD_ALPHAS = (1.0, 2.0, 4.0, 8.0, 16.0, 27.9, 30.0, 51.2, 76.8, 96.08, 225.0, 400.0, 1024.0, 2048.0, 10000.0)


@dataclass(frozen=True, slots=True)
class Cell:
    """One formula at one exponent in one precision.

    alpha      exponent of exact Phong
    precision  a name that `precision_named` knows
    gated      False to measure what the form does where a.b <= 0
    """

    formula: Formula
    alpha: float
    precision: str
    gated: bool = True

    @property
    def approximation(self) -> str:
        """The formula's name in the registry."""
        return self.formula.approximation

    @property
    def lambda_form(self) -> str:
        """dot, difference, cross, tan2, or none for kernels of the cosine."""
        return self.formula.lambda_form

    @property
    def setting(self) -> Setting:
        """What the formula's coefficients are made for."""
        return self.formula.setting(self.alpha)


@dataclass(frozen=True)
class Plan:
    """The axes and sizes of a study. Equal plans on equal code give equal accuracy rows, bit for bit.

    alphas          exponents of exact Phong, > 0
    gammas          powers of two
    lambda_forms    of vectors.LAMBDA_FORMS
    approximations  names in the registry; exact Phong is always measured too
    slopes          beta policies; an approximation without any of them uses its own first one
    spaces          reflect (R, V), half (N, H)
    length_spaces   spaces in which wrong lengths are studied too
    precisions      float16, bfloat16, float32, float64, and fixed point as qI.F
    strata          of strata.STRATUM_NAMES
    samples         pairs per cell and stratum
    seed            any whole number >= 0
    raw             spellings of formulas that remove lengths or start from N, L and V, e.g. phong/each; those that the
                    axes above leave out are not measured
    raw_precisions  in which they and configurations are measured, of the plan's; in all of these where it has none
    timing          measure time too
    timing_budget   seconds the timing may take
    processes       fresh processes that share the timing; 1 for the study's own
    skipping        time kernels that skip dark blocks of pairs, too
    probes          of PROBE_NAMES; may be empty
    meshes          OBJ files that the mesh probe measures beside its own surfaces
    targets         machines whose costs of the formulas are kept; every known one without any
    """

    preset: str = "quick"
    alphas: tuple[float, ...] = QUICK_ALPHAS
    gammas: tuple[int, ...] = (2, 4, 8, 16, 32, 64)
    lambda_forms: tuple[str, ...] = ("dot", "difference", "cross")
    approximations: tuple[str, ...] = tuple(name for name in REGISTRY if name not in LEFT_TO_STANDARD)
    slopes: tuple[str, ...] = ("taylor", "minimax")
    spaces: tuple[str, ...] = SPACES
    length_spaces: tuple[str, ...] = ("reflect",)
    precisions: tuple[str, ...] = ("float16", "float32")
    strata: tuple[str, ...] = USUAL_STRATA
    samples: int = 100 * 1024
    seed: int = 1
    raw: tuple[str, ...] = QUICK_RAW
    raw_precisions: tuple[str, ...] = ("float32",)
    timing: bool = True
    timing_budget: float = 4.0
    processes: int = 1
    skipping: bool = False
    probes: tuple[str, ...] = USUAL_PROBES
    meshes: tuple[str, ...] = ()
    targets: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Plain data that JSON holds; `from_dict` is its inverse."""
        return {k: list(v) if isinstance(v, tuple) else v for k, v in asdict(self).items()}

    @staticmethod
    def from_dict(data: Mapping[str, Any]) -> "Plan":
        """The plan of a manifest."""
        values: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in data.items()}
        return Plan(**values)

    @cached_property
    def digest(self) -> str:
        """Eight hex digits that differ between plans."""
        return hashlib.sha256(json.dumps(self.as_dict(), sort_keys=True).encode()).hexdigest()[:8]

    def validated(self, registry: Mapping[str, Approximation] = REGISTRY) -> "Plan":
        """This plan with sorted, distinct axes; InputError or UnknownNameError names what is wrong."""
        self._check_axes()
        self._check_names(registry)
        self._check_meshes()
        self._check_sizes()
        return replace(
            self,
            alphas=tuple(sorted({float(a) for a in self.alphas})),
            gammas=tuple(sorted({int(g) for g in self.gammas})),
            lambda_forms=_ordered(self.lambda_forms, LAMBDA_FORMS),
            approximations=_ordered({*self.approximations, "phong"}, registry),
            slopes=tuple(dict.fromkeys(self.slopes)),
            spaces=_ordered(self.spaces, SPACES),
            length_spaces=_ordered(self.length_spaces, SPACES),
            precisions=in_order(self.precisions),
            strata=_ordered(self.strata, STRATUM_NAMES),
            raw=tuple(dict.fromkeys(self.raw)),
            probes=_ordered(self.probes, PROBE_NAMES),
            meshes=tuple(dict.fromkeys(self.meshes)),
            targets=tuple(dict.fromkeys(self.targets)),
        )

    def _check_axes(self) -> None:
        for axis in _AXES:
            if not getattr(self, axis):
                raise InputError(
                    f"{axis} is empty", None, "give at least one value, or leave the option out for the preset's"
                )
        for alpha in self.alphas:
            if not (math.isfinite(alpha) and ALPHA.low <= alpha <= ALPHA.high):
                fix = "alpha is Phong's exponent" if alpha else "at alpha 0 Phong is 1 where the light is in front"
                raise InputError(f"alpha = {alpha:g} is not in {ALPHA.low:g} .. {ALPHA.high:g}", None, fix)
        for gamma in self.gammas:
            if not GAMMA.low <= gamma <= GAMMA.high or gamma & (gamma - 1):
                raise InputError(
                    f"gamma = {gamma} is not a power of two in 1 .. {GAMMA.high:g}", None, "use e.g. 4,8,16"
                )

    def _check_names(self, registry: Mapping[str, Approximation]) -> None:
        _known("lambda form", self.lambda_forms, LAMBDA_FORMS)
        _known("approximation", self.approximations, registry)
        slopes = dict.fromkeys(s for a in registry.values() for s in a.slopes if s != "none")
        _known("beta policy", self.slopes, slopes)
        _known("space", (*self.spaces, *self.length_spaces), SPACES)
        for name in (*self.precisions, *self.raw_precisions):
            precision_named(name)
        _known("stratum", self.strata, STRATUM_NAMES)
        _known("probe", self.probes, PROBE_NAMES)
        raw_formulas.check(self.raw, registry)

    def _check_meshes(self) -> None:
        """Read every mesh now, so that a bad one does not end a long run; the probe finds them read."""
        if self.meshes and "meshes" not in self.probes:
            raise InputError("a mesh is given, but the probe that measures it is left out", None, "add --probe meshes")
        names = [load(path).name for path in dict.fromkeys(self.meshes)]
        if twice := sorted({n for n in names if names.count(n) > 1} | {n for n in names if n in TESSELLATIONS}):
            raise InputError(f"two meshes are named {twice[0]}", None, "rename one: rows are distinguished by the name")

    def _check_sizes(self) -> None:
        if self.samples < 1 or self.samples > 1 << 40:
            raise InputError(f"samples = {self.samples} is not in 1 .. 2^40", None, "100000 is a good start")
        if self.seed < 0:
            raise InputError(f"seed = {self.seed} is negative", None, "use a whole number >= 0")
        if not self.timing_budget > 0:
            raise InputError(
                f"timing budget = {self.timing_budget} s is not positive", None, "use --no-timing to skip timing"
            )
        if not 1 <= self.processes <= 64:
            raise InputError(f"processes = {self.processes} is not in 1 .. 64", None, "8 give an interval across them")

    def cells(self, registry: Mapping[str, Approximation] = REGISTRY) -> Iterator[Cell]:
        """Every formula with every exponent that it takes, in every precision; each form gated, then ungated.

        Those for raw vectors come last.
        """
        for precision, name in product(self.precisions, self.approximations):
            for formula, alpha in self.formulas(registry[name]):
                yield Cell(formula, alpha, precision)
                if formula.lambda_form != "none":
                    yield Cell(formula, alpha, precision, gated=False)
        for precision, formula in product(raw_formulas.precisions(self), raw_formulas.of(self, registry)):
            if formula.normalises_in(precision):
                spec = formula.spec(registry)
                yield from (Cell(formula, a, precision) for a in self.alphas if spec.accepts(formula.setting(a)))

    def formulas(self, spec: Approximation) -> Iterator[tuple[Formula, float]]:
        """The formulas of this plan that an approximation takes, each with every exponent that it takes."""
        spaces = [s for s in spec.spaces if s in self.spaces]
        gammas = self.gammas if spec.uses_gamma else (None,)
        slopes = [s for s in spec.slopes if s in self.slopes] or spec.slopes[:1]
        forms = [f for f in spec.lambda_forms if f == "none" or f in self.lambda_forms]
        for space, alpha, gamma, slope in product(spaces, self.alphas, gammas, slopes):
            if spec.accepts(Setting(alpha, gamma, slope, space)):
                for form in forms:
                    yield Formula(spec.name, form, gamma, slope, space), alpha


PRESETS: Mapping[str, Plan] = {
    "quick": Plan(),
    "standard": Plan(
        preset="standard",
        alphas=QUICK_ALPHAS + STANDARD_ALPHAS,
        gammas=(1, 2, 4, 8, 16, 32, 64, 128),
        lambda_forms=tuple(LAMBDA_FORMS),
        approximations=tuple(REGISTRY),
        slopes=(*ALL_SLOPES, "lagarde", "unreal"),
        precisions=("float16", "bfloat16", "float32", "float64"),
        strata=STRATUM_NAMES,
        samples=1 << 17,
        raw=RAW,
        raw_precisions=("float16", "bfloat16", "float32", "float64"),
        timing_budget=60.0,
        processes=2,
        skipping=True,
        probes=(*USUAL_PROBES, "contract", "emitted", "inverse"),
    ),
    "full": Plan(
        preset="full",
        alphas=QUICK_ALPHAS + STANDARD_ALPHAS,
        gammas=(1, 2, 4, 8, 16, 32, 64, 128, 256),
        lambda_forms=tuple(LAMBDA_FORMS),
        approximations=tuple(REGISTRY),
        slopes=(*ALL_SLOPES, "lagarde", "unreal"),
        length_spaces=SPACES,
        precisions=("float16", "bfloat16", "float32", "float64"),
        strata=STRATUM_NAMES,
        samples=1 << 20,
        raw=RAW,
        raw_precisions=("float16", "bfloat16", "float32", "float64"),
        timing_budget=600.0,
        processes=8,
        skipping=True,
        probes=PROBE_NAMES,
    ),
}


def preset(name: str) -> Plan:
    """The plan of this name: quick, standard or full."""
    if name not in PRESETS:
        raise UnknownNameError("preset", name, PRESETS)
    return PRESETS[name]


def with_own(plan: Plan, registry: Mapping[str, Approximation]) -> tuple[str, ...]:
    """The approximations of a plan, and those of a registry that we do not ship: plug-ins and the user's own."""
    return tuple(name for name in registry if name in plan.approximations or name not in REGISTRY)


def _known(kind: str, names: Iterable[str], known: Iterable[str]) -> None:
    known = tuple(known)
    for name in names:
        if name not in known:
            raise UnknownNameError(kind, name, known)


def _ordered(names: Iterable[str], order: Iterable[str]) -> tuple[str, ...]:
    chosen = set(names)
    return tuple(n for n in order if n in chosen)
