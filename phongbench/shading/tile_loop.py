"""The loop of shading: for every tile, load it, ask every light, add up, store.

For each light four loops run over a tile's blocks: which points face it, the coordinate of its highlight, the formula
(a compiled loop of kernels.py over runs of blocks that have a highlight), and the sum. Where the specular colour
depends on incidence, its cosine and the three channels' reflectances come before the sum; a light at a position that
has an ambient term adds that first.
"""

from typing import Any

import numpy as np

from phongbench.compiler import intrinsics, jit
from phongbench.compiler.precisions import Array
from phongbench.formulas import coordinate_kernels
from phongbench.formulas.spec import MAX_COEFFICIENTS
from phongbench.shading import reach_bounds
from phongbench.shading import tiles as at
from phongbench.shading.light_loops import loop_at

_entry, _put, _select = intrinsics.entry, intrinsics.put, intrinsics.select
_values_at = coordinate_kernels.values_at


@jit.inline
def _add(s: Any, light: Any, b: Any, diffuse: Any, lit: Any, tinted: Any) -> None:
    """Add a light's diffuse term, its specular term or both to the sums of a block.

    tinted  whether the specular colour depends on incidence
    """
    dr, dg, db = light[at.DIFFUSE], light[at.DIFFUSE + 1], light[at.DIFFUSE + 2]
    sr, sg, sb = light[at.SPECULAR], light[at.SPECULAR + 1], light[at.SPECULAR + 2]
    for j in range(at.BLOCK):
        i = b * at.BLOCK + j
        r, g, u = at.three(s, at.SUM + i)
        fade = _entry(s, at.FADING + i)
        if diffuse:
            w = _entry(s, at.FACING + i) * fade
            r, g, u = r + dr * w, g + dg * w, u + db * w
        if lit:
            h = _entry(s, at.HIGHLIGHT + i) * fade
            if tinted:
                fr, fg, fb = at.three(s, at.REFLECTED + i)
                r, g, u = r + sr * (h * fr), g + sg * (h * fg), u + sb * (h * fb)
            else:
                r, g, u = r + sr * h, g + sg * h, u + sb * h
        at.put_three(s, at.SUM + i, r, g, u)


@jit.inline
def _shadow(s: Any, visible: Any, first: Any, used: Any, count: Any) -> None:
    """What of a tile sees the light, as a plane; the filling of the last block sees nothing."""
    zero, one = s.dtype.type(0), s.dtype.type(1)
    for j in range(used):
        _put(s, at.SEEN + j, one if first + j < count and visible[min(first + j, count - 1)] else zero)


@jit.inline
def _why(flag: Any) -> Any:
    """Why a block that does not face a light is left out."""
    return at.OUT if flag & at.REACHES == 0 else (at.SHADE if flag & at.SEES == 0 else at.BEHIND)


@jit.inline
def _facing(flags: Any, counts: Any, inside: Any, keep: Any) -> Any:
    """Count the blocks that do not face the light, or keep them all; whether any is left."""
    some = False
    for b in range(flags[at.USED]):
        if flags[at.FLAGS + b] & at.FACES == 0:
            if keep:
                flags[at.FLAGS + b] |= at.FACES
            else:
                counts[_why(flags[at.FLAGS + b])] += min(at.BLOCK, inside - b * at.BLOCK)
        some = some or flags[at.FLAGS + b] & at.FACES != 0
    return some


@jit.inline
def _wanted(flags: Any, counts: Any, inside: Any, plan: Any, keep: Any) -> None:
    """Decide and count the blocks for which the formula is evaluated."""
    for b in range(flags[at.USED]):
        faces = flags[at.FLAGS + b] & at.FACES != 0
        size = min(at.BLOCK, inside - b * at.BLOCK) if faces else 0
        if plan[at.EVALUATES] == 0:
            flags[at.LIT + b] = 0
            if plan[at.HAS_LOOP] == 0:
                counts[at.UNBUILT] += size
        elif faces and keep:
            flags[at.LIT + b] = 1
        elif flags[at.LIT + b] == 0:
            counts[at.UNLIT] += size


