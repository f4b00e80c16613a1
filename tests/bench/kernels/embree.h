/* Embree 3 at its best: every way of calling it, and its build. Each of its scenes shares one vertex and one index buffer.
 * All functions end the program when Embree reports an error or there is no memory. */
#ifndef RT_BENCH_KERNELS_EMBREE_H
#define RT_BENCH_KERNELS_EMBREE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "common/ray.h"
#include "node/primitive/mesh.h"

/* Ways to trace rays: the call (one ray, packets, streams), its flag (coherent or not), the quality of the build (medium
 * or high). */
enum { EMBREE_WAYS = 7 * 2 * 2 };

/* "Intersect16 coherent high"; for streams of shadow rays Intersect stands for Occluded. */
void embree_way_name(int way, char *name, size_t size);

/* The version and the vector instructions in use. */
void embree_describe(char *text, size_t size);

/* Scenes of one mesh, its positions divided by 2^exponent: medium and high quality, robust and not. The buffers are
 * copies, so the mesh may go. */
typedef struct EmbreeScenes EmbreeScenes;
EmbreeScenes *embree_scenes_create(const Mesh *mesh, int exponent);
void embree_scenes_destroy(EmbreeScenes *scenes);

/* Building a robust scene of medium quality with so many threads. */
typedef struct { double wall_s, cpu_s; int64_t bytes, peak_bytes; } EmbreeBuild;  /* bytes: without the shared buffers */
EmbreeBuild embree_build(const Mesh *mesh, int exponent, uint32_t threads);

/* Rays in Embree's own layouts. `any`: only whether something is in their way. Borrows the scenes and the rays, whose
 * numbers must be floats. */
typedef struct EmbreeRays EmbreeRays;
EmbreeRays *embree_rays_create(const EmbreeScenes *scenes, const Ray *rays, size_t count, bool any);
void embree_rays_destroy(EmbreeRays *rays);

/* Makes the rays ready to be traced that way: Embree writes its hits into them. */
void embree_rays_prepare(EmbreeRays *rays, int way, bool robust);

/* A Work over the prepared rays; `first` and `count` as workers_run gives them. */
void embree_rays_trace(void *rays, size_t first, size_t count, uint32_t worker);

/* What was found. With `any` t is 0 if something is in the way. */
typedef struct { double t; uint32_t part; } EmbreeHit;  /* t: INFINITY without a hit */
EmbreeHit embree_rays_hit(const EmbreeRays *rays, size_t index);

#endif
