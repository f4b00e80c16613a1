/* A kernel that traces packets, for the instruction set that the file including this was compiled for: PACKET_LANES says
 * how wide it is, KERNEL names the table that it fills.
 *
 * Rays that follow each other in the stream are near each other, so 64 of one octant at a time share the nodes of the tree
 * of objects; an object gets all the rays that reach it at once, and so do the nodes of a mesh. */
#ifndef RT_ACCEL_PACKET_KERNEL_H
#define RT_ACCEL_PACKET_KERNEL_H

#include "accel/kernel.h"
#include "accel/mesh_data.h"
#include "accel/packet.h"

/* ---- packets in a mesh ---- */

typedef struct {
    SlabPacket *packet;
    MeshRay ray[PACKET];
    uint64_t alive;
} MeshWalk;

static bool nearest_in_mesh(void *context, uint32_t block, uint32_t count, uint64_t rays)
{
    MeshWalk *w = context;
    for (; rays; rays &= rays - 1) {
        uint32_t i = (uint32_t)__builtin_ctzll(rays);
        if (nearer_in_block(&w->ray[i], block, count, w->packet->tmax[i])) packet_shorten(w->packet, i, w->ray[i].end.hi);
    }
    return true;
}

static bool any_in_mesh(void *context, uint32_t block, uint32_t count, uint64_t rays)
{
    MeshWalk *w = context;
    bool more = false;
    for (; rays; rays &= rays - 1) {
        uint32_t i = (uint32_t)__builtin_ctzll(rays);
        if (any_in_block(&w->ray[i], block, count, w->packet->tmax[i]))
            w->alive &= ~((uint64_t)1 << i);
        else
            more = true;
    }
    return more;
}

/* Readies the rays of a mask, ray[i] being what lane i of the packet was made from and tmax[i] where it ends by now. */
static void mesh_walk_init(MeshWalk *w, const MeshPrim *mesh, SlabPacket *p, const Ray *const *ray, const double *tmax,
                           uint64_t rays)
{
    w->packet = p;
    w->alive = rays;
    for (; rays; rays &= rays - 1) {
        uint32_t i = (uint32_t)__builtin_ctzll(rays);
        FilterRay filter = {{p->o[0][i], p->o[1][i], p->o[2][i]},
                            {p->d[0][i], p->d[1][i], p->d[2][i]},
                            p->reach[i] + mesh->reach};
        mesh_ray_init(&w->ray[i], mesh, ray[i], filter, tmax[i]);
    }
}

/* Those of `rays` that hit the mesh; their hits in hit[i]. Shortens the packet's rays. */
static uint64_t mesh_nearest(const MeshPrim *mesh, SlabPacket *p, const Ray *const *ray, const double *tmax,
                             uint64_t rays, Hit *hit)
{
    MeshWalk w;
    mesh_walk_init(&w, mesh, p, ray, tmax, rays);
    packet_walk(&mesh->bvh, p, &w.alive, nearest_in_mesh, &w);
    uint64_t found = 0;
    for (; rays; rays &= rays - 1) {
        uint32_t i = (uint32_t)__builtin_ctzll(rays);
        if (!w.ray[i].found) continue;
        mesh_ray_settle(&w.ray[i]);
        hit[i] = w.ray[i].hit;
        hit[i].leaf = part_of(mesh, hit[i].part);
        found |= rays & -rays;
    }
    return found;
}

static uint64_t mesh_any(const MeshPrim *mesh, SlabPacket *p, const Ray *const *ray, const double *tmax, uint64_t rays)
{
    MeshWalk w;
    mesh_walk_init(&w, mesh, p, ray, tmax, rays);
    packet_walk(&mesh->bvh, p, &w.alive, any_in_mesh, &w);
    return rays & ~w.alive;
}

/* ---- packets in the world ---- */

typedef struct {
    const World *world;
    SlabPacket packet;
    float reach;             /* greatest coordinate of any point of the packet's rays in the world, generously */
    uint64_t alive;
    const Ray *ray[PACKET];
    Hit hit[PACKET];
    double tmax[PACKET];     /* where the next hit must end */
    Scratch *scratch;
} WorldWalk;

/* Ten roundings of 2^-24: the map's entry, the coordinate, the product, three sums, and four to spare. */
#define OBJECT_MARGIN (10 * 0x1p-24f)

/* Directions below this share of the map's size count as this: it moves a point by less than the margin. */
#define OBJECT_PARALLEL 0x1p-32f

/* The rays that meet the object's box in its own space, where it fits a turned object better than the one in the tree.
 * The map and the rays are rounded to float; the box is made larger by what that may do. */
