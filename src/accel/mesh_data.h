/* What a mesh primitive is made of, and its triangle test, for those who walk it: mesh_prim.c with single rays and whole
 * lines, the kernels with packets.
 *
 * The triangle test is that of Woop, Benthin, Wald, "Watertight ray/triangle intersection" (JCGT 2013), in double
 * precision: vertices are translated to the ray's origin and sheared so that the ray runs along an axis; three
 * 2D edge functions decide. Their signs are made exact (a product that cancels to zero is looked at again without
 * rounding), and a sign that is exactly zero is settled as if the ray were moved by an infinitesimal (e, e^2), as in
 * Edelsbrunner, Muecke, "Simulation of simplicity" (1990). A sheared vertex depends on the ray and the vertex only, so
 * a ray that meets a closed mesh at an edge or a vertex crosses exactly one of the triangles there on each way through:
 * no leaks, no double hits, and parity is exact, as CSG needs.
 *
 * Before it, four triangles at a time pass a filter in float, Moeller, Trumbore, "Fast, minimum storage ray/triangle
 * intersection" (1997), with margins for its rounding: it may let through what misses, never stop what hits. */
#ifndef RT_ACCEL_MESH_DATA_H
#define RT_ACCEL_MESH_DATA_H

#include "accel/mesh_prim.h"
#include "accel/traverse.h"
#include "common/numeric.h"

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
    float edge;                         /* the longest component of any edge */
    uint32_t triangle[BLOCK];
} MeshBlock;

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
    bool baked;
    Vec3 *own_position;      /* baked: what position and triangle point at */
    uint32_t (*own_triangle)[3];
} MeshPrim;

/* The ray along +z: x' = x - shear_x z and so on, axes permuted so that z is the direction's greatest component. */
typedef struct { int kx, ky, kz; double sx, sy, sz; Vec3 o; } Shear;

static inline Shear shear_of(const Ray *ray)
{
    Vec3 d = ray->d, a = vec3_abs(d);
    Shear s;
    s.kz = a.x >= a.y ? (a.x >= a.z ? 0 : 2) : (a.y >= a.z ? 1 : 2);
    s.kx = (s.kz + 1) % 3;
    s.ky = (s.kz + 2) % 3;
    double dz = vec3_get(d, s.kz);
    s.sx = vec3_get(d, s.kx) / dz;
    s.sy = vec3_get(d, s.ky) / dz;
    s.sz = 1.0 / dz;
    s.o = ray->o;
    return s;
}

typedef struct { double x, y, z; } Sheared;

static inline Sheared shear(const Shear *s, const Vec3 *vertex)
{
    const double *p = &vertex->x, *o = &s->o.x;
    double z = p[s->kz] - o[s->kz];
    return (Sheared){p[s->kx] - o[s->kx] - s->sx * z, p[s->ky] - o[s->ky] - s->sy * z, z};
}

/* The sign of p.x q.y - p.y q.x for an exact difference of products whose roundings are equal, then by the
 * infinitesimal shift (e, e^2) of the origin: -1, 0 (the edge is a point) or 1. Antisymmetric in p and q. */
static inline int tie_sign(Sheared p, Sheared q)
{
    double a = p.x * q.y, b = p.y * q.x;
    double ra = fma(p.x, q.y, -a), rb = fma(p.y, q.x, -b);
    double d = ra - rb;
    if (d == 0) d = p.y - q.y;
    if (d == 0) d = q.x - p.x;
    return (d > 0) - (d < 0);
}

/* Twice the signed area of the triangle (0, p, q); its sign, never wrong, in *sign. */
static inline double edge_function(Sheared p, Sheared q, int *sign)
{
    double e = p.x * q.y - p.y * q.x;
    *sign = e > 0 ? 1 : e < 0 ? -1 : tie_sign(p, q);
    return e;
}

/* t and the weights of the second and third vertex. On an edge that is seen end on nothing is hit. */
static inline bool hit_triangle(const Shear *s, const Vec3 *a, const Vec3 *b, const Vec3 *c, double *t, double *u,
                                double *v, int *facing)
{
    Sheared A = shear(s, a), B = shear(s, b), C = shear(s, c);
    int su, sv, sw;
    double eu = edge_function(C, B, &su);
    double ev = edge_function(A, C, &sv);
    if (su != sv) return false;
    double ew = edge_function(B, A, &sw);
    if (su != sw || su == 0) return false;
    double det = eu + ev + ew;
    if (det == 0) {  /* the origin's shift decided all three: the triangle is seen edge on, or all but */
        *u = *v = 1.0 / 3;
        *t = (A.z + B.z + C.z) / 3 * s->sz;
    } else {
        double r = 1.0 / det;
        *u = ev * r;
        *v = ew * r;
        *t = (eu * A.z + ev * B.z + ew * C.z) * r * s->sz;
    }
    *facing = su;
    return true;
}

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
    double tmax;             /* the ray's, then the nearest hit's */
    Hit hit;
} MeshRay;

