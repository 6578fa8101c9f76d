"""The same formulas by other people's tools: what `phongbench bench` compares our kernels with.

Each peer is written as its users would write it when they want speed: compiled once where it compiles, without
temporaries where it can write into given arrays, on one thread. The exponent is a value at run time for all of them,
so that none replaces the power by the multiplications of one exponent. Imported only when asked for. Hand-written C is
one of them, and does more kinds of work than the others.
"""

import os
from collections.abc import Callable, Mapping
from contextlib import redirect_stdout
from dataclasses import dataclass
from importlib import import_module
from io import StringIO
from types import MappingProxyType
from typing import Any

import numpy as np

from phongbench.benchmarks import c_loops
from phongbench.compiler.precisions import Array
from phongbench.errors import UnknownNameError

#: exact Phong max(0, a.b)^alpha, and Lyon's max(0, 1 - beta (1 - a.b))^8
PHONG, LYON = "exact Phong", "Lyon gamma 8"
WORKS = (PHONG, LYON)
#: exp(-alpha (1 - a.b)) and max(0, 1 - beta |a x b|^2 / 2)^8, both 0 where a.b is not positive: what C does besides
GAUSSIAN, CROSS = "Gaussian", "Lyon gamma 8, cross"
ALPHA, GAMMA = 50.0, 8
BETA = ALPHA / GAMMA
#: every kind of work -> the formula by which our kernels do it
FORMULAS = {PHONG: "phong", LYON: f"lyon:dot:{GAMMA}", GAUSSIAN: "gaussian:dot", CROSS: f"lyon:cross:{GAMMA}"}
ALL_WORKS = tuple(FORMULAS)


def exact_values(work: str, a: Array, b: Array) -> Array:
    """What a kind of work gives, in float64: (n,) from (3, n)."""
    a, b = a.astype(np.float64), b.astype(np.float64)
    x = (a * b).sum(axis=0)
    if work == GAUSSIAN:
        return np.where(x > 0, np.exp(ALPHA * (x - 1)), 0.0)
    if work == CROSS:
        sines = np.square(np.cross(a, b, axis=0)).sum(axis=0)
        return np.where(x > 0, np.maximum(1 - ALPHA / GAMMA * sines / 2, 0) ** GAMMA, 0.0)
    base = x if work == PHONG else 1 - ALPHA / GAMMA * (1 - x)
    return np.asarray(np.maximum(base, 0) ** (ALPHA if work == PHONG else GAMMA))


@dataclass(frozen=True)
class Peer:
    """A tool ready to work on given arrays.

    version  its release
    passes   of ALL_WORKS -> one pass over all elements; what it returns becomes an array of its values by np.asarray
    """

    version: str
    passes: Mapping[str, Callable[[], Any]]


def _numpy(a: Array, b: Array, out: Array) -> Peer:
    """Ufuncs into given arrays: no allocation in a pass."""
    x, t = np.empty_like(out), np.empty_like(out)
    alpha, beta, one, zero = (np.float32(value) for value in (ALPHA, BETA, 1, 0))

    def cosine() -> None:
        np.multiply(a[0], b[0], out=x)
        for row in (1, 2):
            np.multiply(a[row], b[row], out=t)
            np.add(x, t, out=x)

    def phong() -> Array:
        cosine()
        np.maximum(x, zero, out=x)
        return np.power(x, alpha, out=out)

    def lyon() -> Array:
        cosine()
        np.subtract(one, x, out=x)
        np.multiply(x, beta, out=x)
        np.subtract(one, x, out=x)
        np.maximum(x, zero, out=x)
        np.multiply(x, x, out=x)
        np.multiply(x, x, out=x)
        return np.multiply(x, x, out=out)

    return Peer(np.__version__, {PHONG: phong, LYON: lyon})


def _numexpr(a: Array, b: Array, out: Array) -> Peer:
    """Compiled expressions in blocks that stay in cache."""
    numexpr = import_module("numexpr")
    numexpr.set_num_threads(1)
    alpha, beta = np.array(ALPHA, np.float32), np.array(BETA, np.float32)
    rows = [(name, float) for name in ("ax", "ay", "az", "bx", "by", "bz")]  # numexpr's name of float32
    x = "(ax*bx + ay*by + az*bz)"
    y = f"(1 - beta*(1 - {x}))"
    power = numexpr.NumExpr(f"where({x} > 0, {x}, 0)**alpha", [*rows, ("alpha", float)])
    squares = numexpr.NumExpr(f"where({y} > 0, {y}, 0)**{GAMMA}", [*rows, ("beta", float)])
    return Peer(
        numexpr.__version__,
        {
            PHONG: lambda: power(*a, *b, alpha, out=out, ex_uses_vml=False),
            LYON: lambda: squares(*a, *b, beta, out=out, ex_uses_vml=False),
        },
    )


