"""What may be promised of a formula: a bound of its error that no pair of vectors of the stated domain breaks.

Domain: pairs of vectors that the precision holds, made unit as shaders do it, v * (1 / sqrt(v.v)) or v / sqrt(v.v),
with products rounded or fused, then with lengths as wrong as the budget allows. The bound is proven by enclosures
(accuracy/enclosures). A formula whose body cannot be enclosed is searched, which takes about a second, and the result
widened by the rounding law. Of what is only sampled nothing is promised.

By contract the bound is proven for the code that a shader runs, with a limit for over-long vectors and without, on
every device that keeps the accuracies of WGSL and Vulkan, where vectors are made unit as v * inversesqrt(v.v).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from phongbench.accuracy.enclosures import contract
from phongbench.accuracy.enclosures.bounds import NotEnclosedError, largest
from phongbench.accuracy.enclosures.coordinates import normalised
from phongbench.accuracy.enclosures.devices import LARGEST_PRODUCT
from phongbench.analysis.error_budget import Budget
from phongbench.compiler.precisions import precision_named
from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.formulas.recipes import PAIR
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.rounding_law import rounding_bound
from phongbench.formulas.spec import Approximation

#: of a range of exponents the bound is proven at some, each at most so many times the one before
STEP = 1.2
#: an answer proves a handful of formulas, of which each takes some ten milliseconds, tables up to half a second
SECONDS = 0.1
DEVICES = "on every device that keeps the accuracies of WGSL and Vulkan"
UNIT_ON_DEVICES = "all pairs of vectors made unit there, v * inversesqrt(v.v)"
DOMAIN = "all pairs of vectors made unit as shaders do it, v * (1 / sqrt(v.v)) or v / sqrt(v.v), fused or not"
_HALF_DOMAIN = "all N, L and V, at every incidence and azimuth, against Phong of the angle between R and V"


@dataclass(frozen=True)
class Promise:
    """A bound of the error, and what it rests on.

    bound     no error in the domain is larger; infinite where nothing is promised
    coverage  contract: proven for every conforming device; certified: proven for what runs here; searched: the worst
              that a search found, with rounding, or proven at some exponents of a range; sampled: nothing is promised
    """

    bound: float
    coverage: str

    @property
    def kept(self) -> bool:
        """False where nothing is promised."""
        return self.coverage != "sampled" and math.isfinite(self.bound)


#: ways to remove lengths that leave nothing of them but rounding
EXACT_WAYS = ("each", "once", "squared")
#: roundings before the formula's own, in those that the rounding law allows for: R from N, L and V errs by up to 13.5
#: eps of its length where N is normalised first, 6.5 where nothing is, and one root of squares by 4.25
MORE_ROUNDINGS = 2
UNPROMISED = Promise(math.inf, "sampled")


def promise(
    formula: Formula,
    budget: Budget,
    registry: Mapping[str, Approximation] = REGISTRY,
    *,
    sharp: bool = True,
    search: bool = True,
) -> Promise:
    """What may be promised of a formula over the exponents, precision and lengths of a budget.

    sharp   False: the bound only says on which side of the budget it is, which is sooner known; of a range without the
            room for what lies between the exponents that are proven
    search  False: a formula that cannot be enclosed is not searched, and nothing is promised of it
    """
    if formula.approximation not in registry or (formula.raw and not budget.contract):
        return UNPROMISED
    spec, within = formula.spec(registry), None if sharp else budget.max_error
    ranged = budget.alpha.continuous
    bounds, coverage = list[float](), "contract" if budget.contract else "searched" if ranged else "certified"
    for alpha in exponents_of(budget):
        case = _Case(spec, formula, alpha, budget.precision, budget.length_error, budget.contract)
        try:
            bound = _proven(case, within)
        except NotEnclosedError:
            if budget.contract or not search:
                return UNPROMISED
            bound, coverage = _searched(case), "searched"
        bounds.append(bound)
        if within is not None and bound > within:
            return Promise(bound, coverage)
    room = _between(bounds, budget.precision) if ranged and sharp else 0.0
    return Promise(max(bounds) + room, coverage)


def promise_half(formula: Formula, budget: Budget, registry: Mapping[str, Approximation] = REGISTRY) -> Promise:
    """What may be promised of a formula of (N, H) over all configurations of N, L and V: that both it and Phong lie
    between 0 and 1, and no less than that.

    Where N is tilted by p out of the plane of L and V, at incidence i, R.V = 1 - 2 cos^2(i) sin^2(p) and N.H = cos(p):
    towards grazing incidence Phong stays near 1 at every tilt, where N.H has fallen to nothing. On coplanar vectors,
    where N.H is the cosine of half the angle, `promise` says more.
    """
    if (
        formula.approximation not in REGISTRY
        or registry.get(formula.approximation) is not REGISTRY[formula.approximation]
    ):
        return UNPROMISED
    if formula.raw or budget.length_error or not isinstance(formula.slope, str):
        return UNPROMISED
    if budget.contract:  # on coplanar vectors the value is so near to what lies between 0 and 1
        coplanar = promise(formula, budget, registry)
        return Promise(1.0 + coplanar.bound, coplanar.coverage)
    room = max(rounding_bound(formula.gamma, alpha, budget.precision, "half") for alpha in budget.alpha.values)
    return Promise(1.0 + room, "certified")


def domain(space: str) -> str:
    """The vectors that a promise holds for, in words."""
    return _HALF_DOMAIN if space == "half" else DOMAIN


def promise_raw(
    formula: Formula,
    budget: Budget,
    registry: Mapping[str, Approximation] = REGISTRY,
    *,
    any_length: bool = True,
    sharp: bool = True,
    search: bool = True,
) -> Promise:
    """What may be promised of a formula for raw vectors: that of the same formula on its pair, with more rounding.

    any_length  the lengths are any whose squares and products the precision holds; else as wrong as the budget says
    """
    exact, held = formula.normalise in EXACT_WAYS, precision_named(budget.precision)
    if any_length and not (held.tiny <= 1 / LARGEST_PRODUCT and held.largest >= LARGEST_PRODUCT):
        return UNPROMISED
    if formula.space != "reflect" or formula.normalise not in ("none", *EXACT_WAYS) or (any_length and not exact):
        return UNPROMISED
    growth = 3 if formula.recipe == "lengthwise" else 1  # R is then as long as the square of N times L
    left = 0.0 if exact else math.expm1(growth * math.log1p(budget.length_error))
    if budget.contract:  # the emitted code is enclosed with its recipe; squares leave float16's range
        known = budget.precision == "float32"
        return promise(formula, budget, registry, sharp=sharp) if known else UNPROMISED
    on_pair = replace(formula, recipe=PAIR, normalise="none")
    room = rounding_bound(formula.gamma, MORE_ROUNDINGS * max(budget.alpha.values), budget.precision)
    if room >= budget.max_error and not sharp:
        return Promise(room, "certified")  # beyond the budget, whatever the formula
    smaller = replace(budget, length_error=left, max_error=budget.max_error if sharp else budget.max_error - room)
    kept = promise(on_pair, smaller, registry, sharp=sharp, search=search)
    return Promise(kept.bound + room, kept.coverage)


def bound_at(
    formula: Formula, alpha: float, registry: Mapping[str, Approximation] = REGISTRY, *, length_error: float = 0.0
) -> float | None:
    """The bound in float32 at one exponent, None where nothing is promised: what a shader's header may say."""
    if not alpha > 0:
        return None  # exact Phong is then the same everywhere
    budget = Budget.of(alpha, 1.0, length_error, space=formula.space)
    judge = promise_raw if formula.raw else promise
    kept = judge(formula, budget, registry, search=False)
    return kept.bound if kept.kept else None


