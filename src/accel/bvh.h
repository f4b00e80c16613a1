/* Bounding volume hierarchies, eight children wide, over boxes of anything (triangles, objects).
 * Built as a binary tree by binned SAH (Wald 2007), then collapsed (Wald, Benthin, Boulos 2008; Ylitie, Karras, Laine
 * 2017). */
#ifndef RT_ACCEL_BVH_H
#define RT_ACCEL_BVH_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "common/box.h"
#include "common/err.h"

enum { BVH_WIDTH = 8, BVH_MAX_DEPTH = 96 };

/* A float box, rounded outward from a double one: traversal can only be too generous. */
typedef struct { float lo[3], hi[3]; } BoxF;

/* Not above x. The bits of floats of one sign are in their order, so that the next one is a step of an integer. */
static inline float boxf_down(double x)
{
    float f = (float)x;
    int32_t bits;
    memcpy(&bits, &f, sizeof bits);
    bits -= (bits < 0 ? -1 : 1) * ((double)f > x);  /* no branch: it would go either way */
    memcpy(&f, &bits, sizeof f);
    return f;
}

static inline float boxf_up(double x) { return -boxf_down(-x); }

static inline BoxF boxf_from_box(Box b)
{
    return (BoxF){{boxf_down(b.lo.x), boxf_down(b.lo.y), boxf_down(b.lo.z)},
                  {boxf_up(b.hi.x), boxf_up(b.hi.y), boxf_up(b.hi.z)}};
}

/* 256 bytes, four cache lines. Structure of arrays: the boxes of all children are tested together. An empty slot has
 * lo = +inf, hi = -inf. */
typedef struct {
    _Alignas(64) float lo[3][BVH_WIDTH];
    float hi[3][BVH_WIDTH];
    uint32_t child[BVH_WIDTH];   /* index of a node, or BVH_LEAF and what the leaf holds */
    uint8_t count[BVH_WIDTH];    /* 0: inner; else the leaf's number of items */
    uint8_t used;                /* children in use, the first ones */
    uint32_t order[4];           /* children from far to near, three bits each from the lowest on, for rays whose sense
                                    along x and y is that of bits 0 and 1 (set: negative) and along z is positive; the
                                    opposite sense reads it backwards */
} BvhNode;

/* Set in a child that is a leaf. The rest is the first position in Bvh.order of its items, until the owner puts a number
 * of its own there. */
#define BVH_LEAF 0x80000000u

typedef struct {
    BvhNode *node;       /* node[0] is the root; NULL if there are no items */
    uint32_t node_count;
    uint32_t *order;     /* items in the order of the leaves */
    uint32_t item_count;
    uint32_t root;       /* as a child: BVH_LEAF is set if there is but one leaf */
    BoxF bounds;
} Bvh;

/* What is built over: a box, not empty and without infinities, and the number of the item in it. An item may have several
 * boxes that cover it together. Two vectors of four floats. */
typedef struct {
    _Alignas(16) float lo[3];
    uint32_t item;
    float hi[3];
    uint32_t unused;
} BvhRef;

static inline BvhRef bvh_ref(BoxF b, uint32_t item)
{
    return (BvhRef){{b.lo[0], b.lo[1], b.lo[2]}, item, {b.hi[0], b.hi[1], b.hi[2]}, 0};
}

typedef struct {
    uint32_t max_leaf;   /* greatest number of items in a leaf, 1 to 255 */
    uint32_t block;      /* items that are tested together, a power of two: n cost as much as n / block, rounded up */
    float block_cost;    /* the cost of testing a block as a multiple of that of testing one node */
    uint32_t threads;    /* 0 counts as 1 */
} BvhSettings;

/* Builds over `count` boxes, which are put into the leaves' order. False and *err (ERR_LIMIT) without memory. The result
 * depends on the boxes and their order alone, not on the threads. */
bool bvh_build(Bvh *bvh, BvhRef *ref, uint32_t count, const BvhSettings *settings, Err *err);
void bvh_free(Bvh *bvh);

/* For a tree of leaves with one item each: has them hold the item's number and frees `order`. */
void bvh_name_items(Bvh *bvh);

/* Sets `root`; after what the leaves hold has been changed. */
void bvh_set_root(Bvh *bvh);

#endif
