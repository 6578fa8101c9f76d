"""The command that serves."""

from typing import Any

import click

from phongbench.cli.common import PATH, ROOT


@click.command(short_help="Answer over HTTP: shading, curves, runs, recommendations.")
@click.option("--host", default="127.0.0.1", show_default=True, help="Where to listen.")
@click.option("--port", type=click.IntRange(0, 65535), default=8000, show_default=True, help="0: any free one.")
@click.option("--runs", type=PATH, default=ROOT, show_default=True, help="Folder of the runs.")
@click.option("--workers", type=click.IntRange(1, 256), default=1, show_default=True, help="Processes.")
@click.option(
    "--allowed-host",
    "allowed_hosts",
    multiple=True,
    metavar="NAME",
    help="A name that requests may come under. Repeatable; localhost always may.",
)
@click.option(
    "--cors",
    multiple=True,
    metavar="ORIGIN",
    help="An origin whose pages may read answers, such as a notebook's. Repeatable.",
)
@click.option(
    "--drain",
    "drain_seconds",
    type=click.FloatRange(0, 600),
    default=0.0,
    metavar="SECONDS",
    help="Between SIGTERM, when /readyz turns 503, and closing the door.",
)
def serve(**options: Any) -> None:
    """Serve until stopped: the explorer page at /, the interface at /docs.

    Nothing is ever written, and nothing is measured: that is `phongbench run`. On loopback, requests under another
    name than localhost are refused unless --allowed-host names it. Pages of other origins cannot read answers unless
    --cors names theirs, and never with credentials.

    \b
    Examples:
      phongbench serve
      phongbench serve --port 8080 --runs /srv/phongbench-runs --workers 4
      phongbench serve --host 0.0.0.0 --allowed-host phong.example.org
      phongbench serve --cors http://localhost:8888
    """
    from phongbench_api.serve import serve as start
    from phongbench_api.settings import Settings

    start(Settings(**options))
