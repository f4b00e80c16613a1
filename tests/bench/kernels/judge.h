/* Who is right about a ray: every triangle of the mesh, in quad precision. */
#ifndef RT_BENCH_KERNELS_JUDGE_H
#define RT_BENCH_KERNELS_JUDGE_H

#include "common/ray.h"
#include "node/primitive/mesh.h"

/* The least t with tmin < t <= tmax, INFINITY if there is none: over triangles with their edges, and over their insides
 * alone. They differ only for a ray that goes exactly through an edge, where either is taken for right. */
typedef struct { double with_edges, without_edges; } Truth;

/* The mesh's positions are divided by 2^exponent. */
Truth judge_ray(const Mesh *mesh, int exponent, const Ray *ray);

#endif
