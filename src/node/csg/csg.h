/* Constructive solid geometry as one primitive: a binary tree of union, difference and intersection over closed
 * primitives, each with its own matrix. Events of all leaves along the line are merged by a rule of regularised set
 * operations, so coincident faces leave no film and no lone face. */
#ifndef RT_NODE_CSG_CSG_H
#define RT_NODE_CSG_CSG_H

#include "common/affine.h"
#include "common/err.h"
#include "node/primitive/prim.h"

typedef enum { CSG_UNION, CSG_DIFF, CSG_INTERSECT } CsgOp;

/* A tree in postfix order: a leaf pushes itself, an operator takes the right and then the left operand off the stack. */
typedef struct {
    bool is_leaf;
    CsgOp op;              /* of an operator */
    const Prim *prim;      /* of a leaf: closed, with `segments`; borrowed, must outlive the CSG primitive */
    Affine to_csg;         /* of a leaf: its space to the space of the CSG primitive; invertible */
} CsgToken;

/* NULL and *err without memory or if a leaf's matrix can't be inverted (*bad is then the index of its token).
 * Leaves are numbered in the order of the tokens; Hit.leaf and Edge.leaf are these numbers. A leaf that is a CSG
 * primitive itself counts as all of its own leaves, whose primitives must outlive the new one, too. */
Prim *csg_create(const CsgToken *tokens, size_t count, size_t *bad, Err *err);

/* Which leaf's material a leaf's surface shows: itself, or, for what a difference carves away, the first leaf of the
 * carved solid (the outermost one). For a leaf number below csg_leaf_count. */
uint32_t csg_shown_leaf(const Prim *csg, uint32_t leaf);
uint32_t csg_leaf_count(const Prim *csg);

#endif
