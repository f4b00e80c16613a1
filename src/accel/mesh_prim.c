/* The triangle test is that of Woop, Benthin, Wald, "Watertight ray/triangle intersection" (JCGT 2013), in double
 * precision: vertices are translated to the ray's origin and sheared so that the ray runs along an axis; three
 * 2D edge functions decide. Their signs are made exact (a product that cancels to zero is looked at again without
 * rounding), and a sign that is exactly zero is settled as if the ray were moved by an infinitesimal (e, e^2), as in
 * Edelsbrunner, Muecke, "Simulation of simplicity" (1990). A sheared vertex depends on the ray and the vertex only, so
 * a ray that meets a closed mesh at an edge or a vertex crosses exactly one of the triangles there on each way through:
 * no leaks, no double hits, and parity is exact, as CSG needs.
 *
 * Before it, four triangles at a time pass a filter in float, Moeller, Trumbore, "Fast, minimum storage ray/triangle
 * intersection" (1997), with margins for its rounding: it may let through what misses, never stop what hits. */
#include "accel/mesh_prim.h"

#include <stdlib.h>

#include "accel/packet.h"
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
} Block;

typedef struct { const Mesh *mesh; uint32_t first; Affine to_object; } Source;  /* first: of its triangles in the set */

typedef struct {
    Prim prim;
    const Vec3 *position;
    const uint32_t (*triangle)[3];
    uint32_t triangle_count;
    Bvh bvh;                 /* leaves refer to blocks */
    Block *block;
    Box bounds;
    float reach;             /* of the bounds, rounded up */
    Source *source;          /* in the order of their first triangle; one with the identity unless baked */
    uint32_t source_count;
    bool baked;
    Vec3 *own_position;      /* baked: what position and triangle point at */
    uint32_t (*own_triangle)[3];
} MeshPrim;

/* The ray along +z: x' = x - shear_x z and so on, axes permuted so that z is the direction's greatest component. */
typedef struct { int kx, ky, kz; double sx, sy, sz; Vec3 o; } Shear;

static Shear shear_of(const Ray *ray)
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
static int tie_sign(Sheared p, Sheared q)
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
} Confirm;

typedef struct {
    SlabRay slab;
    float tmax_slab;
    Confirm confirm;
} Walk;

static inline void confirm_init(Confirm *c, const MeshPrim *mesh, const Ray *ray, FilterRay filter)
{
    c->mesh = mesh;
    c->ray = ray;
    c->sheared = false;
    c->found = false;
    c->tmax = ray->tmax;
    c->filter = filter;
}

static inline void walk_init(Walk *w, const MeshPrim *mesh, const Ray *ray)
{
    slab_ray_init(&w->slab, ray);
    w->tmax_slab = slab_t_up(&w->slab, ray->tmax);
    double scale = w->slab.scale;
    FilterRay filter = {{(float)ray->o.x, (float)ray->o.y, (float)ray->o.z},
                        {(float)(ray->d.x * scale), (float)(ray->d.y * scale), (float)(ray->d.z * scale)},
                        slab_up((float)vec3_max(vec3_abs(ray->o))) + mesh->reach};
    confirm_init(&w->confirm, mesh, ray, filter);
}

/* The triangles of the block that the ray may hit with 0 <= t <= tmax, in the slabs' units (`line`: with any t), as a
 * mask. Comparisons say what misses, so that a NaN from an overflow lets the triangle through. */
