/* What a mesh primitive is made of, and how a ray asks its triangles, for those who walk it: mesh_prim.c with single rays
 * and whole lines, the kernels with packets.
 *
 * Before the test of triangle.h, four triangles at a time pass a filter in float, Moeller, Trumbore, "Fast, minimum storage
 * ray/triangle intersection" (1997), with margins for its rounding: it may let through what misses, never stop what
 * hits. */
#ifndef RT_ACCEL_MESH_DATA_H
#define RT_ACCEL_MESH_DATA_H

#include "accel/mesh_prim.h"
#include "accel/traverse.h"
#include "accel/triangle.h"

/* A leaf is one block. */
enum { BLOCK = 4 };

/* Vertices up to which an instance's box is found from each of them. */
enum { SMALL_MESH = 64 };

/* Filtering a triangle against testing eight boxes. */
#define TRIANGLE_COST 0.25f

/* The filter's margin: each of its determinants is a sum of six products of three factors that carry up to three
 * roundings of 2^-24 each, and takes eight more on the way; the direction's components are below 2: 2 x 6 x (9 + 8)
 * of them, rounded up to a power of two. */
#define FILTER_MARGIN (256 * 0x1p-24f)

/* What underflow may add to a determinant. */
#define FILTER_UNDERFLOW 0x1p-120f

typedef struct {
    _Alignas(64) float v[3][BLOCK];     /* first vertices */
    float e1[3][BLOCK], e2[3][BLOCK];   /* edges to the second and third */
    float edge[BLOCK];                  /* the longest component of a triangle's edges */
    uint32_t triangle[BLOCK];
    uint32_t count;                     /* triangles in use, the first ones */
} MeshBlock;

enum { PART_CHUNK = 64 };

typedef struct { const Mesh *mesh; uint32_t first; Affine to_object; } MeshPart;  /* first: of its triangles in the set */

typedef struct {
    Prim prim;
    const Vec3 *position;
    const uint32_t (*triangle)[3];
    uint32_t triangle_count;
    Bvh bvh;                 /* leaves refer to blocks */
    MeshBlock *block;
    uint32_t block_count;
    Box bounds;
    float reach;             /* of the bounds, rounded up */
    MeshPart *source;          /* in the order of their first triangle; one with the identity unless baked */
    uint32_t source_count;
    uint32_t *part_first;      /* baked: the first triangle of each part, and UINT32_MAX */
    uint32_t *part_of_chunk;   /* baked: the part of the first triangle of every PART_CHUNK */
    bool baked;
    Vec3 *own_position;      /* baked: what position points at */
    uint32_t (*own_triangle)[3];   /* baked of several: what triangle points at */
} MeshPrim;

/* What the filter needs of a ray. The direction is the slabs' one, about 1 long, and so are the units of t. */
typedef struct { float o[3], d[3], reach; } FilterRay;

/* A ray's state among triangles. */
typedef struct {
    const MeshPrim *mesh;
    const Ray *ray;
    Shear shear;
    bool sheared;            /* not before the first triangle that passes the filter */
    bool found;
    FilterRay filter;
    TriangleSpan end;        /* where the ray ends: its tmax, then the nearest hit, which is known to be in it */
    Hit hit;                 /* the nearest; its t isn't known before mesh_ray_settle */
} MeshRay;

static inline void mesh_ray_init(MeshRay *r, const MeshPrim *mesh, const Ray *ray, FilterRay filter, double tmax)
{
    r->mesh = mesh;
    r->ray = ray;
    r->sheared = false;
    r->found = false;
    r->end = (TriangleSpan){tmax, tmax};
    r->filter = filter;
}

/* The triangles of the block that the ray may hit with 0 <= t <= tmax, in the slabs' units (`line`: with any t), as a
 * mask. Comparisons say what misses, so that a NaN from an overflow lets the triangle through. */
static inline __attribute__((always_inline)) uint32_t filter_block(const MeshBlock *b, const FilterRay *r, float tmax,
                                                                   bool line)
{
    const Float4 *v = (const Float4 *)b->v, *e1 = (const Float4 *)b->e1, *e2 = (const Float4 *)b->e2;
    Float4 dx = float4_set(r->d[0]), dy = float4_set(r->d[1]), dz = float4_set(r->d[2]);
    Float4 tx = r->o[0] - v[0], ty = r->o[1] - v[1], tz = r->o[2] - v[2];
    Float4 px = float4_minor(dy, e2[2], dz, e2[1]);
    Float4 py = float4_minor(dz, e2[0], dx, e2[2]);
    Float4 pz = float4_minor(dx, e2[1], dy, e2[0]);
    Float4 det = float4_dot(e1[0], e1[1], e1[2], px, py, pz);
    Int4 sign = (Int4)det & INT32_MIN;
    Float4 size = float4_abs(det), u = float4_flip(float4_dot(tx, ty, tz, px, py, pz), sign);
    Float4 edge = float4_load(b->edge);
    Float4 margin = FILTER_MARGIN * r->reach * edge + FILTER_UNDERFLOW;
    Float4 area_margin = FILTER_MARGIN * edge * edge + FILTER_UNDERFLOW;
    Int4 sided = size > area_margin;  /* seen edge on, its sign is not known, and nothing is said */
    Int4 misses = ((u < -margin) | (u > size + margin)) & sided;
    uint32_t all = (1u << b->count) - 1;
    if ((int4_mask(misses) & all) == all) return 0;
    Float4 qx = float4_minor(ty, e1[2], tz, e1[1]);
    Float4 qy = float4_minor(tz, e1[0], tx, e1[2]);
    Float4 qz = float4_minor(tx, e1[1], ty, e1[0]);
    Float4 w = float4_flip(float4_dot(dx, dy, dz, qx, qy, qz), sign);
    misses |= ((w < -margin) | (u + w > size + 2 * margin)) & sided;
    if (!line) {
        Float4 t = float4_flip(float4_dot(e2[0], e2[1], e2[2], qx, qy, qz), sign);
        Float4 t_margin = area_margin * (r->reach + tmax);
        misses |= ((t < -t_margin) | (t > size * tmax + t_margin)) & sided;
    }
    return ~int4_mask(misses) & all;
}

