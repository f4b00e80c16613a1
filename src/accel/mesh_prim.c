#include "accel/mesh_prim.h"

#include <stdlib.h>

#include "accel/mesh_data.h"
#include "accel/mesh_split.h"
#include "common/memory.h"
#include "common/parallel.h"

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
    mesh_ray_init(&w->confirm, mesh, ray, filter, ray->tmax);
}

static bool nearest_leaf(void *context, uint32_t block)
{
    Walk *w = context;
    if (nearer_in_block(&w->confirm, block, w->tmax_slab)) w->tmax_slab = slab_t_up(&w->slab, w->confirm.end.hi);
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
    mesh_ray_settle(&w.confirm);
    *hit = w.confirm.hit;
    hit->leaf = part_of(mesh, hit->part);
    return true;
}

static bool any_leaf(void *context, uint32_t block)
{
    Walk *w = context;
    w->confirm.found = any_in_block(&w->confirm, block, w->tmax_slab);
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
    bool along;
    Scratch *scratch;
} LineWalk;

static bool line_leaf(void *context, uint32_t block)
{
    LineWalk *w = context;
    const MeshPrim *mesh = w->walk.confirm.mesh;
    const MeshBlock *b = &mesh->block[block];
    for (uint32_t mask = filter_block(b, &w->walk.confirm.filter, INFINITY, true); mask; mask &= mask - 1) {
        uint32_t index = b->triangle[__builtin_ctz(mask)];
        const Shear *shear = &w->walk.confirm.shear;
        const Vec3 *p[3];
        TriangleCut cut;
        if (!cut_of_mesh(&w->walk.confirm, index, p, &cut)) continue;
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
        Vec3 size;
        Edge edge = {.n = triangle_normal(p[0], p[1], p[2], &size), .u = cut.u, .v = cut.v, .part = index};
        edge.t = triangle_t(shear, p[0], p[1], p[2], &edge.t_err);
        w->crossing[w->count++] = (Crossing){edge, triangle_entered(shear, &cut)};
    }
    return true;
}

/* Notes whether the line may lie in one of a block's triangles. */
static bool line_along_leaf(void *context, uint32_t block)
{
    LineWalk *w = context;
    const MeshPrim *mesh = w->walk.confirm.mesh;
    const MeshBlock *b = &mesh->block[block];
    const Ray *ray = w->walk.confirm.ray;
    double near = 2 * ALONG * ((double)mesh->reach + vec3_max(vec3_abs(ray->o))), length = vec3_length(ray->d);
    for (uint32_t mask = filter_block(b, &w->walk.confirm.filter, INFINITY, true); mask; mask &= mask - 1) {
        const uint32_t *k = mesh->triangle[b->triangle[__builtin_ctz(mask)]];
        const Vec3 *p = mesh->position;
        Vec3 sizes, n = triangle_normal(&p[k[0]], &p[k[1]], &p[k[2]], &sizes);
        double size = vec3_length(n);
        w->along = w->along || (fabs(vec3_dot(n, ray->d)) <= ALONG * size * length &&
                                fabs(vec3_dot(n, vec3_sub(ray->o, p[k[0]]))) <= near * size);
    }
    return line_leaf(context, block);
}

static int by_t(const void *a, const void *b)
{
    const Crossing *p = a, *q = b;
    if (p->edge.t != q->edge.t) return p->edge.t < q->edge.t ? -1 : 1;
    if (p->entering != q->entering) return p->entering ? -1 : 1;
    return (p->edge.part > q->edge.part) - (p->edge.part < q->edge.part);
}

