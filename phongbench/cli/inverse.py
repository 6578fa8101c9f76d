"""Normals and heights from shading: `inverse line` and the others of its group."""

from pathlib import Path
from typing import Any

import click

from phongbench.cli.common import JSON, PATH, CommaList, notes, show


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
    from phongbench.inverse.line import LineModel
    from phongbench.inverse.line_files import invert_file, save_line

    out, figure, unit = (options.pop(name) for name in ("out", "figure", "unit_light"))
    scale = options["scale"]
    model = LineModel(ambient / scale, diffuse / scale, light, noise / scale) if scale > 0 else None
    found = invert_file(file, model.unit() if model and unit else model, **options)
    notes(found.notes, quiet=as_json)
    if figure is not None:
        from phongbench_reports.figures.inverse_line import save

        save(found, figure)
    if out is not None:
        save_line(found, out)
    csv = found.frame.to_csv(index=False, lineterminator="\n")
    show(found.as_dict(), as_json, lambda: click.echo(out or csv, nl=out is not None))