def _jax(a: Array, b: Array, out: Array) -> Peer:
    """Functions fused by XLA; each pass makes a new array, which is how JAX works."""
    os.environ.setdefault("JAX_PLATFORMS", "cpu")
    os.environ.setdefault("NPROC", "1")
    flags = "--xla_cpu_multi_thread_eigen=false"
    os.environ["XLA_FLAGS"] = f"{os.environ.get('XLA_FLAGS', '')} {flags}".strip()
    jax, jnp = import_module("jax"), import_module("jax.numpy")

    def cosine(a: Any, b: Any) -> Any:
        return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]

    @jax.jit  # type: ignore[untyped-decorator]
    def phong(a: Any, b: Any, alpha: Any) -> Any:
        return jnp.maximum(cosine(a, b), 0) ** alpha

    @jax.jit  # type: ignore[untyped-decorator]
    def lyon(a: Any, b: Any, beta: Any) -> Any:
        y = jnp.maximum(1 - beta * (1 - cosine(a, b)), 0)
        y = y * y
        y = y * y
        return y * y

    held_a, held_b = jnp.asarray(a), jnp.asarray(b)
    alpha, beta = jnp.float32(ALPHA), jnp.float32(BETA)
    return Peer(
        jax.__version__,
        {
            PHONG: lambda: phong(held_a, held_b, alpha).block_until_ready(),
            LYON: lambda: lyon(held_a, held_b, beta).block_until_ready(),
        },
    )


def _torch(a: Array, b: Array, out: Array) -> Peer:
    """Eager operations into given tensors: no allocation in a pass."""
    torch = import_module("torch")
    torch.set_num_threads(1)
    (ax, ay, az), (bx, by, bz), result = torch.from_numpy(a), torch.from_numpy(b), torch.from_numpy(out)
    x = torch.empty_like(result)

    def cosine() -> None:
        torch.mul(ax, bx, out=x)
        x.addcmul_(ay, by)
        x.addcmul_(az, bz)

    def phong() -> Any:
        cosine()
        x.clamp_(min=0)
        return torch.pow(x, ALPHA, out=result)

    def lyon() -> Any:
        cosine()
        x.sub_(1).mul_(BETA).add_(1).clamp_(min=0)
        x.mul_(x)
        x.mul_(x)
        return torch.mul(x, x, out=result)

    return Peer(torch.__version__, {PHONG: phong, LYON: lyon})


def _taichi(a: Array, b: Array, out: Array) -> Peer:
    """Kernels compiled by Taichi for one thread of the CPU, over the arrays as they are."""
    os.environ["ENABLE_TAICHI_HEADER_PRINT"] = "0"
    ti = import_module("taichi")
    ti.init(arch=ti.cpu, cpu_max_num_threads=1, verbose=False, log_level=ti.ERROR, offline_cache=False)

    def phong(a, b, alpha, out):  # type: ignore[no-untyped-def]
        for i in range(out.shape[0]):
            x = a[0, i] * b[0, i] + a[1, i] * b[1, i] + a[2, i] * b[2, i]
            out[i] = ti.pow(ti.max(x, 0.0), alpha)

    def lyon(a, b, beta, out):  # type: ignore[no-untyped-def]
        for i in range(out.shape[0]):
            x = a[0, i] * b[0, i] + a[1, i] * b[1, i] + a[2, i] * b[2, i]
            y = ti.max(1.0 - beta * (1.0 - x), 0.0)
            y = y * y
            y = y * y
            out[i] = y * y

    block, row = ti.types.ndarray(dtype=ti.f32, ndim=2), ti.types.ndarray(dtype=ti.f32, ndim=1)
    for body, number in ((phong, "alpha"), (lyon, "beta")):
        body.__annotations__ = {"a": block, "b": block, number: ti.f32, "out": row}
    compiled = {PHONG: (ti.kernel(phong), ALPHA), LYON: (ti.kernel(lyon), BETA)}

    def passing(work: str) -> Callable[[], Array]:
        kernel, number = compiled[work]

        def once() -> Array:
            kernel(a, b, number, out)
            return out

        return once

    return Peer(".".join(map(str, ti.__version__)), {work: passing(work) for work in WORKS})


def _c(a: Array, b: Array, out: Array) -> Peer:
    """Loops written by hand and compiled by the system's C compiler."""
    version, passes = c_loops.compiled(a, b, out, ALPHA)
    loops = {PHONG: "phong", LYON: "lyon", GAUSSIAN: "gaussian", CROSS: "lyon_cross"}
    return Peer(version, {work: passes[loop] for work, loop in loops.items()})


#: name -> (a, b, out) -> Peer; a and b are float32 of shape (3, n), out float32 of shape (n,)
PEERS: Mapping[str, Callable[[Array, Array, Array], Peer]] = MappingProxyType(
    {"numpy": _numpy, "numexpr": _numexpr, "jax": _jax, "torch": _torch, "taichi": _taichi, "c": _c}
)


def chosen(names: tuple[str, ...] | None) -> tuple[str, ...]:
    """The peers of these names, or all; UnknownNameError lists the known ones."""
    for name in names or ():
        if name not in PEERS:
            raise UnknownNameError("peer", name, PEERS)
    return tuple(dict.fromkeys(names or PEERS))


def prepared(name: str, a: Array, b: Array, out: Array) -> Peer | str:
    """The peer ready to work on these arrays, or why it is absent."""
    try:
        with redirect_stdout(StringIO()):  # some greet; stdout is for data
            return PEERS[name](a, b, out)
    except (ImportError, OSError, RuntimeError) as problem:
        return why_absent(name, problem)


def why_absent(name: str, problem: Exception) -> str:
    """What to tell of a package that could not be used, and how to fix it where that is known."""
    if not isinstance(problem, ModuleNotFoundError):
        return f"cannot be used here: {(str(problem).splitlines() or [type(problem).__name__])[0]}"
    if problem.name != name:
        return f"cannot be imported: {problem}"
    return f"not installed; pip install {name} brings it"