/* The crossings in order, a triangle that stands in several leaves once. */
static uint32_t sort_crossings(Crossing *c, uint32_t count)
{
    uint32_t kept = 0;
    if (count) qsort(c, count, sizeof *c, by_t);
    for (uint32_t i = 0; i < count; i++)
        if (kept == 0 || by_t(&c[kept - 1], &c[i]) != 0) c[kept++] = c[i];
    return kept;
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
    slab_walk(&mesh->bvh, &w.walk.slab, 0, &w.walk.tmax_slab, line_along_leaf, &w);
    list->along |= w.along;
    if (list->scratch->out_of_memory) return false;
    w.count = sort_crossings(w.crossing, w.count);
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

static void mesh_surface(const Prim *prim, const Ray *ray, const Hit *hit, bool uv, Surface *s)
{
    (void)ray;
    const MeshPrim *mesh = (const MeshPrim *)prim;
    const uint32_t *k = mesh->triangle[hit->part];
    const Vec3 *a = &mesh->position[k[0]], *b = &mesh->position[k[1]], *c = &mesh->position[k[2]];
    const double w[3] = {1 - hit->u - hit->v, hit->u, hit->v};
    Vec3 e = vec3_sub(*b, *a), f = vec3_sub(*c, *a), to_b = vec3_scale(e, w[1]), to_c = vec3_scale(f, w[2]);
    s->p = vec3_add(*a, vec3_add(to_b, to_c));
    Vec3 sizes, n = s->n = triangle_normal(a, b, c, &sizes);
    /* Whatever the weights, only the roundings lead off the triangle's plane: of the differences, products and their sum,
     * three of at most the longer edge's size, and of the last sum, one; that of a leaving ray's origin is another. With
     * 18 roundings of the sums that make n . (a - p), twice what triangle_behind allows for, it tells the side of the plane
     * for such a ray in double; not at any price. */
    double edge = larger(vec3_max(vec3_abs(e)), vec3_max(vec3_abs(f))), flat = fabs(n.x) + fabs(n.y) + fabs(n.z);
    double sums = vec3_dot(sizes, vec3_add(vec3_abs(to_b), vec3_abs(to_c))) / flat;
    double off = GAMMA(5) * edge + GAMMA(18) * smaller(sums, edge);
    s->p_err = vec3_at(vec3_make(off, off, off), GAMMA(3), vec3_abs(s->p));
    s->plane = true;
    const MeshPart *source = &mesh->source[hit->leaf];
    uint32_t triangle = hit->part - source->first;
    s->u = s->v = 0;
    if (uv) texture_uv(source->mesh, triangle, w, &s->u, &s->v);
    if (!interpolated_normal(source->mesh, triangle, w, &s->ns))
        s->ns = s->n;
    else if (mesh->baked)
        s->ns = affine_normal(&source->to_object, s->ns);
}

static const Affine *mesh_own(const Prim *prim, const Hit *hit, Vec3 *p, Vec3 *n)
{
    const MeshPrim *mesh = (const MeshPrim *)prim;
    const MeshPart *source = &mesh->source[hit->leaf];
    uint32_t triangle = hit->part - source->first;
    const uint32_t *k = source->mesh->triangle[triangle];
    const Vec3 *a = &source->mesh->position[k[0]], *b = &source->mesh->position[k[1]], *c = &source->mesh->position[k[2]];
    const double w[3] = {1 - hit->u - hit->v, hit->u, hit->v};
    if (p) *p = vec3_add(*a, vec3_add(vec3_scale(vec3_sub(*b, *a), w[1]), vec3_scale(vec3_sub(*c, *a), w[2])));
    Vec3 size;
    if (n && !interpolated_normal(source->mesh, triangle, w, n)) *n = triangle_normal(a, b, c, &size);
    return &source->to_object;
}

static void mesh_prim_destroy(Prim *prim)
{
    MeshPrim *mesh = (MeshPrim *)prim;
    bvh_free(&mesh->bvh);
    free(mesh->block);
    free(mesh->source);
    free(mesh->part_first);
    free(mesh->part_of_chunk);
    free(mesh->own_position);
    free(mesh->own_triangle);
    free(mesh);
}

#define MESH_OPS                                                                                                     \
    .name = "mesh", .bounds = mesh_prim_bounds, .bounds_in = mesh_prim_bounds_in, .intersect = mesh_intersect,       \
    .occluded = mesh_occluded, .surface = mesh_surface, .own = mesh_own, .destroy = mesh_prim_destroy

static const PrimOps open_ops = {MESH_OPS};
static const PrimOps closed_ops = {MESH_OPS, .closed = true, .segments = mesh_segments};

/* ---- making one ---- */

static void fill_block(const MeshPrim *mesh, MeshBlock *b, const uint32_t *item, uint32_t count)
{
    *b = (MeshBlock){.count = count};
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t *k = mesh->triangle[item[i]];
        Vec3 v = mesh->position[k[0]], e1 = vec3_sub(mesh->position[k[1]], v), e2 = vec3_sub(mesh->position[k[2]], v);
        for (int a = 0; a < 3; a++) {
            b->v[a][i] = (float)vec3_get(v, a);
            b->e1[a][i] = (float)vec3_get(e1, a);
            b->e2[a][i] = (float)vec3_get(e2, a);
        }
        float longest = (float)fmax(vec3_max(vec3_abs(e1)), vec3_max(vec3_abs(e2)));
        b->edge[i] = longest * (1 + 0x1p-23f);
        b->triangle[i] = item[i];
    }
}

