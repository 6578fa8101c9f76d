"""Shading offline: the request of the service's /v1/shade, answered by the same functions."""

import os
import sys
from pathlib import Path

import click

from phongbench.cli.common import PATH, WITH
from phongbench.errors import InputError


@click.command(short_help="Shade the points of a request, as the service's /v1/shade does.")
@click.argument("request_file", metavar="IN.json|-")
@click.option("--out", type=PATH, help="A .json or .npy file.  [default: JSON on stdout]")
@click.option("--threads", type=click.IntRange(min=1), help="[default: all cores]")
@WITH
def shade(request_file: str, out: Path | None, threads: int | None, files: tuple[Path, ...]) -> None:
    """Shade points by the full reflection model: ambient, diffuse and specular terms of many lights.

    IN.json holds material, lights, viewer, points and normals; optional are model, specular, ambient_light, normalise
    and precision, and in the material `fresnel`, as {"kind": "dielectric", "n": [1.5, 1.5, 1.5]}. `-` reads it from
    stdin. The answer has the colours and how many (point, light) pairs were skipped.

    \b
    Example:
      echo '{"material": {"ambient": [0.1, 0.1, 0.1], "diffuse": [0.6, 0.5, 0.4], "specular": [1, 1, 1],
             "shininess": 50}, "specular": {"approximation": "lyon", "lambda": "dot", "gamma": 8},
             "ambient_light": [1, 1, 1], "lights": [{"direction": [0, 0, 1]}], "viewer": {"direction": [0, 0, 1]},
             "points": [[0, 0, 0]], "normals": [[0, 0, 1]]}' | phongbench shade -
    """
    from phongbench.formulas.user_files import registry_with
    from phongbench.shading.requests import parse_json, save_shaded, shaded_json, shading_request
    from phongbench.support.user_paths import check_file

    if out is not None and out.suffix not in (".json", ".npy"):
        raise InputError(f"{out.name!r} is neither .json nor .npy", "--out", "the name's end says what is written")
    if out is not None:
        check_file(out)
    request = shading_request(parse_json(_read(request_file)), registry=registry_with(files))
    shaded = request.shade(threads=threads or os.cpu_count() or 1)
    if out is None:
        click.echo(shaded_json(shaded))
    else:
        save_shaded(shaded, out)
        click.echo(out)


def _read(name: str) -> bytes:
    from phongbench.support.user_paths import reading

    if name == "-":
        if sys.stdin is None:
            raise InputError("there is no stdin to read", "-", "give a JSON file")
        return sys.stdin.buffer.read()
    with reading(name, "request", "give a JSON file, or - for stdin"):
        return Path(name).read_bytes()
