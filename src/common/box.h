/* Axis-aligned boxes in double precision. The empty box has lo > hi. */
#ifndef RT_COMMON_BOX_H
#define RT_COMMON_BOX_H

#include <stdbool.h>

#include "common/vec.h"

typedef struct { Vec3 lo, hi; } Box;

static inline Box box_empty(void)
{
    return (Box){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
}

static inline bool box_is_empty(Box b) { return !(b.lo.x <= b.hi.x && b.lo.y <= b.hi.y && b.lo.z <= b.hi.z); }

static inline Box box_union(Box a, Box b)
{
    return (Box){{fmin(a.lo.x, b.lo.x), fmin(a.lo.y, b.lo.y), fmin(a.lo.z, b.lo.z)},
                 {fmax(a.hi.x, b.hi.x), fmax(a.hi.y, b.hi.y), fmax(a.hi.z, b.hi.z)}};
}

static inline Box box_overlap(Box a, Box b)
{
    return (Box){{fmax(a.lo.x, b.lo.x), fmax(a.lo.y, b.lo.y), fmax(a.lo.z, b.lo.z)},
                 {fmin(a.hi.x, b.hi.x), fmin(a.hi.y, b.hi.y), fmin(a.hi.z, b.hi.z)}};
}

static inline Box box_add_point(Box b, Vec3 p) { return box_union(b, (Box){p, p}); }

/* The greatest absolute coordinate; 0 for the empty box. */
static inline double box_reach(Box b)
{
    if (box_is_empty(b)) return 0;
    return fmax(vec3_max(vec3_abs(b.lo)), vec3_max(vec3_abs(b.hi)));
}

#endif
