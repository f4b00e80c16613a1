/* Packets through the tree of objects: rays that follow each other in the stream are near each other, so 64 of one
 * octant at a time share the nodes; an object gets all the rays that reach it at once. */
#include "accel/kernel.h"
#include "accel/packet.h"

typedef struct {
    const World *world;
    SlabPacket packet;
    float world_reach;    /* the greatest coordinate in the world */
    float reach;          /* and of any point of the packet's rays there, generously */
    uint64_t alive;
    const Ray *ray[PACKET];
    Hit hit[PACKET];      /* hit[i].t is where the next one must end */
    Scratch *scratch;
} Walk;

/* ---- the object's own box ---- */

/* Ten roundings of 2^-24: the map's entry, the coordinate, the product, three sums, and four to spare. */
#define OBJECT_MARGIN (10 * 0x1p-24f)

/* Directions below this share of the map's size count as this: it moves a point by less than the margin. */
#define OBJECT_PARALLEL 0x1p-32f

/* The map of an object, its box made larger by what float may get wrong on the way into it. */
typedef struct { float m[3][4], lo[3], hi[3], least_d[3]; } ObjectBox;

static void object_box(const Walk *w, const Object *object, ObjectBox *b)
{
    Box bounds = object->prim->ops->bounds(object->prim);
    for (int a = 0; a < 3; a++) {
        float size = 0;
        for (int j = 0; j < 4; j++) b->m[a][j] = (float)object->to_object.m[a][j];
        for (int j = 0; j < 3; j++) size += fabsf(b->m[a][j]);
        float margin = OBJECT_MARGIN * (size * w->reach + fabsf(b->m[a][3]));
        b->lo[a] = slab_down((float)vec3_get(bounds.lo, a)) - margin;
        b->hi[a] = slab_up((float)vec3_get(bounds.hi, a)) + margin;
        b->least_d[a] = OBJECT_PARALLEL * size;
    }
}

/* Those of the four rays from `at` on that meet the box in the object's space, which fits a turned object better than
 * the one in the tree. */
static inline uint32_t object_lanes(const Walk *w, const ObjectBox *b, uint32_t at)
{
    const SlabPacket *p = &w->packet;
    Float4 ox = float4_load(p->o[0] + at), oy = float4_load(p->o[1] + at), oz = float4_load(p->o[2] + at);
    Float4 dx = float4_load(p->d[0] + at), dy = float4_load(p->d[1] + at), dz = float4_load(p->d[2] + at);
    Float4 enter = {0, 0, 0, 0}, leave = float4_load(p->tmax + at);
    for (int a = 0; a < 3; a++) {
        const float *m = b->m[a];
        Float4 o = m[0] * ox + m[1] * oy + m[2] * oz + m[3];
        Float4 d = m[0] * dx + m[1] * dy + m[2] * dz;
        Float4 size = float4_max(float4_abs(d), float4_set(b->least_d[a]));
        Float4 r = float4_flip(1.0f / size, (Int4)d & INT32_MIN);
        Float4 x = (b->lo[a] - o) * r, y = (b->hi[a] - o) * r;
        enter = float4_max(enter, float4_min(x, y) * (1 - SLAB_MARGIN));
        leave = float4_min(leave, float4_max(x, y) * (1 + SLAB_MARGIN));
    }
    return int4_mask(enter <= leave);
}

static uint64_t rays_at_object(const Walk *w, const Object *object, uint64_t rays)
{
    if (object->in_world) return rays;
    ObjectBox box;
    object_box(w, object, &box);
    uint64_t met = 0;
    for (uint32_t at = 0; at < w->packet.count; at += PACKET_LANES)
        if (rays >> at & 0xf) met |= (uint64_t)object_lanes(w, &box, at) << at;
    return met & rays;
}

/* Where an object can be met, t is at most the way from the farthest origin across the world, as the greatest component
 * of a direction is 1 at least; it is 2 at most. */
static void start_packet(Walk *w, uint32_t count)
{
    packet_init(&w->packet, w->ray, count);
    float reach = packet_greatest(w->packet.reach, count);
    w->reach = reach + 2 * (reach + w->world_reach);
    w->alive = packet_all(count);
}

static void start_stream(Walk *w, const World *world, Scratch *scratch)
{
    w->world = world;
    w->scratch = scratch;
    w->world_reach = 0;
    for (int a = 0; a < 3; a++) {
        w->world_reach = fmaxf(w->world_reach, fabsf(world->bvh.bounds.lo[a]));
        w->world_reach = fmaxf(w->world_reach, fabsf(world->bvh.bounds.hi[a]));
    }
}

/* ---- tracing ---- */

/* The rays of a mask in the object's space, each ending at its nearest hit so far. */
static uint32_t to_object(const Walk *w, const Object *object, uint64_t rays, Ray local[PACKET])
{
    uint32_t n = 0;
    for (; rays; rays &= rays - 1) {
        uint32_t i = (uint32_t)__builtin_ctzll(rays);
        local[n] = ray_to_object(object, w->ray[i]);
        local[n++].tmax = w->hit[i].t;
    }
    return n;
}

