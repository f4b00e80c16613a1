/* Walking a Bvh with up to 64 rays at a time: a node is fetched once for all, and a child that no ray of the packet can
 * meet is found out by one test of the intervals that their origins and directions span (Wald, Benthin, Boulos, "Getting
 * rid of packets", 2008; Boulos et al., "Packet-based Whitted and distribution ray tracing", 2007). What is left is
 * tested ray by ray, several at once; subtrees that only few rays meet are walked by each alone. Boxes are as generous as
 * those of traverse.h, so a ray's hit doesn't depend on its company. */
#ifndef RT_ACCEL_PACKET_H
#define RT_ACCEL_PACKET_H

#include "accel/traverse.h"

/* PACKET_LANES, 4 or 8, comes from the kernel that includes this: as many floats as its instruction set takes at once. */
enum {
    PACKET = 64,
    PACKET_LANES_MASK = (1 << PACKET_LANES) - 1,
    PACKET_FEW = 4,  /* rays for which a node of their own is cheaper than the packet's test */
};

#if PACKET_LANES == 8
typedef float Lanes __attribute__((vector_size(32), may_alias));
typedef int32_t LaneMask __attribute__((vector_size(32), may_alias));

static inline Lanes lanes_set(float x) { return (Lanes){x, x, x, x, x, x, x, x}; }
static inline Lanes lanes_min(Lanes a, Lanes b) { return __builtin_ia32_minps256(a, b); }
static inline Lanes lanes_max(Lanes a, Lanes b) { return __builtin_ia32_maxps256(a, b); }
static inline uint32_t lanes_mask(LaneMask m) { return (uint32_t)__builtin_ia32_movmskps256((Lanes)m); }
#else
typedef Float4 Lanes;
typedef Int4 LaneMask;

static inline Lanes lanes_set(float x) { return float4_set(x); }
static inline Lanes lanes_min(Lanes a, Lanes b) { return float4_min(a, b); }
static inline Lanes lanes_max(Lanes a, Lanes b) { return float4_max(a, b); }
static inline uint32_t lanes_mask(LaneMask m) { return int4_mask(m); }
#endif

static inline Lanes lanes_load(const float *p) { return *(const Lanes *)p; }
static inline Lanes lanes_abs(Lanes a) { return (Lanes)((LaneMask)a & 0x7fffffff); }

static inline float lanes_least(Lanes a)
{
    float m = a[0];
    for (int i = 1; i < PACKET_LANES; i++) m = a[i] < m ? a[i] : m;
    return m;
}

static inline float lanes_greatest(Lanes a)
{
    float m = a[0];
    for (int i = 1; i < PACKET_LANES; i++) m = a[i] > m ? a[i] : m;
    return m;
}

/* SlabRays of one octant, as arrays, and the rays themselves in float, directions in the slabs' units. */
typedef struct {
    _Alignas(64) float o[3][PACKET];
    float d[3][PACKET], reach[PACKET];  /* reach: the origin's greatest coordinate */
    float o_near[3][PACKET], o_far[3][PACKET], r_near[3][PACKET], r_far[3][PACKET], tmin[PACKET], tmax[PACKET];
    double scale[PACKET], per_scale[PACKET];
    uint32_t negative[3], count;
    /* The extremes over the rays: of the origins that give the earliest entry and the latest exit, of the reciprocals. */
    float first_o[3], last_o[3], near_low[3], near_high[3], far_low[3], far_high[3], tmin_all, tmax_all;
} SlabPacket;

static inline uint32_t slab_octant(Vec3 d)
{
    return (uint32_t)(d.x < 0) | (uint32_t)(d.y < 0) << 1 | (uint32_t)(d.z < 0) << 2;
}