static inline uint32_t filter_block(const Block *b, const FilterRay *r, float tmax, bool line, uint32_t count)
{
    const Float4 *v = (const Float4 *)b->v, *e1 = (const Float4 *)b->e1, *e2 = (const Float4 *)b->e2;
    Float4 tx = r->o[0] - v[0], ty = r->o[1] - v[1], tz = r->o[2] - v[2];
    Float4 px = r->d[1] * e2[2] - r->d[2] * e2[1];
    Float4 py = r->d[2] * e2[0] - r->d[0] * e2[2];
    Float4 pz = r->d[0] * e2[1] - r->d[1] * e2[0];
    Float4 qx = ty * e1[2] - tz * e1[1];
    Float4 qy = tz * e1[0] - tx * e1[2];
    Float4 qz = tx * e1[1] - ty * e1[0];
    Float4 det = e1[0] * px + e1[1] * py + e1[2] * pz;
    Int4 sign = (Int4)det & INT32_MIN;
    Float4 size = float4_abs(det);
    Float4 u = float4_flip(tx * px + ty * py + tz * pz, sign);
    Float4 w = float4_flip(r->d[0] * qx + r->d[1] * qy + r->d[2] * qz, sign);
    float margin = FILTER_MARGIN * r->reach * b->edge + FILTER_UNDERFLOW;
    float area_margin = FILTER_MARGIN * b->edge * b->edge + FILTER_UNDERFLOW;
    Int4 misses = (u < -margin) | (w < -margin) | (u + w > size + 2 * margin);
    if (!line) {
        Float4 t = float4_flip(e2[0] * qx + e2[1] * qy + e2[2] * qz, sign);
        float t_margin = area_margin * (r->reach + tmax);
        misses |= (t < -t_margin) | (t > size * tmax + t_margin);
    }
    misses &= size > area_margin;  /* seen edge on, its sign is not known */
    return ~int4_mask(misses) & ((1u << count) - 1);
}

static inline bool test_triangle(Confirm *c, uint32_t index, double *t, double *u, double *v, int *facing)
{
    if (!c->sheared) c->shear = shear_of(c->ray);
    c->sheared = true;
    const uint32_t *k = c->mesh->triangle[index];
    const Vec3 *p = c->mesh->position;
    return hit_triangle(&c->shear, &p[k[0]], &p[k[1]], &p[k[2]], t, u, v, facing);
}

/* Looks for a nearer hit among the triangles of a block; tmax is c->tmax, rounded up, in the slabs' units. */
static inline bool nearer_in_block(Confirm *c, uint32_t block, uint32_t count, float tmax)
{
    const Block *b = &c->mesh->block[block];
    bool nearer = false;
    for (uint32_t mask = filter_block(b, &c->filter, tmax, false, count); mask; mask &= mask - 1) {
        uint32_t index = b->triangle[__builtin_ctz(mask)];
        double t, u, v;
        int facing;
        if (!test_triangle(c, index, &t, &u, &v, &facing) || !(t > c->ray->tmin && t <= c->tmax)) continue;
        if (c->found && t == c->tmax && index > c->hit.part) continue;
        c->hit = (Hit){.t = t, .u = u, .v = v, .part = index};
        c->found = nearer = true;
        c->tmax = t;
    }
    return nearer;
}

static inline bool any_in_block(Confirm *c, uint32_t block, uint32_t count, float tmax)
{
    const Block *b = &c->mesh->block[block];
    for (uint32_t mask = filter_block(b, &c->filter, tmax, false, count); mask; mask &= mask - 1) {
        double t, u, v;
        int facing;
        if (test_triangle(c, b->triangle[__builtin_ctz(mask)], &t, &u, &v, &facing) && t > c->ray->tmin && t <= c->tmax)
            return true;
    }
    return false;
}

static bool nearest_leaf(void *context, uint32_t block, uint32_t count)
{
    Walk *w = context;
    if (nearer_in_block(&w->confirm, block, count, w->tmax_slab)) w->tmax_slab = slab_t_up(&w->slab, w->confirm.tmax);
    return true;
}

/* The source of a triangle: the last one that doesn't begin after it. */
static uint32_t source_of(const MeshPrim *mesh, uint32_t triangle)
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

static bool mesh_intersect(const Prim *prim, const Ray *ray, Hit *hit, Scratch *scratch)
{
    (void)scratch;
    const MeshPrim *mesh = (const MeshPrim *)prim;
    Walk w;
    walk_init(&w, mesh, ray);
    slab_walk(&mesh->bvh, &w.slab, fmaxf(0, slab_t_down(&w.slab, ray->tmin)), &w.tmax_slab, nearest_leaf, &w);
    if (!w.confirm.found) return false;
    *hit = w.confirm.hit;
    hit->leaf = source_of(mesh, hit->part);
    return true;
}

