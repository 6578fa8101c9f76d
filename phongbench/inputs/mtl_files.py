"""Real exponents and colours: the classic table of OpenGL materials, and MTL files."""

import math
import os
import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from phongbench.errors import InputError
from phongbench.inputs.wavefront_text import Notes, name, numbered, read, without_comment

Colour = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Material:
    """What a surface does to light.

    name       str                     as its source calls it
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

#: what an MTL file's shininess may be: the largest alpha
LARGEST_NS = 1e5
#: the colours of a material by their keyword
_COLOURS = {"Ka": "ambient", "Kd": "diffuse", "Ks": "specular"}
#: what is lost with keywords that are ignored; those of textures begin so
_TEXTURES = ("map_", "bump", "disp", "decal", "refl", "norm")
_LOST = dict.fromkeys(("d", "Tr", "Tf", "Ni", "sharpness"), "everything is opaque")
_LOST |= {"illum": "every material has all terms of Phong", "Ke": "materials give no light"}
_LOST |= dict.fromkeys(("Pr", "Pm", "Ps", "Pc", "Pcr", "aniso", "anisor"), "it belongs to another reflection model")


@dataclass(frozen=True)
class MtlFiles:
    """The materials of MTL files.

    materials  in the order of their first definitions; of several with the same name the last counts
    notes      what is changed or ignored, each with its file
    """

    materials: tuple[Material, ...]
    notes: tuple[str, ...] = ()

    def find(self, text: str) -> Material | None:
        """The material that a usemtl line names, which may end in a comment; None if there is none."""
        named = {m.name: m for m in self.materials}
        return named.get(text) or named.get(without_comment(text))


def exponents(materials: Iterable[Material]) -> tuple[float, ...]:
    """The distinct positive shininesses, ascending: the alphas worth studying for these materials."""
    return tuple(sorted({m.shininess for m in materials if m.shininess > 0}))


def read_exponents(path: str | Path) -> tuple[tuple[float, ...], tuple[str, ...]]:
    """The exponents of an MTL file, and notes on what is odd in it; InputError if there are none."""
    read = read_mtl(path)
    if not (alphas := exponents(read.materials)):
        raise InputError("no material has a positive Ns", str(path), "an MTL material needs a line like: Ns 96.08")
    return alphas, read.notes


def read_mtl(*paths: str | Path) -> MtlFiles:
    """The materials of Wavefront MTL files: newmtl, Ns, Ka, Kd and Ks; all else is ignored, and noted.

    Colours above 1 count as 1. Without a positive Ns a material has no highlight.
    Raises InputError naming file and line where a number is missing, malformed or out of range, and where a value
    stands before the first newmtl.
    """
    materials: dict[str, Material] = {}
    notes: list[str] = []
    for path in map(Path, paths):
        noted = Notes()
        for number, material in _definitions(path, noted):
            if materials.get(material.name, material) != material:
                noted.add(f"the material {material.name!r} is defined again, differently: the last one counts", number)
            if max(material.specular) > 0 and material.shininess == 0:
                noted.add("a material whose Ks has no positive Ns gets no highlight", number)
            materials[material.name] = material
        notes += [f"{path}: {sentence}" for sentence in noted.sentences()]
    short = Counter(map(without_comment, materials))
    named = [replace(m, name=without_comment(n)) if short[without_comment(n)] == 1 else m for n, m in materials.items()]
    return MtlFiles(tuple(named), tuple(notes))


def _definitions(path: Path, notes: Notes) -> list[tuple[int, Material]]:
    """The materials of a file, each with the number of its newmtl line; their names may end in comments."""
    found: list[tuple[int, Material]] = []
    for number, line in numbered(read(path, "MTL file", "give the path of a .mtl file")):
        key, _, rest = name(line).partition(" ")
        where = f"{path}:{number}"
        if key == "newmtl":
            if not without_comment(rest):
                raise InputError("newmtl without a name", where, "write: newmtl NAME")
            found.append((number, Material(rest)))
        elif key == "Ns" or key in _COLOURS:
            if not found:
                raise InputError(f"{key} before the first newmtl", where, "start each material with: newmtl NAME")
            values = rest.split("#")[0].split()
            if key == "Ns":
                found[-1] = (found[-1][0], replace(found[-1][1], shininess=_exponent(values, where)))
                continue
            colour = _colour(key, values, where)
            if max(colour) > 1:
                notes.add(f"{key} above 1 counts as 1", number)
            if len(values) == 4:
                notes.add(f"the fourth number of {key} is ignored", number)
            clamped: dict[str, Any] = {_COLOURS[key]: tuple(min(value, 1.0) for value in colour)}
            found[-1] = (found[-1][0], replace(found[-1][1], **clamped))
        elif key and not key.startswith("#"):
            notes.add(f"{key[:20]!r} is ignored: {_lost(key)}", number)
    return found


def _lost(key: str) -> str:
    """What is lost with a keyword."""
    if key.lower().startswith(_TEXTURES):
        return "textures are not drawn"
    return _LOST.get(key, "it is not understood")


def _exponent(values: list[str], where: str) -> float:
    if len(values) != 1:
        raise InputError(f"Ns takes one number, not {len(values)}", where, "write: Ns 96.08")
    return _number(values[0], "Ns", LARGEST_NS, where)


def _colour(key: str, values: list[str], where: str) -> Colour:
    """A colour, which may be too bright."""
    if values and values[0] in ("spectral", "xyz"):
        raise InputError(f"{key} {values[0]} is not supported", where, f"write {key} as red, green and blue")
    if len(values) not in (1, 3, 4):
        raise InputError(f"{key} takes one or three numbers, not {len(values)}", where, f"write: {key} 0.8 0.8 0.8")
    red, *others = (_number(value, key, math.inf, where) for value in values[:3])
    green, blue = others or (red, red)  # the format: green and blue default to red
    return red, green, blue


def _number(text: str, key: str, largest: float, where: str) -> float:
    # float() also takes nan, infinity and 1_0, none of which belongs here
    try:
        value = float(text) if re.fullmatch(r"[-+.\deE]+", text) else math.nan
    except ValueError:
        value = math.nan
    end = 1 if math.isinf(largest) else largest
    fix = f"{key} is a number from 0 to {end:g}"
    if math.isnan(value):
        raise InputError(f"{key} is {text!r}, not a number", where, fix)
    if not 0 <= value <= largest:
        raise InputError(f"{key} = {text} is outside 0 .. {end:g}", where, fix)
    return value


def mtl_paths(folder: Path, libraries: Iterable[str]) -> tuple[list[Path], list[str]]:
    """The MTL files that mtllib lines name, and the names of those that are not there.

    A line names one file, whose name may hold blanks and #, or several; a comment may follow. Where a path is not
    there, as one of another machine, a file of that name in the folder is taken, whatever its case.
    """
    paths: list[Path] = []
    missing: list[str] = []
    for text in libraries:
        words = text.split(" ")
        while words and not (words[0].startswith("#") and _file(folder, words[0]) is None):
            found = ((n, _file(folder, " ".join(words[:n]))) for n in range(len(words), 0, -1))
            length, path = next(((n, file) for n, file in found if file), (1, None))
            if path:
                paths.append(path)
            else:
                missing.append(words[0])
            words = words[length:]
    return paths, missing


def _file(folder: Path, name: str) -> Path | None:
    """The file of a name in a folder, of its last part, or of another case; None if there is none."""
    given = name.strip("\"'").replace("\\", "/")
    last = given.rsplit("/", 1)[-1]
    for candidate in (folder / name, folder / given, folder / last):
        if os.path.isfile(candidate):  # noqa: PTH113 - Path.is_file raises for names that are too long
            return candidate
    return next((p for p in sorted(folder.iterdir()) if p.name.lower() == last.lower() and p.is_file()), None)
