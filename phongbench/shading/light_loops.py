"""The loops of shading that depend on the kind of light, the viewer and the lambda form.

Each is compiled when first wanted, and called by the loop of shade_loop.py through its address. What is the same for
all points may be computed once or at every point; both must give the same bits, so products and sums are not fused.
"""

from functools import cache
from typing import Any

import numpy as np

from phongbench.compiler import intrinsics, jit
from phongbench.compiler.lowering import Body, Precision, lower
from phongbench.compiler.precisions import Array
from phongbench.formulas import lambda_forms
from phongbench.formulas.normalising import pair_bodies
from phongbench.formulas.recipes import pair_of
from phongbench.shading import tiles as at

#: a light in a direction; the same, but its direction repeated in planes; a light at a position; one that fades
KINDS = ("directional", "spread", "point", "fading")
#: pairs that a recipe of formulas makes
_MADE = {"unit": "reflect", "lengthwise": "lengthwise"}


def loop_signature(dtype: Any) -> Any:
    """(planes, numbers of the light, flags of the blocks)."""
    return jit.signature(jit.array_type(dtype), jit.array_type(dtype), jit.array_type(np.int64))


loop_at = intrinsics.function_at(loop_signature)


def _numbers(precision: Precision) -> tuple[Any, ...]:
    """0, 1, 2, the smallest squared length that is not 0, the largest number, NaN."""
    info = np.finfo(precision.carrier)
    return (*map(precision.constant, (0.0, 1.0, 2.0)), info.tiny, info.max, precision.constant(np.nan))


@cache
def facing_loop(kind: str, shadowed: bool, precision: Precision) -> Any:
    """The loop over a tile that finds N.L and the fading of a light, and flags the blocks that face it.

    kind  "directional"; "spread", the same but written to planes; "point"; "fading", a point with attenuation
    A point nearer to a light than its squared distance can tell is dark. The fading is at most the largest number.
    """
    zero, one, _, tiny, most, nan = _numbers(precision)
    dot = lower(lambda_forms.dot, precision)
    placed, fading, planes = kind in ("point", "fading"), kind == "fading", kind != "directional"
    always = np.int32((0 if placed else at.REACHES) | (0 if shadowed else at.SEES))
    none, faces_it, reaches, sees = (np.int32(bit) for bit in (0, at.FACES, at.REACHES, at.SEES))
    entry, put, select, three, put_three = intrinsics.entry, intrinsics.put, intrinsics.select, at.three, at.put_three

    def facing(s: Array, light: Array, flags: Array) -> None:
        x, y, z = light[at.WHERE], light[at.WHERE + 1], light[at.WHERE + 2]
        c, l, q, reach = light[at.FADE], light[at.FADE + 1], light[at.FADE + 2], light[at.REACH]  # noqa: E741  its name in texts
        for b in range(flags[at.USED]):
            found = always
            for j in range(at.BLOCK):
                i = b * at.BLOCK + j
                nx, ny, nz = three(s, at.NORMAL + i)
                lx, ly, lz, fade, near = x, y, z, one, True
                if placed:
                    px, py, pz = three(s, at.POINT + i)
                    lx, ly, lz = x - px, y - py, z - pz
                    squared = dot(lx, ly, lz, lx, ly, lz)
                    inverse = select(squared > tiny, one / np.sqrt(squared), nan)
                    lx, ly, lz = lx * inverse, ly * inverse, lz * inverse
                    near = squared <= reach
                    if fading:
                        value = one / (c + l * (squared * inverse) + q * squared)
                        fade = select(value < most, value, most)
                    else:
                        fade = c
                if planes:
                    put_three(s, at.TOWARDS + i, lx, ly, lz)
                cosine = dot(nx, ny, nz, lx, ly, lz)
                if placed:
                    cosine = select(near, cosine, zero)
                if shadowed:
                    seen = entry(s, at.SEEN + i) > zero
                    cosine = select(seen, cosine, zero)
                    found = np.int32(found | select(seen, sees, none))
                faces = cosine > zero
                found = np.int32(found | select(faces, faces_it, none))
                if placed:
                    found = np.int32(found | select(near, reaches, none))
                put(s, at.FACING + i, select(faces, cosine, zero))
                put(s, at.FADING + i, select(faces, fade, zero))
            flags[at.FLAGS + b] = found

    return jit.elementwise(loop_signature(precision.carrier), facing, fused=False)


