/* Walking a Bvh with one ray, in plain C; what is done with a leaf's items is the caller's, inlined.
 *
 * Box tests are in float and generous: the origin is rounded both ways, the reciprocal direction is shrunk for the near
 * planes and stretched for the far ones by the rounding of the difference, the reciprocal and the product, so an entry
 * distance is never above, an exit distance never below the true one. */
#ifndef RT_ACCEL_TRAVERSE_H
#define RT_ACCEL_TRAVERSE_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "accel/bvh.h"
#include "common/ray.h"

/* Distances are in units of 1 / scale: the direction is multiplied by the power of two `scale`, so that it is about 1
 * and float reaches. */
typedef struct {
    float o_near[3], o_far[3], r_near[3], r_far[3];
    uint32_t negative[3];
    double scale, per_scale;  /* and its reciprocal, a power of two too */
} SlabRay;

/* Four float roundings (difference, direction, reciprocal, product), 2^-24 each, and one to spare. */
#define SLAB_MARGIN (5 * 0x1p-24f)

/* A direction component below this, beside a greatest one of 1 to 2, counts as zero for the boxes. Over a distance of
 * 2^20 times the origin's reach it moves a ray by less than SLAB_SLACK of that reach. */
#define SLAB_PARALLEL 0x1p-80f
#define SLAB_SLACK 0x1p-60f

static inline float slab_up(float f) { return f + fabsf(f) * 0x1p-23f + 0x1p-126f; }
static inline float slab_down(float f) { return f - fabsf(f) * 0x1p-23f - 0x1p-126f; }

static inline __attribute__((always_inline)) void slab_ray_init(SlabRay *r, const Ray *ray)
{
    r->scale = vec3_pow2_scale(ray->d);
    r->per_scale = 1 / r->scale;
    float reach = (float)vec3_max(vec3_abs(ray->o));
    const double o[3] = {ray->o.x, ray->o.y, ray->o.z}, d[3] = {ray->d.x, ray->d.y, ray->d.z};
    for (int a = 0; a < 3; a++) {
        float of = (float)o[a], df = (float)(d[a] * r->scale);
        float low = slab_down(of), high = slab_up(of);
        r->negative[a] = d[a] < 0;
        if (fabsf(df) < SLAB_PARALLEL) {
            df = r->negative[a] ? -SLAB_PARALLEL : SLAB_PARALLEL;
            low -= SLAB_SLACK * reach;
            high += SLAB_SLACK * reach;
        }
        float rcp = 1.0f / df;
        r->o_near[a] = r->negative[a] ? low : high;
        r->o_far[a] = r->negative[a] ? high : low;
        r->r_near[a] = rcp * (1 - SLAB_MARGIN);
        r->r_far[a] = rcp * (1 + SLAB_MARGIN);
    }
}

/* t of the ray in the slab's units, rounded up and down. */
static inline float slab_t_up(const SlabRay *r, double t) { return slab_up((float)(t * r->per_scale)); }
static inline float slab_t_down(const SlabRay *r, double t) { return slab_down((float)(t * r->per_scale)); }

/* Four floats at a time, in the compiler's own vector notation: it becomes vector instructions on any machine that has
 * some. The three operations that the notation lacks are the baseline's own where there is one. */
typedef float Float4 __attribute__((vector_size(16), may_alias));
typedef int32_t Int4 __attribute__((vector_size(16), may_alias));

static inline Float4 float4_load(const float *p) { return *(const Float4 *)p; }

#ifdef __SSE2__
static inline Float4 float4_min(Float4 a, Float4 b) { return __builtin_ia32_minps(a, b); }
static inline Float4 float4_max(Float4 a, Float4 b) { return __builtin_ia32_maxps(a, b); }
static inline uint32_t int4_mask(Int4 m) { return (uint32_t)__builtin_ia32_movmskps((Float4)m); }
#else
static inline Float4 float4_pick(Int4 m, Float4 a, Float4 b) { return (Float4)((m & (Int4)a) | (~m & (Int4)b)); }
static inline Float4 float4_min(Float4 a, Float4 b) { return float4_pick(a < b, a, b); }
static inline Float4 float4_max(Float4 a, Float4 b) { return float4_pick(a > b, a, b); }

/* Bit i is set where lane i of a comparison holds. */
static inline uint32_t int4_mask(Int4 m)
{
    m &= (Int4){1, 2, 4, 8};
    return (uint32_t)(m[0] | m[1] | m[2] | m[3]);
}
#endif

