"""Figures made of pictures: what reflections, interpolation and formulas do to a scene. PNG: pixels are the point.

`python -m phongbench_reports.figures.scene_images FOLDER` draws all of them. Nothing here is
measured but errors of the pictures.
"""

import io
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from phongbench.formulas.formula import Formula
from phongbench.scenes import images, triples
from phongbench.scenes.render import render
from phongbench.scenes.scene import Mesh, Scene
from phongbench.scenes.scene_files import read_scene
from phongbench.support import image_files
from phongbench_reports.plots import footnote, ink, sheet

#: pixels of a picture in a figure, and how finely the figure is written
SIZE, DPI = (480, 270), 160
#: side by side on the test card: one that is visibly wrong, the same with a better slope, one that is nearly right
SHOWN = tuple(map(Formula.parse, ("lyon:dot:8", "lyon:dot:8:minimax", "lyon-quadratic:dot:4")))

Codes = NDArray[np.uint8]


@dataclass(frozen=True)
class Sheet:
    """Pictures in rows.

    pictures codes, (height, width, 3) each
    titles   one above each
    columns  pictures in a row
    note     what they show, for the foot
    facts    a record for each picture, for a table
    height   inches of a row
    scale    whether the scale of differences stands below
    """

    pictures: Sequence[Codes]
    titles: Sequence[str]
    columns: int
    note: str
    facts: Sequence[dict[str, Any]] = ()
    height: float = 2.7
    scale: bool = False


def depths(scene_name: str = "chequerboard", deepest: int = 3, size: tuple[int, int] = SIZE) -> Sheet:
    """A scene with 0, 1, ... reflections in a row, and by how many codes each differs from the one before."""
    scene = read_scene(scene_name)
    drawn = [render(scene, size=size, depth=depth, supersampling=2) for depth in range(deepest + 1)]
    titles = ["direct light only"]
    facts = [{"scene": scene.name, "reflections": 0, "rays": drawn[0].rays, "pixels_changed": 0.0}]
    for number, (before, after) in enumerate(pairwise(drawn), 1):
        off = np.abs(image_files.codes(after.picture).astype(int) - image_files.codes(before.picture)).max(axis=2)
        share = float((off > 0).mean())
        titles.append(f"{number} reflection{'s' * (number > 1)}: {share:.1%} of the pixels change")
        facts.append({"scene": scene.name, "reflections": number, "rays": after.rays, "pixels_changed": share})
    note = f"scene {scene.name}, {size[0]} × {size[1]} pixels, 4 samples each; changes of one 8-bit sRGB code or more"
    return Sheet([image_files.codes(d.picture) for d in drawn], titles, 2, note, facts)


def interpolation(degrees: Sequence[float] = (44.0, 21.0, 5.0)) -> Sheet:
    """Flat, Gouraud and Phong shading of one sphere in triangles from coarse to fine."""
    scene = read_scene("tessellation")
    kinds = (("none", "flat"), ("colours", "Gouraud"), ("normals", "Phong"))
    pictures, titles = [], []
    for smooth, name in kinds:
        for index in range(len(degrees)):
            alone = _alone(scene, index, smooth)
            pictures.append(image_files.codes(render(alone, size=(270, 270), supersampling=2).picture))
            titles.append(f"{name}, edges of {degrees[index]:g}°")
    highlight = scene.materials[0].reflection.shininess
    note = f"Gouraud shading mixes colours, Phong shading normals, made unit again; α = {highlight:g}, one far light"
    return Sheet(pictures, titles, len(degrees), note, (), 3.1)


