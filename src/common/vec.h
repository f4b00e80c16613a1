/* Double-precision vectors, by value. Colours and texture coordinates are cglm's (colour.h). */
#ifndef RT_COMMON_VEC_H
#define RT_COMMON_VEC_H

#include <math.h>
#include <stdint.h>
#include <string.h>

typedef struct { double x, y, z; } Vec3;

static inline Vec3 vec3_make(double x, double y, double z) { return (Vec3){x, y, z}; }
static inline Vec3 vec3_add(Vec3 a, Vec3 b) { return vec3_make(a.x + b.x, a.y + b.y, a.z + b.z); }
static inline Vec3 vec3_sub(Vec3 a, Vec3 b) { return vec3_make(a.x - b.x, a.y - b.y, a.z - b.z); }
static inline Vec3 vec3_neg(Vec3 a) { return vec3_make(-a.x, -a.y, -a.z); }
static inline Vec3 vec3_scale(Vec3 a, double s) { return vec3_make(a.x * s, a.y * s, a.z * s); }
static inline Vec3 vec3_abs(Vec3 a) { return vec3_make(fabs(a.x), fabs(a.y), fabs(a.z)); }
static inline double vec3_dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
/* Plain comparisons: fmax is a call for the sake of NaN, which has no place here. */
static inline double vec3_max(Vec3 a)
{
    double m = a.x > a.y ? a.x : a.y;
    return m > a.z ? m : a.z;
}

static inline Vec3 vec3_least(Vec3 a, Vec3 b)
{
    return vec3_make(a.x < b.x ? a.x : b.x, a.y < b.y ? a.y : b.y, a.z < b.z ? a.z : b.z);
}

static inline Vec3 vec3_most(Vec3 a, Vec3 b)
{
    return vec3_make(a.x > b.x ? a.x : b.x, a.y > b.y ? a.y : b.y, a.z > b.z ? a.z : b.z);
}

static inline double vec3_length(Vec3 a) { return sqrt(vec3_dot(a, a)); }

static inline Vec3 vec3_cross(Vec3 a, Vec3 b)
{
    return vec3_make(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

/* a + t b: the point of a ray at t. */
static inline Vec3 vec3_at(Vec3 a, double t, Vec3 b)
{
    return vec3_make(a.x + t * b.x, a.y + t * b.y, a.z + t * b.z);
}

/* The component 0, 1 or 2. */
static inline double vec3_get(Vec3 a, int axis) { return axis == 0 ? a.x : axis == 1 ? a.y : a.z; }

/* The power of two that brings the greatest component to [1, 2), to [1, 4) if that component is 2^1022 or more, and
 * as near as a number gets for a subnormal one; 1 for the zero vector. Multiplying by it is exact unless something
 * underflows, so squares neither overflow nor underflow afterwards. */
static inline double vec3_pow2_scale(Vec3 a)
{
    double m = vec3_max(vec3_abs(a));
    uint64_t bits;
    memcpy(&bits, &m, sizeof bits);
    uint64_t exponent = bits >> 52;
    if (exponent - 1 >= 2044) {  /* none of the usual */
        if (exponent == 2047 || m == 0) return 1;
        exponent = exponent ? 2045 : 1;
    }
    bits = (2046 - exponent) << 52;
    memcpy(&m, &bits, sizeof m);
    return m;
}

/* Unit vector of the same direction for any finite non-zero length, 1e-300 and 1e300 included. */
static inline Vec3 vec3_normalize(Vec3 a)
{
    double d = vec3_dot(a, a);
    if (!(d > 1e-200 && d < 1e200)) {
        double m = vec3_max(vec3_abs(a));
        if (!(m > 0)) return a;
        int e = ilogb(m);
        a = vec3_make(ldexp(a.x, -e), ldexp(a.y, -e), ldexp(a.z, -e));
        d = vec3_dot(a, a);
    }
    return vec3_scale(a, 1.0 / sqrt(d));
}

#endif