def contract_at(
    formula: Formula,
    alpha: float,
    precision: str = "float32",
    registry: Mapping[str, Approximation] = REGISTRY,
    *,
    length_error: float = 0.0,
    limited: bool = True,
) -> float | None:
    """The bound at one exponent on every conforming device, None where nothing is promised: for a shader's header.

    precision  float32 or float16
    limited    whether the code limits values of over-long vectors to 1
    """
    if formula.approximation not in registry or not alpha > 0:
        return None
    case = _Case(formula.spec(registry), formula, alpha, precision, length_error, True, limited)
    try:
        bound = _proven(case, None)
    except NotEnclosedError:
        return None
    return bound if math.isfinite(bound) else None


def without_contract(
    formula: Formula,
    alpha: float,
    precision: str = "float32",
    registry: Mapping[str, Approximation] = REGISTRY,
    *,
    length_error: float = 0.0,
    limited: bool = True,
) -> str:
    """Why `contract_at` has no bound, and the one short of right angles where there is one, for a shader's header; ""
    where nothing is known of the formula.
    """
    if formula.approximation not in registry or not alpha > 0:
        return ""
    spec, setting, held = formula.spec(registry), formula.setting(alpha), precision_named(precision)
    reason = contract.why_not(spec, formula, setting, held)
    try:
        short = contract.largest(
            spec, formula, setting, held, length_error=length_error, domain=contract.SHORT, limited=limited
        )
    except NotEnclosedError:
        short = math.inf
    most = f"; {contract.short_of(formula)} it errs by at most {short:.3g} there: proven" if short < math.inf else ""
    return f"no bound holds {DEVICES}: {reason}{most}"


