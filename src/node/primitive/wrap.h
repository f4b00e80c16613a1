/* Texture coordinates that the round primitives share. */
#ifndef RT_NODE_PRIMITIVE_WRAP_H
#define RT_NODE_PRIMITIVE_WRAP_H

#include <stdbool.h>

#include "common/vec.h"

#define ONE_OVER_PI 0.31830988618379067154

/* Once round the y axis from the angle atan2(x, z) = -180 degrees: grows to the right seen from outside, y up. */
static inline double wrap_u(Vec3 p) { return 0.5 + 0.5 * ONE_OVER_PI * atan2(p.x, p.z); }

/* A flat end by x and z; 0 if they aren't wanted. */
static inline void wrap_cap(Vec3 p, bool wanted, double *u, double *v)
{
    *u = wanted ? 0.5 * (p.x + 1) : 0;
    *v = wanted ? 0.5 * (p.z + 1) : 0;
}

/* Without the calls that fmin and fmax cost. */
static inline double clamp(double x, double lo, double hi) { return x < lo ? lo : x > hi ? hi : x; }

/* Puts a point of a disc of radius 1 that rounding carried beyond the rim back onto it. Relative error GAMMA(5). */
static inline void wrap_into_disc(Vec3 *p)
{
    double rr = p->x * p->x + p->z * p->z;
    if (rr <= 1) return;
    double s = 1 / sqrt(rr);
    p->x *= s;
    p->z *= s;
}

#endif
