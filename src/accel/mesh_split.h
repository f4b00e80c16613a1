/* Boxes of a mesh's triangles for the builder: those of long, slanting ones are cut into several. */
#ifndef RT_ACCEL_MESH_SPLIT_H
#define RT_ACCEL_MESH_SPLIT_H

#include "accel/bvh.h"
#include "common/vec.h"

typedef struct {
    const Vec3 *position;
    const uint32_t (*triangle)[3];
    uint32_t count;
    Box bounds;
} SplitMesh;

/* At most so many times as many boxes are added as there are triangles. */
#define SPLIT_BUDGET 0.2

/* *ref holds a box for each triangle, in order; it is freed and replaced where cutting pays (see mesh_split.c), *count
 * being set to the number of boxes. Those of a triangle cover it, rounded outward. False without memory, nothing being
 * changed. The result doesn't depend on the threads. */
bool mesh_split(const SplitMesh *mesh, uint32_t threads, BvhRef **ref, uint32_t *count);

#endif