/* What is found in a chunk of triangles or of nodes, and what the chunks before it hold. */
typedef struct { Box bounds; uint32_t first_block; } ChunkResult;

typedef struct {
    MeshPrim *mesh;
    BvhRef *ref;
    ChunkResult *chunk;
} MeshBuild;

/* A triangle that was cut may have come to a leaf with two of its boxes. Returns how many items are left. */
static uint32_t drop_repeated(uint32_t *item, uint32_t count)
{
    uint32_t kept = 0;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t k = 0;
        while (k < kept && item[k] != item[i]) k++;
        if (k == kept) item[kept++] = item[i];
    }
    return kept;
}

static uint32_t leaves_of(const BvhNode *node)
{
    uint32_t n = 0;
    for (int k = 0; k < node->used; k++) n += node->count[k] > 0;
    return n;
}

static void count_turn(void *context, uint32_t chunk, uint32_t worker)
{
    (void)worker;
    MeshBuild *m = context;
    const Bvh *bvh = &m->mesh->bvh;
    uint32_t leaves = 0;
    for (uint32_t i = chunk * PARALLEL_CHUNK; i < parallel_chunk_end(chunk, bvh->node_count); i++)
        leaves += leaves_of(&bvh->node[i]);
    m->chunk[chunk].first_block = leaves;
}

static void blocks_turn(void *context, uint32_t chunk, uint32_t worker)
{
    (void)worker;
    MeshBuild *m = context;
    Bvh *bvh = &m->mesh->bvh;
    uint32_t n = m->chunk[chunk].first_block;
    for (uint32_t i = chunk * PARALLEL_CHUNK; i < parallel_chunk_end(chunk, bvh->node_count); i++) {
        BvhNode *node = &bvh->node[i];
        for (int k = 0; k < node->used; k++) {
            if (!(node->child[k] & BVH_LEAF)) continue;
            uint32_t *item = bvh->order + (node->child[k] & ~BVH_LEAF);
            node->count[k] = (uint8_t)drop_repeated(item, node->count[k]);
            fill_block(m->mesh, &m->mesh->block[n], item, node->count[k]);
            node->child[k] = BVH_LEAF | n++;
        }
    }
}

/* One block for each leaf, which then refers to it in place of its items. */
static bool make_blocks(MeshBuild *m, uint32_t threads)
{
    MeshPrim *mesh = m->mesh;
    uint32_t chunks = parallel_chunks(mesh->bvh.node_count), leaves = 0;
    parallel_for(threads, chunks, count_turn, m);
    for (uint32_t i = 0; i < chunks; i++) {
        uint32_t here = m->chunk[i].first_block;
        m->chunk[i].first_block = leaves;
        leaves += here;
    }
    mesh->block = memory_array(leaves + (size_t)1, sizeof *mesh->block);
    if (!mesh->block) return false;
    mesh->block_count = leaves;
    parallel_for(threads, chunks, blocks_turn, m);
    free(mesh->bvh.order);
    mesh->bvh.order = NULL;
    if (mesh->bvh.node_count) bvh_set_root(&mesh->bvh);
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

static void refs_turn(void *context, uint32_t chunk, uint32_t worker)
{
    (void)worker;
    MeshBuild *m = context;
    const MeshPrim *mesh = m->mesh;
    Box bounds = box_empty();
    for (uint32_t i = chunk * PARALLEL_CHUNK; i < parallel_chunk_end(chunk, mesh->triangle_count); i++) {
        Box b = box_empty();
        for (int j = 0; j < 3; j++) b = box_add_point(b, mesh->position[mesh->triangle[i][j]]);
        m->ref[i] = bvh_ref(boxf_from_box(b), i);
        bounds = box_union(bounds, b);
    }
    m->chunk[chunk].bounds = bounds;
}

/* The triangles' boxes, and the mesh's own. */
static bool make_refs(MeshBuild *m, const MeshSettings *settings, uint32_t *count)
{
    MeshPrim *mesh = m->mesh;
    uint32_t chunks = parallel_chunks(mesh->triangle_count);
    *count = mesh->triangle_count;
    m->ref = memory_array(*count + (size_t)1, sizeof *m->ref);
    if (!m->ref) return false;
    parallel_for(settings->threads, chunks, refs_turn, m);
    mesh->bounds = box_empty();
    for (uint32_t i = 0; i < chunks; i++) mesh->bounds = box_union(mesh->bounds, m->chunk[i].bounds);
    mesh->reach = slab_up((float)box_reach(mesh->bounds));
    if (!settings->split) return true;
    SplitMesh split = {mesh->position, mesh->triangle, mesh->triangle_count, mesh->bounds};
    return mesh_split(&split, settings->threads, &m->ref, count);
}

static bool build(MeshPrim *mesh, const MeshSettings *settings, Err *err)
{
    static const MeshSettings plain = {.threads = 1};
    if (!settings) settings = &plain;
    MeshBuild m = {.mesh = mesh};
    uint32_t count;
    /* a node holds at least a triangle, so there are no more chunks of nodes than of references */
    m.chunk = malloc((parallel_chunks(mesh->triangle_count) * (size_t)2 + 1) * sizeof *m.chunk);
    bool ok = (m.chunk && make_refs(&m, settings, &count)) || err_memory(err, "a mesh");
    if (ok) {
        BvhSettings bvh = {.max_leaf = BLOCK, .block = BLOCK, .block_cost = BLOCK * TRIANGLE_COST,
                           .threads = settings->threads};
        ok = bvh_build(&mesh->bvh, m.ref, count, &bvh, err);
    }
    free(m.ref);
    ok = ok && (make_blocks(&m, settings->threads) || err_memory(err, "a mesh"));
    free(m.chunk);
    return ok;
}

Prim *mesh_prim_create(const Mesh *mesh, bool closed, const MeshSettings *settings, Err *err)
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
    if (!build(p, settings, err)) {
        mesh_prim_destroy(&p->prim);
        return NULL;
    }
    return &p->prim;
}

