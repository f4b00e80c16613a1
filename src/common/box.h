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

static inline Box box_union(Box a, Box b) { return (Box){vec3_least(a.lo, b.lo), vec3_most(a.hi, b.hi)}; }
static inline Box box_overlap(Box a, Box b) { return (Box){vec3_most(a.lo, b.lo), vec3_least(a.hi, b.hi)}; }
static inline Box box_add_point(Box b, Vec3 p) { return box_union(b, (Box){p, p}); }

/* The greatest absolute coordinate; 0 for the empty box. */
static inline double box_reach(Box b)
{
    if (box_is_empty(b)) return 0;
    return fmax(vec3_max(vec3_abs(b.lo)), vec3_max(vec3_abs(b.hi)));
}

#endif