static uint64_t rays_at_object(const WorldWalk *w, const Object *object, uint64_t rays)
{
    if (object->in_world) return rays;
    Box bounds = object->prim->ops->bounds(object->prim);
    float m[3][4], lo[3], hi[3], least_d[3];
    for (int a = 0; a < 3; a++) {
        float size = 0;
        for (int j = 0; j < 4; j++) m[a][j] = (float)object->to_object.m[a][j];
        for (int j = 0; j < 3; j++) size += fabsf(m[a][j]);
        float margin = OBJECT_MARGIN * (size * w->reach + fabsf(m[a][3]));
        lo[a] = slab_down((float)vec3_get(bounds.lo, a)) - margin;
        hi[a] = slab_up((float)vec3_get(bounds.hi, a)) + margin;
        least_d[a] = OBJECT_PARALLEL * size;
    }
    const SlabPacket *p = &w->packet;
    uint64_t met = 0;
    for (uint32_t at = 0; at < p->count; at += PACKET_LANES) {
        if (!(rays >> at & PACKET_LANES_MASK)) continue;
        Lanes enter = lanes_set(0), leave = lanes_load(p->tmax + at);
        for (int a = 0; a < 3; a++) {
            Lanes o = m[a][0] * lanes_load(p->o[0] + at) + m[a][1] * lanes_load(p->o[1] + at) +
                      m[a][2] * lanes_load(p->o[2] + at) + m[a][3];
            Lanes d = m[a][0] * lanes_load(p->d[0] + at) + m[a][1] * lanes_load(p->d[1] + at) +
                      m[a][2] * lanes_load(p->d[2] + at);
            LaneMask sign = (LaneMask)d & INT32_MIN;
            Lanes r = (Lanes)((LaneMask)(1.0f / lanes_max(lanes_abs(d), lanes_set(least_d[a]))) ^ sign);
            Lanes x = (lo[a] - o) * r, y = (hi[a] - o) * r;
            enter = lanes_max(enter, lanes_min(x, y) * (1 - SLAB_MARGIN));
            leave = lanes_min(leave, lanes_max(x, y) * (1 + SLAB_MARGIN));
        }
        met |= (uint64_t)lanes_mask(enter <= leave) << at;
    }
    return met & rays;
}

/* The rays of a mask in the object's space; lane[j] is where the j-th came from. */
static uint32_t rays_to_object(const WorldWalk *w, const Object *object, uint64_t rays, Ray *local, uint32_t *lane)
{
    uint32_t n = 0;
    for (; rays; rays &= rays - 1) {
        uint32_t i = (uint32_t)__builtin_ctzll(rays);
        local[n] = ray_to_object(object, w->ray[i]);
        local[n].tmax = w->tmax[i];
        lane[n++] = i;
    }
    return n;
}

/* A hit of ray i; of equal t the least object's counts. */
static void take_hit(WorldWalk *w, uint32_t i, uint32_t object, const Hit *hit)
{
    if (hit->t == w->tmax[i] && object > w->hit[i].object) return;
    w->hit[i] = *hit;
    w->hit[i].object = object;
    w->tmax[i] = hit->t;
    packet_shorten(&w->packet, i, hit->t);
}

/* A mesh in its place takes the world's packet as it is; one in a space of its own gets new ones there. */
static void nearest_at_mesh(WorldWalk *w, uint32_t index, const MeshPrim *mesh, uint64_t rays)
{
    const Object *object = &w->world->objects[index];
    Hit hit[PACKET];
    if (object->in_world) {
        uint64_t found = mesh_nearest(mesh, &w->packet, w->ray, w->tmax, rays, hit);
        for (; found; found &= found - 1) {
            uint32_t i = (uint32_t)__builtin_ctzll(found);
            take_hit(w, i, index, &hit[i]);
        }
        return;
    }
    Ray local[PACKET];
    uint32_t lane[PACKET], n = rays_to_object(w, object, rays, local, lane);
    for (uint64_t left = packet_all(n); left;) {
        const Ray *ray[PACKET];
        SlabPacket packet;
        double tmax[PACKET];
        uint32_t at[PACKET], count = packet_gather(local, &left, ray, at);
        packet_init(&packet, ray, count);
        for (uint32_t i = 0; i < count; i++) tmax[i] = ray[i]->tmax;
        uint64_t found = mesh_nearest(mesh, &packet, ray, tmax, packet_all(count), hit);
        for (; found; found &= found - 1) {
            uint32_t i = (uint32_t)__builtin_ctzll(found);
            take_hit(w, lane[at[i]], index, &hit[i]);
        }
    }
}

static void nearest_at_prim(WorldWalk *w, uint32_t index, uint64_t rays)
{
    const Object *object = &w->world->objects[index];
    for (; rays; rays &= rays - 1) {
        uint32_t i = (uint32_t)__builtin_ctzll(rays);
        Ray local = ray_to_object(object, w->ray[i]);
        local.tmax = w->tmax[i];
        Hit hit;
        arena_reset(w->scratch->arena);
        if (object->prim->ops->intersect(object->prim, &local, &hit, w->scratch)) take_hit(w, i, index, &hit);
    }
}

static bool nearest_in_world(void *context, uint32_t first, uint32_t count, uint64_t rays)
{
    WorldWalk *w = context;
    for (uint32_t k = first; k < first + count; k++) {
        uint32_t index = w->world->bvh.order[k];
        const Object *object = &w->world->objects[index];
        const MeshPrim *mesh = mesh_prim_data(object->prim);
        uint64_t met = rays_at_object(w, object, rays);
        if (mesh && met)
            nearest_at_mesh(w, index, mesh, met);
        else
            nearest_at_prim(w, index, met);
    }
    return true;
}

