"""Normals and heights from shading: `inverse line` and the others of its group."""

from pathlib import Path
from typing import Any

import click

from phongbench.cli.common import JSON, PATH, WITH, CommaList, facts, grid, notes, show


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
@click.option("--mask", type=PATH, metavar="PICTURE", help="Pixels that are wanted: those not black.")
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


@inverse.command(short_help="Shapes that `inverse image` may choose among, from depth maps.")
@click.argument("depths", type=PATH, required=False, metavar="[FOLDER|FILE.npz]")
@click.option("--synthetic", type=click.IntRange(min=2), metavar="N", help="Instead: N synthetic heads, by a program.")
@click.option(
    "--components", default=20, show_default=True, metavar="K", help="Principal components, at most maps - 1."
)
@click.option(
    "--held-out", default=0, metavar="N", help="Learn without the last N maps, and tell how well they come back."
)
@click.option("--out", required=True, type=PATH, metavar="FILE.npz", help="The shapes: mean, components, variances.")
@JSON
def learn(depths: Path | None, synthetic: int | None, components: int, held_out: int, out: Path, as_json: bool) -> None:
    """Learn the principal components of depth maps: a folder of .npy (h, w), or a .npz with one array (maps, h, w).

    Heights are towards the viewer, in pixels. No faces are shipped: --synthetic makes heads of a few parameters.
    Maps held out are drawn by exact Phong with noise, and fitted with the prior on coefficients, with the components
    alone, and not at all: angles between normals in degrees, heights' errors as a share of the map's span.
    """
    from phongbench.cli.layout import table
    from phongbench.inverse import held_out as trials
    from phongbench.inverse import shape_model

    if (depths is None) == (synthetic is None):
        raise click.UsageError("give depth maps, or --synthetic N")
    maps = shape_model.read_depths(depths) if depths is not None else shape_model.synthetic_heads(synthetic or 2)
    shapes, rows = trials.learn_and_try(maps, components, held_out)
    shape_model.save_shapes(shapes, out)
    learnt = maps[: len(maps) - held_out]
    share = float(shapes.variances.sum() / max(learnt.var(axis=0, ddof=1).sum(), 1e-300))
    answer: dict[str, Any] = {"out": str(out), "maps": len(learnt), "components": components}
    answer |= {"share_of_variance": share}
    if not held_out:
        show(answer, as_json, lambda: facts(answer))
        return
    answer |= {"ratio_to_mean_shape": trials.ratio(rows)}
    records = [{str(name): value for name, value in row.items()} for row in rows.to_dict("records")]
    show(
        answer | {"held_out": records} if as_json else answer,
        as_json,
        lambda: facts(answer),
        lambda: table("Maps held out", *grid(records)),
    )


@inverse.command(short_help="From one picture: the cone of normals, or the most probable shape.")
@click.argument("picture", type=PATH, metavar="PICTURE")
@click.option("--light", required=True, type=CommaList("numbers", float), metavar="X,Y,Z", help="Towards the light.")
@click.option("--prior", type=(click.Choice(["pca"]), PATH), metavar="pca SHAPES.npz", help="What `learn` has written.")
@click.option("--noise", default=0.01, show_default=True, metavar="SD", help="Of intensities; weighs the prior.")
@click.option("--out", required=True, type=PATH, help="Heights, .npy or .obj; without a prior the cones, .npy.")
@click.option("--normals", "normals_out", type=PATH, metavar="FILE", help="Normals, too: .npy, .exr or .png.")
@_model_options
@JSON
def image(
    picture: Path,
    light: Any,
    prior: Any,
    noise: float,
    out: Path,
    normals_out: Path | None,
    as_json: bool,
    **options: Any,
) -> None:
    """One equation a pixel leaves a cone of normals around the light: its half angle in degrees; with a prior, a shape.

    \b
    Examples:
      phongbench inverse learn --synthetic 200 --out heads.npz
      phongbench inverse image face.png --light 0.3,0.2,1 --diffuse 0.8 --prior pca heads.npz --out face.obj
      phongbench inverse image picture.png --light 0.3,0.2,1 --diffuse 0.8 --out cones.npy
    """
    from phongbench.inverse import picture_files, shape_model
    from phongbench.inverse.surface_model import PhotometricLight
    from phongbench.support import image_files

    picture_files.check_heights(out)
    if normals_out is not None:
        image_files.check_writable(normals_out)
    grey = picture_files.read_grey(picture, options.pop("linear"))
    model, towards = _surface(options), PhotometricLight.of(light, where="--light")
    if prior is None:
        picture_files.save_heights(shape_model.cone(grey, towards, model), out)
        answer: dict[str, Any] = {"cones": str(out)}
    else:
        found = shape_model.fit(grey, shape_model.read_shapes(prior[1]), towards, model, noise)
        picture_files.save_heights(found.heights, out)
        if normals_out is not None:
            picture_files.save_normals(shape_model.normals_of(found.heights), normals_out)
        answer = {"heights": str(out), "residual_rms": found.residual, "evaluations": found.evaluations}
    show(answer, as_json, lambda: facts(answer))
