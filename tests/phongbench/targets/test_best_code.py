"""What is written costs no more than the best that is known by hand, wherever the compilers are."""

import re

import pytest

from phongbench.formulas.formula import Formula
from phongbench.targets.chips import TARGETS
from phongbench.targets.code_shapes import Code, code
from phongbench.targets.harness import UNROLLED
from phongbench.targets.measure import CONTEXTS, costs

ALPHA = 50.0
COSINE = "dot(r, v) * inversesqrt(dot(r, r) * dot(v, v))"
EACH = "dot(normalize(r), normalize(v))"
#: a table's lookup: the last entry is there twice, so that the end needs no other index
LOOKUP = "int i = int(x); float y = TABLE[i]; return y + (x - float(i)) * (TABLE[i + 1] - y);"
#: formula -> the body of `highlight` as one writes it by hand who knows what a chip does for nothing. As ours, on GPUs
#: those of vectors that keep their lengths give no more than 1; in C they give 0 behind the surface and for no number
HAND = {
    "phong": "return pow(unit_dot(r, v), 50.0);",
    "gaussian:dot": "float x = unit_dot(r, v); return lit(x, exp2(72.13475 * x - 72.13475));",
    "schlick": "float x = unit_dot(r, v); return x / (50.0 - 49.0 * x);",
    "doom3": "float x = unit_sum(4.0, dot(r, v), -3.0); return x * x;",
    "phong/once": f"return pow(unit({COSINE}), 50.0);",
    "phong/each": "vec3 a = normalize(r); vec3 b = normalize(v); return pow(unit_dot(a, b), 50.0);",
    "gaussian:dot/once": f"float x = {COSINE}; return lit(x, exp2(72.13475 * x - 72.13475));",
    "gaussian:dot/each": f"float x = {EACH}; return lit(x, exp2(72.13475 * x - 72.13475));",
    "phong@reflect": "vec3 m = reflect(-l, normalize(n)); return pow(unit_dot(m, v), 50.0);",
    "integer-power": "float x = unit_dot(r, v); float y = x * x * x; y *= y; y *= y; y *= y; y *= x; return y * y;",
    "table-x": f"float x = 255.0 * unit_dot(r, v); x = at_most(x, 255.0); {LOOKUP}",
    "table-u:dot": "float d = 1.0 - at_most(unit_dot(r, v), 1.0); float x = d * (234.97144 * d + 457.14285); "
    f"x = min(x, 64.0); {LOOKUP}",
    "kuijk-blake": "float t = acos(at_most(unit_dot(r, v), 1.0)); float s = max(0.4082357 - t, 0.0);"
    "return t < 0.11463918 ? 1.0 - 21.36761 * t * t : 8.343305 * s * s;",
    "lyon-quadratic:dot:8": "float x = unit_dot(r, v); float w = min(6.2259417 - 6.2259417 * x, 1.3213732);"
    "float y = unit_sum(-w, 1.0 - 0.37839425 * w, 1.0); y *= y; y *= y; y *= y; return x > 0.0 ? y : 0.0;",
    "gaussian-quadratic:dot": "float x = at_most(unit_dot(r, v), 1.0); float t = max(72.13475 * x - 72.13475, -120.0); "
    "int i = int(t); float f = t - float(i) + 1.0; float y = f * (0.33718944 * f + 0.6576359) + 1.0017247;"
    "return lit(x, y * from_bits((i + 126) << 23));",
}
#: Lyon's factor before it is squared, and what it is multiplied by where the form is blind to the back
LYON = {
    "dot": "float x = unit_sum({b}, dot(r, v), -{c});{squarings} return x;",
    "cross": "vec3 c = cross(r, v); float x = unit_sum(-{h}, dot(c, c), 1.0);{squarings} {gated}",
    "difference": "vec3 d = r - v; float x = unit_sum(-{h}, dot(d, d), 1.0);{squarings} {gated}",
    "tan2": "vec3 c = cross(r, v); float e = dot(r, v); float x = unit_sum(-{h}, dot(c, c) / (e * e), 1.0);"
    "{squarings} {gated}",
}
GATED = "return dot(r, v) > 0.0 ? x : 0.0;"
for form, factor in LYON.items():
    for n in range(1, 6):
        beta = ALPHA / 2**n
        parts = {"b": beta, "c": beta - 1, "h": beta / 2, "squarings": " x *= x;" * n, "gated": GATED}
        HAND[f"lyon:{form}:{2**n}"] = factor.format(**parts)
for gamma in (8, 32):
    HAND[f"lyon:dot:{gamma}/once"] = HAND[f"lyon:dot:{gamma}"].replace("dot(r, v)", COSINE)
    HAND[f"lyon:dot:{gamma}/each"] = HAND[f"lyon:dot:{gamma}"].replace("dot(r, v)", EACH)