static inline SlabRay packet_get(const SlabPacket *p, uint32_t i)
{
    SlabRay r = {.scale = p->scale[i], .per_scale = p->per_scale[i]};
    for (int a = 0; a < 3; a++) {
        r.o_near[a] = p->o_near[a][i];
        r.o_far[a] = p->o_far[a][i];
        r.r_near[a] = p->r_near[a][i];
        r.r_far[a] = p->r_far[a][i];
        r.negative[a] = p->negative[a];
    }
    return r;
}

static inline float packet_greatest(const float *x, uint32_t n)
{
    float m = x[0];
    for (uint32_t i = 1; i < n; i++) m = x[i] > m ? x[i] : m;
    return m;
}

/* slab_ray_init for one axis of all the rays, and their extremes. */
static inline void packet_init_axis(SlabPacket *p, int a)
{
    bool back = p->negative[a];
    Lanes least_o = lanes_set(INFINITY), most_o = -least_o, near_low = least_o, near_high = most_o;
    Lanes far_low = least_o, far_high = most_o;
    for (uint32_t i = 0; i < p->count; i += PACKET_LANES) {
        Lanes o = lanes_load(p->o[a] + i), d = lanes_load(p->d[a] + i);
        Lanes around = lanes_abs(o) * 0x1p-23f + 0x1p-126f;
        LaneMask parallel = lanes_abs(d) < SLAB_PARALLEL;
        around += (Lanes)((LaneMask)(lanes_load(p->reach + i) * SLAB_SLACK) & parallel);
        d = (Lanes)(((LaneMask)lanes_set(back ? -SLAB_PARALLEL : SLAB_PARALLEL) & parallel) | ((LaneMask)d & ~parallel));
        Lanes low = o - around, high = o + around, rcp = 1.0f / d;
        Lanes near = rcp * (1 - SLAB_MARGIN), far = rcp * (1 + SLAB_MARGIN);
        *(Lanes *)(p->o_near[a] + i) = back ? low : high;
        *(Lanes *)(p->o_far[a] + i) = back ? high : low;
        *(Lanes *)(p->r_near[a] + i) = near;
        *(Lanes *)(p->r_far[a] + i) = far;
        least_o = lanes_min(least_o, low);
        most_o = lanes_max(most_o, high);
        near_low = lanes_min(near_low, near);
        near_high = lanes_max(near_high, near);
        far_low = lanes_min(far_low, far);
        far_high = lanes_max(far_high, far);
    }
    /* earliest entry: the origin farthest along the axis' sense; latest exit: the one farthest back */
    float least = lanes_least(least_o), most = lanes_greatest(most_o);
    p->first_o[a] = back ? least : most;
    p->last_o[a] = back ? most : least;
    p->near_low[a] = lanes_least(near_low);
    p->near_high[a] = lanes_greatest(near_high);
    p->far_low[a] = lanes_least(far_low);
    p->far_high[a] = lanes_greatest(far_high);
}

/* Fills it from n (1 to PACKET) rays of one octant. Lanes up to the next multiple of PACKET_LANES repeat the first ray
 * and meet nothing. */
static inline void packet_init(SlabPacket *p, const Ray *const *rays, uint32_t n)
{
    p->count = n;
    p->tmin_all = INFINITY;
    p->tmax_all = -INFINITY;
    for (uint32_t i = 0; i < n || i % PACKET_LANES; i++) {
        const Ray *ray = rays[i < n ? i : 0];
        double scale = vec3_pow2_scale(ray->d), per_scale = 1 / scale;
        p->scale[i] = scale;
        p->per_scale[i] = per_scale;
        p->reach[i] = slab_up((float)vec3_max(vec3_abs(ray->o)));
        p->o[0][i] = (float)ray->o.x;
        p->o[1][i] = (float)ray->o.y;
        p->o[2][i] = (float)ray->o.z;
        p->d[0][i] = (float)(ray->d.x * scale);
        p->d[1][i] = (float)(ray->d.y * scale);
        p->d[2][i] = (float)(ray->d.z * scale);
        float tmin = slab_down((float)(ray->tmin * per_scale)), tmax = slab_up((float)(ray->tmax * per_scale));
        p->tmin[i] = i < n ? (tmin > 0 ? tmin : 0) : INFINITY;
        p->tmax[i] = i < n ? tmax : -INFINITY;
        if (p->tmin[i] < p->tmin_all) p->tmin_all = p->tmin[i];
        if (p->tmax[i] > p->tmax_all) p->tmax_all = p->tmax[i];
    }
    uint32_t octant = slab_octant(rays[0]->d);
    for (int a = 0; a < 3; a++) {
        p->negative[a] = octant >> a & 1;
        packet_init_axis(p, a);
    }
}

