"""Compilers and disassemblers, each in a process of its own: one that crashes or hangs takes nothing with it."""

import subprocess
from collections.abc import Sequence

from phongbench.errors import InputError

#: seconds that programs which are compiled together may take: a tool that hangs is no reason to wait for ever
PATIENCE = 600


def answer(tool: str, command: Sequence[object], given: bytes = b"", *, chip: str = "") -> tuple[bytes, str]:
    """What a tool writes to stdout, given this on stdin, and to stderr.

    tool, chip  for people: who answers, and for what
    Raises InputError, with the tool's first complaint, where it refuses, fails or does not answer in PATIENCE.
    """
    what = f"{tool} for {chip}" if chip else tool
    try:
        words = [str(word) for word in command]
        done = subprocess.run(words, input=given, capture_output=True, check=False, timeout=PATIENCE)
    except OSError as problem:
        raise InputError(f"{what} does not start: {problem.strerror}", None, "install it again") from problem
    except subprocess.TimeoutExpired as problem:
        raise InputError(f"{what} did not answer in {PATIENCE} s", None, "try another release") from problem
    said = done.stderr.decode(errors="replace")
    if done.returncode:
        complaints = [line.strip() for line in said.splitlines() if "error" in line.lower()]
        if not complaints:
            raise InputError(f"{what} failed: exit {done.returncode}", None, "install it again; other targets go on")
        fix = "see `phongbench shader`; other targets go on"
        raise InputError(f"{what} refuses the code: {complaints[0]}", None, fix)
    return done.stdout, said
