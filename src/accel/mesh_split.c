/* Karras, Aila, "Fast parallel construction of high-quality bounding volume hierarchies" (2013), section 4.2: the budget is
 * given to the triangles by how much area their boxes waste and by how high in the tree that is felt; a triangle's boxes
 * are cut where the nodes of a spatial tree over the whole mesh would be. */
#include "accel/mesh_split.h"

#include <math.h>
#include <stdlib.h>

#include "common/memory.h"
#include "common/numeric.h"
#include "common/parallel.h"

enum {
    GRID_BITS = 20,      /* planes are counted in 2^-20 of the mesh's greatest extent */
    MAX_CUTS = 1023,     /* of one triangle */
    SHARE_STEPS = 30,    /* bisections of the cuts per priority */
};

typedef struct { const Vec3 *corner[3]; } Corners;

/* Of a chunk of triangles: the sum of their lengths, cuts and boxes, and the boxes of those before it. */
typedef struct { double length; uint64_t cuts; uint32_t boxes, first; } ChunkCuts;

typedef struct {
    const SplitMesh *mesh;
    const BvhRef *whole; /* the triangles' boxes before they are cut */
    double cell;         /* the grid's */
    double mean_length;  /* of the triangles' boxes, along their longest axis */
    double share;        /* cuts per priority */
    float *priority;     /* of each triangle */
    ChunkCuts *chunk;
    BvhRef *ref;
} Splitter;

static Corners corners_of(const SplitMesh *m, uint32_t i)
{
    const uint32_t *k = m->triangle[i];
    return (Corners){{&m->position[k[0]], &m->position[k[1]], &m->position[k[2]]}};
}

static Box box_of(const Corners *t)
{
    return box_add_point(box_add_point((Box){*t->corner[0], *t->corner[0]}, *t->corner[1]), *t->corner[2]);
}

/* ---- where to cut ---- */

typedef struct { int axis; double at; uint32_t level; } Plane;   /* level: 0 halves the whole mesh; GRID_BITS: no plane */

static uint32_t cell_of(const Splitter *s, double x, int axis)
{
    double cell = (x - vec3_get(s->mesh->bounds.lo, axis)) / s->cell;
    double last = (1 << GRID_BITS) - 1;
    return cell > 0 ? (uint32_t)(cell < last ? cell : last) : 0;
}

/* The plane of the highest level that goes through a box: cell numbers on its two sides differ in their first bit from
 * the left that differs at all. */
static Plane plane_through(const Splitter *s, const Box *box)
{
    Plane best = {0, 0, GRID_BITS};
    for (int a = 0; a < 3; a++) {
        uint32_t lo = cell_of(s, vec3_get(box->lo, a), a), hi = cell_of(s, vec3_get(box->hi, a), a);
        if (lo == hi) continue;
        uint32_t bit = 31 - (uint32_t)__builtin_clz(lo ^ hi), level = GRID_BITS - 1 - bit;
        double at = vec3_get(s->mesh->bounds.lo, a) + s->cell * (double)(hi >> bit << bit);
        if (level < best.level && at > vec3_get(box->lo, a) && at < vec3_get(box->hi, a)) best = (Plane){a, at, level};
    }
    return best;
}

/* ---- cutting ---- */

/* Bound on the error of a coordinate of the point where an edge goes through a plane, as a multiple of the greatest
 * coordinate: its weight w = (at - a) / (b - a) carries three roundings and the product w (b - a) two more, each of
 * terms no greater than twice that coordinate; then the sum and the box around it are rounded. */
#define CUT_ERROR GAMMA(14)

static Vec3 with(Vec3 v, int axis, double x)
{
    double *p = &v.x;
    p[axis] = x;
    return v;
}

/* The boxes of the parts of a triangle within `box` that lie on the two sides of a plane, grown by the rounding of the
 * points on it (Stich, Friedrich, Dietrich, "Spatial splits in bounding volume hierarchies", 2009). One that holds nothing
 * is empty. */
static void cut(const Corners *t, const Box *box, const Plane *plane, Box side[2])
{
    side[0] = side[1] = box_empty();
    for (int i = 0; i < 3; i++) {
        const Vec3 *p = t->corner[i], *q = t->corner[(i + 1) % 3];
        double a = vec3_get(*p, plane->axis), b = vec3_get(*q, plane->axis);
        if (a <= plane->at) side[0] = box_add_point(side[0], *p);
        if (a >= plane->at) side[1] = box_add_point(side[1], *p);
        if (!((a < plane->at && b > plane->at) || (a > plane->at && b < plane->at))) continue;
        Vec3 through = with(vec3_at(*p, (plane->at - a) / (b - a), vec3_sub(*q, *p)), plane->axis, plane->at);
        double e = CUT_ERROR * fmax(vec3_max(vec3_abs(*p)), vec3_max(vec3_abs(*q)));
        Vec3 err = with(vec3_make(e, e, e), plane->axis, 0);
        Box point = {vec3_sub(through, err), vec3_add(through, err)};
        for (int k = 0; k < 2; k++) side[k] = box_union(side[k], point);
    }
    for (int k = 0; k < 2; k++) side[k] = box_overlap(side[k], *box);
}

