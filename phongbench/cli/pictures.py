"""Pictures of scenes: `render`."""

import math
import re
from pathlib import Path
from typing import Any

import click

from phongbench.cli.common import JSON, PATH, WITH, facts, grid, notes, show
from phongbench.cli.shards import CPU_NAME, pin_processor


class Size(click.ParamType[Any]):
    """Width and height, as 1280x720."""

    name = "WxH"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """`1280x720` -> (1280, 720)."""
        found = re.fullmatch(r"([0-9]{1,9})x([0-9]{1,9})", value) if isinstance(value, str) else None
        if not found:
            self.fail(f"{value!r} is not a size; write e.g. 1280x720", param, ctx)
        return int(found[1]), int(found[2])


#: what a terminal shows as tables, in this order
_TABLES = ("ledger", "skips", "tracers", "compared", "absent", "formulas", "left_out")


@click.command(short_help="Draw a scene, and tell what was left out.")
@click.argument("scene", required=False, metavar="[SCENE.toml]")
@click.option(
    "--out",
    type=PATH,
    help="Where to write: .png; linear float32 as .npy, or as .exr (extra `scene`).  [default: SCENE.png]",
)
@click.option("--size", type=Size(), metavar="WxH", help="Pixels.  [default: the scene's]")
@click.option("--specular", metavar="FORMULA", help="Of the specular term, e.g. lyon:cross:8 or lyon:dot:8:minimax.")
@WITH
@click.option("--model", type=click.Choice(["phong", "blinn-phong"]), default="phong", show_default=True)
@click.option("--depth", type=int, metavar="N", help="Reflections in a row.  [default: the scene's]")
@click.option("--supersampling", type=int, metavar="N", help="N x N samples for each pixel.  [default: the scene's]")
@click.option("--shadows/--no-shadows", default=None, help="Whether objects throw shadows.  [default: the scene's]")
@click.option("--skip/--no-skip", default=True, help="Whether to leave out what the picture does not need.")
@click.option("--exact", is_flag=True, help="Leave out only what changes no bit.")
@click.option("--compare", is_flag=True, help="Write exact Phong, this formula, and their difference side by side.")
@click.option("--bench", is_flag=True, help="Measure what each skip saves, and other tracers beside ours.")
@click.option("--formulas", is_flag=True, help="Tell each formula's picture error and time beside exact Phong's.")
@click.option("--threads", type=click.IntRange(min=1), help="[default: all cores]")
@click.option(
    "--cluster", metavar="ADDRESS|local:N", help="Draw on a Dask cluster: its scheduler, its file, or N processes."
)
@CPU_NAME
@click.option("--list", "listing", is_flag=True, help="List the shipped scenes.")
@JSON
def render(
    scene: str | None,
    bench: bool,
    formulas: bool,
    listing: bool,
    cluster: str | None,
    cpu_name: str | None,
    as_json: bool,
    files: tuple[Path, ...],
    **options: Any,
) -> None:
    """Draw a scene from a TOML file, or a shipped one by its name, and tell what was left out.

    \b
    Examples:
      phongbench render --list
      phongbench render chequerboard --out picture.png --size 1280x720
      phongbench render test-card --specular lyon:difference:8 --compare --out triple.png
      phongbench render test-card --formulas
      phongbench render my-scene.toml --with my_highlight.py --specular my-highlight:dot:8 --out picture.exr
      phongbench render many-lights --bench
      phongbench render test-card --size 7680x4320 --cluster tcp://scheduler:8786
    """
    if listing:
        _list_scenes(as_json)
        return
    if scene is None:
        raise click.UsageError("name a scene: a TOML file, or one of those that --list shows")
    if (bench or formulas) and (options["compare"] or options["out"]):
        raise click.UsageError("--bench and --formulas draw no picture: leave --compare and --out away")
    if formulas and options["model"] != "phong":
        raise click.UsageError("--formulas compares with exact Phong: leave --model away")
    if (bench or formulas) and cluster:
        raise click.UsageError("--bench and --formulas measure times, which are of one machine: leave --cluster away")
    pin_processor(cpu_name)
    from phongbench.benchmarks import scene_bench
    from phongbench.cli.terminal import TerminalProgress
    from phongbench.formulas.user_files import registry_with
    from phongbench.scenes import render_to_file

    action = scene_bench.measure if bench else scene_bench.judge if formulas else render_to_file.draw
    options["engine"] = _picture_cluster(cluster, files)
    wanted = render_to_file.RenderOptions(scene, registry=registry_with(files), **options)
    with TerminalProgress(quiet=as_json) as progress:
        answer = action(wanted, progress)
    notes(answer.get("notes", ()), quiet=as_json)
    _show(answer, as_json)


