// What C needs of its library, and a bare processor lacks: the instructions that there are, and functions of our own.
// The polynomials' coefficients stand in front. As in phongbench/compiler: float_bits.py and elementary.py, in float32.

static inline void *memcpy(void *to, const void *from, __SIZE_TYPE__ size) { return __builtin_memcpy(to, from, size); }
static inline float sqrtf(float x) { return __builtin_sqrtf(x); }
static inline float fabsf(float x) { return __builtin_fabsf(x); }
static inline float fmaxf(float x, float y) { return x > y ? x : y; }
static inline float fminf(float x, float y) { return x < y ? x : y; }

static inline int bits_of(float x) {
    int bits;
    __builtin_memcpy(&bits, &x, sizeof bits);
    return bits;
}

static inline float of_bits(int bits) {
    float x;
    __builtin_memcpy(&x, &bits, sizeof x);
    return x;
}

static inline float rintf(float x) {
    float magic = x < 0.0f ? -8388608.0f : 8388608.0f;
    return fabsf(x) < 8388608.0f ? (x + magic) - magic : x;
}

static inline float floorf(float x) {
    float nearest = rintf(x);
    return nearest > x ? nearest - 1.0f : nearest;
}

static inline float log2f(float x) {
    int above = bits_of(x) - 0x3f3504f3;
    float f = of_bits(bits_of(x) - (above & -0x800000)) - 1.0f;
    float ratio = LOG2_RATIO[7];
    for (int k = 6; k >= 0; k--) ratio = ratio * f + LOG2_RATIO[k];
    return (float)(above >> 23) + f * ratio;
}

static inline float exp2f(float t) {
    float inside = t > 128.0f ? 128.0f : t;
    float k = inside + 12582912.0f;
    float r = inside - (k - 12582912.0f);
    float value = EXP2[5];
    for (int i = 4; i >= 0; i--) value = value * r + EXP2[i];
    return t >= -126.0f ? of_bits(bits_of(value) + (int)((unsigned)bits_of(k) << 23)) : 0.0f;
}

static inline float expf(float x) { return exp2f(x * 1.4426950408889634f); }

static inline float powf(float x, float y) { return x > 1.2e-38f ? exp2f(y * log2f(x)) : 0.0f; }

static inline float acosf(float x) {
    float above = x > -1.0f ? x : -1.0f;
    float inside = above < 1.0f ? above : 1.0f;
    float size = fabsf(inside);
    float t = 1.0f - 2.0f * size;
    float ratio = ARC[8];
    for (int k = 7; k >= 0; k--) ratio = ratio * t + ARC[k];
    float arc = sqrtf(1.0f - size) * ratio;
    return inside > 0.0f ? arc : 3.14159265f - arc;
}

template <typename number> union vec3 {
    struct {
        number x, y, z;
    };
    number v[3];
};

template <typename number> static inline vec3<number> moved(vec3<number> v, number k, vec3<number> w) {
    return vec3<number>{{v.y * k + w.x, v.z * k + w.y, v.x * k + w.z}};
}

template <typename number> extern number given[9][64];
template <typename number> extern number found[64];
