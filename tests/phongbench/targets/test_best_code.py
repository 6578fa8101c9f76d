"""What is written costs no more than the best that is known by hand, wherever the compilers are."""

import re

import pytest

from phongbench.formulas.formula import Formula
from phongbench.targets.chips import TARGETS
from phongbench.targets.code_shapes import Code, code
from phongbench.targets.harness import UNROLLED
from phongbench.targets.measure import costs

ALPHA = 50.0
COSINE = "dot(r, v) * inversesqrt(dot(r, r) * dot(v, v))"
#: formula -> the body of `highlight` as one writes it by hand who knows what GPUs do for nothing. As ours, those of
#: vectors that keep their lengths give no more than 1
HAND = {
    "phong": "return pow(clamp(dot(r, v), 0.0, 1.0), 50.0);",
    "gaussian:dot": "return exp2(72.13475 * clamp(dot(r, v), 0.0, 1.0) - 72.13475);",
    "schlick": "float x = clamp(dot(r, v), 0.0, 1.0); return x / (50.0 - 49.0 * x);",
    "doom3": "float x = clamp(4.0 * dot(r, v) - 3.0, 0.0, 1.0); return x * x;",
    "phong/once": f"return pow(clamp({COSINE}, 0.0, 1.0), 50.0);",
    "phong/each": "return pow(clamp(dot(normalize(r), normalize(v)), 0.0, 1.0), 50.0);",
    "gaussian:dot/once": f"return exp2(72.13475 * {COSINE} - 72.13475);",
    "gaussian:dot/each": "return exp2(72.13475 * dot(normalize(r), normalize(v)) - 72.13475);",
    "phong@reflect": "return pow(clamp(dot(reflect(-l, normalize(n)), v), 0.0, 1.0), 50.0);",
}
#: Lyon's factor before it is squared, and what it is multiplied by where the form is blind to the back
LYON = {
    "dot": "float x = clamp({b} * dot(r, v) - {c}, 0.0, 1.0);{squarings} return x;",
    "cross": "vec3 c = cross(r, v); float x = max(1.0 - {h} * dot(c, c), 0.0);{squarings} {gated}",
    "difference": "vec3 d = r - v; float x = max(1.0 - {h} * dot(d, d), 0.0);{squarings} {gated}",
    "tan2": "vec3 c = cross(r, v); float e = dot(r, v); float x = max(1.0 - {h} * dot(c, c) / (e * e), 0.0);"
    "{squarings} {gated}",
}
GATED = "return dot(r, v) > 0.0 ? x : 0.0;"
for form, body in LYON.items():
    for n in range(1, 6):
        beta = ALPHA / 2**n
        parts = {"b": beta, "c": beta - 1, "h": beta / 2, "squarings": " x *= x;" * n, "gated": GATED}
        HAND[f"lyon:{form}:{2**n}"] = body.format(**parts)
HAND["lyon:dot:8/once"] = f"float x = clamp(6.25 * {COSINE} - 5.25, 0.0, 1.0);{' x *= x;' * 3} return x;"
HAND["lyon:dot:8/each"] = HAND["lyon:dot:8"].replace("dot(r, v)", "dot(normalize(r), normalize(v))")
HAND["lyon:cross:8/once"] = HAND["lyon:cross:8"].replace("dot(c, c)", "dot(c, c) / (dot(r, r) * dot(v, v))")
HAND["lyon:dot:8@reflect"] = HAND["lyon:dot:8"].replace("dot(r, v)", "dot(reflect(-l, normalize(n)), v)")
HAND["lyon:dot:8@halfway"] = (
    f"float x = clamp(25.0 * dot(n, normalize(l) + normalize(v)) - 24.0, 0.0, 1.0);{' x *= x;' * 3} return x;"
)
#: what still costs more, by at most so much, and why: it is to be mended, and the list to shrink
DEARER = {
    "schlick": 2.0,  # alpha - alpha x + x stays two steps
    "gaussian:dot/once": 4.0,  # limited to 1, which vectors without lengths do not need
    "gaussian:dot/each": 2.0,
}
#: GLSL's words in CUDA
IN_CUDA = """
#define vec3 float3
#define max fmaxf
#define pow __powf
#define exp2 exp2f
#define inversesqrt rsqrtf
#define clamp(x, low, high) __saturatef(x)
#define OWN static __device__ inline
OWN float3 operator-(float3 a, float3 b) { return make_float3(a.x - b.x, a.y - b.y, a.z - b.z); }
OWN float3 operator+(float3 a, float3 b) { return make_float3(a.x + b.x, a.y + b.y, a.z + b.z); }
OWN float3 operator-(float3 a) { return make_float3(-a.x, -a.y, -a.z); }
OWN float3 operator*(float3 a, float s) { return make_float3(a.x * s, a.y * s, a.z * s); }
OWN float dot(float3 a, float3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
OWN float3 cross(float3 a, float3 b) {
    return make_float3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
OWN float3 normalize(float3 a) { return a * rsqrtf(dot(a, a)); }
OWN float3 reflect(float3 i, float3 n) { return i - n * (2 * dot(n, i)); }
"""


def by_hand(spelling: str, language: str) -> Code:
    """The code of a formula by hand."""
    taken = "nlv" if "@" in spelling else "rv"
    body = re.sub(r"\b(\d+\.\d+)\b", r"\1f", HAND[spelling]) if language == "cuda" else HAND[spelling]
    header = f"float highlight({', '.join(f'vec3 {name}' for name in taken)})"
    before = f"{IN_CUDA}OWN " if language == "cuda" else ""
    return Code(spelling, f"{before}{header} {{ {body} }}", len(taken))


@pytest.mark.parametrize("name", [name for name, target in TARGETS.items() if target.language in ("glsl", "cuda")])
def test_code_that_is_written_costs_no_more_than_by_hand(name: str) -> None:
    target = TARGETS[name]
    if (missing := target.why_not()) is not None:
        pytest.skip(missing)
    ours = costs(target, [code(Formula.parse(spelling), ALPHA, target.language) for spelling in HAND])
    hand = costs(target, [by_hand(spelling, target.language) for spelling in HAND])
    one = 2.0 / UNROLLED  # an instruction of a whole program, such as the load of a constant, says nothing of a call
    dearer = {
        spelling: (written.cost, best.cost)
        for spelling, written, best in zip(HAND, ours, hand, strict=True)
        if written.cost > best.cost + DEARER.get(spelling, 0.0) + one
    }
    assert dearer == {}