/* Finds parts by their triangles. */
static bool index_parts(MeshPrim *p)
{
    p->part_first = malloc((p->source_count + (size_t)1) * sizeof *p->part_first);
    p->part_of_chunk = malloc((p->triangle_count / PART_CHUNK + (size_t)1) * sizeof *p->part_of_chunk);
    if (!p->part_first || !p->part_of_chunk) return false;
    for (uint32_t i = 0; i < p->source_count; i++) p->part_first[i] = p->source[i].first;
    p->part_first[p->source_count] = UINT32_MAX;
    uint32_t part = 0;
    for (uint32_t i = 0; i <= p->triangle_count / PART_CHUNK; i++) {
        while (p->part_first[part + 1] <= i * PART_CHUNK) part++;
        p->part_of_chunk[i] = part;
    }
    return true;
}

/* The triangles of all parts by the positions of all. One mesh's own do for it alone. */
static bool join_triangles(MeshPrim *p, const BakedMesh *baked)
{
    p->triangle = (const uint32_t (*)[3])baked[0].mesh->triangle;
    if (p->source_count == 1) return true;
    p->own_triangle = malloc((p->triangle_count + (size_t)1) * sizeof *p->own_triangle);
    if (!p->own_triangle) return false;
    p->triangle = (const uint32_t (*)[3])p->own_triangle;
    uint32_t positions = 0, triangles = 0;
    for (uint32_t i = 0; i < p->source_count; i++) {
        const Mesh *mesh = baked[i].mesh;
        for (uint32_t j = 0; j < mesh->triangle_count; j++, triangles++)
            for (int k = 0; k < 3; k++) p->own_triangle[triangles][k] = positions + mesh->triangle[j][k];
        positions += mesh->position_count;
    }
    return true;
}

Prim *mesh_prim_bake(const BakedMesh *baked, uint32_t count, const MeshSettings *settings, Err *err)
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
    p->source = calloc(count, sizeof *p->source);
    p->own_position = malloc((positions + 1) * sizeof *p->own_position);
    if (!p->source || !p->own_position || positions > UINT32_MAX || triangles > UINT32_MAX) goto fail;
    p->position = p->own_position;
    p->source_count = count;
    uint32_t position_count = 0;
    for (uint32_t i = 0; i < count; i++) {
        const Mesh *mesh = baked[i].mesh;
        p->source[i] = (MeshPart){mesh, p->triangle_count, baked[i].to_object};
        for (uint32_t j = 0; j < mesh->position_count; j++)
            p->own_position[position_count + j] = affine_point(&baked[i].to_world, mesh->position[j]);
        p->triangle_count += mesh->triangle_count;
        position_count += mesh->position_count;
    }
    if (!join_triangles(p, baked) || !index_parts(p)) goto fail;
    if (!build(p, settings, err)) {
        mesh_prim_destroy(&p->prim);
        return NULL;
    }
    return &p->prim;

fail:
    if (p) mesh_prim_destroy(&p->prim);
    err_memory(err, "the baked meshes");
    return NULL;
}
