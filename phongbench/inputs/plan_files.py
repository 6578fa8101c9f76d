"""Plans as people write them: a TOML file, and the options of a command line."""

import re
import tomllib
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from phongbench.errors import InputError, UnknownNameError
from phongbench.inputs.mtl_files import read_exponents
from phongbench.inputs.plan import PRESETS, Plan, preset


def read_toml(path: Path) -> Plan:
    """A plan from a TOML file: `preset` and any field of Plan.

    Raises InputError naming file, line and key for what is missing, malformed, unknown or of the wrong type.
    """
    try:
        text = path.read_text(encoding="utf-8")
        data = tomllib.loads(text)
    except OSError as problem:
        raise InputError(
            f"cannot read the plan: {problem.strerror}", str(path), "give the path of a TOML file"
        ) from problem
    except (ValueError, RecursionError) as problem:  # not TOML, not UTF-8, or a number without end
        raise InputError(
            f"not valid TOML: {problem}", str(path), "see `phongbench run --help` for an example plan"
        ) from problem
    types = {f.name: type(getattr(PRESETS["quick"], f.name)) for f in fields(Plan)}
    values: dict[str, Any] = {}
    for key, value in data.items():
        where = f"{path}:{_line_of(key, text)}"
        if key not in types:
            raise UnknownNameError("plan key", key, types, where)
        values[key] = _typed(key, value, types[key], where)
    base = preset(values.pop("preset", "quick"))
    return replace(base, **values)


def compose(
    path: Path | None = None,
    preset_name: str | None = None,
    materials: Path | None = None,
    *,
    scenes: bool = False,
    note: Callable[[str], None] = lambda _: None,
    **wishes: Any,
) -> Plan:
    """The plan of a command line: a file or a preset, changed by every wish that is not None.

    path       TOML plan; excludes preset_name
    materials  MTL file whose distinct shininess values become the exponents
    scenes     whether to ask the probe of this name, whatever other probes are asked
    note       called with what is odd in the MTL file
    wishes     fields of Plan
    """
    if path and preset_name:
        raise InputError("a plan file and --preset were both given", None, "write `preset = ...` into the plan")
    if materials and wishes.get("alphas"):
        raise InputError("--materials and --alpha were both given", None, "both choose the exponents: leave one out")
    if wishes.get("probes") == ("none",):
        wishes["probes"] = ()
    if materials:
        wishes["alphas"], notes = read_exponents(materials)
        for sentence in notes:
            note(sentence)
    base = read_toml(path) if path else preset(preset_name or "quick")
    plan = replace(base, **{name: value for name, value in wishes.items() if value is not None})
    return replace(plan, probes=tuple(dict.fromkeys((*plan.probes, "scenes")))) if scenes else plan


def _typed(key: str, value: Any, wanted: type, where: str) -> Any:
    if wanted is tuple:
        members = value if isinstance(value, list) else [value]
        number = key in ("alphas", "gammas")
        for member in members:
            if isinstance(member, bool) or not isinstance(member, (int, float) if number else str):
                raise InputError(f"{key} = {member!r} is not a {'number' if number else 'name'}", where)
            if key == "gammas" and not isinstance(member, int):
                raise InputError(f"{key} = {member!r} is not a whole number", where)
        return tuple(members)
    if wanted is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if type(value) is not wanted:
        raise InputError(f"{key} = {value!r} is not of type {wanted.__name__}", where)
    return value


def _line_of(key: str, text: str) -> int:
    pattern = re.compile(rf"^\s*[\"']?{re.escape(key)}[\"']?\s*[=.]|^\s*\[+\s*{re.escape(key)}\s*\]+")
    return next((number for number, line in enumerate(text.splitlines(), 1) if pattern.match(line)), 1)