static bool any_leaf(void *context, uint32_t block, uint32_t count)
{
    Walk *w = context;
    w->confirm.found = any_in_block(&w->confirm, block, count, w->tmax_slab);
    return !w->confirm.found;
}

static bool mesh_occluded(const Prim *prim, const Ray *ray, Scratch *scratch)
{
    (void)scratch;
    const MeshPrim *mesh = (const MeshPrim *)prim;
    Walk w;
    walk_init(&w, mesh, ray);
    slab_walk(&mesh->bvh, &w.slab, fmaxf(0, slab_t_down(&w.slab, ray->tmin)), &w.tmax_slab, any_leaf, &w);
    return w.confirm.found;
}

/* ---- many rays ---- */

typedef struct {
    SlabPacket packet;
    Confirm confirm[PACKET];
    uint64_t alive;
} PacketWalk;

static bool nearest_leaf_many(void *context, uint32_t block, uint32_t count, uint64_t rays)
{
    PacketWalk *w = context;
    for (; rays; rays &= rays - 1) {
        uint32_t i = (uint32_t)__builtin_ctzll(rays);
        if (nearer_in_block(&w->confirm[i], block, count, w->packet.tmax[i]))
            packet_shorten(&w->packet, i, w->confirm[i].tmax);
    }
    return true;
}

static bool any_leaf_many(void *context, uint32_t block, uint32_t count, uint64_t rays)
{
    PacketWalk *w = context;
    bool more = false;
    for (; rays; rays &= rays - 1) {
        uint32_t i = (uint32_t)__builtin_ctzll(rays);
        if (any_in_block(&w->confirm[i], block, count, w->packet.tmax[i]))
            w->alive &= ~((uint64_t)1 << i);
        else
            more = true;
    }
    return more;
}

static void packet_walk_init(PacketWalk *w, const MeshPrim *mesh, const Ray *const *ray, uint32_t n)
{
    packet_init(&w->packet, ray, n);
    const SlabPacket *p = &w->packet;
    for (uint32_t i = 0; i < n; i++) {
        FilterRay filter = {{p->o[0][i], p->o[1][i], p->o[2][i]},
                            {p->d[0][i], p->d[1][i], p->d[2][i]},
                            p->reach[i] + mesh->reach};
        confirm_init(&w->confirm[i], mesh, ray[i], filter);
    }
    w->alive = packet_all(n);
}

static uint64_t mesh_intersect_many(const Prim *prim, const Ray *rays, uint32_t n, Hit *hit, Scratch *scratch)
{
    const MeshPrim *mesh = (const MeshPrim *)prim;
    PacketWalk w;
    uint64_t found = 0;
    for (uint64_t left = packet_all(n); left;) {
        const Ray *ray[PACKET];
        uint32_t index[PACKET], count = packet_gather(rays, &left, ray, index);
        if (count <= PACKET_FEW) {
            for (uint32_t i = 0; i < count; i++)
                if (mesh_intersect(prim, ray[i], &hit[index[i]], scratch)) found |= (uint64_t)1 << index[i];
            continue;
        }
        packet_walk_init(&w, mesh, ray, count);
        packet_walk(&mesh->bvh, &w.packet, &w.alive, nearest_leaf_many, &w);
        for (uint32_t i = 0; i < count; i++) {
            if (!w.confirm[i].found) continue;
            hit[index[i]] = w.confirm[i].hit;
            hit[index[i]].leaf = source_of(mesh, w.confirm[i].hit.part);
            found |= (uint64_t)1 << index[i];
        }
    }
    return found;
}

static uint64_t mesh_occluded_many(const Prim *prim, const Ray *rays, uint32_t n, Scratch *scratch)
{
    const MeshPrim *mesh = (const MeshPrim *)prim;
    PacketWalk w;
    uint64_t found = 0;
    for (uint64_t left = packet_all(n); left;) {
        const Ray *ray[PACKET];
        uint32_t index[PACKET], count = packet_gather(rays, &left, ray, index);
        if (count <= PACKET_FEW) {
            for (uint32_t i = 0; i < count; i++)
                if (mesh_occluded(prim, ray[i], scratch)) found |= (uint64_t)1 << index[i];
            continue;
        }
        packet_walk_init(&w, mesh, ray, count);
        packet_walk(&mesh->bvh, &w.packet, &w.alive, any_leaf_many, &w);
        for (uint32_t i = 0; i < count; i++)
            if (!(w.alive >> i & 1)) found |= (uint64_t)1 << index[i];
    }
    return found;
}

