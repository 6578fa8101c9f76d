"""The command line: parse, one library call, print, exit code.

Heavy modules are imported by the command that needs them.
"""

import errno
import io
import os
import sys
import warnings
from typing import Any

import click

from phongbench import __version__
from phongbench.cli.advice import recommend
from phongbench.cli.answers import claims, front
from phongbench.cli.benchmarks import bench
from phongbench.cli.common import say
from phongbench.cli.installation import approximations, doctor
from phongbench.cli.inverse import inverse
from phongbench.cli.pictures import render
from phongbench.cli.runs import compare, list_runs, show_run, verify
from phongbench.cli.serving import serve
from phongbench.cli.shaders import shader
from phongbench.cli.shading import shade
from phongbench.cli.shards import merge
from phongbench.cli.study import report, run
from phongbench.cli.targets import targets
from phongbench.errors import (
    CorruptRunError,
    InputError,
    InterruptedStudyError,
    LockedError,
    MeasurementError,
    PhongbenchError,
    StorageError,
)

#: the one table from errors to exit codes
EXIT_CODES: tuple[tuple[type[PhongbenchError], int], ...] = (
    (LockedError, 4),
    (StorageError, 5),
    (CorruptRunError, 6),
    (InputError, 2),
    (MeasurementError, 3),
    (InterruptedStudyError, 130),
    (PhongbenchError, 1),
)
INTERRUPTED = 130


class Commands(click.Group):
    """Turns deliberate errors into two lines on stderr and an exit code, warnings into one."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Refuse an empty word: it is a variable that was not set, and would count as what is usual."""
        for before, word in zip(["phongbench", *args], args, strict=False):
            if not word or (word.startswith("--") and word.endswith("=")):
                raise click.UsageError(f"what follows {word.rstrip('=') or before} is empty", ctx)
        return super().parse_args(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; never a traceback for what the user can fix."""
        if isinstance(sys.stdout, io.TextIOWrapper):
            sys.stdout.reconfigure(errors="replace")  # a locale may have no character for a sign of a table
        try:
            with warnings.catch_warnings():
                warnings.showwarning = lambda message, *_: say(f"phongbench: {message}", err=True)
                return super().invoke(ctx)
        except PhongbenchError as problem:
            say(f"phongbench: {problem}", err=True)
            sys.exit(next(code for kind, code in EXIT_CODES if isinstance(problem, kind)))
        except OSError as problem:
            if problem.errno == errno.EPIPE:  # who read the output has seen enough
                raise
            place = f"{problem.filename}: " if problem.filename else ""
            say(f"phongbench: {place}the system refuses: {problem.strerror or problem}", err=True)
            _drop_unwritten()
            sys.exit(next(code for kind, code in EXIT_CODES if kind is StorageError))
        except KeyboardInterrupt:
            click.echo("phongbench: interrupted", err=True)
            sys.exit(INTERRUPTED)


def _drop_unwritten() -> None:
    """Drop what stdout cannot take: at the end Python would try once more, and exit with its own code."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


EXAMPLES = """\b
Examples:
  phongbench run                                  a quick study and its report, in under a minute
  phongbench run --alpha 10,50,200 --only lyon,gaussian
  phongbench run --materials scene.mtl --preset standard --out my-study
  phongbench report latest --single-file          the report as one file to send around
  phongbench show latest                          what the newest run found
  phongbench recommend --alpha 50 --max-error 1/255
"""


@click.group(
    cls=Commands, help=f"Which specular-highlight formula to ship, by measured error and run time.\n\n{EXAMPLES}"
)
@click.version_option(__version__, prog_name="phongbench")
def main() -> None:
    """Entry point."""


for command in (
    run, merge, report, list_runs, show_run, verify, compare, front, recommend, claims, approximations, targets, doctor,
    bench, shade, shader, render, inverse, serve,
):  # fmt: skip
    main.add_command(command)
