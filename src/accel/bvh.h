/* Bounding volume hierarchies, eight children wide, over boxes of anything (triangles, objects).
 * Built as a binary tree by binned SAH (Wald 2007), then collapsed (Wald, Benthin, Boulos 2008). */
#ifndef RT_ACCEL_BVH_H
#define RT_ACCEL_BVH_H

#include <stdbool.h>
#include <stdint.h>

#include "common/box.h"
#include "common/err.h"

enum { BVH_WIDTH = 8, BVH_MAX_DEPTH = 96 };

/* A float box, rounded outward from a double one: traversal can only be too generous. */
typedef struct { float lo[3], hi[3]; } BoxF;

BoxF boxf_from_box(Box box);

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

/* Builds over `count` boxes, none of them empty. `max_leaf` (1 to 255) bounds the items of a leaf; `item_cost` is the
 * cost of testing an item as a multiple of that of testing one node. False and *err (ERR_LIMIT) without memory.
 * The result depends on the boxes alone. */
bool bvh_build(Bvh *bvh, const BoxF *box, uint32_t count, uint32_t max_leaf, float item_cost, Err *err);
void bvh_free(Bvh *bvh);

/* For a tree of leaves with one item each: has them hold the item's number and frees `order`. */
void bvh_name_items(Bvh *bvh);

/* Sets `root`; after what the leaves hold has been changed. */
void bvh_set_root(Bvh *bvh);

#endif