static inline void mesh_ray_init(MeshRay *r, const MeshPrim *mesh, const Ray *ray, FilterRay filter)
{
    r->mesh = mesh;
    r->ray = ray;
    r->sheared = false;
    r->found = false;
    r->tmax = ray->tmax;
    r->filter = filter;
}

/* The triangles of the block that the ray may hit with 0 <= t <= tmax, in the slabs' units (`line`: with any t), as a
 * mask. Comparisons say what misses, so that a NaN from an overflow lets the triangle through. */
static inline uint32_t filter_block(const MeshBlock *b, const FilterRay *r, float tmax, bool line, uint32_t count)
{
    const Float4 *v = (const Float4 *)b->v, *e1 = (const Float4 *)b->e1, *e2 = (const Float4 *)b->e2;
    Float4 tx = r->o[0] - v[0], ty = r->o[1] - v[1], tz = r->o[2] - v[2];
    Float4 px = r->d[1] * e2[2] - r->d[2] * e2[1];
    Float4 py = r->d[2] * e2[0] - r->d[0] * e2[2];
    Float4 pz = r->d[0] * e2[1] - r->d[1] * e2[0];
    Float4 det = e1[0] * px + e1[1] * py + e1[2] * pz;
    Int4 sign = (Int4)det & INT32_MIN;
    Float4 size = float4_abs(det), u = float4_flip(tx * px + ty * py + tz * pz, sign);
    float margin = FILTER_MARGIN * r->reach * b->edge + FILTER_UNDERFLOW;
    float area_margin = FILTER_MARGIN * b->edge * b->edge + FILTER_UNDERFLOW;
    Int4 sided = size > area_margin;  /* seen edge on, its sign is not known, and nothing is said */
    Int4 misses = ((u < -margin) | (u > size + margin)) & sided;
    uint32_t all = (1u << count) - 1;
    if ((int4_mask(misses) & all) == all) return 0;
    Float4 qx = ty * e1[2] - tz * e1[1];
    Float4 qy = tz * e1[0] - tx * e1[2];
    Float4 qz = tx * e1[1] - ty * e1[0];
    Float4 w = float4_flip(r->d[0] * qx + r->d[1] * qy + r->d[2] * qz, sign);
    misses |= ((w < -margin) | (u + w > size + 2 * margin)) & sided;
    if (!line) {
        Float4 t = float4_flip(e2[0] * qx + e2[1] * qy + e2[2] * qz, sign);
        float t_margin = area_margin * (r->reach + tmax);
        misses |= ((t < -t_margin) | (t > size * tmax + t_margin)) & sided;
    }
    return ~int4_mask(misses) & all;
}

static inline bool test_triangle(MeshRay *r, uint32_t index, double *t, double *u, double *v, int *facing)
{
    if (!r->sheared) r->shear = shear_of(r->ray);
    r->sheared = true;
    const uint32_t *k = r->mesh->triangle[index];
    const Vec3 *p = r->mesh->position;
    return hit_triangle(&r->shear, &p[k[0]], &p[k[1]], &p[k[2]], t, u, v, facing);
}

/* Looks for a nearer hit among the triangles of a block; tmax is c->tmax, rounded up, in the slabs' units. */
static inline bool nearer_in_block(MeshRay *r, uint32_t block, uint32_t count, float tmax)
{
    const MeshBlock *b = &r->mesh->block[block];
    bool nearer = false;
    for (uint32_t mask = filter_block(b, &r->filter, tmax, false, count); mask; mask &= mask - 1) {
        uint32_t index = b->triangle[__builtin_ctz(mask)];
        double t, u, v;
        int facing;
        if (!test_triangle(r, index, &t, &u, &v, &facing) || !(t > r->ray->tmin && t <= r->tmax)) continue;
        if (r->found && t == r->tmax && index > r->hit.part) continue;
        r->hit = (Hit){.t = t, .u = u, .v = v, .part = index};
        r->found = nearer = true;
        r->tmax = t;
    }
    return nearer;
}

static inline bool any_in_block(MeshRay *r, uint32_t block, uint32_t count, float tmax)
{
    const MeshBlock *b = &r->mesh->block[block];
    for (uint32_t mask = filter_block(b, &r->filter, tmax, false, count); mask; mask &= mask - 1) {
        double t, u, v;
        int facing;
        if (test_triangle(r, b->triangle[__builtin_ctz(mask)], &t, &u, &v, &facing) && t > r->ray->tmin && t <= r->tmax)
            return true;
    }
    return false;
}

/* The part that a triangle belongs to: the last one that doesn't begin after it. */
static inline uint32_t part_of(const MeshPrim *mesh, uint32_t triangle)
{
    uint32_t low = 0, high = mesh->source_count;
    while (high - low > 1) {
        uint32_t mid = low + (high - low) / 2;
        if (mesh->source[mid].first <= triangle)
            low = mid;
        else
            high = mid;
    }
    return low;
}

/* The data of a primitive that is a mesh; NULL for any other. */
const MeshPrim *mesh_prim_data(const Prim *prim);

#endif
