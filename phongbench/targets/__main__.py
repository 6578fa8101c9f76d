"""Write the shipped costs of the targets whose compilers are here: `python -m phongbench.targets [NAME..]`."""

import resource
import sys
from functools import cache
from pathlib import Path

from phongbench.errors import PhongbenchError
from phongbench.formulas.shader_code.language import FLOAT32
from phongbench.support.atomic_files import write_text, write_whole
from phongbench.targets.chips import TARGETS, target_named
from phongbench.targets.code_shapes import Code, catalogue
from phongbench.targets.costs import FOLDER, as_text, compiled, place
from phongbench.targets.target import Target


def write(target: Target, precision: str = FLOAT32, folder: Path = FOLDER) -> Path:
    """Compile every formula of the full study for the target and write its costs; the file."""
    codes = _codes(target.language, precision)
    text = as_text(compiled(target, codes, precision))
    path = folder / place(target.name, precision).name
    write_whole(path, lambda file: write_text(file, text))
    return path


@cache
def _codes(language: str, precision: str) -> tuple[Code, ...]:
    return catalogue(language, precision=precision)


def _seconds() -> float:
    """Of processor time that this process and those it ran have taken."""
    return sum(resource.getrusage(who).ru_utime for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def main(names: list[str]) -> int:
    """Write what can be written, saying why the rest cannot; exit code 1 if anything cannot."""
    failed = 0
    chosen = [target_named(name) for name in names] or list(TARGETS.values())
    for target, precision in [(one, precision) for one in chosen for precision in one.precisions]:
        before = _seconds()
        try:
            path = write(target, precision)
            sys.stdout.write(f"{path.name}: {_seconds() - before:.0f} s of processor time\n")
        except PhongbenchError as problem:
            failed = 1
            sys.stderr.write(f"{target.name}: {problem}\n")
    return failed


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except PhongbenchError as problem:
        sys.exit(f"phongbench.targets: {problem}")