static uint64_t any_at_mesh(WorldWalk *w, const Object *object, const MeshPrim *mesh, uint64_t rays)
{
    if (object->in_world) return mesh_any(mesh, &w->packet, w->ray, w->tmax, rays);
    Ray local[PACKET];
    uint32_t lane[PACKET], n = rays_to_object(w, object, rays, local, lane);
    uint64_t blocked = 0;
    for (uint64_t left = packet_all(n); left;) {
        const Ray *ray[PACKET];
        SlabPacket packet;
        double tmax[PACKET];
        uint32_t at[PACKET], count = packet_gather(local, &left, ray, at);
        packet_init(&packet, ray, count);
        for (uint32_t i = 0; i < count; i++) tmax[i] = ray[i]->tmax;
        uint64_t found = mesh_any(mesh, &packet, ray, tmax, packet_all(count));
        for (; found; found &= found - 1) blocked |= (uint64_t)1 << lane[at[__builtin_ctzll(found)]];
    }
    return blocked;
}

static uint64_t any_at_prim(WorldWalk *w, const Object *object, uint64_t rays)
{
    const PrimOps *ops = object->prim->ops;
    uint64_t blocked = 0;
    for (; rays; rays &= rays - 1) {
        Ray local = ray_to_object(object, w->ray[__builtin_ctzll(rays)]);
        Hit hit;
        arena_reset(w->scratch->arena);
        bool hits = ops->occluded ? ops->occluded(object->prim, &local, w->scratch)
                                  : ops->intersect(object->prim, &local, &hit, w->scratch);
        if (hits) blocked |= rays & -rays;
    }
    return blocked;
}

static bool any_in_world(void *context, uint32_t first, uint32_t count, uint64_t rays)
{
    WorldWalk *w = context;
    for (uint32_t k = first; k < first + count && rays; k++) {
        const Object *object = &w->world->objects[w->world->bvh.order[k]];
        const MeshPrim *mesh = mesh_prim_data(object->prim);
        uint64_t met = rays_at_object(w, object, rays);
        if (!met) continue;
        uint64_t blocked = mesh ? any_at_mesh(w, object, mesh, met) : any_at_prim(w, object, met);
        rays &= ~blocked;
        w->alive &= ~blocked;
    }
    return rays != 0;
}

/* ---- streams ---- */

/* Gathers the next packet of the rays left of a group of PACKET; index[i] is where its i-th ray stands among them. */
static uint32_t next_packet(WorldWalk *w, const Ray *rays, uint64_t *left, uint32_t index[PACKET])
{
    uint32_t count = packet_gather(rays, left, w->ray, index);
    packet_init(&w->packet, w->ray, count);
    /* Where an object can be met, t is at most the way from the farthest origin across the world, as the greatest
     * component of a direction is 1 at least; it is 2 at most. */
    float world = 0, reach = packet_greatest(w->packet.reach, count);
    for (int a = 0; a < 3; a++) {
        world = fmaxf(world, fabsf(w->world->bvh.bounds.lo[a]));
        world = fmaxf(world, fabsf(w->world->bvh.bounds.hi[a]));
    }
    w->reach = reach + 2 * (reach + world);
    w->alive = packet_all(count);
    for (uint32_t i = 0; i < count; i++) w->tmax[i] = w->ray[i]->tmax;
    return count;
}

static void intersect(const World *world, const Ray *rays, Hit *hits, size_t n, Scratch *scratch)
{
    WorldWalk w;
    w.world = world;
    w.scratch = scratch;
    for (size_t at = 0; at < n; at += PACKET) {
        for (uint64_t left = packet_all(n - at < PACKET ? (uint32_t)(n - at) : PACKET); left;) {
            uint32_t index[PACKET], count = next_packet(&w, rays + at, &left, index);
            for (uint32_t i = 0; i < count; i++) w.hit[i] = (Hit){.t = w.tmax[i], .object = HIT_NONE};
            packet_walk(&world->bvh, &w.packet, &w.alive, nearest_in_world, &w);
            for (uint32_t i = 0; i < count; i++) hits[at + index[i]] = w.hit[i];
        }
    }
}

static void occluded(const World *world, const Ray *rays, bool *blocked, size_t n, Scratch *scratch)
{
    WorldWalk w;
    w.world = world;
    w.scratch = scratch;
    for (size_t at = 0; at < n; at += PACKET) {
        for (uint64_t left = packet_all(n - at < PACKET ? (uint32_t)(n - at) : PACKET); left;) {
            uint32_t index[PACKET], count = next_packet(&w, rays + at, &left, index);
            packet_walk(&world->bvh, &w.packet, &w.alive, any_in_world, &w);
            for (uint32_t i = 0; i < count; i++) blocked[at + index[i]] = !(w.alive >> i & 1);
        }
    }
}

#endif