def formulas(scene_name: str = "test-card", size: tuple[int, int] = SIZE) -> Sheet:
    """Some formulas, and the difference of each to exact Phong, all on one scale."""
    scene = read_scene(scene_name)
    exact = render(scene, size=size, specular=Formula()).picture
    pictures, titles = [], []
    facts: list[dict[str, Any]] = []
    for formula in SHOWN:
        other = render(scene, size=size, specular=formula).picture
        error = images.compare(exact, other, flip=False)
        name = str(formula)
        facts.append({"scene": scene.name, "formula": name, **error.as_dict()})
        pictures += [image_files.codes(other), triples.shades(triples.difference(exact, other))]
        titles += [name, f"difference to exact Phong: at most {error.max_codes} codes"]
    note = f"scene {scene.name}: α doubles from 2 to 4096 in reading order; differences of sRGB values, in codes of 255"
    return Sheet(pictures, titles, 2, note, facts, scale=True)


#: file name -> what draws it
FIGURES: dict[str, Callable[[], Sheet]] = {
    "depths.png": depths,
    "interpolation.png": interpolation,
    "formulas.png": formulas,
}


def _alone(scene: Scene, index: int, smooth: str) -> Scene:
    """One of the scene's meshes, in the middle, close up."""
    mesh: Mesh = scene.of(Mesh)[index]
    middle = (mesh.vertices.max(axis=0) + mesh.vertices.min(axis=0)) / 2
    moved = replace(mesh, vertices=mesh.vertices - middle, smooth=smooth)
    camera = replace(scene.camera, position=(0.0, 0.0, 8.0), target=(0.0, 0.0, 0.0))
    return replace(scene, objects=(moved,), camera=camera)


def figure_of(sheet_of: Sheet, *, native: bool = False) -> Figure:
    """The pictures with a title above each and the note below; call it inside `ink`.

    native  for a page: the pixels as they are, which a reader's screen scales, and no note, which the page has itself
    """
    columns, rows = sheet_of.columns, -(-len(sheet_of.pictures) // sheet_of.columns)
    below = (0.05 if native else 0.35) + 0.45 * sheet_of.scale
    tall = sheet_of.height * rows + below - 0.05
    figure, axes = sheet(
        tall, rows, columns, left=0.01, right=0.99, top=1 - 0.3 / tall, bottom=below / tall, wspace=0.03, hspace=0.14
    )
    for one, picture, title in zip(axes, sheet_of.pictures, sheet_of.titles, strict=True):
        one.imshow(picture, interpolation="none" if columns == 3 or native else "antialiased")
        one.set_title(title, fontsize=9)
        one.set_axis_off()
    if sheet_of.scale:
        _scale(figure, tall, below)
    if not native:
        footnote(figure, sheet_of.note)
    return figure


def _scale(figure: Figure, tall: float, below: float) -> None:
    """The scale of differences below the pictures, as wide as they are.

    tall, below  inches of the figure, and of what lies below the pictures
    """
    axes = figure.add_axes((0.01, (below - 0.17) / tall, 0.98, 0.1 / tall))
    axes.imshow(triples.bar(512), aspect="auto", extent=(0.0, 1.0, 0.0, 1.0))
    axes.set_xticks([])
    axes.set_yticks([])
    axes.grid(visible=False)
    names = [*triples.TICKS[:-1], f"{triples.TICKS[-1]} codes"]
    for place, name in zip(np.linspace(0.0, 1.0, len(names)), names, strict=True):
        side = "left" if place == 0 else "right" if place == 1 else "center"
        axes.text(place, -0.7, name, transform=axes.transAxes, ha=side, va="top", fontsize=7.5)


def png(sheet_of: Sheet) -> bytes:
    """The pictures as a PNG that is the same for the same pictures."""
    buffer = io.BytesIO()
    settings: dict[str, Any] = {"facecolor": "white", "metadata": {"Software": "phongbench"}}
    with ink():
        figure_of(sheet_of).savefig(buffer, format="png", dpi=DPI, **settings)
    return buffer.getvalue()


def write(folder: Path) -> list[Path]:
    """Draw every figure into a folder; the files."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / name for name in FIGURES]
    for path, draw in zip(paths, FIGURES.values(), strict=True):
        path.write_bytes(png(draw()))
    return paths


if __name__ == "__main__":
    for written in write(Path(sys.argv[1])):
        sys.stdout.write(f"{written}\n")
