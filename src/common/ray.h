/* Rays, what they hit, and the surface there. */
#ifndef RT_COMMON_RAY_H
#define RT_COMMON_RAY_H

#include <stdbool.h>
#include <stdint.h>

#include "common/vec.h"

/* o + t d for tmin < t <= tmax. d need not be a unit vector and is never renormalised, so t means the same
 * in every space that the ray is carried to. */
typedef struct {
    Vec3 o, d;
    double tmin, tmax;
} Ray;

#define HIT_NONE UINT32_MAX

/* The nearest point found on a ray. A primitive fills t, u, v, leaf and part; object is the world's. */
typedef struct {
    double t;
    double u, v;      /* payload of the primitive: barycentric coordinates of a triangle, ... */
    uint32_t part;    /* which face of the primitive, triangle of the mesh */
    uint32_t leaf;    /* which of the primitive's shadings: leaf of a CSG tree, source of a baked mesh; else 0 */
    uint32_t object;  /* index in World.objects, HIT_NONE if nothing was hit */
} Hit;

/* A plane face (a triangle of a mesh) that a ray starts beside and leads away from, so that it can't meet it: tests of it,
 * which would have to find out in the highest precision, are left out. HIT_NONE, whatever the part: none. */
typedef struct { uint32_t object, part; } LeftFace;

/* The geometry at a hit, made once for the winning hit, in the space of the primitive. */
typedef struct {
    Vec3 p;       /* point, put back onto the surface where that is possible */
    Vec3 p_err;   /* bound on the distance of p from the true surface point, per component */
    Vec3 n;       /* geometric normal, outward on a closed primitive, of any positive length */
    Vec3 ns;      /* shading normal, of any positive length; n if the primitive has no other */
    double u, v;  /* texture coordinates, (0,0) being the picture's lower left */
    bool plane;   /* the hit's part is one plane face; false unless set */
} Surface;

#endif