/* ---- the whole line ---- */

/* All crossings of a line, for CSG. `entering` by the triangle's orientation. */
typedef struct { Edge edge; bool entering; } Crossing;

typedef struct {
    Walk walk;
    Crossing *crossing;
    uint32_t count, capacity;
    Scratch *scratch;
} LineWalk;

static Vec3 triangle_normal(const Vec3 *a, const Vec3 *b, const Vec3 *c)
{
    return vec3_cross(vec3_sub(*b, *a), vec3_sub(*c, *a));
}

/* Bound on the error of t: the vertices relative to the origin carry one rounding, their shear two more, and the weights
 * move the point within the plane; so the point is off the plane by a few roundings of the coordinates that took part,
 * and of the origin's distance, which the normal's share of the direction turns into an error of t. */
static double t_bound(const Ray *ray, const Vec3 *a, const Vec3 *b, const Vec3 *c, Vec3 n)
{
    Vec3 o = ray->o;
    Vec3 reach = vec3_add(vec3_add(vec3_abs(vec3_sub(*a, o)), vec3_abs(vec3_sub(*b, o))), vec3_abs(vec3_sub(*c, o)));
    double r = vec3_max(reach);
    double across = fabs(vec3_dot(n, ray->d));
    double off = GAMMA(16) * r * (fabs(n.x) + fabs(n.y) + fabs(n.z));
    return across > 0 ? off / across : INFINITY;
}

static bool line_leaf(void *context, uint32_t block, uint32_t count)
{
    LineWalk *w = context;
    const MeshPrim *mesh = w->walk.confirm.mesh;
    const Block *b = &mesh->block[block];
    for (uint32_t mask = filter_block(b, &w->walk.confirm.filter, INFINITY, true, count); mask; mask &= mask - 1) {
        uint32_t index = b->triangle[__builtin_ctz(mask)];
        const uint32_t *k = mesh->triangle[index];
        const Vec3 *p = mesh->position;
        double t, u, v;
        int facing;
        if (!test_triangle(&w->walk.confirm, index, &t, &u, &v, &facing)) continue;
        if (w->count == w->capacity) {
            uint32_t capacity = w->capacity ? 2 * w->capacity : 16;
            Crossing *c = arena_alloc(w->scratch->arena, capacity * sizeof *c);
            if (!c) {
                w->scratch->out_of_memory = true;
                return false;
            }
            if (w->count) memcpy(c, w->crossing, w->count * sizeof *c);
            w->crossing = c;
            w->capacity = capacity;
        }
        Vec3 n = triangle_normal(&p[k[0]], &p[k[1]], &p[k[2]]);
        double err = t_bound(w->walk.confirm.ray, &p[k[0]], &p[k[1]], &p[k[2]], n);
        bool entering = (w->walk.confirm.shear.sz > 0) == (facing > 0);
        w->crossing[w->count++] = (Crossing){{.t = t, .t_err = err, .n = n, .u = u, .v = v, .part = index}, entering};
    }
    return true;
}

static int by_t(const void *a, const void *b)
{
    const Crossing *p = a, *q = b;
    if (p->edge.t != q->edge.t) return p->edge.t < q->edge.t ? -1 : 1;
    if (p->entering != q->entering) return p->entering ? -1 : 1;
    return (p->edge.part > q->edge.part) - (p->edge.part < q->edge.part);
}

/* Inside is where the winding number isn't zero, so parts that overlap are one solid and a mesh that is inside out is
 * a solid too. */
