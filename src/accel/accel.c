#include "accel/accel.h"

#include "accel/kernel.h"

void world_intersect(const World *world, const Ray *rays, Hit *hits, size_t n, Scratch *scratch)
{
    kernel_packet.intersect(world, rays, hits, n, scratch);
}

void world_occluded(const World *world, const Ray *rays, bool *blocked, size_t n, Scratch *scratch)
{
    kernel_packet.occluded(world, rays, blocked, n, scratch);
}
