/* Texture coordinates that the round primitives share. */
#ifndef RT_NODE_PRIMITIVE_WRAP_H
#define RT_NODE_PRIMITIVE_WRAP_H

#include "common/vec.h"

#define ONE_OVER_PI 0.31830988618379067154

/* Once round the y axis from the angle atan2(x, z) = -180 degrees: grows to the right seen from outside, y up. */
static inline double wrap_u(Vec3 p) { return 0.5 + 0.5 * ONE_OVER_PI * atan2(p.x, p.z); }

/* A flat end by x and z. */
static inline void wrap_cap(Vec3 p, double *u, double *v)
{
    *u = 0.5 * (p.x + 1);
    *v = 0.5 * (p.z + 1);
}

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