static double longest(const Box *b) { return vec3_max(vec3_sub(b->hi, b->lo)); }

/* Cuts a triangle's part within `box` `cuts` times at most; returns the number of boxes, and writes them to `ref` unless
 * it is NULL. */
static uint32_t cut_up(const Splitter *s, uint32_t item, const Corners *t, const Box *box, uint32_t cuts, BvhRef *ref)
{
    Plane plane = cuts ? plane_through(s, box) : (Plane){.level = GRID_BITS};
    if (plane.level == GRID_BITS) {
        if (ref) *ref = bvh_ref(boxf_from_box(*box), item);
        return 1;
    }
    Box side[2];
    cut(t, box, &plane, side);
    if (box_is_empty(side[0]) && box_is_empty(side[1])) return 0;  /* boxes are wider than what they hold */
    if (box_is_empty(side[0]) || box_is_empty(side[1]))
        return cut_up(s, item, t, &side[box_is_empty(side[0])], cuts - 1, ref);
    double l = longest(&side[0]), r = longest(&side[1]);
    uint32_t left = (uint32_t)(l / (l + r) * (cuts - 1) + 0.5);
    uint32_t n = cut_up(s, item, t, &side[0], left, ref);
    return n + cut_up(s, item, t, &side[1], cuts - 1 - left, ref ? ref + n : NULL);
}

/* ---- how often to cut which ---- */

/* Cut are boxes of more than WORTH_CUTTING times the area that cutting without end would leave, which the two halves of a
 * rectangle along the axes don't have, and of more than LONG times the mean length; into no more parts than have that mean
 * length. Cutting what is no longer than its neighbours, slivers too, made every mesh slower that was tried: the
 * neighbours' boxes fill the same space. */
#define WORTH_CUTTING 2.0
#define LONG 8.0

static double length_of(const BvhRef *r)
{
    float x = r->hi[0] - r->lo[0], y = r->hi[1] - r->lo[1], z = r->hi[2] - r->lo[2];
    float m = x > y ? x : y;
    return (double)(m > z ? m : z);
}

static bool is_long(const Splitter *s, uint32_t i) { return length_of(&s->whole[i]) > LONG * s->mean_length; }

/* The cube root of the area that a triangle's box has more than its own, halved with each level of the plane through it.
 * Cut without end, the boxes would have the area of the triangle's shadows along the axes. */
static float priority_of(const Splitter *s, uint32_t i)
{
    if (!is_long(s, i)) return 0;
    Corners t = corners_of(s->mesh, i);
    Box box = box_of(&t);
    Plane plane = plane_through(s, &box);
    if (plane.level == GRID_BITS) return 0;
    Vec3 d = vec3_sub(box.hi, box.lo);
    Vec3 n = vec3_abs(vec3_cross(vec3_sub(*t.corner[1], *t.corner[0]), vec3_sub(*t.corner[2], *t.corner[0])));
    double area = 2 * (d.x * d.y + d.y * d.z + d.z * d.x), least = n.x + n.y + n.z;
    return area > WORTH_CUTTING * least ? (float)cbrt(ldexp(area - least, -(int)plane.level)) : 0;
}

static uint32_t cuts_of(const Splitter *s, uint32_t i)
{
    double cuts = s->share * (double)s->priority[i];
    if (cuts < 1) return 0;
    return (uint32_t)fmin(cuts, fmin(length_of(&s->whole[i]) / s->mean_length, MAX_CUTS));
}

static void length_turn(void *context, uint32_t chunk, uint32_t worker)
{
    (void)worker;
    Splitter *s = context;
    double sum = 0;
    for (uint32_t i = chunk * PARALLEL_CHUNK; i < parallel_chunk_end(chunk, s->mesh->count); i++)
        sum += length_of(&s->whole[i]);
    s->chunk[chunk].length = sum;
}

static void long_turn(void *context, uint32_t chunk, uint32_t worker)
{
    (void)worker;
    Splitter *s = context;
    s->chunk[chunk].boxes = 0;
    for (uint32_t i = chunk * PARALLEL_CHUNK; i < parallel_chunk_end(chunk, s->mesh->count); i++)
        s->chunk[chunk].boxes += is_long(s, i);
}