HAND["lyon:cross:8/once"] = HAND["lyon:cross:8"].replace("dot(c, c)", "dot(c, c) / (dot(r, r) * dot(v, v))")
HAND["lyon:dot:8@reflect"] = HAND["lyon:dot:8"].replace("dot(r, v)", "dot(reflect(-l, normalize(n)), v)")
HAND["lyon:dot:8@halfway"] = (
    f"float x = unit_sum(25.0, dot(n, normalize(l) + normalize(v)), -24.0);{' x *= x;' * 3} return x;"
)
#: how much more of many cycles says nothing: which registers are spilled, which constants loaded anew
NOISE = 0.02
#: the words of HAND that a language lacks
WORDS = {
    "glsl": """
#define unit(x) clamp(x, 0.0, 1.0)
#define unit_sum(x, y, z) clamp((x) * (y) + (z), 0.0, 1.0)
#define unit_dot(a, b) clamp(dot(a, b), 0.0, 1.0)
#define lit(x, y) (y)
#define at_most(x, high) (x)
#define from_bits intBitsToFloat
""",
    "cuda": """
#define vec3 float3
#define max fmaxf
#define min fminf
#define pow __powf
#define exp2 exp2f
#define acos acosf
#define inversesqrt rsqrtf
#define unit(x) __saturatef(x)
#define lit(x, y) (y)
#define at_most(x, high) (x)
#define from_bits __int_as_float
#define OWN static __device__ inline
OWN float unit_sum(float x, float y, float z) {
    float sum;
    asm("fma.rn.ftz.sat.f32 %0, %1, %2, %3;" : "=f"(sum) : "f"(x), "f"(y), "f"(z));
    return sum;
}
OWN float unit_dot(float3 a, float3 b) { return unit_sum(a.z, b.z, a.x * b.x + a.y * b.y); }
""",
    "c": """
#define max fmaxf
#define min fminf
#define pow powf
#define exp2 exp2f
#define acos acosf
#define inversesqrt(x) (1.0f / sqrtf(x))
#define unit(x) fmaxf(x, 0.0f)
#define unit_sum(x, y, z) fmaxf((x) * (y) + (z), 0.0f)
#define unit_dot(a, b) fmaxf(dot(a, b), 0.0f)
#define lit(x, y) ((x) > 0.0f ? (y) : 0.0f)
#define at_most(x, high) fminf(x, high)
#define from_bits of_bits
#define OWN static inline
OWN vec3 make_float3(float x, float y, float z) { return vec3{{x, y, z}}; }
""",
}
#: GLSL's functions of vectors, in the languages that have none
VECTORS = """
OWN vec3 operator-(vec3 a, vec3 b) { return make_float3(a.x - b.x, a.y - b.y, a.z - b.z); }
OWN vec3 operator+(vec3 a, vec3 b) { return make_float3(a.x + b.x, a.y + b.y, a.z + b.z); }
OWN vec3 operator-(vec3 a) { return make_float3(-a.x, -a.y, -a.z); }
OWN vec3 operator*(vec3 a, float s) { return make_float3(a.x * s, a.y * s, a.z * s); }
OWN float dot(vec3 a, vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
OWN vec3 cross(vec3 a, vec3 b) {
    return make_float3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
OWN vec3 normalize(vec3 a) { return a * inversesqrt(dot(a, a)); }
OWN vec3 reflect(vec3 i, vec3 n) { return i - n * (2 * dot(n, i)); }
"""


def by_hand(spelling: str, language: str) -> Code:
    """The code of a formula by hand."""
    taken, body = "nlv" if "@" in spelling else "rv", HAND[spelling]
    if language != "glsl":
        body = re.sub(r"\b(\d+\.\d+)\b", r"\1f", body)
    if language == "c":
        body = " ".join(f"vec3 {x} = make_float3({x}_[0], {x}_[1], {x}_[2]);" for x in taken) + body
    parameter = "const float {}_[3]" if language == "c" else "vec3 {}"
    own, vectors = ("", "") if language == "glsl" else ("OWN ", VECTORS)
    table = "\n".join(re.findall(r".*\bTABLE\[\d+\].*;", code(Formula.parse(spelling), ALPHA, language).text))
    text = f"{own}float highlight({', '.join(map(parameter.format, taken))}) {{ {body} }}"
    whole = "\n".join([WORDS[language], vectors, table, text])
    return Code(spelling, re.sub(r"\bvec3\b", "vec3<float>", whole) if language == "c" else whole, len(taken))


@pytest.mark.parametrize("name", TARGETS)
def test_code_that_is_written_costs_no_more_than_by_hand(name: str) -> None:
    target = TARGETS[name]
    if (missing := target.why_not()) is not None:
        pytest.skip(missing)
    ours = [code(Formula.parse(spelling), ALPHA, target.language) for spelling in HAND]
    both = [*ours, *(by_hand(spelling, target.language) for spelling in HAND)]
    found = costs(target, both, CONTEXTS[:1])  # other work around a call makes most of what is compiled
    # an instruction of a whole program, such as the load of a constant, says nothing of a call
    dearer = {
        spelling: (written.cost, best.cost)
        for spelling, written, best in zip(HAND, found[: len(HAND)], found[len(HAND) :], strict=True)
        if written.cost > best.cost * (1 + NOISE) + 2.0 / UNROLLED
    }
    assert dearer == {}