static bool mesh_segments(const Prim *prim, const Ray *ray, SegList *list)
{
    const MeshPrim *mesh = (const MeshPrim *)prim;
    /* The walk goes forward only: it starts far enough back, at the box's farthest point from the origin. */
    double reach = 0, step = vec3_max(vec3_abs(ray->d));
    for (int a = 0; a < 3; a++) {
        double o = vec3_get(ray->o, a);
        reach = fmax(reach, fmax(fabs(o - vec3_get(mesh->bounds.lo, a)), fabs(o - vec3_get(mesh->bounds.hi, a))));
    }
    double back = 4 * reach / step;
    Ray whole = *ray;
    whole.o = vec3_at(ray->o, -back, ray->d);
    LineWalk w = {.scratch = list->scratch};
    walk_init(&w.walk, mesh, ray);
    slab_ray_init(&w.walk.slab, &whole);
    /* whole.o is off the line by a rounding of its coordinates, about that of its float form; the boxes allow for more */
    for (int a = 0; a < 3; a++) {
        float slack = (float)(fabs(vec3_get(whole.o, a)) + reach) * 0x1p-22f;
        w.walk.slab.o_near[a] += w.walk.slab.negative[a] ? -slack : slack;
        w.walk.slab.o_far[a] += w.walk.slab.negative[a] ? slack : -slack;
    }
    w.walk.tmax_slab = INFINITY;
    slab_walk(&mesh->bvh, &w.walk.slab, 0, &w.walk.tmax_slab, line_leaf, &w);
    if (list->scratch->out_of_memory) return false;
    if (w.count) qsort(w.crossing, w.count, sizeof *w.crossing, by_t);
    int depth = 0;
    const Edge *in = NULL;
    for (uint32_t i = 0; i < w.count; i++) {
        int before = depth;
        depth += w.crossing[i].entering ? 1 : -1;
        if (before == 0) in = &w.crossing[i].edge;
        if (depth == 0 && !seg_list_add(list, *in, w.crossing[i].edge)) return false;
    }
    return true;
}

static Box mesh_prim_bounds(const Prim *prim) { return ((const MeshPrim *)prim)->bounds; }

/* Vertex by vertex for the small meshes that scenes repeat many times, leaves and tiles. */
static Box mesh_prim_bounds_in(const Prim *prim, const Affine *map)
{
    const MeshPrim *mesh = (const MeshPrim *)prim;
    const Mesh *data = mesh->source[0].mesh;
    if (mesh->baked || data->position_count > SMALL_MESH) return affine_box(map, mesh->bounds);
    Box box = box_empty();
    Vec3 zero = {0, 0, 0};
    for (uint32_t i = 0; i < data->position_count; i++)
        box = box_union(box, affine_box_about(map, data->position[i], zero));
    return box_overlap(box, affine_box(map, mesh->bounds));
}

static void texture_uv(const Mesh *mesh, uint32_t triangle, const double w[3], double *u, double *v)
{
    const uint32_t *k = mesh->triangle_uv ? mesh->triangle_uv[triangle] : NULL;
    if (!k || k[0] == UINT32_MAX || k[1] == UINT32_MAX || k[2] == UINT32_MAX) {
        *u = w[1];
        *v = w[2];
        return;
    }
    *u = *v = 0;
    for (int i = 0; i < 3; i++) {
        *u += w[i] * (double)mesh->uv[k[i]][0];
        *v += w[i] * (double)mesh->uv[k[i]][1];
    }
}

/* The interpolated normal in the mesh's own space; false if there is none. */
static bool interpolated_normal(const Mesh *mesh, uint32_t triangle, const double w[3], Vec3 *n)
{
    const uint32_t *k = mesh->triangle_normal ? mesh->triangle_normal[triangle] : NULL;
    if (!k || k[0] == UINT32_MAX || k[1] == UINT32_MAX || k[2] == UINT32_MAX) return false;
    Vec3 sum = {0, 0, 0};
    for (int i = 0; i < 3; i++) {
        const float *f = mesh->normal[k[i]];
        sum = vec3_at(sum, w[i], vec3_make((double)f[0], (double)f[1], (double)f[2]));
    }
    *n = sum;
    return vec3_max(vec3_abs(sum)) > 0;
}

