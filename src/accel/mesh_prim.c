#include "accel/mesh_prim.h"

#include <stdlib.h>

#include "accel/mesh_data.h"

typedef struct {
    SlabRay slab;
    float tmax_slab;
    MeshRay confirm;
} Walk;

static void walk_init(Walk *w, const MeshPrim *mesh, const Ray *ray)
{
    slab_ray_init(&w->slab, ray);
    w->tmax_slab = slab_t_up(&w->slab, ray->tmax);
    double scale = w->slab.scale;
    FilterRay filter = {{(float)ray->o.x, (float)ray->o.y, (float)ray->o.z},
                        {(float)(ray->d.x * scale), (float)(ray->d.y * scale), (float)(ray->d.z * scale)},
                        slab_up((float)vec3_max(vec3_abs(ray->o))) + mesh->reach};
    mesh_ray_init(&w->confirm, mesh, ray, filter);
}

static bool nearest_leaf(void *context, uint32_t block, uint32_t count)
{
    Walk *w = context;
    if (nearer_in_block(&w->confirm, block, count, w->tmax_slab)) w->tmax_slab = slab_t_up(&w->slab, w->confirm.tmax);
    return true;
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
    hit->leaf = part_of(mesh, hit->part);
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
    const MeshBlock *b = &mesh->block[block];
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
    Box box = box_empty(), whole = affine_box(map, mesh->bounds);
    for (uint32_t i = 0; i < data->position_count; i++) {
        Vec3 p = affine_point(map, data->position[i]);
        box.lo = vec3_least(box.lo, p);
        box.hi = vec3_most(box.hi, p);
    }
    /* No vertex rounds worse than the corner farthest out; the sum below rounds once more. */
    Vec3 lo = vec3_abs(mesh->bounds.lo), hi = vec3_abs(mesh->bounds.hi), zero = {0, 0, 0};
    Vec3 err = vec3_scale(affine_point_error(map, vec3_most(lo, hi), zero), 2);
    box.lo = vec3_sub(box.lo, err);
    box.hi = vec3_add(box.hi, err);
    return box_overlap(box, whole);
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
    Vec3 size = vec3_most(vec3_abs(*a), vec3_most(vec3_abs(*b), vec3_abs(*c)));
    double extent = vec3_max(size);
    s->p_err = vec3_scale(vec3_add(size, vec3_make(extent, extent, extent)), GAMMA(16));
    s->n = triangle_normal(a, b, c);
    const MeshPart *source = &mesh->source[hit->leaf];
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

#define MESH_OPS                                                                                                     \
    .name = "mesh", .bounds = mesh_prim_bounds, .bounds_in = mesh_prim_bounds_in, .intersect = mesh_intersect,       \
    .occluded = mesh_occluded, .surface = mesh_surface, .destroy = mesh_prim_destroy

static const PrimOps open_ops = {MESH_OPS};
static const PrimOps closed_ops = {MESH_OPS, .closed = true, .segments = mesh_segments};

static void fill_block(const MeshPrim *mesh, MeshBlock *b, const uint32_t *item, uint32_t count)
{
    *b = (MeshBlock){.edge = 0};
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
    mesh->block_count = leaves;
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

const MeshPrim *mesh_prim_data(const Prim *prim)
{
    return prim->ops == &open_ops || prim->ops == &closed_ops ? (const MeshPrim *)prim : NULL;
}

uint64_t mesh_prim_bytes(const Prim *prim)
{
    const MeshPrim *mesh = mesh_prim_data(prim);
    if (!mesh) return 0;
    return (uint64_t)mesh->bvh.node_count * sizeof *mesh->bvh.node + (uint64_t)mesh->block_count * sizeof *mesh->block;
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
    MeshPart *source = calloc(1, sizeof *source);
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
    *source = (MeshPart){mesh, 0, affine_identity()};
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
        p->source[i] = (MeshPart){mesh, p->triangle_count, baked[i].to_object};
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
