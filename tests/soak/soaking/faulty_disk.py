"""Commands of phongbench on a disk that fails at a chosen call, or killed at a chosen moment.

`faulty_disk.c` is preloaded into a process of its own, which forks for each command: imports and compiled kernels are
there already.
"""

import ctypes
import errno
import json
import os
import select
import signal
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

SOURCE = Path(__file__).with_suffix(".c")
#: the calls that are counted, in the order of the library's numbers
CALLS = ("open", "write", "fsync", "rename", "mkdir")
#: what befalls a call: an error number or death, and whether all later calls fail alike
FAULTS: Mapping[str, tuple[int, bool]] = {
    "ENOSPC": (errno.ENOSPC, False),
    "full": (errno.ENOSPC, True),
    "EIO": (errno.EIO, False),
    "EINTR": (errno.EINTR, False),
    "kill -9": (-1, False),
}
#: what a process that is killed returns
KILLED = -int(signal.SIGKILL)
_LIBRARY = "PHONGBENCH_FAULTY_DISK"


def preloaded(words: list[str]) -> "subprocess.CompletedProcess[str]":
    """Run `python -m soaking` with these words, and the library, which is built for it; SIGTERM is passed on."""
    with tempfile.TemporaryDirectory(prefix="phongbench-faulty-") as folder:
        library = Path(folder) / "faulty.so"
        compiler = ["cc", "-O1", "-shared", "-fPIC", "-o", str(library), str(SOURCE), "-ldl"]
        subprocess.run(compiler, check=True)
        paths = os.pathsep.join(filter(None, (str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH"))))
        surroundings = os.environ | {"LD_PRELOAD": str(library), _LIBRARY: str(library), "PYTHONPATH": paths}
        command = [sys.executable, "-m", "soaking", *words]
        with subprocess.Popen(command, env=surroundings, stdout=subprocess.PIPE, text=True) as process:
            before = signal.signal(signal.SIGTERM, lambda number, _: process.send_signal(number))
            try:
                told = process.communicate()[0]
            finally:
                signal.signal(signal.SIGTERM, before)
        return subprocess.CompletedProcess(command, process.returncode, told)


def is_preloaded() -> bool:
    """Whether this process is one that `preloaded` has started."""
    return _LIBRARY in os.environ


@dataclass(frozen=True)
class Fault:
    """What befalls a command: one of FAULTS, and at which call below the folder; 0: at none, calls are counted."""

    kind: str = "EIO"
    call: int = 0

    def __str__(self) -> str:
        return f"{self.kind} at call {self.call}"


@dataclass(frozen=True)
class Ended:
    """How a command ended: its exit code or negative signal, what it said, and its calls to the disk by kind."""

    code: int
    said: str
    calls: Mapping[str, int]


def call(words: list[str], folder: Path, fault: Fault | None = None, seconds: float | None = None) -> Ended:
    """Run a command of phongbench in a process of its own.

    fault    what befalls it below the folder
    seconds  after which it is killed
    """
    with tempfile.TemporaryDirectory(prefix="phongbench-said-") as place:
        said, counted = Path(place) / "said", Path(place) / "calls"
        said.touch()
        process = os.fork()
        if not process:
            _run(words, folder, fault or Fault(), said, counted)
        if seconds is not None:
            handle = os.pidfd_open(process)
            if not select.select([handle], [], [], seconds)[0]:
                os.kill(process, signal.SIGKILL)
            os.close(handle)
        code = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
        whole = counted.exists() and code >= 0  # one that was killed may have begun to write them
        calls = json.loads(counted.read_text()) if whole else {}
        return Ended(code, said.read_text(errors="replace"), calls)


def _run(words: list[str], folder: Path, fault: Fault, said: Path, counted: Path) -> NoReturn:
    """The command in this process, which ends as it does."""
    code: Any = 70
    library = ctypes.CDLL(os.environ[_LIBRARY])
    try:
        for stream in (1, 2):
            os.dup2(os.open(said, os.O_WRONLY | os.O_APPEND), stream)
        from phongbench.cli.main import main

        number, stays = FAULTS[fault.kind]
        library.faults_arm(str(folder).encode(), ctypes.c_long(fault.call), number, int(stays))
        main(args=words, prog_name="phongbench")
    except SystemExit as end:
        code = end.code or 0
    except BaseException:  # noqa: BLE001 - what escapes is what a user would see
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        counted.write_text(json.dumps({name: library.faults_seen(kind) for kind, name in enumerate(CALLS)}))
        os._exit(code if isinstance(code, int) else 1)
