"""NVIDIA's run-time compiler without a GPU, in a process of its own: CUDA C on stdin, the machine code on stdout.

The library, the architecture and folders of headers are the arguments; without an architecture the answer is the
compiler's version. What it says of code that it refuses goes to stderr, and the exit code is 1.
"""

import ctypes
import sys
from collections.abc import Sequence
from typing import Any

#: what a shader's arithmetic is: multiply-adds, no subnormal numbers, powers and roots by the special unit
_OPTIONS = ("--use_fast_math", "--std=c++17", "--disable-warnings")


class Nvrtc:
    """The compiler, loaded from this file."""

    def __init__(self, library: str) -> None:
        self.library = ctypes.CDLL(library)

    def _call(self, name: str, *arguments: Any) -> bool:
        return int(getattr(self.library, f"nvrtc{name}")(*arguments)) == 0

    def _text(self, program: ctypes.c_void_p, what: str) -> bytes:
        """Its log, or its machine code."""
        size = ctypes.c_size_t()
        self._call(f"Get{what}Size", program, ctypes.byref(size))
        held = ctypes.create_string_buffer(size.value)
        self._call(f"Get{what}", program, held)
        return held.raw

    def version(self) -> str:
        """Major and minor."""
        major, minor = ctypes.c_int(), ctypes.c_int()
        self._call("Version", ctypes.byref(major), ctypes.byref(minor))
        return f"{major.value}.{minor.value}"

    def compiled(self, source: bytes, architecture: str, headers: Sequence[str]) -> tuple[bool, bytes]:
        """Whether it compiles, and the machine code; else the compiler's words."""
        program, folders = ctypes.c_void_p(), [f"--include-path={folder}" for folder in headers]
        options = [f"--gpu-architecture={architecture}", *folders, *_OPTIONS]
        self._call("CreateProgram", ctypes.byref(program), source, b"program", 0, None, None)
        given = (ctypes.c_char_p * len(options))(*(option.encode() for option in options))
        done = self._call("CompileProgram", program, len(options), given)
        return done, self._text(program, "CUBIN" if done else "ProgramLog")


def main(library: str, architecture: str | None = None, *headers: str) -> int:
    """Compile what stdin holds; 1 where that is refused."""
    compiler = Nvrtc(library)
    if architecture is None:
        sys.stdout.write(compiler.version())
        return 0
    done, answer = compiler.compiled(sys.stdin.buffer.read(), architecture, headers)
    (sys.stdout if done else sys.stderr).buffer.write(answer)
    return 0 if done else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