def _picture_cluster(address: str | None, files: tuple[Path, ...]) -> Any:
    """What draws tiles on the cluster at an address; None without one."""
    if address is None:
        return None
    from phongbench.study.cluster.pictures import PictureCluster

    return PictureCluster(address, files)


def _list_scenes(as_json: bool) -> None:
    from phongbench.cli.layout import table
    from phongbench.scenes.render_to_file import listed

    scenes = listed()
    show(scenes, as_json, lambda: table("", ("scene", "shows"), [tuple(row.values()) for row in scenes]))


def _show(answer: dict[str, Any], as_json: bool) -> None:
    """The facts, then the tables."""
    from phongbench.cli.layout import table

    tables = [
        lambda name=name, rows=rows: table(name, *grid(rows)) for name in _TABLES if (rows := readable(answer, name))
    ]
    show(answer, as_json, lambda: facts(labelled(answer)), *tables)


#: of a picture compared with exact Phong: what each measure is called, and how it is written
_ERRORS: dict[str, tuple[str, str]] = {
    "max_codes": ("largest error", "{} codes of 255"),
    "visible": ("pixels off by a code", "{:.2%}"),
    "max_abs": ("largest, linear light", "{:.3g}"),
    "mean_abs": ("mean, linear light", "{:.2g}"),
    "rms": ("root mean square", "{:.2g}"),
    "psnr": ("PSNR", "{:.1f} dB"),
    "flip": ("FLIP", "{:.2g}"),
    "energy": ("light / exact", "{:.3f}"),
    "highlight_area": ("highlight's area / exact", "{:.3f}"),
}


def labelled(answer: dict[str, Any]) -> dict[str, Any]:
    """The facts of an answer as people read them: a line for each, rounded, with its unit; tables left out."""
    lines = {name.replace("_", " "): value for name, value in answer.items() if not isinstance(value, list)}
    if "width" in lines:
        lines["size"] = f"{lines.pop('width')} x {lines.pop('height')} pixels"
    if "mrays per second" in lines:
        lines["rays per second"] = f"{lines.pop('mrays per second'):.3g} million"
    if isinstance(seconds := lines.get("seconds"), dict):
        lines["seconds"] = ", ".join(f"{name} {value:.2g}" for name, value in seconds.items())
    errors = lines.pop("error", {})
    if errors and errors["psnr"] is None:  # no error at all
        errors = errors | {"psnr": math.inf}
    told = [(label, form, errors.get(name)) for name, (label, form) in _ERRORS.items()]
    return lines | {label: form.format(value) for label, form, value in told if value is not None}


#: columns that a line has room for, of tables with more
_COLUMNS = {
    "tracers": (
        "tracer",
        "draws",
        "size",
        "seconds",
        "mpixels_per_second",
        "mrays_per_second",
        "ratio",
        "pixels_off",
        "surfaces_agree",
    ),
    "compared": ("tracer", "version", "note"),
    "formulas": (
        "formula", "max_abs", "lobe_error", "max_codes", "visible", "psnr", "flip", "energy", "highlight_area",
        "ratio",
    ),
}  # fmt: skip


def readable(answer: dict[str, Any], name: str) -> list[dict[str, Any]]:
    """The rows of a table as people read them: no more columns than a line holds, each tracer compared with once."""
    rows = answer.get("tracers" if name == "compared" else name, [])
    if name == "compared":  # a tracer is named once, however much it drew
        rows = {row["tracer"]: row for row in rows}.values()
    return [{column: row[column] for column in _COLUMNS.get(name, row)} for row in rows]