/* a b + c, fused where the processor does that: for tests with a margin only, as the last bit differs. */
static inline Float4 float4_mul_add(Float4 a, Float4 b, Float4 c)
{
#ifdef __FMA__
    return __builtin_ia32_vfmaddps(a, b, c);
#else
    return a * b + c;
#endif
}

/* a b - c d, and the product of two vectors. */
static inline Float4 float4_minor(Float4 a, Float4 b, Float4 c, Float4 d) { return float4_mul_add(a, b, -(c * d)); }

static inline Float4 float4_dot(Float4 ax, Float4 ay, Float4 az, Float4 bx, Float4 by, Float4 bz)
{
    return float4_mul_add(ax, bx, float4_mul_add(ay, by, az * bz));
}

static inline Float4 float4_set(float x) { return (Float4){x, x, x, x}; }
static inline Float4 float4_abs(Float4 a) { return (Float4)((Int4)a & 0x7fffffff); }
static inline Float4 float4_flip(Float4 a, Int4 sign) { return (Float4)((Int4)a ^ sign); }

/* The children whose boxes the ray meets within [tmin, tmax] as a mask, their entry distances in entry[]. tmin >= 0. */
static inline __attribute__((always_inline)) uint32_t slab_children(const BvhNode *node, const SlabRay *r, float tmin,
                                                                    float tmax, Float4 entry[BVH_WIDTH / 4])
{
    const Float4 *near[3], *far[3];
    for (int a = 0; a < 3; a++) {
        near[a] = (const Float4 *)(r->negative[a] ? node->hi[a] : node->lo[a]);
        far[a] = (const Float4 *)(r->negative[a] ? node->lo[a] : node->hi[a]);
    }
    uint32_t mask = 0;
    for (int i = 0; i < BVH_WIDTH / 4; i++) {
        Float4 x = (near[0][i] - r->o_near[0]) * r->r_near[0];
        Float4 y = (near[1][i] - r->o_near[1]) * r->r_near[1];
        Float4 z = (near[2][i] - r->o_near[2]) * r->r_near[2];
        entry[i] = float4_max(float4_max(x, y), float4_max(z, float4_set(tmin)));
        x = (far[0][i] - r->o_far[0]) * r->r_far[0];
        y = (far[1][i] - r->o_far[1]) * r->r_far[1];
        z = (far[2][i] - r->o_far[2]) * r->r_far[2];
        Float4 leave = float4_min(float4_min(x, y), float4_min(z, float4_set(tmax)));
        mask |= int4_mask(entry[i] <= leave) << (4 * i);
    }
    return mask;
}

/* A subtree or leaf that waits for its turn. */
typedef struct { float entry; uint32_t child; } SlabTask;

enum { SLAB_STACK = (BVH_WIDTH - 1) * BVH_MAX_DEPTH + BVH_WIDTH };

/* Visits the leaves below `start` that the ray meets, nearer ones first. `leaf` gets what the leaf holds and
 * returns false to end the walk; it may lower *tmax (in units of slab_t_up) as hits are found. */
static inline __attribute__((always_inline)) void slab_walk_from(const Bvh *bvh, SlabTask start, const SlabRay *r,
                                                                 float tmin, float *tmax,
                                                                 bool (*leaf)(void *, uint32_t leaf),
                                                                 void *context)
{
    SlabTask stack[SLAB_STACK];
    uint32_t top = 0;
    SlabTask now = start;
    for (;;) {
        if (now.child & BVH_LEAF) {
            if (!leaf(context, now.child & ~BVH_LEAF)) return;
        } else {
            const BvhNode *node = &bvh->node[now.child];
            Float4 entry[BVH_WIDTH / 4];
            uint32_t mask = slab_children(node, r, tmin, *tmax, entry);
            uint32_t bottom = top;
            while (mask) {
                uint32_t i = (uint32_t)__builtin_ctz(mask);
                mask &= mask - 1;
                SlabTask task = {entry[i / 4][i % 4], node->child[i]};
                uint32_t k = top++;
                while (k > bottom && stack[k - 1].entry < task.entry) {  /* the nearest ends on top */
                    stack[k] = stack[k - 1];
                    k--;
                }
                stack[k] = task;
            }
        }
        do {
            if (top == 0) return;
            now = stack[--top];
        } while (now.entry > *tmax);
    }
}

/* The same from the root. */
static inline __attribute__((always_inline)) void slab_walk(const Bvh *bvh, const SlabRay *r, float tmin, float *tmax,
                                                            bool (*leaf)(void *, uint32_t leaf),
                                                            void *context)
{
    if (bvh->item_count) slab_walk_from(bvh, (SlabTask){0, bvh->root}, r, tmin, tmax, leaf, context);
}

#endif