static bool any_long(Splitter *s, uint32_t threads)
{
    uint32_t chunks = parallel_chunks(s->mesh->count);
    double sum = 0;
    bool any = false;
    parallel_for(threads, chunks, length_turn, s);
    for (uint32_t i = 0; i < chunks; i++) sum += s->chunk[i].length;
    s->mean_length = sum / s->mesh->count;
    parallel_for(threads, chunks, long_turn, s);
    for (uint32_t i = 0; i < chunks; i++) any |= s->chunk[i].boxes > 0;
    return any;
}

static void priority_turn(void *context, uint32_t chunk, uint32_t worker)
{
    (void)worker;
    Splitter *s = context;
    for (uint32_t i = chunk * PARALLEL_CHUNK; i < parallel_chunk_end(chunk, s->mesh->count); i++)
        s->priority[i] = priority_of(s, i);
}

static void cuts_turn(void *context, uint32_t chunk, uint32_t worker)
{
    (void)worker;
    Splitter *s = context;
    uint64_t cuts = 0;
    for (uint32_t i = chunk * PARALLEL_CHUNK; i < parallel_chunk_end(chunk, s->mesh->count); i++) cuts += cuts_of(s, i);
    s->chunk[chunk].cuts = cuts;
}

static uint64_t all_cuts(Splitter *s, uint32_t threads)
{
    uint64_t cuts = 0;
    parallel_for(threads, parallel_chunks(s->mesh->count), cuts_turn, s);
    for (uint32_t i = 0; i < parallel_chunks(s->mesh->count); i++) cuts += s->chunk[i].cuts;
    return cuts;
}

/* The most cuts per priority that the budget allows. */
static void choose_share(Splitter *s, uint32_t threads)
{
    double greatest = 0, low = 0;
    for (uint32_t i = 0; i < s->mesh->count; i++) greatest = fmax(greatest, (double)s->priority[i]);
    uint64_t budget = (uint64_t)(SPLIT_BUDGET * s->mesh->count), room = UINT32_MAX - s->mesh->count;
    if (budget > room) budget = room;
    if (!(greatest > 0) || budget == 0) return;
    double high = (double)budget / greatest;
    for (s->share = high; all_cuts(s, threads) <= budget && high * greatest < 0x1p60; s->share = high) high *= 2;
    for (int i = 0; i < SHARE_STEPS; i++) {
        s->share = low + (high - low) / 2;
        if (all_cuts(s, threads) <= budget)
            low = s->share;
        else
            high = s->share;
    }
    s->share = low;
}

/* Counts the chunk's boxes, or writes them once there is room. */
static void boxes_turn(void *context, uint32_t chunk, uint32_t worker)
{
    (void)worker;
    Splitter *s = context;
    uint32_t n = 0;
    BvhRef *ref = s->ref ? s->ref + s->chunk[chunk].first : NULL;
    for (uint32_t i = chunk * PARALLEL_CHUNK; i < parallel_chunk_end(chunk, s->mesh->count); i++) {
        uint32_t cuts = cuts_of(s, i);
        if (cuts == 0) {
            if (ref) ref[n] = s->whole[i];
            n++;
            continue;
        }
        Corners t = corners_of(s->mesh, i);
        Box box = box_of(&t);
        n += cut_up(s, i, &t, &box, cuts, ref ? ref + n : NULL);
    }
    s->chunk[chunk].boxes = n;
}

static bool split(Splitter *s, uint32_t threads, BvhRef **ref, uint32_t *count)
{
    uint32_t chunks = parallel_chunks(s->mesh->count), n = 0;
    s->chunk = malloc((chunks + (size_t)1) * sizeof *s->chunk);
    if (!s->chunk) return false;
    if (!any_long(s, threads)) return true;
    s->priority = malloc(s->mesh->count * sizeof *s->priority);
    if (!s->priority) return false;
    parallel_for(threads, chunks, priority_turn, s);
    choose_share(s, threads);
    parallel_for(threads, chunks, boxes_turn, s);
    for (uint32_t i = 0; i < chunks; i++) {
        s->chunk[i].first = n;
        n += s->chunk[i].boxes;
    }
    s->ref = memory_array(n, sizeof *s->ref);
    if (!s->ref) return false;
    parallel_for(threads, chunks, boxes_turn, s);
    free(*ref);
    *ref = s->ref;
    *count = n;
    return true;
}

bool mesh_split(const SplitMesh *mesh, uint32_t threads, BvhRef **ref, uint32_t *count)
{
    Splitter s = {.mesh = mesh, .whole = *ref, .cell = longest(&mesh->bounds) / (1 << GRID_BITS)};
    bool ok = mesh->count == 0 || split(&s, threads, ref, count);
    free(s.priority);
    free(s.chunk);
    return ok;
}
