"""The processor that kernels are compiled for, where it is not to be this machine's own."""

import os
import re
import subprocess
import sys

from phongbench.errors import InputError

#: compiles a loop that is worth vectors, and runs it: an instruction that is not there ends the process
_TRIAL = """
import numba, numpy as np
@numba.njit(fastmath=True)
def total(a):
    s = 0.0
    for x in a: s += x * x + 1.0
    return s
assert total(np.ones(1000)) == 2000.0
"""


def pin(name: str) -> None:
    """Compile for the processor of this name, with what it has and nothing else, here and in processes begun from here.

    name  as LLVM knows it: haswell, skylake-avx512, znver3
    Raises InputError for a name that is unknown, that this machine cannot run, or where it is too late.
    """
    fix = "give a processor that LLVM knows and all machines can run, e.g. x86-64-v3 or haswell"
    if not re.fullmatch(r"[a-z0-9][a-z0-9._-]*", name):
        raise InputError(f"{name!r} is no name of a processor", "--cpu-name", fix)
    if "numba" in sys.modules:
        raise InputError("the compiler is loaded already", "--cpu-name", "set NUMBA_CPU_NAME before Python starts")
    pinned = {"NUMBA_CPU_NAME": name, "NUMBA_CPU_FEATURES": ""}
    tried = subprocess.run(
        [sys.executable, "-c", _TRIAL], env={**os.environ, **pinned}, capture_output=True, text=True, check=False
    )
    if "not a recognized processor" in tried.stderr:
        raise InputError(f"the compiler knows no processor {name!r}", "--cpu-name", fix)
    if tried.returncode:
        raise InputError(f"this machine cannot run code for {name!r}", "--cpu-name", fix)
    os.environ.update(pinned)
