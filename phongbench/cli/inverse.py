"""Normals and heights from shading: `inverse line` and the others of its group."""

from pathlib import Path
from typing import Any

import click

from phongbench.cli.common import JSON, PATH, WITH, CommaList, facts, notes, show


@click.group(short_help="Normals and heights from shading.")
def inverse() -> None:
    """Ask the reflection model backwards: which normals, and which heights, give this shading?

    Axes: x to the right, y up, z and heights towards the viewer, who is far away.
    """


@inverse.command(short_help="Along a line across a cylinder.")
@click.argument("file", type=PATH, metavar="FILE")
@click.option("--ambient", required=True, type=float, metavar="A", help="Intensity without the light.")
@click.option("--diffuse", required=True, type=float, metavar="D", help="What the light adds where it falls straight.")
@click.option(
    "--light", required=True, type=CommaList("numbers", float), metavar="X,Z", help="Towards the light; length counts."
)
@click.option("--unit-light", is_flag=True, help="Make the light's length 1.")
@click.option(
    "--prior",
    default="convex",
    show_default=True,
    metavar="NAME",
    help="Which branch: convex, concave, continuous, towards-viewer, or a file of the angles expected, in degrees.",
)
@click.option("--noise", default=0.0, metavar="SD", help="Standard deviation of intensities, for the heights' band.")
@click.option(
    "--scale",
    default=1.0,
    metavar="S",
    help="The largest possible intensity, e.g. 255; A, D and SD are on the same scale.",
)
@click.option("--rule", default="simpson", show_default=True, metavar="NAME", help="Of the integral; or trapezoid.")
@click.option(
    "--from", "start", default="left", show_default=True, metavar="SIDE", help="Where heights are 0: left, right, both."
)
@click.option("--bridge", is_flag=True, help="Go on across samples in shadow, saturated or too bright.")
@click.option("--out", type=PATH, help="A table: .csv, .parquet or .json.  [default: CSV on stdout]")
@click.option("--figure", type=PATH, help="A picture: .svg or .png.")
@JSON
def line(file: Path, ambient: float, diffuse: float, light: Any, noise: float, as_json: bool, **options: Any) -> None:
    """Both normals at every sample of a line of intensities, the branch that the prior means, and heights.

    FILE is CSV or .npy: one column of intensities, or the columns x,intensity; samples are 1 apart without x. Across a
    cylinder (I - A) / D = Lx Nx + Lz Nz and Nx^2 + Nz^2 = 1 have two solutions, one to either side of the light.

    \b
    Examples:
      phongbench inverse line scan.csv --ambient 0.1 --diffuse 0.7 --light 0.71,0.71
      phongbench inverse line scan.csv --ambient 20 --diffuse 180 --scale 255 --light 0,1 --figure scan.svg
      phongbench inverse line scan.npy --ambient 0.1 --diffuse 0.7 --light 0,1 --prior continuous --noise 0.004
    """
    from phongbench.inverse.line_files import check_scale, invert_file, save_line
    from phongbench.inverse.line_model import LineModel

    out, figure, unit = (options.pop(name) for name in ("out", "figure", "unit_light"))
    scale = check_scale(options["scale"])
    model = LineModel(ambient / scale, diffuse / scale, light, noise / scale)
    found = invert_file(file, model.unit() if unit else model, **options)
    notes(found.notes, quiet=as_json)
    if figure is not None:
        from phongbench_reports.figures.inverse_line import save

        save(found, figure)
    if out is not None:
        save_line(found, out)
    csv = found.frame.to_csv(index=False, lineterminator="\n")
    show(found.as_dict(), as_json, lambda: click.echo(out or csv, nl=out is not None))


