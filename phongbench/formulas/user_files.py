"""Formulas from users' own files, which `--with` names: read, run and checked as if they were ours."""

import re
import sys
from collections.abc import Iterable, Mapping
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import MappingProxyType, ModuleType

from phongbench.compiler.lowering import PRECISIONS, lower
from phongbench.errors import InputError
from phongbench.formulas.registry import REGISTRY, blame, example
from phongbench.formulas.spec import Approximation


def load_file(path: str | Path) -> tuple[Approximation, ...]:
    """The approximations of a user's module: a file of the same shape as those in this folder, with SPEC or SPECS.

    Raises InputError, naming file and line, if it cannot be read or run, offers nothing, or takes a name of ours;
    KernelError if a kernel cannot be compiled.
    """
    path = Path(path).resolve()
    module = _run(path)
    found = getattr(module, "SPECS", None) or (getattr(module, "SPEC", None),)
    if not isinstance(found, tuple | list) or not all(isinstance(s, Approximation) for s in found):
        fix = "define SPEC = Approximation(...), or SPECS, a tuple of them"
        raise InputError("no approximation in this file", str(path), fix)
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
