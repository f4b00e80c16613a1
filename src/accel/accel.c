#include "accel/accel.h"

#include "accel/kernel.h"

const Kernel *kernel_best(void)
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return &kernel_avx2;
#endif
    return &kernel_packet;
}

void world_intersect(const World *world, const Ray *rays, Hit *hits, size_t n, Scratch *scratch)
{
    world->kernel->intersect(world, rays, hits, n, scratch);
}

void world_occluded(const World *world, const Ray *rays, bool *blocked, size_t n, Scratch *scratch)
{
    world->kernel->occluded(world, rays, blocked, n, scratch);
}
