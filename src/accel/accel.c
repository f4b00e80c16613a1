#include "accel/accel.h"

#include <string.h>

#include "accel/kernel.h"

#if defined(__x86_64__)
static bool has_avx2(void)
{
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2");
}

static bool has_avx512(void)
{
    return has_avx2() && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
           __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw");
}
#endif

static bool always(void) { return true; }

/* The widest last. */
static const struct { const Kernel *kernel; bool (*runs)(void); } kernels[] = {
    {&kernel_scalar, always},
#if defined(__x86_64__)
    {&kernel_sse2, always},
    {&kernel_avx2, has_avx2},
    {&kernel_avx512, has_avx512},
#endif
};

enum { KERNELS = sizeof kernels / sizeof *kernels };

const Kernel *kernel_best(const char *widest)
{
    const Kernel *best = NULL;
    for (int i = 0; i < KERNELS; i++) {
        if (kernels[i].runs()) best = kernels[i].kernel;
        if (widest && strcmp(kernels[i].kernel->name, widest) == 0) return best;
    }
    return widest ? NULL : best;
}

const char *kernel_name(const Kernel *kernel) { return kernel->name; }

void world_intersect(const World *world, const Ray *rays, const LeftFace *left, Hit *hits, size_t n, Scratch *scratch)
{
    world->kernel->intersect(world, rays, left, hits, n, scratch);
}

void world_occluded(const World *world, const Ray *rays, const LeftFace *left, bool *blocked, size_t n, Scratch *scratch)
{
    world->kernel->occluded(world, rays, left, blocked, n, scratch);
}
