"""All formulas that ship. Adding one: its file in `approximations/`, its name in FAMILIES."""

import traceback
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from importlib import import_module
from itertools import product
from pathlib import Path
from types import MappingProxyType
from typing import Any, NoReturn

from phongbench.errors import InputError, PhongbenchError, UnknownNameError
from phongbench.formulas.spec import Approximation, Setting

#: the modules of approximations/, in the order in which they are shown
FAMILIES = (
    "phong",
    "lyon",
    "lyon_quadratic",
    "gaussian",
    "schlick",
    "blinn",
    "integer_power",
    "table_x",
    "table_u",
    "bit_trick",
    "kuijk_blake",
    "doom3",
    "gaussian_quadratic",
)


def offered(module: object) -> tuple[Approximation, ...]:
    """What a module offers: its SPECS, or its SPEC alone; empty unless all of it are approximations."""
    specs: Any = getattr(module, "SPECS", None) or (getattr(module, "SPEC", None),)
    whole = isinstance(specs, tuple | list) and all(isinstance(spec, Approximation) for spec in specs)
    return tuple(specs) if whole else ()


def specs_of(family: str) -> tuple[Approximation, ...]:
    """What a module of approximations/ offers."""
    return offered(import_module(f"phongbench.formulas.approximations.{family}"))


REGISTRY: Mapping[str, Approximation] = MappingProxyType({s.name: s for family in FAMILIES for s in specs_of(family)})


def get(name: str, registry: Mapping[str, Approximation] = REGISTRY) -> Approximation:
    """The approximation of this name; UnknownNameError lists the known ones."""
    if name not in registry:
        raise UnknownNameError("approximation", name, registry)
    return registry[name]


_RAISED = "this line of the file raised it"
#: for files written for modules of phongbench that have moved
_IMPORTS = (
    "write `import phongbench as pb`, and pb.Approximation, pb.Cost, pb.Source, pb.ALPHA, pb.GAMMA; "
    "helpers of kernels are in pb.elementary"
)


@contextmanager
def guarded(spec: Approximation) -> Iterator[None]:
    """Whatever a user's formula raises inside is an InputError that names its file and line; ours raise what they do.

    The file is named without its folder: what failed is stored with the results.
    """
    try:
        yield
    except Exception as problem:
        if isinstance(problem, PhongbenchError) or spec.name in REGISTRY:
            raise
        path = Path(spec.kernel.__code__.co_filename)
        blame(problem, path, path.name)


def example(spec: Approximation) -> Setting:
    """A setting this approximation accepts, near alpha = 10 and gamma = 8 if it can."""
    alphas, gammas = (10.0, 8.0, 32.0, 1.0, 2.0, 64.0, 256.0), (8, 4, 16, 2, 1, 64)
    for alpha, gamma in product(alphas, gammas if spec.uses_gamma else (None,)):
        setting = Setting(alpha, gamma, spec.slopes[0], spec.spaces[0])
        try:
            spec.check(setting)
        except InputError:
            continue
        return setting
    raise InputError(f"{spec.name!r} accepts no alpha of {alphas}", spec.name, "check its parameters and accepts")


def blame(problem: Exception, path: Path, name: str | None = None) -> NoReturn:
    """Raise an InputError naming the last line of the user's file that led to the problem.

    name  what to call the file; None: its path
    """
    called = name or str(path)
    if isinstance(problem, SyntaxError):
        raise InputError(problem.msg, f"{called}:{problem.lineno}", "the file must be valid Python") from problem
    lines = [frame.lineno for frame in traceback.extract_tb(problem.__traceback__) if Path(frame.filename) == path]
    where = f"{called}:{lines[-1]}" if lines else called
    if isinstance(problem, PhongbenchError):
        raise InputError(problem.what, where, problem.fix or _RAISED) from problem
    ours = isinstance(problem, ImportError) and (problem.name or "").partition(".")[0] == "phongbench"
    raise InputError(f"{type(problem).__name__}: {problem}", where, _IMPORTS if ours else _RAISED) from problem


def describe(spec: Approximation) -> dict[str, Any]:
    """An approximation as plain data, for the command line and the service."""
    from phongbench.formulas.formula import normalises  # late: formulas are read with the registry

    return {
        "name": spec.name,
        "title": spec.title,
        "kind": spec.kind,
        "formula": spec.formula,
        "lambda_forms": list(spec.lambda_forms),
        "spaces": list(spec.spaces),
        "beta_policies": list(spec.slopes),
        "parameters": [
            {"name": p.name, "meaning": p.meaning, "low": p.low, "high": p.high, "unit": p.unit, "whole": p.whole}
            for p in spec.parameters
        ],
        "domain": spec.domain,
        "cost": spec.cost.text,
        "support": _support(spec),
        "source": spec.source.citation,
        "also": [source.citation for source in spec.also],
        "takes_alpha_0": takes_zero(spec),
        "normalise": normalises(spec),
    }


def takes_zero(spec: Approximation) -> bool:
    """True if it takes alpha 0, with its first slope at least, and is Phong's constant there."""
    return spec.at_zero is not None and spec.at_zero(replace(example(spec), alpha=0.0)) is None


def _support(spec: Approximation) -> dict[str, Any] | None:
    """Where the formula is exactly 0, by the example of one setting; None where it never is."""
    if spec.cutoff is None:
        return None
    setting = example(spec)
    return {"alpha": setting.alpha, "gamma": setting.gamma, "zero_beyond_lambda": spec.cutoff(setting)}