static uint64_t intersect_object(const Object *object, const Ray *local, uint32_t n, Hit *hit, Scratch *scratch)
{
    const PrimOps *ops = object->prim->ops;
    if (n > 1 && ops->intersect_many) return ops->intersect_many(object->prim, local, n, hit, scratch);
    uint64_t found = 0;
    for (uint32_t i = 0; i < n; i++) {
        arena_reset(scratch->arena);
        found |= (uint64_t)ops->intersect(object->prim, &local[i], &hit[i], scratch) << i;
    }
    return found;
}

static bool nearest_leaf(void *context, uint32_t first, uint32_t count, uint64_t rays)
{
    Walk *w = context;
    for (uint32_t k = first; k < first + count; k++) {
        uint32_t index = w->world->bvh.order[k];
        const Object *object = &w->world->objects[index];
        uint64_t rest = rays_at_object(w, object, rays);
        if (!rest) continue;
        Ray local[PACKET];
        Hit hit[PACKET];
        uint32_t n = to_object(w, object, rest, local);
        uint64_t found = intersect_object(object, local, n, hit, w->scratch);
        for (uint32_t j = 0; j < n; j++, rest &= rest - 1) {
            if (!(found >> j & 1)) continue;
            uint32_t i = (uint32_t)__builtin_ctzll(rest);
            if (hit[j].t == w->hit[i].t && index > w->hit[i].object) continue;
            w->hit[i] = hit[j];
            w->hit[i].object = index;
            packet_shorten(&w->packet, i, hit[j].t);
        }
    }
    return true;
}

static void intersect(const World *world, const Ray *rays, Hit *hits, size_t n, Scratch *scratch)
{
    Walk w;
    start_stream(&w, world, scratch);
    for (size_t at = 0; at < n; at += PACKET) {
        uint64_t left = packet_all(n - at < PACKET ? (uint32_t)(n - at) : PACKET);
        while (left) {
            uint32_t index[PACKET], count = packet_gather(rays + at, &left, w.ray, index);
            start_packet(&w, count);
            for (uint32_t i = 0; i < count; i++) w.hit[i] = (Hit){.t = w.ray[i]->tmax, .object = HIT_NONE};
            packet_walk(&world->bvh, &w.packet, &w.alive, nearest_leaf, &w);
            for (uint32_t i = 0; i < count; i++) hits[at + index[i]] = w.hit[i];
        }
    }
}

static uint64_t occluded_object(const Object *object, const Ray *local, uint32_t n, Scratch *scratch)
{
    const PrimOps *ops = object->prim->ops;
    if (n > 1 && ops->occluded_many) return ops->occluded_many(object->prim, local, n, scratch);
    uint64_t found = 0;
    for (uint32_t i = 0; i < n; i++) {
        Hit hit;
        arena_reset(scratch->arena);
        bool hits = ops->occluded ? ops->occluded(object->prim, &local[i], scratch)
                                  : ops->intersect(object->prim, &local[i], &hit, scratch);
        found |= (uint64_t)hits << i;
    }
    return found;
}

static bool blocking_leaf(void *context, uint32_t first, uint32_t count, uint64_t rays)
{
    Walk *w = context;
    for (uint32_t k = first; k < first + count && rays; k++) {
        const Object *object = &w->world->objects[w->world->bvh.order[k]];
        uint64_t rest = rays_at_object(w, object, rays), blocked = 0;
        if (!rest) continue;
        Ray local[PACKET];
        uint32_t n = to_object(w, object, rest, local);
        uint64_t found = occluded_object(object, local, n, w->scratch);
        for (uint32_t j = 0; j < n; j++, rest &= rest - 1)
            if (found >> j & 1) blocked |= rest & -rest;
        rays &= ~blocked;
        w->alive &= ~blocked;
    }
    return rays != 0;
}

static void occluded(const World *world, const Ray *rays, bool *blocked, size_t n, Scratch *scratch)
{
    Walk w;
    start_stream(&w, world, scratch);
    for (size_t at = 0; at < n; at += PACKET) {
        uint64_t left = packet_all(n - at < PACKET ? (uint32_t)(n - at) : PACKET);
        while (left) {
            uint32_t index[PACKET], count = packet_gather(rays + at, &left, w.ray, index);
            start_packet(&w, count);
            for (uint32_t i = 0; i < count; i++) w.hit[i].t = w.ray[i]->tmax;
            packet_walk(&world->bvh, &w.packet, &w.alive, blocking_leaf, &w);
            for (uint32_t i = 0; i < count; i++) blocked[at + index[i]] = !(w.alive >> i & 1);
        }
    }
}

const Kernel kernel_packet = {"packet", intersect, occluded};