/* How the ray's line crosses a triangle of the mesh, whose corners go to p; false if it passes it. */
static inline __attribute__((always_inline)) bool cut_of_mesh(MeshRay *r, uint32_t index, const Vec3 *p[3],
                                                              TriangleCut *cut)
{
    if (!r->sheared) r->shear = shear_of(r->ray);
    r->sheared = true;
    const uint32_t *k = r->mesh->triangle[index];
    for (int i = 0; i < 3; i++) p[i] = &r->mesh->position[k[i]];
    return triangle_cut(&r->shear, p[0], p[1], p[2], cut);
}

/* Finds out the t of the nearest hit. Out of the way of what is done for every triangle. */
static __attribute__((noinline, unused)) void mesh_ray_settle(MeshRay *r)
{
    if (!r->found) return;
    if (r->end.lo < r->end.hi) {
        const uint32_t *k = r->mesh->triangle[r->hit.part];
        const Vec3 *p = r->mesh->position;
        double err;
        r->end.lo = r->end.hi = triangle_t(&r->shear, &p[k[0]], &p[k[1]], &p[k[2]], &err);
    }
    r->hit.t = r->end.lo;
}

/* Whether a crossing is after tmin; if so, *t is where. */
static __attribute__((noinline, unused)) bool after_start(const MeshRay *r, const Vec3 *const p[3], const TriangleCut *cut,
                                                          TriangleSpan span, double *t)
{
    double from = r->ray->tmin, err;
    if (!(span.hi > from) || (from >= 0 && triangle_behind(&r->shear, p[0], p[1], p[2], cut))) return false;
    *t = triangle_t(&r->shear, p[0], p[1], p[2], &err);
    return *t > from;
}

/* Whether a crossing is surely on the ray and nearer than what was found. */
static inline bool surely_nearer(const MeshRay *r, TriangleSpan span)
{
    return span.lo > r->ray->tmin && span.hi < r->end.lo;
}

/* Looks for a nearer hit among the triangles of a block; tmax is r->end.hi, rounded up, in the slabs' units. What the
 * spans can't tell apart is settled by t, and if t is the same, by the lower index. */
static inline __attribute__((always_inline)) bool nearer_in_block(MeshRay *r, uint32_t block, float tmax)
{
    const MeshBlock *b = &r->mesh->block[block];
    bool nearer = false;
    for (uint32_t mask = filter_block(b, &r->filter, tmax, false); mask; mask &= mask - 1) {
        uint32_t index = b->triangle[__builtin_ctz(mask)];
        const Vec3 *p[3];
        TriangleCut cut;
        if (!cut_of_mesh(r, index, p, &cut)) continue;
        TriangleSpan span = triangle_span(&r->shear, &cut);
        if (span.lo > r->end.hi) continue;
        if (!surely_nearer(r, span)) {
            double t;
            if (!after_start(r, p, &cut, span, &t)) continue;
            mesh_ray_settle(r);
            if (!(t <= r->end.hi) || (r->found && t == r->end.hi && index > r->hit.part)) continue;
            span.lo = span.hi = t;
        }
        r->end = span;
        r->hit = (Hit){.u = cut.u, .v = cut.v, .part = index};
        r->found = nearer = true;
    }
    return nearer;
}

static inline __attribute__((always_inline)) bool any_in_block(MeshRay *r, uint32_t block, float tmax)
{
    const MeshBlock *b = &r->mesh->block[block];
    for (uint32_t mask = filter_block(b, &r->filter, tmax, false); mask; mask &= mask - 1) {
        const Vec3 *p[3];
        TriangleCut cut;
        if (!cut_of_mesh(r, b->triangle[__builtin_ctz(mask)], p, &cut)) continue;
        TriangleSpan span = triangle_span(&r->shear, &cut);
        if (span.lo > r->end.hi) continue;
        double t;
        if (surely_nearer(r, span) || (after_start(r, p, &cut, span, &t) && t <= r->end.hi)) return true;
    }
    return false;
}

/* The part that a triangle belongs to: the last one that doesn't begin after it. */
static inline uint32_t part_of(const MeshPrim *mesh, uint32_t triangle)
{
    if (mesh->source_count == 1) return 0;
    uint32_t part = mesh->part_of_chunk[triangle / PART_CHUNK];
    while (mesh->part_first[part + 1] <= triangle) part++;
    return part;
}

/* The data of a primitive that is a mesh; NULL for any other. */
const MeshPrim *mesh_prim_data(const Prim *prim);

#endif
