/* What bends the normals of a mesh. */
#ifndef RT_NODE_BUMPING_BUMP_H
#define RT_NODE_BUMPING_BUMP_H

#include "common/vec.h"

typedef struct Bump Bump;

typedef struct {
    const char *name;
    /* The bent normal, in object space, for an object-space normal n of any positive length. */
    Vec3 (*bend)(const Bump *, double u, double v, Vec3 n);
} BumpOps;

struct Bump { const BumpOps *ops; };

/* Circular waves about (u0, v0): with d the distance in texture coordinates, if d > 0 and d / period <= periods, the
 * normal is turned about the object's x axis by cos(2 pi d / period) radians. period > 0, periods >= 0.
 * NULL without memory; the caller frees it with free(). */
Bump *wave_create(double u0, double v0, double periods, double period);

#endif