@jit.inline
def _formula(s: Any, flags: Any, values: Any, given: Any, coefficients: Any, table: Any, result: Any) -> None:
    """Evaluate a formula over each run of blocks that are lit: it is called for a run, not for a block.

    values  address of its loop, from plane `given` to plane `result`; 0 where the gate is closed
    """
    start = -1
    for b in range(flags[at.USED] + 1):
        lit = b < flags[at.USED] and flags[at.LIT + b] != 0
        if lit and start < 0:
            start = b
        if not lit and start >= 0:
            low, high = start * at.BLOCK, b * at.BLOCK
            _values_at(values, s)(
                s[given + low : given + high],
                s[at.GATE + low : at.GATE + high],
                coefficients,
                table,
                s[result + low : result + high],
            )
            start = -1


@jit.inline
def _reflect(s: Any, light: Any, flags: Any, plan: Any, loop: Any, fresnel: Any) -> None:
    """What the lit blocks reflect of each channel at their incidence."""
    loop_at(plan[at.INCIDENCE_LOOP], s)(s, light, flags)
    for c in range(3):
        row = fresnel[c * MAX_COEFFICIENTS : (c + 1) * MAX_COEFFICIENTS]
        _formula(s, flags, loop, at.INCIDENCE, row, fresnel[:1], at.REFLECTED + c * at.TILE)


@jit.inline
def _sum(s: Any, light: Any, flags: Any, plan: Any, tinted: Any) -> None:
    """Add what a light gives to the blocks that face it; the flags are told apart here, outside the loops."""
    diffuse, specular = plan[at.ADDS_DIFFUSE] != 0, plan[at.ADDS_SPECULAR] != 0
    for b in range(flags[at.USED]):
        if flags[at.FLAGS + b] & at.FACES:
            lit = specular and flags[at.LIT + b] != 0
            if diffuse and lit:
                if tinted:
                    _add(s, light, b, True, True, True)
                else:
                    _add(s, light, b, True, True, False)
            elif lit:
                if tinted:
                    _add(s, light, b, False, True, True)
                else:
                    _add(s, light, b, False, True, False)
            elif diffuse:
                _add(s, light, b, True, False, False)


@jit.inline
def _ready(points: Any, normals: Any, s: Any, first: Any, used: Any, options: Any, constants: Any) -> Any:
    """Load a tile; 0 if every point of it can be shaded."""
    count, columns = len(points) // 3, options[at.COLUMNS]
    bad = at.load(points, s, at.POINT, first, used, count, columns, constants[at.LARGEST])
    bad |= at.load(normals, s, at.NORMAL, first, used, count, columns, constants[at.LARGEST])
    if options[at.NORMALISE]:
        bad |= at.unit_normals(s, used, constants[at.TINY])
    return bad


@jit.inline
def _look(
    s: Any, towards: Any, lights: Any, first: Any, used: Any, count: Any, options: Any, constants: Any, counts: Any
) -> None:
    """Where each point of a tile is seen from: the given directions, or those to the viewer."""
    if len(towards):
        at.load(towards, s, at.VIEW, first, used, count, options[at.COLUMNS], constants[at.LARGEST])
    elif options[at.KEEP_LENGTH] and options[at.EYE_PLACED]:
        at.look(s, lights[0], used, True, constants[at.TINY], True)
        counts[at.LEFT_LONG] += min(at.TILE, count - first)
    else:
        at.look(s, lights[0], used, options[at.EYE_PLACED], constants[at.TINY], False)


@jit.inline
def _first_bad(points: Any, normals: Any, first: Any, count: Any, options: Any, constants: Any) -> int:
    """The index of the first point from here on that cannot be shaded."""
    for i in range(first, count):
        squared = constants.dtype.type(0)
        fine = True
        for k in range(3):
            p = at.component(points, i, k, count, options[at.COLUMNS])
            n = at.component(normals, i, k, count, options[at.COLUMNS])
            fine = fine and abs(p) <= constants[at.LARGEST] and abs(n) <= constants[at.LARGEST]
            squared += n * n
        if not fine or (options[at.NORMALISE] and not squared >= constants[at.TINY]):
            return int(i)
    return int(first)