static void mesh_surface(const Prim *prim, const Ray *ray, const Hit *hit, Surface *s)
{
    (void)ray;
    const MeshPrim *mesh = (const MeshPrim *)prim;
    const uint32_t *k = mesh->triangle[hit->part];
    const Vec3 *a = &mesh->position[k[0]], *b = &mesh->position[k[1]], *c = &mesh->position[k[2]];
    const double w[3] = {1 - hit->u - hit->v, hit->u, hit->v};
    s->p = vec3_add(vec3_add(vec3_scale(*a, w[0]), vec3_scale(*b, w[1])), vec3_scale(*c, w[2]));
    /* Weights, products and sums take 7 roundings (pbrt, 3rd ed., 3.9.4). A ray that leaves from here computes its t to
     * this triangle from differences of the vertices with about as many again, of twice the size; both are covered, or
     * it could meet the triangle at once. */
    Vec3 size = vec3_make(fmax(fabs(a->x), fmax(fabs(b->x), fabs(c->x))), fmax(fabs(a->y), fmax(fabs(b->y), fabs(c->y))),
                          fmax(fabs(a->z), fmax(fabs(b->z), fabs(c->z))));
    double extent = vec3_max(size);
    s->p_err = vec3_scale(vec3_add(size, vec3_make(extent, extent, extent)), GAMMA(16));
    s->n = triangle_normal(a, b, c);
    const Source *source = &mesh->source[hit->leaf];
    uint32_t triangle = hit->part - source->first;
    texture_uv(source->mesh, triangle, w, &s->u, &s->v);
    if (!interpolated_normal(source->mesh, triangle, w, &s->ns))
        s->ns = s->n;
    else if (mesh->baked)
        s->ns = affine_normal(&source->to_object, s->ns);
}

static void mesh_prim_destroy(Prim *prim)
{
    MeshPrim *mesh = (MeshPrim *)prim;
    bvh_free(&mesh->bvh);
    free(mesh->block);
    free(mesh->source);
    free(mesh->own_position);
    free(mesh->own_triangle);
    free(mesh);
}

static const PrimOps open_ops = {
    .name = "mesh",
    .bounds = mesh_prim_bounds,
    .bounds_in = mesh_prim_bounds_in,
    .intersect = mesh_intersect,
    .occluded = mesh_occluded,
    .intersect_many = mesh_intersect_many,
    .occluded_many = mesh_occluded_many,
    .surface = mesh_surface,
    .destroy = mesh_prim_destroy,
};

static const PrimOps closed_ops = {
    .name = "mesh",
    .closed = true,
    .bounds = mesh_prim_bounds,
    .bounds_in = mesh_prim_bounds_in,
    .intersect = mesh_intersect,
    .occluded = mesh_occluded,
    .intersect_many = mesh_intersect_many,
    .occluded_many = mesh_occluded_many,
    .segments = mesh_segments,
    .surface = mesh_surface,
    .destroy = mesh_prim_destroy,
};

static void fill_block(const MeshPrim *mesh, Block *b, const uint32_t *item, uint32_t count)
{
    *b = (Block){.edge = 0};
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t *k = mesh->triangle[item[i]];
        Vec3 v = mesh->position[k[0]], e1 = vec3_sub(mesh->position[k[1]], v), e2 = vec3_sub(mesh->position[k[2]], v);
        for (int a = 0; a < 3; a++) {
            b->v[a][i] = (float)vec3_get(v, a);
            b->e1[a][i] = (float)vec3_get(e1, a);
            b->e2[a][i] = (float)vec3_get(e2, a);
        }
        float longest = (float)fmax(vec3_max(vec3_abs(e1)), vec3_max(vec3_abs(e2)));
        b->edge = fmaxf(b->edge, longest * (1 + 0x1p-23f));
        b->triangle[i] = item[i];
    }
}

