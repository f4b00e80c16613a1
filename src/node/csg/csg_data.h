/* What a CSG primitive is made of, for those who walk it: csg.c with single rays and whole lines, the kernels with many
 * rays. csg.c tells what the parts mean. */
#ifndef RT_NODE_CSG_CSG_DATA_H
#define RT_NODE_CSG_CSG_DATA_H

#include "node/csg/csg.h"

/* A ray that starts farther away than so many times the reach is moved to the solid first. */
enum { CSG_FAR_ORIGIN = 4 };

typedef struct {
    Affine to_leaf;
    Vec3 middle;         /* CSG space: where leaf_middle is, to a rounding */
    Vec3 leaf_middle;    /* of its box */
    Vec3 departure;      /* CSG space: the most that the place's error is for a ray which starts on the leaf */
    Vec3 spread;         /* the part of the place's error in leaf space that doesn't depend on the ray */
    double spread_most;  /* its greatest component */
    double growth;       /* what else there may be of it, for places as far as 1 from the middle */
    const Prim *prim;
    uint32_t gate;
    bool flip;           /* its complement counts */
    bool identity;
    bool coarse;         /* its place may be off by more than the slopes that SegList.along tells apart */
    uint32_t shown;
    Affine to_csg;
    Box bounds;          /* leaf space */
    Vec3 skin;           /* CSG space: how far its matrix may be off, and more */
} CsgLeaf;

/* On if at least `threshold` of its operands are: 1 makes it an OR, their number an AND. */
typedef struct { uint32_t parent, threshold; } CsgGate;

typedef struct {
    uint32_t count;
    bool settled;        /* its state before the present group of events */
} CsgState;

/* In preorder; `skip` is the next one outside the subtree. */
typedef struct {
    Box box;
    uint32_t skip;
    uint32_t first, count;  /* items of a leaf; count 0: inner */
} CsgNode;

typedef struct {
    Box box;
    uint32_t leaf;
} CsgItem;

typedef struct {
    Prim prim;
    CsgLeaf *leaf;
    CsgGate *gate;
    CsgState *idle;      /* of all gates, at t = -infinity */
    CsgNode *node;
    CsgItem *item;       /* leaves that can matter, in the order of the nodes */
    CsgToken *token;     /* none of them a CSG primitive */
    uint32_t leaf_count, gate_count, node_count, item_count, token_count;
    Box bounds;
    Vec3 centre;
    double reach, radius;   /* the greatest distance along an axis from the origin, and from the centre */
} Csg;

/* NULL if the primitive is none of constructive solid geometry. */
const Csg *csg_data(const Prim *prim);

#endif
