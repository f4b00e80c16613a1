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
    void (*intersect)(const World *world, const Ray *rays, const LeftFace *left, Hit *hits, size_t n, Scratch *scratch);
    void (*occluded)(const World *world, const Ray *rays, const LeftFace *left, bool *blocked, size_t n, Scratch *scratch);
} Kernel;

extern const Kernel kernel_scalar;  /* one ray at a time */
#if defined(__x86_64__)
extern const Kernel kernel_sse2;    /* streams (stream_kernel.h) for every x86-64 processor */
extern const Kernel kernel_avx2;    /* for those with AVX2 and FMA */
extern const Kernel kernel_avx512;  /* for those with AVX-512 F, VL, DQ and BW */
#endif

/* The ray in the object's space, its t unchanged. */
Ray ray_to_object(const Object *object, const Ray *ray);

#endif
