"""Formulas that do not ship with us, read, run and checked as if they did: users' files, which `--with` names, and
plug-ins, which installed distributions offer by entry points of the group `phongbench.approximations`.
"""

import os
import re
import sys
import warnings
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import MappingProxyType, ModuleType

from phongbench.compiler.lowering import PRECISIONS, lower
from phongbench.errors import InputError, PhongbenchError
from phongbench.formulas.registry import REGISTRY, blame, example, offered
from phongbench.formulas.spec import Approximation
from phongbench.support.user_paths import reading

#: an entry point of this group names an Approximation, several in a tuple or list, or a module with SPEC or SPECS
GROUP = "phongbench.approximations"


def load_file(path: str | Path) -> tuple[Approximation, ...]:
    """The approximations of a Python file of your own: of the same shape as ours, with SPEC or SPECS.

    Raises InputError, naming file and line, if it cannot be read or run, offers nothing, or takes a name of ours;
    KernelError if a kernel cannot be compiled.

    >>> [spec.name for spec in pb.load_file("rational.py")]
    ['rational']
    """
    path = Path(os.path.realpath(path))
    specs = offered(_run(path))
    if not specs:
        fix = "define SPEC = Approximation(...), or SPECS, a tuple of them"
        raise InputError("no approximation in this file", str(path), fix)
    for spec in specs:
        _examine(spec, path)
    return specs


@cache
def installed() -> Mapping[str, Approximation]:
    """Our registry and the plug-ins'. One that cannot be used is left out; a warning names its distribution."""
    known = dict(REGISTRY)
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name):
        try:
            known = extended(_plugged(entry), known)
        except Exception as problem:  # noqa: BLE001 - another distribution's code may raise anything
            what = problem.what if isinstance(problem, PhongbenchError) else f"{type(problem).__name__}: {problem}"
            origin = f"{entry.dist.name} {entry.dist.version}" if entry.dist else "an unknown distribution"
            warnings.warn(f"the plug-in {entry.name!r} of {origin} is left out: {what}", RuntimeWarning, stacklevel=2)
    return MappingProxyType(known)


def registry_with(files: Iterable[str | Path]) -> Mapping[str, Approximation]:
    """Our registry, the plug-ins' and the approximations of these files; InputError if two have the same name."""
    known = installed()
    for path in files:
        known = extended(load_file(path), known, str(path))
    return known


def extended(
    specs: Iterable[Approximation], known: Mapping[str, Approximation], where: str | None = None
) -> dict[str, Approximation]:
    """These approximations beside the known ones; InputError at this place if two have the same name."""
    more = dict(known)
    for spec in specs:
        if spec.name in more:
            raise InputError(f"the approximation {spec.name!r} is loaded twice", where, "give it another name")
        more[spec.name] = spec
    return more


def _plugged(entry: EntryPoint) -> tuple[Approximation, ...]:
    """What an entry point offers, checked."""
    value = entry.load()
    specs = (value,) if isinstance(value, Approximation) else offered(value) or value
    if not isinstance(specs, tuple | list) or not all(isinstance(spec, Approximation) for spec in specs):
        raise InputError(f"{entry.value} is no approximation")
    for spec in specs:
        _examine(spec, Path(spec.kernel.__code__.co_filename))
    return tuple(specs)


def _run(path: Path) -> ModuleType:
    with reading(path, "file of the formula", "--with takes a Python file that defines SPEC = Approximation(...)"):
        path.open("rb").close()
    description = spec_from_file_location(f"phongbench_with_{re.sub(r'[^0-9A-Za-z]', '_', path.stem)}", path)
    if description is None or description.loader is None:
        raise InputError("not a Python file", str(path), "its name must end in .py")
    module = module_from_spec(description)
    sys.modules[module.__name__] = module
    try:
        description.loader.exec_module(module)
    except Exception as problem:  # noqa: BLE001 - a user's module may raise anything
        del sys.modules[module.__name__]
        blame(problem, path)
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
        blame(problem, path)
    wanted = {a for a in spec.arguments if a != "table"}
    if set(values) != wanted:
        raise InputError(
            f"the coefficients of {spec.name!r} are {sorted(values)}, but its kernel takes {sorted(wanted)}",
            str(path),
            "coefficients(setting) returns {argument: value} for every argument of the kernel but the first and table",
        )
    for precision in PRECISIONS.values():
        lower(spec.kernel, precision, **{name: int(values[name]) for name in spec.knowns})