#: options of the reflection model that commands on pictures share
def _model_options(command: Any) -> Any:
    for option in reversed((
        click.option("--ambient", default=0.0, show_default=True, metavar="A", help="Intensity without the lights."),
        click.option("--diffuse", default=1.0, show_default=True, metavar="D", help="Strength of the diffuse term."),
        click.option("--ks", default=0.0, show_default=True, metavar="S", help="Strength of the specular term."),
        click.option("--alpha", default=50.0, show_default=True, metavar="A", help="Exponent of the highlight."),
        click.option("--specular", default="phong", show_default=True, metavar="FORMULA", help="Of the highlight."),
        WITH,
        click.option("--mask", type=PATH, metavar="PICTURE", help="Pixels that are wanted: those not black."),
        click.option("--linear", is_flag=True, help="PNG holds linear codes.  [default: sRGB]"),
    )):  # fmt: skip
        command = option(command)
    return command


def _surface(options: dict[str, Any]) -> Any:
    """The reflection model of these options, which are taken out."""
    from phongbench.formulas.formula import Formula
    from phongbench.formulas.user_files import registry_with
    from phongbench.inverse.surface_model import SurfaceModel

    registry = registry_with(options.pop("files"))
    formula = Formula.parse(options.pop("specular"), registry)
    ambient, diffuse, ks, alpha = (options.pop(name) for name in ("ambient", "diffuse", "ks", "alpha"))
    return SurfaceModel(ambient, diffuse, ks, alpha, formula, registry)


@inverse.command(short_help="From three or more pictures under known lights.")
@click.argument("pictures", type=PATH, nargs=-1, required=True, metavar="PICTURES..")
@click.option("--lights", required=True, type=PATH, metavar="FILE.json", help="A direction for each picture, in order.")
@click.option("--out", required=True, type=PATH, help="Normals: .npy, .exr, or a normal map .png.")
@click.option("--heights", type=PATH, metavar="FILE", help="Heights, too: .npy or .obj.")
@_model_options
@click.option("--albedo", is_flag=True, help="Solve for a factor of the diffuse term in each pixel.")
@click.option("--gloss", is_flag=True, help="Solve for a factor of the specular term in each pixel.")
@click.option("--saturation", type=float, metavar="I", help="Unused from here on.  [default: the largest code of PNG]")
@click.option("--shadow", type=float, metavar="I", help="Unused up to this above A.  [default: 0.01 D]")
@click.option("--threads", type=click.IntRange(min=1), help="[default: all cores]")
@JSON
def photometric(
    pictures: tuple[Path, ...], out: Path, heights: Path | None, threads: int | None, as_json: bool, **options: Any
) -> None:
    """Normals, and heights, from pictures of one view under known lights, by the full reflection model.

    PICTURES are .png, .exr or .npy; colours count by their mean. FILE.json is {"lights": [{"direction": [x, y, z],
    "intensity": 1}, ..]}, towards each light. Normals are (h, w, 3), NaN where nothing is known: x to the right, y up,
    z to the viewer; heights grow to the viewer, a pixel is 1.

    \b
    Examples:
      phongbench inverse photometric a.png b.png c.png --lights lights.json --out normals.npy --albedo
      phongbench inverse photometric *.exr --lights lights.json --diffuse 0.7 --ks 0.5 --alpha 50 --out map.png
      phongbench inverse photometric *.npy --lights l.json --ks 0.5 --specular lyon:dot:8 --out n.npy --heights z.obj
    """
    from phongbench.inverse.picture_files import check_heights, invert_files, save_heights, save_normals
    from phongbench.support.image_files import check_writable
    from phongbench.support.process import cores

    check_writable(out)
    if heights is not None:
        check_heights(heights)
    found = invert_files(pictures, options.pop("lights"), _surface(options), threads=threads or cores(), **options)
    save_normals(found.normals, out)
    if heights is not None:
        save_heights(found.heights(), heights)
    answer = {"normals": str(out), "heights": None if heights is None else str(heights), **found.summary()}
    show(answer, as_json, lambda: facts({name: value for name, value in answer.items() if value is not None}))
