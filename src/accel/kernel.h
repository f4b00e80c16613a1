/* The kernels: each traces streams of rays through a World and gives the same hits as the scalar one, the truth. */
#ifndef RT_ACCEL_KERNEL_H
#define RT_ACCEL_KERNEL_H

#include <stdbool.h>
#include <stddef.h>

#include "common/ray.h"
#include "common/scratch.h"
#include "scene/world.h"

typedef struct Kernel {
    const char *name;
    void (*intersect)(const World *world, const Ray *rays, Hit *hits, size_t n, Scratch *scratch);
    void (*occluded)(const World *world, const Ray *rays, bool *blocked, size_t n, Scratch *scratch);
} Kernel;

extern const Kernel kernel_scalar;  /* one ray at a time */
extern const Kernel kernel_packet;  /* up to 64 rays of one octant at a time, with the baseline's vectors */
#if defined(__x86_64__)
extern const Kernel kernel_avx2;    /* the same for processors with AVX2 and FMA */
#endif

/* The ray in the object's space, its t unchanged. */
Ray ray_to_object(const Object *object, const Ray *ray);

#endif
