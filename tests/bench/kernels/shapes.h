/* The meshes of the benchmark of the kernels, generated, the same on every machine. All coordinates are floats, so that
 * a program that keeps its vertices in float traces the very same triangles. */
#ifndef RT_BENCH_KERNELS_SHAPES_H
#define RT_BENCH_KERNELS_SHAPES_H

#include "node/primitive/mesh.h"

/* A mesh, from where it is seen, and a point light. Lengths in the mesh's own units. */
typedef struct {
    Mesh *mesh;
    Vec3 eye, view, light;
    double fov_deg;     /* the full vertical angle */
} Shape;

/* "terrain": a fractal landscape; "scan": a bumpy closed surface whose triangles differ in area by a factor of 20; "room":
 * walls, furniture and many small things, seen from inside; "thin": blades of long thin triangles. About `triangles`
 * triangles. The caller frees shape->mesh with mesh_destroy. Ends the program for another name or without memory. */
void shape_make(Shape *shape, const char *name, uint32_t triangles);

#endif