@jit.driver
def shade_tiles(prepared: Any, vectors: Any, tiles: Array, out: Array, counts: Array, lost: Array, s: Array) -> int:
    """Shade some tiles. Returns the index of the first point that cannot be shaded, or -1.

    prepared  of `loop_arguments`, the same for all points
        lights, spread       (L, at.NUMBERS) and the same transposed and flat
        plan, options        (L, at.PLAN) what is to be done for each light; at.OPTIONS
        constants            the bounds of the precision, then ka ia
        coefficients, table  what the formula's loop takes; fresnel, what the reflectance's takes for each channel
    vectors   read-only and flat
        points, normals      3n       rows of three or three columns (options)
        visible              (L, n)   of the shadowed lights; (0, 0) without
        towards              3n       unit directions to where points are seen from; empty where that is the viewer
    tiles     2          first tile and the one after the last
    out       3n         colours, laid out as the points
    counts    at.COUNTS  added to
    lost      1          raised to the most that a point lost by reach, where the options want boxes
    s         at.SCRATCH
    """
    lights, spread, plan, options, constants, coefficients, table, fresnel = prepared
    points, normals, visible, towards = vectors
    flags = np.zeros(2 * at.BLOCKS + 1, np.int64)
    verdicts, spare = np.zeros(len(lights), points.dtype), np.zeros(len(lights), points.dtype)
    room = np.zeros(reach_bounds.ROOM * len(lights), points.dtype)
    count = len(points) // 3
    for tile in range(tiles[0], tiles[1]):
        first = tile * at.TILE
        inside = min(at.TILE, count - first)
        used = (inside + at.BLOCK - 1) // at.BLOCK
        flags[at.USED] = used
        if _ready(points, normals, s, first, used, options, constants):
            return _first_bad(points, normals, first, count, options, constants)
        if options[at.NEEDS_VIEW]:
            _look(s, towards, lights, first, used, count, options, constants, counts)
        if options[at.BOXES]:
            at.enclose(s, 0, used)
            reach_bounds.judge(s, spread, verdicts, room, constants[at.SLACK], constants[at.TINY])
            if options[at.LIMITED]:
                reach_bounds.loop_at(options[at.REACH_LOOP], s)(s, spread, spare, room, constants, lost, flags)
        for c in range(3):
            s[at.SUM + c * at.TILE : at.SUM + c * at.TILE + used * at.BLOCK] = constants[at.AMBIENT + c]
        for k in range(len(lights)):
            light, todo = lights[k], plan[k]
            if todo[at.GLOWS] and verdicts[k] < 2:
                loop_at(todo[at.GLOW_LOOP], s)(s, light, flags)
            if verdicts[k] > 0:
                counts[at.BEHIND if verdicts[k] < 2 else at.OUT] += inside
                continue
            if todo[at.SEEN_ROW] >= 0:
                _shadow(s, visible[todo[at.SEEN_ROW]], first, used * at.BLOCK, count)
            loop_at(todo[at.FACING_LOOP], s)(s, light, flags)
            if _facing(flags, counts, inside, options[at.KEEP_BEHIND]):
                if todo[at.HAS_LOOP]:
                    loop_at(todo[at.COORDINATE_LOOP], s)(s, light, flags)
                _wanted(flags, counts, inside, todo, options[at.KEEP_UNLIT])
                _formula(s, flags, options[at.FORMULA_LOOP], at.COORDINATE, coefficients, table, at.HIGHLIGHT)
                if options[at.HAS_FRESNEL] and todo[at.EVALUATES]:
                    _reflect(s, light, flags, todo, options[at.FRESNEL_LOOP], fresnel)
                _sum(s, light, flags, todo, options[at.HAS_FRESNEL] != 0)
        at.store(s, out, first, used, count, options[at.COLUMNS])
    return -1
