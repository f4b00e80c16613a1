/* Meshes as primitives: triangles in double precision under a BVH, watertight and hit exactly once. */
#ifndef RT_ACCEL_MESH_PRIM_H
#define RT_ACCEL_MESH_PRIM_H

#include "common/affine.h"
#include "common/err.h"
#include "node/primitive/mesh.h"
#include "node/primitive/prim.h"

typedef struct {
    uint32_t threads;   /* 0 counts as 1 */
    bool split;         /* boxes of long triangles are cut (mesh_split.h): slower to build, faster to trace */
} MeshSettings;

/* A mesh in its own space; borrows the mesh. `closed`: the caller has seen mesh_is_closed, so it may be a CSG operand.
 * `settings` NULL: one thread, no cuts. NULL and *err (ERR_LIMIT) without memory. */
Prim *mesh_prim_create(const Mesh *mesh, bool closed, const MeshSettings *settings, Err *err);

/* Meshes, each with its matrix, `count` > 0 of them, baked into one set in the space that the matrices lead to. Hit.leaf is
 * the index of the mesh among them. Borrows the meshes. */
typedef struct {
    const Mesh *mesh;
    Affine to_world, to_object;
} BakedMesh;

Prim *mesh_prim_bake(const BakedMesh *baked, uint32_t count, const MeshSettings *settings, Err *err);

/* Bytes of what was built to find the triangles, without the positions and indices that they are made of; 0 if the
 * primitive is no mesh. */
uint64_t mesh_prim_bytes(const Prim *prim);

#endif
