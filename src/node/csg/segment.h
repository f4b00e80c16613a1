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

/* Grows in the scratch arena; no fixed capacity that could drop segments. */
typedef struct {
    Seg *seg;
    uint32_t count, capacity;
    Scratch *scratch;
} SegList;

static inline SegList seg_list(Scratch *scratch) { return (SegList){.scratch = scratch}; }

/* Appends; false (and scratch->out_of_memory) without memory. */
bool seg_list_add(SegList *list, Edge in, Edge out);

#endif
