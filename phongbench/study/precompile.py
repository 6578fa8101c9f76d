"""A second process that compiles, on a cold kernel cache, what the first will need later: the sweep's drivers and the
timed kernels.

Compilation holds the interpreter, so threads cannot share it; a process can. It writes to the same cache, in files of
its own: numba keeps one index for each function, and the first process compiles other functions meanwhile. On two cores
it takes the time of `make run` on a fresh machine down by about a quarter.
"""

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import product

from phongbench.accuracy import sweep
from phongbench.accuracy.probes.incidence import native
from phongbench.compiler import jit
from phongbench.formulas.coordinate_kernels import values_kernel
from phongbench.formulas.fresnel.catalogue import KINDS
from phongbench.inputs.plan import Plan
from phongbench.support.process import seldom_collected
from phongbench.timing import skip_kernels
from phongbench.timing.measure import compile_all
from phongbench.timing.timed_kernels import timed_formulas


def start(plan: Plan) -> "subprocess.Popen[bytes] | None":
    """Begin compiling for this plan if the cache is cold; the process, which nobody has to wait for but a timing."""
    if jit.DISABLED or any(jit.cache_folder().rglob("*_pairs_kernel*")):
        return None
    process = subprocess.Popen(
        [sys.executable, "-m", "phongbench.study.precompile"],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    if process.stdin:
        process.stdin.write(json.dumps(plan.as_dict()).encode())
        process.stdin.close()
    return process


def stop(process: "subprocess.Popen[bytes] | None", *, at_once: bool) -> None:
    """Wait for the process, or end it: nothing may run beside a timing, nor be left when a study ends early."""
    if process is not None:
        if at_once:
            process.kill()
        process.wait()


@contextmanager
def beside(plan: Plan) -> "Iterator[subprocess.Popen[bytes] | None]":
    """The process that compiles for this plan; ended where the study that it helps ends early, at whatever step."""
    process = start(plan)
    try:
        yield process
    except BaseException:
        stop(process, at_once=True)
        raise


@seldom_collected()
def compile_for(plan: Plan) -> None:
    """Compile the drivers and timed kernels of a plan's own approximations.

    A user's are compiled where they are loaded.
    """
    prepared = sweep.prepare(plan)
    sweep.compile_drivers(prepared)
    if plan.timing:
        compile_all(timed_formulas(prepared.cells, prepared.registry), lit=skip_kernels.LIT if plan.skipping else ())
    if "incidence" in plan.probes:
        for formula, precision in product(KINDS.values(), native(plan)):
            values_kernel(formula, precision)


if __name__ == "__main__":
    given = Plan.from_dict(json.load(sys.stdin))
    from phongbench.formulas.registry import REGISTRY

    known = tuple(name for name in given.approximations if name in REGISTRY)
    compile_for(Plan.from_dict(given.as_dict() | {"approximations": list(known)}))