/* One block for each leaf, which then refers to it in place of its items. */
static bool make_blocks(MeshPrim *mesh)
{
    Bvh *bvh = &mesh->bvh;
    uint32_t leaves = 0;
    for (uint32_t i = 0; i < bvh->node_count; i++)
        for (int k = 0; k < bvh->node[i].used; k++) leaves += bvh->node[i].count[k] > 0;
    mesh->block = aligned_alloc(64, (leaves + (size_t)1) * sizeof *mesh->block);
    if (!mesh->block) return false;
    uint32_t n = 0;
    for (uint32_t i = 0; i < bvh->node_count; i++)
        for (int k = 0; k < bvh->node[i].used; k++) {
            BvhNode *node = &bvh->node[i];
            if (node->count[k] == 0) continue;
            fill_block(mesh, &mesh->block[n], bvh->order + node->child[k], node->count[k]);
            node->child[k] = n++;
        }
    free(bvh->order);
    bvh->order = NULL;
    return true;
}

static bool build(MeshPrim *mesh, Err *err)
{
    BoxF *box = malloc((mesh->triangle_count + (size_t)1) * sizeof *box);
    if (!box) return err_memory(err, "a mesh");
    mesh->bounds = box_empty();
    for (uint32_t i = 0; i < mesh->triangle_count; i++) {
        Box b = box_empty();
        for (int j = 0; j < 3; j++) b = box_add_point(b, mesh->position[mesh->triangle[i][j]]);
        box[i] = boxf_from_box(b);
        mesh->bounds = box_union(mesh->bounds, b);
    }
    mesh->reach = slab_up((float)box_reach(mesh->bounds));
    bool ok = bvh_build(&mesh->bvh, box, mesh->triangle_count, BLOCK, TRIANGLE_COST, err);
    free(box);
    return ok && (make_blocks(mesh) || err_memory(err, "a mesh"));
}

Prim *mesh_prim_create(const Mesh *mesh, bool closed, Err *err)
{
    MeshPrim *p = calloc(1, sizeof *p);
    Source *source = calloc(1, sizeof *source);
    if (!p || !source) {
        free(p);
        free(source);
        err_memory(err, "a mesh");
        return NULL;
    }
    p->prim.ops = closed ? &closed_ops : &open_ops;
    p->position = mesh->position;
    p->triangle = (const uint32_t (*)[3])mesh->triangle;
    p->triangle_count = mesh->triangle_count;
    *source = (Source){mesh, 0, affine_identity()};
    p->source = source;
    p->source_count = 1;
    if (!build(p, err)) {
        mesh_prim_destroy(&p->prim);
        return NULL;
    }
    return &p->prim;
}

Prim *mesh_prim_bake(const BakedMesh *baked, uint32_t count, Err *err)
{
    size_t positions = 0, triangles = 0;
    for (uint32_t i = 0; i < count; i++) {
        positions += baked[i].mesh->position_count;
        triangles += baked[i].mesh->triangle_count;
    }
    MeshPrim *p = calloc(1, sizeof *p);
    if (!p) goto fail;
    p->prim.ops = &open_ops;
    p->baked = true;
    p->source = calloc(count + (size_t)1, sizeof *p->source);
    p->own_position = malloc((positions + 1) * sizeof *p->own_position);
    p->own_triangle = malloc((triangles + 1) * sizeof *p->own_triangle);
    if (!p->source || !p->own_position || !p->own_triangle || positions > UINT32_MAX || triangles > UINT32_MAX) goto fail;
    p->position = p->own_position;
    p->triangle = (const uint32_t (*)[3])p->own_triangle;
    p->source_count = count;
    uint32_t position_count = 0;
    for (uint32_t i = 0; i < count; i++) {
        const Mesh *mesh = baked[i].mesh;
        p->source[i] = (Source){mesh, p->triangle_count, baked[i].to_object};
        for (uint32_t j = 0; j < mesh->triangle_count; j++)
            for (int k = 0; k < 3; k++)
                p->own_triangle[p->triangle_count + j][k] = position_count + mesh->triangle[j][k];
        for (uint32_t j = 0; j < mesh->position_count; j++)
            p->own_position[position_count + j] = affine_point(&baked[i].to_world, mesh->position[j]);
        p->triangle_count += mesh->triangle_count;
        position_count += mesh->position_count;
    }
    if (!build(p, err)) {
        mesh_prim_destroy(&p->prim);
        return NULL;
    }
    return &p->prim;

fail:
    if (p) mesh_prim_destroy(&p->prim);
    err_memory(err, "the baked meshes");
    return NULL;
}