/* Takes the rays of one octant out of *left (bits below n) and lists them; returns how many. */
static inline uint32_t packet_gather(const Ray *rays, uint64_t *left, const Ray *ray[PACKET], uint32_t index[PACKET])
{
    uint32_t n = 0, octant = 0;
    for (uint64_t rest = *left; rest; rest &= rest - 1) {
        uint32_t i = (uint32_t)__builtin_ctzll(rest), o = slab_octant(rays[i].d);
        if (n == 0) octant = o;
        if (o != octant) continue;
        *left &= ~((uint64_t)1 << i);
        index[n] = i;
        ray[n++] = &rays[i];
    }
    return n;
}

static inline uint64_t packet_all(uint32_t n) { return n == 64 ? UINT64_MAX : ((uint64_t)1 << n) - 1; }

/* Ray i ends earlier from now on. */
static inline void packet_shorten(SlabPacket *p, uint32_t i, double t)
{
    p->tmax[i] = slab_up((float)(t * p->per_scale[i]));
}

/* The children that some ray might meet, and bounds on their entry distances: differences and products are monotonic,
 * rounded ones too, so the extremes bound every ray's own test. */
static inline __attribute__((always_inline)) uint32_t packet_children(const BvhNode *node, const SlabPacket *p,
                                                                      Lanes entry[BVH_WIDTH / PACKET_LANES])
{
    uint32_t mask = 0;
    for (int i = 0; i < BVH_WIDTH / PACKET_LANES; i++) {
        Lanes enter = lanes_set(p->tmin_all), leave = lanes_set(p->tmax_all);
        for (int a = 0; a < 3; a++) {
            Lanes lo = lanes_load(node->lo[a] + PACKET_LANES * i), hi = lanes_load(node->hi[a] + PACKET_LANES * i);
            Lanes near = (p->negative[a] ? hi : lo) - p->first_o[a], far = (p->negative[a] ? lo : hi) - p->last_o[a];
            enter = lanes_max(enter, lanes_min(near * p->near_low[a], near * p->near_high[a]));
            leave = lanes_min(leave, lanes_max(far * p->far_low[a], far * p->far_high[a]));
        }
        entry[i] = enter;
        mask |= lanes_mask(enter <= leave) << (PACKET_LANES * i);
    }
    return mask;
}

/* Those of `rays` that meet child k. */
static inline __attribute__((always_inline)) uint64_t packet_lanes(const SlabPacket *p, const BvhNode *node, int k,
                                                                   uint64_t rays)
{
    Lanes near[3], far[3];
    for (int a = 0; a < 3; a++) {
        float lo = node->lo[a][k], hi = node->hi[a][k];
        near[a] = lanes_set(p->negative[a] ? hi : lo);
        far[a] = lanes_set(p->negative[a] ? lo : hi);
    }
    uint64_t met = 0;
    for (uint32_t at = 0; at < p->count; at += PACKET_LANES) {
        if (!(rays >> at & PACKET_LANES_MASK)) continue;
        Lanes x = (near[0] - lanes_load(p->o_near[0] + at)) * lanes_load(p->r_near[0] + at);
        Lanes y = (near[1] - lanes_load(p->o_near[1] + at)) * lanes_load(p->r_near[1] + at);
        Lanes z = (near[2] - lanes_load(p->o_near[2] + at)) * lanes_load(p->r_near[2] + at);
        Lanes enter = lanes_max(lanes_max(x, y), lanes_max(z, lanes_load(p->tmin + at)));
        x = (far[0] - lanes_load(p->o_far[0] + at)) * lanes_load(p->r_far[0] + at);
        y = (far[1] - lanes_load(p->o_far[1] + at)) * lanes_load(p->r_far[1] + at);
        z = (far[2] - lanes_load(p->o_far[2] + at)) * lanes_load(p->r_far[2] + at);
        Lanes leave = lanes_min(lanes_min(x, y), lanes_min(z, lanes_load(p->tmax + at)));
        met |= (uint64_t)lanes_mask(enter <= leave) << at;
    }
    return met & rays;
}