@cache
def glow_loop(fading: bool, precision: Precision) -> Any:
    """The loop over a tile that adds the ambient term of a light at a position to all points within its reach.

    fading  whether the light has attenuation; at most the largest number, as in `facing_loop`
    """
    zero, one, _, _, most, _ = _numbers(precision)
    dot = lower(lambda_forms.dot, precision)
    select, three, put_three = intrinsics.select, at.three, at.put_three

    def glowing(s: Array, light: Array, flags: Array) -> None:
        x, y, z = light[at.WHERE], light[at.WHERE + 1], light[at.WHERE + 2]
        c, l, q, reach = light[at.FADE], light[at.FADE + 1], light[at.FADE + 2], light[at.REACH]  # noqa: E741  its name in texts
        red, green, blue = light[at.GLOW], light[at.GLOW + 1], light[at.GLOW + 2]
        for b in range(flags[at.USED]):
            for j in range(at.BLOCK):
                i = b * at.BLOCK + j
                px, py, pz = three(s, at.POINT + i)
                lx, ly, lz = x - px, y - py, z - pz
                squared = dot(lx, ly, lz, lx, ly, lz)
                fade = c
                if fading:
                    value = one / (c + l * np.sqrt(squared) + q * squared)
                    fade = select(value < most, value, most)
                w = select(squared <= reach, fade, zero)
                r, g, u = three(s, at.SUM + i)
                put_three(s, at.SUM + i, r + red * w, g + green * w, u + blue * w)

    return jit.elementwise(loop_signature(precision.carrier), glowing, fused=False)


@cache
def _pair_maker(pair: str, precision: Precision) -> Body:
    """From N, L and V, their components and N.L, to the six components of the formula's pair; L and V are unit.

    pair  "reflect": R = 2 (N.L) N - L and V; "half": N and H = (L + V) / |L + V|; "halfway": N and L + V as it is;
          "unit": as "reflect" of N / |N|; "lengthwise": R = 2 (N.L) N - (N.N) L, which no length of N turns, and V
    """
    _, one, two, tiny, _, nan = _numbers(precision)
    dot, select, halved, made = lower(lambda_forms.dot, precision), intrinsics.select, pair == "half", _MADE.get(pair)
    if made is not None:
        recipe = pair_of(made, precision)

        @jit.inline
        def by_recipe(n: Any, l: Any, v: Any, cosine: Any) -> Any:  # noqa: E741  its name in texts
            return recipe(n[0], n[1], n[2], l[0], l[1], l[2], v[0], v[1], v[2])

        return by_recipe

    @jit.inline
    def mirrored(n: Any, l: Any, v: Any, cosine: Any) -> Any:  # noqa: E741
        twice = two * cosine
        return twice * n[0] - l[0], twice * n[1] - l[1], twice * n[2] - l[2], v[0], v[1], v[2]

    @jit.inline
    def middle(n: Any, l: Any, v: Any, cosine: Any) -> Any:  # noqa: E741
        hx, hy, hz = l[0] + v[0], l[1] + v[1], l[2] + v[2]
        if halved:
            squared = dot(hx, hy, hz, hx, hy, hz)
            inverse = select(squared > tiny, one / np.sqrt(squared), nan)
            hx, hy, hz = hx * inverse, hy * inverse, hz * inverse
        return n[0], n[1], n[2], hx, hy, hz

    return mirrored if pair == "reflect" else middle


