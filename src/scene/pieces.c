#include "scene/pieces.h"

#include <math.h>
#include <stdlib.h>

#include "common/memory.h"

/* An object is cut in halves, and these again, as long as that leaves at most this share of the boxes' area: by the
 * surface area heuristic that of the rays that have it tested. A thin rod along a diagonal keeps a half each time. */
#define WORTH_CUTTING 0.75

/* Of one object, as a power of two. */
enum { MOST_HALVINGS = 6 };

/* Boxes that may be added in a scene. 130 bytes each, the builder's needs and the nodes', make 32 megabytes. */
enum { PIECES_ADDED = 1 << 18 };

/* Half the edges of an object's box in its place: `along` of the longest one, `others` of the two together. */
typedef struct { int axis; double along[3], others[3]; } Frame;

static Frame frame_of(const Object *o)
{
    Box b = o->prim->ops->bounds(o->prim);
    Vec3 half = vec3_scale(vec3_sub(b.hi, b.lo), 0.5);
    Frame f = {.axis = 0};
    double longest = -1;
    for (int j = 0; j < 3; j++) {
        double length = 0, h = vec3_get(half, j);
        for (int i = 0; i < 3; i++) length = fmax(length, fabs(o->to_world.m[i][j]) * h);
        if (!(length > longest)) continue;
        longest = length;
        f.axis = j;
    }
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double edge = fabs(o->to_world.m[i][j]) * vec3_get(half, j);
            if (j == f.axis) f.along[i] = edge;
            else f.others[i] += edge;
        }
    return f;
}

static double area_of(double x, double y, double z) { return x * y + y * z + z * x; }

/* Of all the pieces' boxes. */
static double pieces_area(const Frame *f, const BvhRef *whole, int halvings)
{
    double e[3];
    for (int i = 0; i < 3; i++)
        e[i] = fmin(f->others[i] + ldexp(f->along[i], -halvings), 0.5 * (double)(whole->hi[i] - whole->lo[i]));
    return ldexp(area_of(e[0], e[1], e[2]), halvings);
}

static int halvings_of(const Object *o, const BvhRef *whole)
{
    Frame f = frame_of(o);
    double area = pieces_area(&f, whole, 0);
    for (int n = 0; n < MOST_HALVINGS; n++) {
        double halved = pieces_area(&f, whole, n + 1);
        if (!(halved <= WORTH_CUTTING * area)) return n;
        area = halved;
    }
    return MOST_HALVINGS;
}

static double *coordinate(Vec3 *v, int axis) { return axis == 0 ? &v->x : axis == 1 ? &v->y : &v->z; }

/* Writes the boxes of an object's pieces. */
static void write_pieces(const Object *o, const BvhRef *whole, int halvings, BvhRef *ref)
{
    if (halvings == 0) {
        *ref = *whole;
        return;
    }
    Frame f = frame_of(o);
    Box all = o->prim->ops->bounds(o->prim);
    uint32_t n = 1u << halvings;
    double lo = vec3_get(all.lo, f.axis), hi = vec3_get(all.hi, f.axis);
    for (uint32_t i = 0; i < n; i++) {
        Box piece = all;
        if (i > 0) *coordinate(&piece.lo, f.axis) = lo + (hi - lo) * i / n;
        if (i + 1 < n) *coordinate(&piece.hi, f.axis) = lo + (hi - lo) * (i + 1) / n;
        BoxF box = boxf_from_box(affine_box(&o->to_world, piece));
        for (int a = 0; a < 3; a++) {
            box.lo[a] = fmaxf(box.lo[a], whole->lo[a]);
            box.hi[a] = fminf(box.hi[a], whole->hi[a]);
        }
        ref[i] = bvh_ref(box, whole->item);
    }
}

bool pieces_cut(const Object *object, BvhRef **ref, uint32_t *count, Err *err)
{
    const BvhRef *whole = *ref;
    uint8_t *halvings = memory_array(*count + (size_t)1, 1);
    uint64_t of[MOST_HALVINGS + 1] = {0};
    if (!halvings) return err_memory(err, "the scene");
    for (uint32_t i = 0; i < *count; i++) of[halvings[i] = (uint8_t)halvings_of(&object[i], &whole[i])]++;
    int most = MOST_HALVINGS;
    uint64_t added;
    for (;; most--) {  /* as deep as the budget allows */
        added = 0;
        for (int n = 1; n <= MOST_HALVINGS; n++) added += of[n] * ((1u << (n < most ? n : most)) - 1);
        if (added <= PIECES_ADDED && added <= UINT32_MAX / 2 - *count) break;
    }
    BvhRef *pieces = added ? memory_array(*count + (size_t)added, sizeof *pieces) : NULL;
    if (pieces) {
        uint32_t n = 0;
        for (uint32_t i = 0; i < *count; i++) {
            int h = halvings[i] < most ? halvings[i] : most;
            write_pieces(&object[i], &whole[i], h, pieces + n);
            n += 1u << h;
        }
        free(*ref);
        *ref = pieces;
        *count = n;
    }
    free(halvings);
    return !added || pieces || err_memory(err, "the scene");
}
