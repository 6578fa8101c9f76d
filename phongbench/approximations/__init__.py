"""The registry. Adding an approximation: its file in this folder, its name in FAMILIES."""

import re
import sys
import traceback
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from itertools import product
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import NoReturn

from phongbench.errors import InputError, PhongbenchError, UnknownNameError
from phongbench.lowering import PRECISIONS, lower
from phongbench.spec import Approximation, Setting

#: the modules of this folder, in the order in which they are shown
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
)


def _specs(family: str) -> tuple[Approximation, ...]:
    module = import_module(f"{__name__}.{family}")
    return tuple(getattr(module, "SPECS", ())) or (module.SPEC,)


REGISTRY: Mapping[str, Approximation] = MappingProxyType({s.name: s for family in FAMILIES for s in _specs(family)})


def get(name: str, registry: Mapping[str, Approximation] = REGISTRY) -> Approximation:
    """The approximation of this name; UnknownNameError lists the known ones."""
    if name not in registry:
        raise UnknownNameError("approximation", name, registry)
    return registry[name]


def load_file(path: str | Path) -> tuple[Approximation, ...]:
    """The approximations of a user's module: a file of the same shape as those in this folder, with SPEC or SPECS.

    Raises InputError, naming file and line, if it cannot be read or run, offers nothing, or takes a name of ours;
    KernelError if a kernel cannot be compiled.
    """
    path = Path(path).resolve()
    module = _run(path)
    found = getattr(module, "SPECS", None) or (getattr(module, "SPEC", None),)
    if not isinstance(found, tuple | list) or not all(isinstance(s, Approximation) for s in found):
        mend = "define SPEC = Approximation(...), or SPECS, a tuple of them"
        raise InputError("no approximation in this file", str(path), mend)
    for spec in found:
        _examine(spec, path)
    return tuple(found)


def registry_with(files: Iterable[str | Path]) -> Mapping[str, Approximation]:
    """Our registry and the approximations of these files; InputError if two have the same name."""
    known = dict(REGISTRY)
    for path in files:
        for spec in load_file(path):
            if spec.name in known:
                raise InputError(f"the approximation {spec.name!r} is loaded twice", str(path), "give it another name")
            known[spec.name] = spec
    return MappingProxyType(known)


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
        _blame(problem, path, path.name)


def _run(path: Path) -> ModuleType:
    if not path.is_file():
        raise InputError("no such file", str(path), "--with takes a Python file that defines SPEC = Approximation(...)")
    description = spec_from_file_location(f"phongbench_with_{re.sub(r'[^0-9A-Za-z]', '_', path.stem)}", path)
    if description is None or description.loader is None:
        raise InputError("not a Python file", str(path), "its name must end in .py")
    module = module_from_spec(description)
    sys.modules[module.__name__] = module
    try:
        description.loader.exec_module(module)
    except Exception as problem:  # noqa: BLE001 - a user's module may raise anything
        del sys.modules[module.__name__]
        _blame(problem, path)
    return module


def _examine(spec: Approximation, path: Path) -> None:
    """Check that the name is free, that the coefficients fit the kernel, and that the kernel can be compiled."""
    if not re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", spec.name):
        raise InputError(f"{spec.name!r} is not a name", str(path), "use a-z, 0-9 and hyphens, e.g. my-lyon")
    if spec.name in REGISTRY:
        raise InputError(f"phongbench has an approximation {spec.name!r}", str(path), "give yours another name")
    setting = example(spec)
    try:
        values = spec.coefficients(setting)
    except Exception as problem:  # noqa: BLE001 - as above
        _blame(problem, path)
    wanted = {a for a in spec.arguments if a != "table"}
    if set(values) != wanted:
        raise InputError(
            f"the coefficients of {spec.name!r} are {sorted(values)}, but its kernel takes {sorted(wanted)}", str(path),
            "coefficients(setting) returns {argument: value} for every argument of the kernel but the first and table",
        )  # fmt: skip
    for precision in PRECISIONS.values():
        lower(spec.kernel, precision, **{name: int(values[name]) for name in spec.knowns})


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


def _blame(problem: Exception, path: Path, name: str | None = None) -> NoReturn:
    """Raise an InputError naming the last line of the user's file that led to the problem.

    name  what to call the file; None: its path
    """
    called = name or str(path)
    if isinstance(problem, SyntaxError):
        raise InputError(problem.msg, f"{called}:{problem.lineno}", "the file must be valid Python") from problem
    lines = [frame.lineno for frame in traceback.extract_tb(problem.__traceback__) if Path(frame.filename) == path]
    what = problem.what if isinstance(problem, PhongbenchError) else f"{type(problem).__name__}: {problem}"
    mend = (isinstance(problem, PhongbenchError) and problem.mend) or "this line of the file raised it"
    raise InputError(what, f"{called}:{lines[-1]}" if lines else called, mend) from problem