def seconds(budget: Budget) -> float:
    """What an answer may take on one core, its formulas proven at every exponent; for admission only."""
    return SECONDS * len(exponents_of(budget))


def exponents_of(budget: Budget) -> tuple[float, ...]:
    """The exponents that a bound is proven at: those listed, or enough of a range, its ends among them."""
    if not budget.alpha.continuous:
        return budget.alpha.values
    low, high = budget.alpha.values
    count = max(3, math.ceil(math.log(high / low) / math.log(STEP)) + 1)
    return tuple(float(x) for x in np.geomspace(low, high, count))


def _between(bounds: list[float], precision: str) -> float:
    """How much larger than at its neighbours a bound may be between them: half a step, and coefficients' rounding."""
    steps = np.abs(np.diff(bounds)) if np.isfinite(bounds).all() else np.zeros(1)
    return 0.5 * float(steps.max()) + precision_named(precision).eps


@dataclass(frozen=True)
class _Case:
    """One formula at one exponent on one domain."""

    spec: Approximation
    formula: Formula
    alpha: float
    precision: str
    length_error: float
    contract: bool = False
    limited: bool = False


@lru_cache(4096)
def _proven(case: _Case, within: float | None) -> float:
    """The proven bound; infinite at an exponent that the formula does not take."""
    setting = case.formula.setting(case.alpha)
    try:
        case.spec.check(setting)
    except InputError:
        return math.inf
    precision = precision_named(case.precision)
    form, length_error = case.formula.lambda_form, case.length_error
    if case.contract:
        return contract.largest(
            case.spec, case.formula, setting, precision, length_error=length_error, budget=within, limited=case.limited
        )
    return largest(case.spec, form, setting, precision, length_error=length_error, budget=within)


@lru_cache(1024)
def _searched(case: _Case) -> float:
    """What a search finds, and the rounding that it may have missed."""
    from phongbench.accuracy.probes.search import worst_error  # late: it compiles

    reach = normalised(precision_named(case.precision), case.length_error).high - 1
    missed = rounding_bound(case.formula.gamma, case.alpha, case.precision, case.formula.space)
    return worst_error(case.spec, case.formula, case.alpha, case.precision, reach) + missed
