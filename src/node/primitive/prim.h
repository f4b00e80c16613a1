/* The table of operations that every primitive fills in.
 *
 * A primitive works in its own object space, never assumes a unit direction and never renormalises one (it may scale a
 * direction by an exact power of two if it undoes that in t). After it is built it is const and shared by all threads. */
#ifndef RT_NODE_PRIMITIVE_PRIM_H
#define RT_NODE_PRIMITIVE_PRIM_H

#include <stdbool.h>
#include <stdint.h>

#include "common/affine.h"
#include "common/box.h"
#include "common/ray.h"
#include "common/scratch.h"
#include "node/csg/segment.h"

typedef struct Prim Prim;
typedef struct PrimOps PrimOps;

struct Prim { const PrimOps *ops; };

/* The forms that kernels know by themselves, to test many rays at once (accel/solid_kernel.h). */
typedef enum { FORM_OTHER, FORM_SPHERE, FORM_CUBE, FORM_CYLINDER, FORM_CONE, FORM_TORUS } PrimForm;

/* Hit.part of a cylinder's and a cone's faces; those of a cube are 2 axis + side. */
enum { CYLINDER_SIDE, CYLINDER_TOP, CYLINDER_BOTTOM };
enum { CONE_SIDE, CONE_BASE };

struct PrimOps {
    const char *name;  /* "torus": messages, statistics */
    PrimForm form;
    bool closed;       /* bounds a solid: may be a CSG operand (a mesh: see mesh_prim.h) */

    Box (*bounds)(const Prim *);

    /* A box around the primitive's image under a map, tighter than that of its bounds. NULL: that one. */
    Box (*bounds_in)(const Prim *, const Affine *);

    /* The nearest hit with tmin < t <= tmax: fills t, u, v, leaf (0 unless it has several shadings) and part of *hit
     * and returns true; otherwise leaves *hit alone. The t of one surface point is the same from intersect, segments
     * and occluded. */
    bool (*intersect)(const Prim *, const Ray *, Hit *hit, Scratch *);

    /* Any hit with tmin < t <= tmax. NULL: by way of intersect. */
    bool (*occluded)(const Prim *, const Ray *, Scratch *);

    /* Every in/out pair along the whole line, t from -infinity to infinity, in order, appended to the list (tmin and
     * tmax are ignored). Only for closed primitives, NULL otherwise. False without memory. */
    bool (*segments)(const Prim *, const Ray *, SegList *);

    /* Point, normals, error bound and, if `uv` asks for them, texture coordinates (else 0) at a hit that intersect or
     * segments gave on this very ray. */
    void (*surface)(const Prim *, const Ray *, const Hit *, bool uv, Surface *);

    /* For a primitive that is made of parts with spaces of their own, as the baked meshes: the map to that of the part that
     * was hit, *p and *n (NULL: not wanted) becoming the point and the normal there, as surface gives them if the part is
     * hit in its own space. Bumps and textures work there. NULL: the primitive's space is its own. */
    const Affine *(*own)(const Prim *, const Hit *, Vec3 *p, Vec3 *n);

    /* Releases what prim_destroy must; NULL: free() is enough. */
    void (*destroy)(Prim *);
};

/* A box around the primitive's image under a map. */
Box prim_bounds_in(const Prim *prim, const Affine *map);

/* Frees a primitive made by one of the *_create functions. NULL is allowed. */
void prim_destroy(Prim *prim);

#endif