@cache
def coordinate_loop(
    pair: str,
    form: str,
    light_planes: bool,
    view_planes: bool,
    exact_tail: bool,
    precision: Precision,
    normalise: str = "none",
) -> Any:
    """The loop over a tile that finds the formula's coordinate and its gate, and flags the blocks with a highlight.

    pair          what it is a coordinate of, see `_pair_maker`
    form          a lambda form, or "none" for the cosine itself
    light_planes  whether L is a plane or the same everywhere; view_planes the same of V. What is the same everywhere is
                  computed once: the compiler lifts it out of the loop.
    normalise     how the pair's lengths are removed. Where that leaves the precision's range, the gate is closed
    """
    zero, one, _, _, most, _ = _numbers(precision)
    none, removes = np.int32(0), normalise != "none"
    coordinate, gate_of = pair_bodies(form, normalise, precision)
    made, sign = _pair_maker(pair, precision), one if form == "none" else -one
    entry, put, select, three = intrinsics.entry, intrinsics.put, intrinsics.select, at.three

    def coordinates(s: Array, light: Array, flags: Array) -> None:
        x, y, z = light[at.WHERE], light[at.WHERE + 1], light[at.WHERE + 2]
        ex, ey, ez = light[at.EYE], light[at.EYE + 1], light[at.EYE + 2]
        dark, tail = sign * light[at.DARK], light[at.TAIL]
        for b in range(flags[at.USED]):
            flags[at.LIT + b] = 0
            if flags[at.FLAGS + b] & at.FACES:
                found = none
                for j in range(at.BLOCK):
                    i = b * at.BLOCK + j
                    nx, ny, nz = three(s, at.NORMAL + i)
                    lx, ly, lz, vx, vy, vz = x, y, z, ex, ey, ez
                    if light_planes:
                        lx, ly, lz = three(s, at.TOWARDS + i)
                    if view_planes:
                        vx, vy, vz = three(s, at.VIEW + i)
                    facing = entry(s, at.FACING + i)
                    ax, ay, az, bx, by, bz = made((nx, ny, nz), (lx, ly, lz), (vx, vy, vz), facing)
                    value = coordinate(ax, ay, az, bx, by, bz)
                    gate = select(facing > zero, gate_of(ax, ay, az, bx, by, bz), zero)
                    if removes:
                        gate = select(abs(value) <= most, gate, zero)
                    if exact_tail:
                        gate = select(value > tail, gate, zero)
                    put(s, at.COORDINATE + i, value)
                    put(s, at.GATE + i, gate)
                    found = np.int32(found | np.int32((gate > zero) & (sign * value > dark)))
                flags[at.LIT + b] = found

    return jit.elementwise(loop_signature(precision.carrier), coordinates, fused=False)


@cache
def incidence_loop(light_planes: bool, view_planes: bool, precision: Precision) -> Any:
    """The loop over a tile that finds the cosine of incidence, v = V.H, where a block has a highlight.

    light_planes, view_planes  as in `coordinate_loop`

    Formula  v = |L + V| / 2 of unit L and V, which is sqrt((1 + L.V) / 2), but keeps its digits at grazing incidence;
             0 for L = -V, and where L or V has no direction
    """
    zero = precision.constant(0.0)
    dot, half = lower(lambda_forms.dot, precision), precision.constant(0.5)
    put, select, three = intrinsics.put, intrinsics.select, at.three

    def incidences(s: Array, light: Array, flags: Array) -> None:
        x, y, z = light[at.WHERE], light[at.WHERE + 1], light[at.WHERE + 2]
        ex, ey, ez = light[at.EYE], light[at.EYE + 1], light[at.EYE + 2]
        for b in range(flags[at.USED]):
            if flags[at.LIT + b]:
                for j in range(at.BLOCK):
                    i = b * at.BLOCK + j
                    lx, ly, lz, vx, vy, vz = x, y, z, ex, ey, ez
                    if light_planes:
                        lx, ly, lz = three(s, at.TOWARDS + i)
                    if view_planes:
                        vx, vy, vz = three(s, at.VIEW + i)
                    hx, hy, hz = lx + vx, ly + vy, lz + vz
                    squared = dot(hx, hy, hz, hx, hy, hz)
                    put(s, at.INCIDENCE + i, select(squared > zero, half * np.sqrt(squared), zero))

    return jit.elementwise(loop_signature(precision.carrier), incidences, fused=False)
