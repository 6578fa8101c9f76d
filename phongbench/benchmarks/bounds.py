"""The least time a compiled loop can take here: what its machine code asks of each unit, over what the unit gives.

A loop's bound is the largest of three quotients: its multiplications and multiply-adds over the ports that do them,
all its vector instructions over the ports of vectors, and its bytes over what the arrays' place in memory delivers.
What an element asks is counted in the assembly of the innermost loop. What the machine gives is measured in the same
run, by three loops that ask little but one of these: no clock rate and no table of processors is needed. It is a bound
from below: waits, divisions, roots and gathers are not in it, which is what a time above it is spent on.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from phongbench.compiler import jit
from phongbench.compiler.precisions import Array
from phongbench.formulas import pair_kernels
from phongbench.formulas.kernel import Kernel, read_only
from phongbench.formulas.spec import MAX_COEFFICIENTS

#: what the bound of a loop can come from
PORTS, VECTORS, BYTES = "multiply-add ports", "vector ports", "bytes"
UNITS = (PORTS, VECTORS, BYTES)
#: what whole calls are bound by, too: a root and a quotient for each unit vector, which share one slow unit
ROOTS = "roots and quotients"
CALIBRATED = (*UNITS, ROOTS)
#: how much longer than its bound a loop may take unexplained
ROOM = 1.3
_LABEL = re.compile(r"^(\.?\w+):")
_BRANCH = re.compile(r"^\tj\w+\t(\.?\w+)$")
_INSTRUCTION = re.compile(r"^\t([a-z]\w*)\t(.*%[xyz]mm\d+.*)$")
_WIDTH = re.compile(r"%([xyz])mm\d+")
_MULTIPLY_ADD = re.compile(r"v?(?:fn?m(?:add|sub)\d+|mul)[ps][sd]$")
#: copies and broadcasts, which other ports do, or none
_MOVE = re.compile(r"v?p?(?:mov(?!mskp)|broadcast)")
_SCALAR = re.compile(r"(?<=s)[sd]$")
#: an array's element: not the stack, where constants and tables lie, not a constant, not one value for all lanes
_ARRAY = re.compile(r"(?<![\w.])-?\d*\(%(?!r[si]p\b)\w+(?:,%\w+)?(?:,\d)?\)(?!\{1to)")
_ROOTS_EACH = 2
_FRAME = "movq\t%rsp, %rbp"
_BYTES = {"x": 16, "y": 32, "z": 64}


@dataclass(frozen=True)
class Work:
    """What a loop asks for an element, in instructions of whole vectors.

    multiply_adds  multiplications and multiply-adds; additions have other ports on some processors
    vectors        vector instructions that compute, these included
    bytes          that are read and written
    lanes          elements of a vector; 1 where nothing was vectorised
    """

    multiply_adds: float
    vectors: float
    bytes: float
    lanes: int

    def of(self, unit: str) -> float:
        """What it asks of one of UNITS."""
        return {PORTS: self.multiply_adds, VECTORS: self.vectors, BYTES: self.bytes}[unit]

    def bound(self, rates: Mapping[str, float]) -> tuple[float, str]:
        """(nanoseconds an element, the unit that it comes from), from what each of UNITS does in a nanosecond."""
        return max((self.of(unit) / rates[unit], unit) for unit in UNITS)


def counted(assembly: str, itemsize: int) -> Work | None:
    """The work of the innermost loop that stores most: elements are what it stores, of so many bytes each.

    None where no loop stores a vector register to an array: not x86, or not such a loop.
    """
    if _FRAME in assembly:  # where it holds no address of its own, it holds the stack's
        assembly = assembly.replace("(%rbp", "(%rsp")
    loops = [_Loop.of(lines) for lines in _innermost(assembly.splitlines())]
    best = max(loops, key=lambda loop: loop.stored, default=None)
    return None if best is None or not best.stored else best.work(itemsize)


def _innermost(lines: Sequence[str]) -> list[Sequence[str]]:
    """Lines of every loop without another in it: from a label to a branch back to it."""
    labels = {match[1]: i for i, line in enumerate(lines) if (match := _LABEL.match(line))}
    branches = ((labels.get(match[1], i), i) for i, line in enumerate(lines) if (match := _BRANCH.match(line)))
    spans = [(start, end) for start, end in branches if start < end]
    return [
        lines[start:end]
        for start, end in spans
        if not any(start <= s and e <= end and (s, e) != (start, end) for s, e in spans)
    ]


@dataclass(frozen=True)
class _Loop:
    """Counts of one iteration; width in bytes of its widest vector."""

    multiply_adds: int
    vectors: int
    moved: int
    stored: int
    width: int
    scalar: bool

    @classmethod
    def of(cls, lines: Sequence[str]) -> "_Loop":
        found = [(match[1], match[2]) for line in lines if (match := _INSTRUCTION.match(line.split("#")[0].rstrip()))]
        computing = [name for name, _ in found if not _MOVE.match(name)]
        touched = [(name, operands, _bytes(name, operands)) for name, operands in found if _ARRAY.search(operands)]
        return cls(
            multiply_adds=sum(_MULTIPLY_ADD.match(name) is not None for name in computing),
            vectors=len(computing),
            moved=sum(size for _, _, size in touched),
            stored=sum(size for name, operands, size in touched if _MOVE.match(name) and operands.endswith(")")),
            width=max((_bytes(name, operands) for name, operands in found), default=0),
            scalar=all(_SCALAR.search(name) for name in computing),
        )

    def work(self, itemsize: int) -> Work:
        elements = self.stored / itemsize
        lanes = 1 if self.scalar else self.width // itemsize
        return Work(self.multiply_adds / elements, self.vectors / elements, self.moved / elements, lanes)


def _bytes(name: str, operands: str) -> int:
    if (scalar := _SCALAR.search(name)) is not None:
        return 4 if scalar[0] == "s" else 8
    return max(_BYTES[width] for width in _WIDTH.findall(operands))


# what the machine gives


@cache
def _busy(unit: str) -> tuple[Any, type]:
    """The loop that asks little but one unit, of the signature of formulas over pairs, and the type of its numbers.

    Steps are written out: a loop of them would not be vectorised. Two chains for each element, of several vectors at a
    time, are more than a port's latency.
    """

    def multiply_adds(a: Any, b: Any, coefficients: Any, table: Any, out: Any) -> None:
        p, q = coefficients[0], coefficients[1]
        for i in range(len(out)):
            x = a[0, i]
            y, z = x * p, x * q
            y, z = y * x + p, z * x + q
            y, z = y * x + p, z * x + q
            y, z = y * x + p, z * x + q
            y, z = y * x + p, z * x + q
            y, z = y * x + p, z * x + q
            y, z = y * x + p, z * x + q
            y, z = y * x + p, z * x + q
            y, z = y * x + p, z * x + q
            out[i] = y * z

    def whole_numbers(a: Any, b: Any, coefficients: Any, table: Any, out: Any) -> None:
        p, q = coefficients[0], coefficients[1]
        for i in range(len(out)):  # neither of both operations undoes the other, so that nothing can be left out
            x = a[0, i]
            y, z = x + p, x + q
            y, z = (y ^ x) + p, (z ^ x) + q
            y, z = (y ^ x) + p, (z ^ x) + q
            y, z = (y ^ x) + p, (z ^ x) + q
            y, z = (y ^ x) + p, (z ^ x) + q
            y, z = (y ^ x) + p, (z ^ x) + q
            y, z = (y ^ x) + p, (z ^ x) + q
            out[i] = y ^ z

    def sums(a: Any, b: Any, coefficients: Any, table: Any, out: Any) -> None:
        for i in range(len(out)):
            out[i] = (a[0, i] + a[1, i]) + (a[2, i] + b[0, i]) + (b[1, i] + b[2, i])

    def roots(a: Any, b: Any, coefficients: Any, table: Any, out: Any) -> None:
        p, q = coefficients[0], coefficients[1]
        for i in range(len(out)):
            x = a[0, i] * a[0, i]
            out[i] = p / np.sqrt(x + p) + p / np.sqrt(x + q)

    body = {PORTS: multiply_adds, VECTORS: whole_numbers, BYTES: sums, ROOTS: roots}[unit]
    kind = np.int64 if unit == VECTORS else np.float32
    return jit.elementwise(pair_kernels.pairs_signature(kind), body), kind


def passing(kernel: Kernel, a: Array, b: Array, out: Array) -> Callable[[], Array]:
    """A pass of a loop over pairs, as Python calls it: it fills `out` and returns it."""
    address, row, table = kernel.address, kernel.coefficients, kernel.table
    first, second = read_only(a), read_only(b)

    def once() -> Array:
        pair_kernels.fill_pairs(address, first, second, row, table, out)
        return out

    return once


def calibrating(unit: str, a: Array, b: Array, out: Array) -> Callable[[], Array]:
    """A pass of the loop that asks for this one of CALIBRATED, over float32 arrays whose memory it takes as its own."""
    loop, kind = _busy(unit)
    row: Array = np.zeros(MAX_COEFFICIENTS, kind)
    table: Array = np.zeros(1, kind)
    row[:2] = (0x9E3779B9, 0x7F4A7C15) if unit == VECTORS else (0.75, 0.5)
    return passing(Kernel(loop, row, table), a.view(kind), b.view(kind), out.view(kind))


def rate(unit: str, ns: float) -> float | None:
    """What a unit does in a nanosecond, if a float32 element of its calibrating loop takes so many; None if unknown.

    One of ROOTS is a root with a quotient, of a float32 number.
    """
    if unit == ROOTS:
        return _ROOTS_EACH / ns
    loop, kind = _busy(unit)
    work = of_loop(loop, np.dtype(kind).itemsize)
    return None if work is None else work.of(unit) / ns * (np.dtype(np.float32).itemsize / np.dtype(kind).itemsize)


@cache
def of_loop(loop: Any, itemsize: int = 4) -> Work | None:
    """The work of a compiled loop over pairs; None where its code is not counted."""
    return counted(jit.code(loop)[1], itemsize)


def rates(least: Mapping[str, float]) -> dict[str, float]:
    """What each of CALIBRATED does in a nanosecond: whole vectors, bytes, or roots; nothing where code is not counted.

    least  nanoseconds an element, at best, of the calibrating loop of each of CALIBRATED, and maybe of others
    """
    given = {unit: found for unit in CALIBRATED if (found := rate(unit, least[unit])) is not None}
    return given if len(given) == len(CALIBRATED) else {}


def lanes() -> int:
    """float32 numbers of a whole vector, as the calibrating loop of multiply-adds has them."""
    work = of_loop(_busy(PORTS)[0])
    return 1 if work is None else work.lanes


def rows(working_set: str, least: Mapping[str, float], asked: Mapping[str, Work | None]) -> list[dict[str, Any]]:
    """Loops beside their bounds in one working set; none where code is not counted.

    least  nanoseconds an element, at best, of each kind of work and of the calibrating loop of each of CALIBRATED
    asked  what a kind of work asks; those without a time are left out
    serial                         nanoseconds if computing and moving bytes never overlapped
    multiply_adds, vectors, bytes  of an element alone, vectors aside
    """
    given = rates(least)
    if not given:
        return []
    return [
        _row(work, asks, least[work], given) | {"working_set": working_set}
        for work, asks in asked.items()
        if asks is not None and work in least
    ]


def _row(work: str, asks: Work, ns: float, rates: Mapping[str, float]) -> dict[str, Any]:
    bound, unit = asks.bound(rates)
    return {
        "work": work,
        "ns": ns,
        "bound": bound,
        "over_bound": ns / bound,
        "bound_by": unit,
        "serial": max(asks.of(one) / rates[one] for one in (PORTS, VECTORS)) + asks.bytes / rates[BYTES],
        "multiply_adds": asks.multiply_adds * asks.lanes,
        "vectors": asks.vectors * asks.lanes,
        "bytes": asks.bytes,
        "lanes": asks.lanes,
    }


def excuses(found: Sequence[Mapping[str, Any]]) -> list[str]:
    """Why loops take more than ROOM times their bounds, as far as the numbers of `rows` tell."""
    said = []
    for row in found:
        if row["over_bound"] > ROOM:
            overlap = f"computing and moving its bytes overlap in part: in turn they would take {row['serial']:.3g} ns"
            waits = "waits of its own steps, divisions, roots and gathers are in no bound"
            why = overlap if row["ns"] <= row["serial"] else waits
            said.append(f"{row['work']}, {row['working_set']}: {row['over_bound']:.2f} times its bound; {why}")
    return said
