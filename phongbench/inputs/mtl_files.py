"""Real exponents and colours: the classic table of OpenGL materials, and MTL files."""

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from phongbench.errors import InputError

Colour = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Material:
    """What a surface does to light.

    name       str                     as its source calls it, with hyphens
    ambient    (r, g, b) in 0 .. 1     ka
    diffuse    (r, g, b) in 0 .. 1     kd
    specular   (r, g, b) in 0 .. 1     ks
    shininess  float >= 0              alpha; 0 means no highlight
    """

    name: str
    ambient: Colour = (0.2, 0.2, 0.2)
    diffuse: Colour = (0.8, 0.8, 0.8)
    specular: Colour = (0.0, 0.0, 0.0)
    shininess: float = 0.0


# Source OPENGL_MATERIALS. Columns: name, ambient, diffuse, specular, shininess / 128.
_OPENGL = """
emerald        0.0215   0.1745   0.0215   0.07568  0.61424    0.07568    0.633      0.727811   0.633      0.6
jade           0.135    0.2225   0.1575   0.54     0.89       0.63       0.316228   0.316228   0.316228   0.1
obsidian       0.05375  0.05     0.06625  0.18275  0.17       0.22525    0.332741   0.328634   0.346435   0.3
pearl          0.25     0.20725  0.20725  1        0.829      0.829      0.296648   0.296648   0.296648   0.088
ruby           0.1745   0.01175  0.01175  0.61424  0.04136    0.04136    0.727811   0.626959   0.626959   0.6
turquoise      0.1      0.18725  0.1745   0.396    0.74151    0.69102    0.297254   0.30829    0.306678   0.1
brass          0.329412 0.223529 0.027451 0.780392 0.568627   0.113725   0.992157   0.941176   0.807843   0.21794872
bronze         0.2125   0.1275   0.054    0.714    0.4284     0.18144    0.393548   0.271906   0.166721   0.2
chrome         0.25     0.25     0.25     0.4      0.4        0.4        0.774597   0.774597   0.774597   0.6
copper         0.19125  0.0735   0.0225   0.7038   0.27048    0.0828     0.256777   0.137622   0.086014   0.1
gold           0.24725  0.1995   0.0745   0.75164  0.60648    0.22648    0.628281   0.555802   0.366065   0.4
silver         0.19225  0.19225  0.19225  0.50754  0.50754    0.50754    0.508273   0.508273   0.508273   0.4
black-plastic  0        0        0        0.01     0.01       0.01       0.5        0.5        0.5        0.25
cyan-plastic   0        0.1      0.06     0        0.50980392 0.50980392 0.50196078 0.50196078 0.50196078 0.25
green-plastic  0        0        0        0.1      0.35       0.1        0.45       0.55       0.45       0.25
red-plastic    0        0        0        0.5      0          0          0.7        0.6        0.6        0.25
white-plastic  0        0        0        0.55     0.55       0.55       0.7        0.7        0.7        0.25
yellow-plastic 0        0        0        0.5      0.5        0          0.6        0.6        0.5        0.25
black-rubber   0.02     0.02     0.02     0.01     0.01       0.01       0.4        0.4        0.4        0.078125
cyan-rubber    0        0.05     0.05     0.4      0.5        0.5        0.04       0.7        0.7        0.078125
green-rubber   0        0.05     0        0.4      0.5        0.4        0.04       0.7        0.04       0.078125
red-rubber     0.05     0        0        0.5      0.4        0.4        0.7        0.04       0.04       0.078125
white-rubber   0.05     0.05     0.05     0.5      0.5        0.5        0.7        0.7        0.7        0.078125
yellow-rubber  0.05     0.05     0        0.5      0.5        0.4        0.7        0.7        0.04       0.078125
"""


def _row(line: str) -> Material:
    name, *numbers = line.split()
    v = [float(n) for n in numbers]
    return Material(name, (v[0], v[1], v[2]), (v[3], v[4], v[5]), (v[6], v[7], v[8]), 128 * v[9])


#: the 24 materials of the OpenGL teapots demo (source OPENGL_MATERIALS)
OPENGL: tuple[Material, ...] = tuple(_row(line) for line in _OPENGL.strip().splitlines())

#: what an MTL file's shininess may be
LARGEST_NS = 1000.0


def exponents(materials: Iterable[Material]) -> tuple[float, ...]:
    """The distinct positive shininesses, ascending: the alphas worth studying for these materials."""
    return tuple(sorted({m.shininess for m in materials if m.shininess > 0}))


def read_mtl(path: str | Path) -> tuple[Material, ...]:
    """The materials of a Wavefront MTL file, in its order: newmtl, Ns, Ka, Kd and Ks; all else is skipped.

    Raises InputError naming file and line where a number is missing, malformed or out of range, where a value stands
    before the first newmtl, and if no material has an Ns.
    """
    path = Path(path)
    try:
        lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    except (OSError, ValueError) as problem:  # ValueError: a name that no file can have
        what = f"cannot read the MTL file: {getattr(problem, 'strerror', None) or problem}"
        raise InputError(what, str(path), "give the path of a .mtl file") from problem
    found: list[Material] = []
    shiny = False
    for number, line in enumerate(lines, 1):
        key, *values = line.split("#")[0].split() or [""]
        where = f"{path}:{number}"
        if key == "newmtl":
            found.append(_named(values, where, found))
        elif key in ("Ns", "Ka", "Kd", "Ks"):
            if not found:
                raise InputError(f"{key} before the first newmtl", where, "start each material with: newmtl NAME")
            found[-1] = _with(found[-1], key, values, where)
            shiny = shiny or key == "Ns"
    if not shiny:
        raise InputError("no material has a shininess", str(path), "an MTL material needs a line like: Ns 96.08")
    return tuple(found)


def _named(values: list[str], where: str, found: list[Material]) -> Material:
    if not values:
        raise InputError("newmtl without a name", where, "write: newmtl NAME")
    name = "-".join(values)
    if any(m.name == name for m in found):
        raise InputError(f"the material {name!r} is defined twice", where, "rename one of them")
    return Material(name)


def _with(material: Material, key: str, values: list[str], where: str) -> Material:
    """The material with the value of one line."""
    if key == "Ns":
        if len(values) != 1:
            raise InputError(f"Ns takes one number, not {len(values)}", where, "write: Ns 96.08")
        return replace(material, shininess=_number(values[0], "Ns", LARGEST_NS, where))
    if values and values[0] in ("spectral", "xyz"):
        raise InputError(f"{key} {values[0]} is not supported", where, f"write {key} as red, green and blue")
    if len(values) not in (1, 3):
        raise InputError(f"{key} takes one or three numbers, not {len(values)}", where, f"write: {key} 0.8 0.8 0.8")
    red, *others = (_number(v, key, 1.0, where) for v in values)
    green, blue = others or (red, red)  # the format: green and blue default to red
    colour = (red, green, blue)
    if key == "Ka":
        return replace(material, ambient=colour)
    return replace(material, diffuse=colour) if key == "Kd" else replace(material, specular=colour)


def _number(text: str, key: str, largest: float, where: str) -> float:
    # float() also takes nan, infinity and 1_0, none of which belongs here
    value = float(text) if re.fullmatch(r"[-+.\deE]+", text) and _parses(text) else math.nan
    fix = f"{key} is a number from 0 to {largest:g}"
    if math.isnan(value):
        raise InputError(f"{key} is {text!r}, not a number", where, fix)
    if not 0 <= value <= largest:
        raise InputError(f"{key} = {text} is outside 0 .. {largest:g}", where, fix)
    return value


def _parses(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
