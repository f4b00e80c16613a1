/* The part of a line that lies inside a solid, as an ordered list of disjoint segments. */
#ifndef RT_NODE_CSG_SEGMENT_H
#define RT_NODE_CSG_SEGMENT_H

#include <stdbool.h>
#include <stdint.h>

#include "common/scratch.h"
#include "common/vec.h"

/* Where the line crosses the surface. */
typedef struct {
    double t;
    double t_err;   /* bound on |t - true t| for the object-space ray as given */
    Vec3 n;         /* outward normal there, object space, of any positive length: turns errors of place into errors of t */
    double u, v;    /* the payload and part of the Hit that this crossing would be */
    uint32_t part;
    uint32_t leaf;
} Edge;

typedef struct { Edge in, out; } Seg;  /* in.t <= out.t */

/* A line of less slope than this to a plane or a ruled line of a surface, and nearer to it than ALONG times the solid's
 * extent, may lie in the surface once the roundings of its place are counted. Steeper ones leave the roundings' reach
 * within 2^20 times as far. */
#define ALONG 0x1p-20

/* Grows in the scratch arena; no fixed capacity that could drop segments. */
typedef struct {
    Seg *seg;
    uint32_t count, capacity;
    Scratch *scratch;
    bool along;     /* set, and never cleared, by a primitive that the line may lie in the surface of, hit or missed */
} SegList;

static inline SegList seg_list(Scratch *scratch) { return (SegList){.scratch = scratch}; }

/* Appends; false (and scratch->out_of_memory) without memory. */
bool seg_list_add(SegList *list, Edge in, Edge out);

#endif
