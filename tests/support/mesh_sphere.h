/* A closed mesh to test with. */
#ifndef RT_SUPPORT_MESH_SPHERE_H
#define RT_SUPPORT_MESH_SPHERE_H

#include "node/primitive/mesh.h"

/* A sphere of radius 1 of rings x sectors quadrilaterals about `centre`, poles as fans: a pole is the corner of
 * `sectors` triangles. The caller frees it with mesh_destroy. */
Mesh *mesh_sphere(uint32_t rings, uint32_t sectors, Vec3 centre);

#endif
