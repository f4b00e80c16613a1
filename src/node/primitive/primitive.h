/* The analytic primitives. Each create returns NULL without memory; free with prim_destroy.
 * Size, place and proportions come from the node's matrix. */
#ifndef RT_NODE_PRIMITIVE_PRIMITIVE_H
#define RT_NODE_PRIMITIVE_PRIMITIVE_H

#include "node/primitive/prim.h"

Prim *sphere_create(void);         /* radius 1 at the origin */
Prim *cube_create(void);           /* the box [0,1]^3 */
Prim *cylinder_create(void);       /* axis y, radius 1, capped at y = -1 and y = 1 */
Prim *cone_create(void);           /* apex at the origin, x^2 + z^2 <= y^2, -1 <= y <= 0, base disc at y = -1 */
Prim *torus_create(double minor);  /* axis y, major radius 1; minor > 0, above 1 the spindle with its inside filled */

/* For kernels: a torus' minor radius, and whether a point is outside its surface for certain (for a spindle: or in the
 * inner lens, which has a surface of its own). */
double torus_minor(const Prim *prim);
bool torus_is_outside(const Prim *prim, Vec3 p);

#endif