/* A subtree or leaf that waits for its turn, with the rays that meet it. */
typedef struct { uint64_t rays; float entry; uint32_t child, count; } PacketTask;

/* One ray's walk on behalf of its packet. */
typedef struct {
    bool (*leaf)(void *, uint32_t child, uint32_t count, uint64_t rays);
    void *context;
    uint64_t ray;
} PacketSingle;

static inline __attribute__((always_inline)) bool packet_single_leaf(void *context, uint32_t child, uint32_t count)
{
    PacketSingle *s = context;
    return s->leaf(s->context, child, count, s->ray);
}

static inline __attribute__((always_inline)) void packet_walk_alone(
    const Bvh *bvh, SlabPacket *p, const PacketTask *task,
    bool (*leaf)(void *, uint32_t child, uint32_t count, uint64_t rays), void *context)
{
    for (uint64_t rays = task->rays; rays; rays &= rays - 1) {
        uint32_t i = (uint32_t)__builtin_ctzll(rays);
        SlabRay r = packet_get(p, i);
        PacketSingle single = {leaf, context, rays & -rays};
        slab_walk_from(bvh, (SlabTask){0, task->child, task->count}, &r, p->tmin[i], &p->tmax[i], packet_single_leaf,
                       &single);
    }
}

/* Visits the leaves that rays of the packet meet, roughly nearer ones first. `leaf` gets the rays as a mask, calls
 * packet_shorten as hits are found, and returns false if the ray or all of the rays that it got need no more leaves;
 * rays taken out of *alive are done. */
static inline __attribute__((always_inline)) void packet_walk(
    const Bvh *bvh, SlabPacket *p, const uint64_t *alive,
    bool (*leaf)(void *, uint32_t child, uint32_t count, uint64_t rays), void *context)
{
    if (!bvh->node) return;
    PacketTask stack[SLAB_STACK];
    uint32_t top = 0;
    stack[top++] = (PacketTask){*alive, 0, 0, 0};
    while (top > 0) {
        PacketTask now = stack[--top];
        now.rays &= *alive;
        if (!now.rays || now.entry > p->tmax_all) continue;
        if (now.count) {
            leaf(context, now.child, now.count, now.rays);
            p->tmax_all = packet_greatest(p->tmax, p->count);
            continue;
        }
        if (__builtin_popcountll(now.rays) <= PACKET_FEW) {
            packet_walk_alone(bvh, p, &now, leaf, context);
            p->tmax_all = packet_greatest(p->tmax, p->count);
            continue;
        }
        const BvhNode *node = &bvh->node[now.child];
        Lanes entry[BVH_WIDTH / PACKET_LANES];
        uint32_t bottom = top;
        for (uint32_t mask = packet_children(node, p, entry); mask; mask &= mask - 1) {
            int k = __builtin_ctz(mask);
            float nearest = entry[k / PACKET_LANES][k % PACKET_LANES];
            PacketTask task = {packet_lanes(p, node, k, now.rays), nearest, node->child[k], node->count[k]};
            if (!task.rays) continue;
            uint32_t i = top++;
            while (i > bottom && stack[i - 1].entry < task.entry) {
                stack[i] = stack[i - 1];
                i--;
            }
            stack[i] = task;
        }
    }
}

#endif
