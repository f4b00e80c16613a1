/* Constructive solid geometry on events with identities.
 *
 * Along a line each leaf gives ordered in/out pairs. Sorted together they are events; the Boolean expression is
 * evaluated only on the open intervals between them, never at a surface, which gives the regularised result
 * (Requicha and Voelcker 1985). Three things are not as in Roth 1982, who merged segment lists up the tree:
 *
 * 1. The expression is a tree of counting gates. Differences become intersections with a complement, complements are
 *    pushed down to the leaves (De Morgan), and a gate takes in its operands of the same kind. So A - B - C - ... and
 *    A + B + C + ... are one gate however deep they were written; a crossing adds one to or takes one off the counts
 *    on its way to the root, and stops where a gate's state doesn't change.
 *
 * 2. Leaves are found by a bounding volume hierarchy of their own. What counts of a leaf lies in its box and in the
 *    boxes of all operators above it (a difference has the box of its left operand, an intersection the overlap).
 *    A leaf whose part the line misses stays at the value that it has far away. That is exact: by induction from the
 *    leaves, an operator's value outside its box is constant whatever was left out, and inside the boxes of all the
 *    operators above it nothing was left out.
 *
 * 3. Coincidence. Each event has an interval in t that holds the true crossing: the primitive's own bound, and the
 *    error e of the place in leaf space (rounding of the ray's transform, rounding of the leaf's matrix) along the
 *    normal n, |n|.e / |n.d|. As both gap and bound grow by 1 / |n.d| at grazing angles, whether two faces count as
 *    one depends on the thickness between them, not on the view. Events are taken together as long as their intervals
 *    have a point in common: then moving every face by no more than its bound makes them really one. (Chaining, where
 *    each overlaps but the next, would let one grazing face with its long interval join the two sides of a thick
 *    wall.) A leaf that goes in and out within a group is a sliver of its own, and changes nothing. Results thinner
 *    than the bounds of their two ends, which can remain between neighbouring groups, are dropped.
 *
 * 4. Rays in faces. Where a ray lies in a leaf's face, the error of the place decides whether there is a crossing at all,
 *    and leaves that share the face may decide differently: a ray between two boxes that abut would see both or none.
 *    Which leaves these are is found by asking them: eight lines beside the ray, as far as the bound on the place's error,
 *    meet the leaf as often as the ray does, or else nothing is certain. Then the ray is taken to pass the leaf as a
 *    line does that is moved aside, until it passes clearly, in one direction of CSG space for all leaves, that no face
 *    is likely to have (in the manner of the simulation of simplicity, Edelsbrunner and Muecke 1990). So a face that
 *    several leaves share is passed on the same side of all of them. That decides on the parts; their ends are then
 *    those of the line moved least that has as many. The lines beside the ray also give the bounds of crossings at
 *    grazing angles, where the surface between is no plane. All this is done only for a ray along a face, or with a
 *    crossing of little slope. */
#include "node/csg/csg.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/dd.h"
#include "common/numeric.h"
#include "node/csg/csg_data.h"

#define NONE UINT32_MAX

enum {
    /* Roundings that an entry of a leaf's matrix or of its inverse may have behind it: four products of four roundings
     * (node on node), or as many in the inverse. */
    MATRIX_ROUNDINGS = 16,
    /* The slab test has three roundings of (plane - origin), and the origin is within five times the reach. */
    SLAB_ROUNDINGS = 32,
    ASIDE_STEPS = 12,
    LEAVES_PER_NODE = 4,
    LOCAL_EVENTS = 24,   /* as many live on the stack */
    LOCAL_GATES = 16,
    INSERTION_MAX = 24,  /* sorted by insertion up to here, by merging above */
};

static const PrimOps OPS;

/* ---- Tracing ---- */

typedef struct {
    double t, lo, hi;    /* along the moved ray */
    uint32_t edge;       /* 2 * segment, + 1 where it leaves */
    uint32_t leaf;
} Event;

typedef struct {
    const Csg *csg;
    Scratch *scratch;
    Vec3 o, d, inv;      /* the moved ray and 1 / d */
    double shift;        /* t of its origin on the ray as given */
    SegList segs;        /* of all leaves, one after the other */
    SegList beside;      /* of a leaf and a line beside the ray */
    Event *event;
    uint32_t count, capacity;
    uint32_t *order;     /* of the events by t; in the end its first `result_count` are those of the result */
    uint32_t result_count;
    Event local_event[LOCAL_EVENTS];
    uint32_t local_order[2 * LOCAL_EVENTS];
} Trace;

/* Without the calls that fmax and its rules for NaN cost. */
static double larger(double a, double b) { return a > b ? a : b; }
static double largest(Vec3 a) { return larger(a.x, larger(a.y, a.z)); }
static Vec3 reciprocal(Vec3 a) { return vec3_make(1 / a.x, 1 / a.y, 1 / a.z); }

/* Moves the origin of a far ray to the point nearest to the middle of the solid and returns how far in t. The rounding
 * of this is the same for all leaves, so faces stay as near to each other as if the ray had started there. */
static double move_origin(const Csg *csg, Vec3 *o, Vec3 d)
{
    if (largest(vec3_abs(*o)) <= CSG_FAR_ORIGIN * csg->reach) return 0;
    double m = largest(vec3_abs(d)), k = m > 1e-100 && m < 1e100 ? 1 : vec3_pow2_scale(d);
    Vec3 e = vec3_scale(d, k);
    double shift = vec3_dot(vec3_sub(csg->centre, *o), e) / vec3_dot(e, e) * k;
    if (!isfinite(shift)) return 0;
    *o = vec3_at(*o, shift, d);
    return shift;
}

/* Clips [near, far] to a pair of planes. A zero direction gives 1 / d = +-inf: then planes beside the origin give
 * infinities of the right sign, and a plane through it gives 0 * inf = NaN, which no comparison lets in. */
static void clip_slab(double lo, double hi, double o, double inv, double *near, double *far)
{
    double a = ((inv < 0 ? hi : lo) - o) * inv;
    double b = ((inv < 0 ? lo : hi) - o) * inv;
    *near = a > *near ? a : *near;
    *far = b < *far ? b : *far;
}

static Box box_pad(Box box, Vec3 by) { return (Box){vec3_sub(box.lo, by), vec3_add(box.hi, by)}; }

static bool clip_box(Box box, Vec3 o, Vec3 inv, double *near, double *far)
{
    clip_slab(box.lo.x, box.hi.x, o.x, inv.x, near, far);
    clip_slab(box.lo.y, box.hi.y, o.y, inv.y, near, far);
    clip_slab(box.lo.z, box.hi.z, o.z, inv.z, near, far);
    return *near <= *far;
}

/* The boxes are padded for the roundings of this, so it need not be. */
static bool line_meets(const Trace *tr, Box box)
{
    double near = -INFINITY, far = INFINITY;
    return clip_box(box, tr->o, tr->inv, &near, &far);
}

static bool reserve_events(Trace *tr, uint32_t more)
{
    if (more <= tr->capacity - tr->count) return true;
    uint32_t capacity = 2 * tr->capacity;
    while (capacity - tr->count < more) capacity *= 2;
    Event *event = arena_alloc(tr->scratch->arena, capacity * sizeof *event);
    if (!event) {
        tr->scratch->out_of_memory = true;
        return false;
    }
    memcpy(event, tr->event, tr->count * sizeof *event);
    tr->event = event;
    tr->capacity = capacity;
    return true;
}

/* Bound on the error, in leaf space, of the places on the ray up to |t|: what the ray's transform rounds (Higham 2002,
 * section 3.5) and what the leaf's matrix is off. */
static Vec3 place_error(const CsgLeaf *leaf, Vec3 o, Vec3 d, double t)
{
    Vec3 reach = vec3_at(vec3_abs(vec3_sub(o, leaf->middle)), t, vec3_abs(d));
    return vec3_at(leaf->spread, GAMMA(5), affine_abs_vector(&leaf->to_leaf, reach));
}

/* By way of the leaf's middle: with the inverse's translation there would be several roundings of the distance to the
 * origin of CSG space, which may be far away. */
static Ray leaf_ray(const CsgLeaf *leaf, Vec3 o, Vec3 d)
{
    if (leaf->identity) return (Ray){o, d, -INFINITY, INFINITY};
    Vec3 from = affine_vector(&leaf->to_leaf, vec3_sub(o, leaf->middle));
    return (Ray){vec3_add(leaf->leaf_middle, from), affine_vector(&leaf->to_leaf, d), -INFINITY, INFINITY};
}

/* How far t may be off: the primitive's own bound, and what the error of the place in leaf space makes of it. */
static double edge_error(const Edge *edge, Vec3 d, Vec3 place_err)
{
    double err = edge->t_err + vec3_dot(vec3_abs(edge->n), place_err) / fabs(vec3_dot(edge->n, d));
    return err <= INFINITY ? err : INFINITY;
}

/* Between these are the angles of a surface's normals at the ends of a chord that is E deep, sqrt(8 E / r) for the radius
 * r, with E from u to 2^-24; those of triangles that should lie in one plane are below. */
static const double TANGENT_LEAST = 0x1p-30, TANGENT_MOST = 0x1p-10;

/* Whether a part of the line is only a sliver that may be there or not, as the error of the place has it. A corner that is
 * cut off: short, and no longer than the errors of its two ends and of lines moved by as much again. Or what a tangent
 * cuts off a curved surface: the normals of its ends are nearly the same, and it is up to 2 E deep, where its length is
 * that of four errors. What is not a sliver and yet may be there or not lies in a face or along a ruled line. */
static bool is_sliver(const Seg *seg, Vec3 d, Vec3 place_err)
{
    double length = seg->out.t - seg->in.t;
    double err = edge_error(&seg->in, d, place_err) + edge_error(&seg->out, d, place_err);
    if (length * largest(vec3_abs(d)) <= largest(place_err) / ALONG) return length <= 2 * err;
    if (length > 4 * err) return false;
    double angle = vec3_length(vec3_sub(vec3_normalize(seg->in.n), vec3_normalize(seg->out.n)));
    return angle > TANGENT_LEAST && angle < TANGENT_MOST;
}

/* How many of a list's segments, from `first` on, are no slivers. */
static uint32_t count_parts(const SegList *list, uint32_t first, Vec3 d, Vec3 place_err)
{
    uint32_t parts = 0;
    for (uint32_t i = first; i < list->count; i++) parts += !is_sliver(&list->seg[i], d, place_err);
    return parts;
}

/* Widens the intervals of the events of a leaf, whose segments are those from `first` on, to what they are on a line
 * beside the ray that has as many parts. */
static void widen_events(const Trace *tr, uint32_t first, Event *event, Vec3 d, Vec3 place_err)
{
    uint32_t k = first;
    for (uint32_t i = 0; i < tr->beside.count; i++) {
        const Seg *seg = &tr->beside.seg[i];
        if (is_sliver(seg, d, place_err)) continue;
        while (is_sliver(&tr->segs.seg[k], d, place_err)) k++;
        Event *in = &event[2 * (k++ - first)], *out = in + 1;
        in->lo = fmin(in->lo, seg->in.t - seg->in.t_err);
        in->hi = fmax(in->hi, seg->in.t + seg->in.t_err);
        out->lo = fmin(out->lo, seg->out.t - seg->out.t_err);
        out->hi = fmax(out->hi, seg->out.t + seg->out.t_err);
    }
}

enum { CORNERS = 8 };

static Vec3 box_corner(Vec3 half, unsigned corner)
{
    return vec3_make(corner & 1 ? half.x : -half.x, corner & 2 ? half.y : -half.y, corner & 4 ? half.z : -half.z);
}

/* Whether the lines beside one, moved by the error of the place along all axes, all have as many parts in the leaf: a
 * plane with the normal n is off by |n|.e at most, and some of the eight are moved by all of that. Widens the events, of
 * segments from `first` on, if there are any. False in *ok without memory. */
static bool is_clear(Trace *tr, const CsgLeaf *leaf, const Ray *ray, Vec3 e, uint32_t parts, uint32_t first, Event *event,
                     bool *ok)
{
    bool clear = true;
    for (unsigned corner = 0; corner < CORNERS; corner++) {
        Ray line = {vec3_add(ray->o, box_corner(e, corner)), ray->d, -INFINITY, INFINITY};
        tr->beside.count = 0;
        *ok = leaf->prim->ops->segments(leaf->prim, &line, &tr->beside);
        if (!*ok) return false;
        bool same = count_parts(&tr->beside, 0, ray->d, e) == parts;
        if (same && event) widen_events(tr, first, event, ray->d, e);
        clear = clear && same;
    }
    return clear;
}

/* Appends the events of a leaf's segments from `first` on. *clear becomes false if one has little slope. */
static bool add_events(Trace *tr, uint32_t index, const Ray *ray, Vec3 place_err, uint32_t first, bool *clear)
{
    uint32_t end = tr->segs.count;
    if (!reserve_events(tr, 2 * (end - first))) return false;
    for (uint32_t s = first; s < end; s++) {
        const Seg *seg = &tr->segs.seg[s];
        double long_err = ALONG * (seg->out.t - seg->in.t);
        for (uint32_t side = 0; side < 2; side++) {
            const Edge *edge = side ? &seg->out : &seg->in;
            double err = edge_error(edge, ray->d, place_err);
            tr->event[tr->count++] = (Event){edge->t, edge->t - err, edge->t + err, 2 * s + side, index};
            *clear = *clear && err <= long_err;
        }
    }
    return true;
}

/* Prepares the events of a leaf for being widened: those of little slope begin with t alone, and the two of a sliver are
 * one place. Returns them. */
static Event *narrow_events(Trace *tr, uint32_t first, Vec3 d, Vec3 place_err)
{
    Event *event = tr->event + tr->count - 2 * (tr->segs.count - first);
    for (uint32_t k = first; k < tr->segs.count; k++) {
        const Seg *seg = &tr->segs.seg[k];
        Event *in = &event[2 * (k - first)], *out = in + 1;
        double long_err = ALONG * (seg->out.t - seg->in.t);
        if (is_sliver(seg, d, place_err)) {
            in->hi = fmax(in->hi, out->hi);
            out->lo = fmin(in->lo, out->lo);
        } else {
            if (!(in->hi - in->t <= long_err)) in->lo = in->hi = in->t;
            if (!(out->hi - out->t <= long_err)) out->lo = out->hi = out->t;
        }
    }
    return event;
}

/* Takes from the intervals of a leaf's events what is outside its box: on a face nearly in the ray's direction a bound may
 * reach anywhere, but the leaf is not there. */
static void cap_events(const Trace *tr, const CsgLeaf *leaf, const Ray *ray, Vec3 place_err, uint32_t first)
{
    Event *event = tr->event + tr->count - 2 * (tr->segs.count - first), *end = tr->event + tr->count;
    double near = -INFINITY, far = INFINITY;
    if (!clip_box(box_pad(leaf->bounds, place_err), ray->o, reciprocal(ray->d), &near, &far)) return;
    for (; event < end; event++) {
        event->lo = fmin(event->t, fmax(event->lo, near));
        event->hi = fmax(event->t, fmin(event->hi, far));
    }
}

static const Vec3 ASIDE = {0.8017837257372732, 0.5122083536123418, 0.3079614987123441};

/* The steps, in units of the error of the place: the first aside, to decide with, and the first to take the ends from;
 * both double. Faces are usually off by a few roundings and not by their bound, so the ends are hardly moved. */
static const double ASIDE_FIRST = 0.5, MOVE_FIRST = 0x1p-5;
enum { MOVES = 6 * CORNERS };  /* the last are by the whole error */

/* Whether a leaf's segments from `first` on have the parts of the line beside: their ends no farther off than the step
 * makes them, unless the slope is little. */
static bool are_alike(const Trace *tr, uint32_t first, Vec3 d, Vec3 place_err)
{
    if (count_parts(&tr->segs, first, d, place_err) != count_parts(&tr->beside, 0, d, place_err)) return false;
    for (uint32_t i = 0, k = first; i < tr->beside.count; i++) {
        const Seg *a = &tr->beside.seg[i];
        if (is_sliver(a, d, place_err)) continue;
        while (is_sliver(&tr->segs.seg[k], d, place_err)) k++;
        const Seg *b = &tr->segs.seg[k++];
        double close = ALONG * (a->out.t - a->in.t);
        if (!(fabs(a->in.t - b->in.t) <= close && fabs(a->out.t - b->out.t) <= close)) return false;
    }
    return true;
}

/* Finds the segments, appended from `first` on, of the line moved least that has the parts of the line beside: of those
 * toward the corners of the error. Near a tangent to a curved surface no other line has the same ends: then as many parts
 * will do, so that a ray which leaves the surface from beyond the error doesn't meet it again. If it must be, that line
 * beside itself. *moved gets how far it was moved. */
static bool move_least(Trace *tr, const CsgLeaf *leaf, const Ray *ray, const Ray *beside, Vec3 e, uint32_t first,
                       Vec3 *moved)
{
    Ray line = *ray, chosen = *beside;
    uint32_t parts = count_parts(&tr->beside, 0, ray->d, e);
    bool found = false;
    for (unsigned k = 0; k <= MOVES; k++) {
        if (k > 0) {
            double scale = ldexp(MOVE_FIRST, (int)((k - 1) / CORNERS));
            line.o = vec3_add(ray->o, box_corner(vec3_scale(e, scale), k % CORNERS));
        }
        tr->segs.count = first;
        if (!leaf->prim->ops->segments(leaf->prim, &line, &tr->segs)) return false;
        bool alike = are_alike(tr, first, ray->d, e);
        if (alike || (!found && count_parts(&tr->segs, first, ray->d, e) == parts)) {
            found = true;
            chosen = line;
        }
        if (alike) break;
    }
    *moved = vec3_abs(vec3_sub(chosen.o, ray->o));
    tr->segs.count = first;
    return leaf->prim->ops->segments(leaf->prim, &chosen, &tr->segs);
}

/* Replaces the segments of a leaf that isn't passed clearly by those of a line moved aside. */
static bool pass_aside(Trace *tr, uint32_t index, const Ray *ray, Vec3 e, uint32_t first)
{
    const CsgLeaf *leaf = &tr->csg->leaf[index];
    Vec3 aside = affine_vector(&leaf->to_leaf, ASIDE), moved;
    double step = ASIDE_FIRST * largest(affine_abs_vector(&leaf->to_csg, e));
    Ray line = *ray;
    bool clear = false, ok = true;
    uint32_t parts = 0;
    for (int k = 0; k < ASIDE_STEPS && !clear; k++, step *= 2) {
        line.o = vec3_at(ray->o, step, aside);
        tr->beside.count = 0;
        if (!leaf->prim->ops->segments(leaf->prim, &line, &tr->beside)) return false;
        parts = count_parts(&tr->beside, 0, ray->d, e);
        clear = is_clear(tr, leaf, &line, e, parts, 0, NULL, &ok);
        if (!ok) return false;
    }
    tr->count -= 2 * (tr->segs.count - first);
    tr->segs.count = first;
    if (parts == 0) return true;
    tr->beside.count = 0;
    if (!leaf->prim->ops->segments(leaf->prim, &line, &tr->beside)) return false;
    if (!move_least(tr, leaf, ray, &line, e, first, &moved)) return false;
    if (!add_events(tr, index, ray, vec3_add(e, moved), first, &clear)) return false;
    is_clear(tr, leaf, ray, e, parts, first, narrow_events(tr, first, ray->d, e), &ok);
    cap_events(tr, leaf, ray, vec3_add(e, moved), first);
    return ok;
}

/* Looks again at a leaf that the ray passes along a face of or at little slope. */
static bool collect_beside(Trace *tr, uint32_t index, const Ray *ray, uint32_t first)
{
    const CsgLeaf *leaf = &tr->csg->leaf[index];
    double way = (largest(vec3_abs(vec3_sub(tr->o, tr->csg->centre))) + tr->csg->radius) / largest(vec3_abs(tr->d));
    Vec3 e = place_error(leaf, tr->o, tr->d, way);
    if (!(largest(e) < INFINITY)) return true;
    Event *event = narrow_events(tr, first, ray->d, e);
    bool ok;
    bool clear = is_clear(tr, leaf, ray, e, count_parts(&tr->segs, first, ray->d, e), first, event, &ok);
    if (!ok) return false;
    cap_events(tr, leaf, ray, e, first);
    if (clear) return true;
    return pass_aside(tr, index, ray, e, first);
}

/* Appends the crossings of one leaf. */
static bool collect_leaf(Trace *tr, uint32_t index)
{
    const CsgLeaf *leaf = &tr->csg->leaf[index];
    Ray ray = leaf_ray(leaf, tr->o, tr->d);
    uint32_t first = tr->segs.count;
    tr->segs.along = leaf->coarse;
    if (!leaf->prim->ops->segments(leaf->prim, &ray, &tr->segs)) return false;
    uint32_t end = tr->segs.count;
    bool clear = !tr->segs.along;
    if (end > first) {
        double far_t = larger(fabs(tr->segs.seg[first].in.t), fabs(tr->segs.seg[end - 1].out.t));
        if (!add_events(tr, index, &ray, place_error(leaf, tr->o, tr->d, far_t), first, &clear)) return false;
    }
    return clear || collect_beside(tr, index, &ray, first);
}

static bool collect(Trace *tr)
{
    const Csg *csg = tr->csg;
    bool test_nodes = csg->node_count > 1;
    for (uint32_t i = 0; i < csg->node_count;) {
        const CsgNode *node = &csg->node[i];
        if (test_nodes && !line_meets(tr, node->box)) {
            i = node->skip;
            continue;
        }
        for (uint32_t k = 0; k < node->count; k++) {
            const CsgItem *item = &csg->item[node->first + k];
            if (line_meets(tr, item->box) && !collect_leaf(tr, item->leaf)) return false;
        }
        i++;
    }
    return true;
}

typedef bool Before(const Event *event, uint32_t a, uint32_t b);

static bool before_by_t(const Event *event, uint32_t a, uint32_t b)
{
    if (event[a].t != event[b].t) return event[a].t < event[b].t;
    if (event[a].leaf != event[b].leaf) return event[a].leaf < event[b].leaf;
    return a < b;
}

static bool before_by_leaf(const Event *event, uint32_t a, uint32_t b)
{
    return event[a].leaf != event[b].leaf ? event[a].leaf < event[b].leaf : a < b;
}

/* Few by insertion, many by merging bottom up; `room` holds as many again. */
static inline void sort_events(const Event *event, uint32_t *order, uint32_t n, uint32_t *room, Before *before)
{
    uint32_t run = n <= INSERTION_MAX ? n : 8;
    for (uint32_t first = 0; first < n; first += run) {
        uint32_t end = n - first < run ? n : first + run;
        for (uint32_t i = first + 1; i < end; i++) {
            uint32_t x = order[i], j = i;
            for (; j > first && before(event, x, order[j - 1]); j--) order[j] = order[j - 1];
            order[j] = x;
        }
    }
    for (; run < n; run *= 2) {
        for (uint32_t first = 0; first < n; first += 2 * run) {
            uint32_t mid = n - first < run ? n : first + run;
            uint32_t end = n - first < 2 * run ? n : first + 2 * run;
            uint32_t i = first, j = mid, k = first;
            while (i < mid && j < end) room[k++] = before(event, order[j], order[i]) ? order[j++] : order[i++];
            while (i < mid) room[k++] = order[i++];
            while (j < end) room[k++] = order[j++];
        }
        memcpy(order, room, n * sizeof *order);
    }
}

static bool gate_is_on(const Csg *csg, const CsgState *state, uint32_t gate)
{
    return state[gate].count >= csg->gate[gate].threshold;
}

/* The literal of a leaf goes on or off: counts it up the tree as far as states change. */
static void switch_leaf(const Csg *csg, CsgState *state, const CsgLeaf *leaf, bool on)
{
    for (uint32_t g = leaf->gate; g != NONE; g = csg->gate[g].parent) {
        bool was = gate_is_on(csg, state, g);
        state[g].count += on ? 1 : UINT32_MAX;
        if (gate_is_on(csg, state, g) == was) return;
    }
}

/* Whether all gates from the leaf to the root have gone `on` in this group: then the leaf's face is one of the result.
 * (A face of A in (A x B) + C that happens to lie on C, away from B, is not.) */
static bool carries_to_root(const Csg *csg, const CsgState *state, const CsgLeaf *leaf, bool on)
{
    for (uint32_t g = leaf->gate; g != NONE; g = csg->gate[g].parent)
        if (state[g].settled == on || gate_is_on(csg, state, g) != on) return false;
    return true;
}

static void settle(const Csg *csg, CsgState *state, const CsgLeaf *leaf)
{
    for (uint32_t g = leaf->gate; g != NONE; g = csg->gate[g].parent) {
        bool on = gate_is_on(csg, state, g);
        if (state[g].settled == on) return;
        state[g].settled = on;
    }
}

static bool event_leaves(const Event *event) { return event->edge & 1; }
static bool event_switches_on(const Csg *csg, const Event *event)
{
    return event_leaves(event) == csg->leaf[event->leaf].flip;
}

/* One event alone: the common case. Returns it if it shows in the result, else NONE. */
static uint32_t pass_single(const Trace *tr, CsgState *state, uint32_t index)
{
    const Csg *csg = tr->csg;
    const Event *event = &tr->event[index];
    bool on = event_switches_on(csg, event);
    for (uint32_t g = csg->leaf[event->leaf].gate; g != NONE; g = csg->gate[g].parent) {
        state[g].count += on ? 1 : UINT32_MAX;
        if (gate_is_on(csg, state, g) == state[g].settled) return NONE;
        state[g].settled = on;
    }
    return index;
}

/* Which of two events that both carry to the root shows for a group with [lo, hi] in common, where the true crossing
 * is: one that lies there, if possible the first (whose material it is), else the one that is known best. */
static uint32_t better_shown(const Trace *tr, uint32_t shown, uint32_t other, double lo, double hi)
{
    if (shown == NONE) return other;
    const Event *a = &tr->event[shown], *b = &tr->event[other];
    if (a->t >= lo && a->t <= hi) return shown;
    return (b->t >= lo && b->t <= hi) || b->hi - b->lo < a->hi - a->lo ? other : shown;
}

/* A group of events, in place of one. Returns the one that shows, one of those that carry to the root, or NONE. */
static uint32_t pass_group(const Trace *tr, CsgState *state, uint32_t *group, uint32_t n, uint32_t *room)
{
    const Csg *csg = tr->csg;
    sort_events(tr->event, group, n, room, before_by_leaf);
    double lo = -INFINITY, hi = INFINITY;
    for (uint32_t i = 0; i < n; i++) {
        lo = larger(lo, tr->event[group[i]].lo);
        hi = -larger(-hi, -tr->event[group[i]].hi);
    }
    uint32_t changed = 0;  /* of each leaf keep the first event if their number is odd; the others cancel out */
    for (uint32_t i = 0, end; i < n; i = end) {
        uint32_t leaf = tr->event[group[i]].leaf;
        for (end = i + 1; end < n && tr->event[group[end]].leaf == leaf;) end++;
        if ((end - i) % 2) group[changed++] = group[i];
    }
    for (uint32_t i = 0; i < changed; i++) {
        const Event *event = &tr->event[group[i]];
        switch_leaf(csg, state, &csg->leaf[event->leaf], event_switches_on(csg, event));
    }
    uint32_t shown = NONE;
    bool on = gate_is_on(csg, state, 0);
    if (on != state[0].settled) {
        for (uint32_t i = 0; i < changed; i++) {
            const Event *event = &tr->event[group[i]];
            if (event_switches_on(csg, event) == on && carries_to_root(csg, state, &csg->leaf[event->leaf], on))
                shown = better_shown(tr, shown, group[i], lo, hi);
        }
        assert(shown != NONE);
    }
    for (uint32_t i = 0; i < changed; i++) settle(csg, state, &csg->leaf[tr->event[group[i]].leaf]);
    return shown;
}

/* Turns the events into those of the result, which go in and out in turn. */
static bool resolve(Trace *tr)
{
    const Csg *csg = tr->csg;
    uint32_t n = tr->count;
    CsgState local_state[LOCAL_GATES], *state = local_state;
    tr->order = tr->local_order;
    if (n > LOCAL_EVENTS) tr->order = arena_alloc(tr->scratch->arena, 2 * (size_t)n * sizeof *tr->order);
    if (csg->gate_count > LOCAL_GATES) state = arena_alloc(tr->scratch->arena, csg->gate_count * sizeof *state);
    if (!tr->order || !state) {
        tr->scratch->out_of_memory = true;
        return false;
    }
    memcpy(state, csg->idle, csg->gate_count * sizeof *state);
    uint32_t *order = tr->order, *room = order + n, kept = 0;
    for (uint32_t i = 0; i < n; i++) order[i] = i;
    sort_events(tr->event, order, n, room, before_by_t);

    for (uint32_t i = 0, end; i < n; i = end) {
        double common_hi = tr->event[order[i]].hi;
        for (end = i + 1; end < n && tr->event[order[end]].lo <= common_hi; end++)
            if (tr->event[order[end]].hi < common_hi) common_hi = tr->event[order[end]].hi;
        uint32_t shown = end - i == 1 ? pass_single(tr, state, order[i])
                                      : pass_group(tr, state, order + i, end - i, room);
        if (shown == NONE) continue;
        if (kept > 0 && tr->event[shown].lo <= tr->event[order[kept - 1]].hi)
            kept--;  /* a film of the solid, or of the air between two parts of it */
        else
            order[kept++] = shown;
    }
    assert(kept % 2 == 0);
    tr->result_count = kept;
    return true;
}

static bool trace(Trace *tr, const Prim *prim, const Ray *ray, Scratch *scratch)
{
    const Csg *csg = (const Csg *)prim;
    tr->csg = csg;
    tr->scratch = scratch;
    tr->o = ray->o;
    tr->d = ray->d;
    tr->shift = move_origin(csg, &tr->o, ray->d);
    tr->inv = reciprocal(ray->d);
    tr->segs = seg_list(scratch);
    tr->beside = seg_list(scratch);
    tr->event = tr->local_event;
    tr->count = 0;
    tr->capacity = LOCAL_EVENTS;
    tr->result_count = 0;
    if (!collect(tr)) return false;
    return tr->count == 0 || resolve(tr);
}

static const Edge *event_edge(const Trace *tr, const Event *event)
{
    const Seg *seg = &tr->segs.seg[event->edge / 2];
    return event_leaves(event) ? &seg->out : &seg->in;
}

/* The event of the first edge with tmin < t <= tmax, or NULL. */
static const Event *first_in_range(const Trace *tr, const Ray *ray, double *t)
{
    for (uint32_t i = 0; i < tr->result_count; i++) {
        const Event *event = &tr->event[tr->order[i]];
        *t = event->t + tr->shift;
        if (*t > ray->tmin) return *t <= ray->tmax ? event : NULL;
    }
    return NULL;
}

static bool csg_intersect(const Prim *prim, const Ray *ray, Hit *hit, Scratch *scratch)
{
    Trace tr;
    double t;
    if (!trace(&tr, prim, ray, scratch)) return false;
    const Event *event = first_in_range(&tr, ray, &t);
    if (!event) return false;
    const Edge *edge = event_edge(&tr, event);
    hit->t = t;
    hit->u = edge->u;
    hit->v = edge->v;
    hit->part = edge->part;
    hit->leaf = event->leaf;
    return true;
}

static bool csg_occluded(const Prim *prim, const Ray *ray, Scratch *scratch)
{
    Trace tr;
    double t;
    return trace(&tr, prim, ray, scratch) && first_in_range(&tr, ray, &t);
}

/* An edge of the result in the terms of the ray as given. */
static Edge result_edge(const Trace *tr, const Ray *ray, const Event *event)
{
    const CsgLeaf *leaf = &tr->csg->leaf[event->leaf];
    Edge edge = *event_edge(tr, event);
    Vec3 n = leaf->identity ? edge.n : affine_normal(&leaf->to_leaf, edge.n);
    edge.n = leaf->flip ? vec3_neg(n) : n;
    edge.t_err = fmax(event->hi - event->t, event->t - event->lo);
    edge.t = event->t + tr->shift;
    edge.leaf = event->leaf;
    if (tr->shift != 0) {
        Vec3 moved = vec3_at(vec3_abs(ray->o), fabs(tr->shift), vec3_abs(ray->d));
        double thickness = GAMMA(2) * vec3_dot(vec3_abs(n), moved);
        edge.t_err += thickness / fabs(vec3_dot(n, ray->d)) + UNIT_ROUNDOFF * fabs(edge.t);
        if (isnan(edge.t_err)) edge.t_err = INFINITY;
    }
    return edge;
}

static bool csg_segments(const Prim *prim, const Ray *ray, SegList *list)
{
    Trace tr;
    if (!trace(&tr, prim, ray, list->scratch)) return false;
    for (uint32_t i = 0; i < tr.result_count; i += 2) {
        Edge in = result_edge(&tr, ray, &tr.event[tr.order[i]]);
        Edge out = result_edge(&tr, ray, &tr.event[tr.order[i + 1]]);
        if (!seg_list_add(list, in, out)) return false;
    }
    return true;
}

static void csg_surface(const Prim *prim, const Ray *ray, const Hit *hit, bool uv, Surface *surface)
{
    const Csg *csg = (const Csg *)prim;
    const CsgLeaf *leaf = &csg->leaf[hit->leaf];
    Vec3 o = ray->o;
    double shift = move_origin(csg, &o, ray->d);
    /* A ray that was moved aside is taken as given: the leaf puts the point onto its surface all the same. */
    Ray in_leaf = leaf_ray(leaf, o, ray->d);
    in_leaf.tmin = ray->tmin - shift;
    in_leaf.tmax = ray->tmax - shift;
    Hit leaf_hit = *hit;
    leaf_hit.t -= shift;
    leaf_hit.leaf = 0;
    leaf->prim->ops->surface(leaf->prim, &in_leaf, &leaf_hit, uv, surface);
    if (!leaf->identity) {
        surface->p_err = affine_point_error(&leaf->to_csg, surface->p, surface->p_err);
        surface->p = affine_point(&leaf->to_csg, surface->p);
        surface->n = affine_normal(&leaf->to_leaf, surface->n);
        surface->ns = affine_normal(&leaf->to_leaf, surface->ns);
    }
    if (leaf->flip) {
        surface->n = vec3_neg(surface->n);
        surface->ns = vec3_neg(surface->ns);
    }
    surface->p_err = vec3_add(surface->p_err, leaf->departure);
    /* A face that counts as one with this may lie above the point; that is no matter: also for a ray that leaves from
     * here the two are one crossing, at this leaf's t. But moving the origin and back has cost a rounding of t. */
    if (shift != 0) surface->p_err = vec3_at(surface->p_err, GAMMA(2) * fabs(hit->t), vec3_abs(ray->d));
}

static Box csg_bounds(const Prim *prim) { return ((const Csg *)prim)->bounds; }

static void csg_destroy(Prim *prim)
{
    Csg *csg = (Csg *)prim;
    free(csg->leaf);
    free(csg->gate);
    free(csg->idle);
    free(csg->node);
    free(csg->item);
    free(csg->token);
    free(csg);
}

/* ---- Building ---- */

/* What is known of each token while the tree is built. The right operand of token i ends at i - 1, the left one before
 * that; so ascending order has operands before operators and descending order the other way round. */
typedef struct {
    Box box;             /* first that of its solid, later cut down to the boxes above */
    uint32_t size;       /* tokens of its subtree */
    uint32_t first_leaf;
    uint32_t shown;      /* whose material shows, NONE for its own */
    uint32_t gate;
    bool flip;
} Work;

/* Copies the tokens and puts the trees of CSG primitives among the leaves in their places, so that a leaf number alone
 * identifies a surface to any depth. */
static void copy_tokens(Csg *csg, const CsgToken *tokens, size_t count, uint32_t *origin)
{
    uint32_t n = 0;
    for (size_t i = 0; i < count; i++) {
        const Csg *inner = tokens[i].is_leaf && tokens[i].prim->ops == &OPS ? (const Csg *)tokens[i].prim : NULL;
        for (uint32_t k = 0; k < (inner ? inner->token_count : 1); k++, n++) {
            csg->token[n] = inner ? inner->token[k] : tokens[i];
            if (inner && inner->token[k].is_leaf)
                csg->token[n].to_csg = affine_mul(&tokens[i].to_csg, &inner->token[k].to_csg);
            origin[n] = (uint32_t)i;
        }
    }
    assert(n == csg->token_count);
}

static bool is_identity(const Affine *a)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++)
            if (a->m[i][j] != (i == j)) return false;
    return true;
}

static Vec3 translation(const Affine *a) { return vec3_make(a->m[0][3], a->m[1][3], a->m[2][3]); }

static Vec3 box_middle(Box b) { return vec3_add(vec3_scale(b.lo, 0.5), vec3_scale(b.hi, 0.5)); }

/* The point's image to a single rounding, whatever cancels in it: in double-double, with the greatest entry at 1 so that no
 * product is out of range. */
static Vec3 image_of(const Affine *a, Vec3 p)
{
    double image[3], greatest = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++) greatest = fmax(greatest, fabs(a->m[i][j]));
    int e = ilogb(greatest);
    Affine near = affine_ldexp(a, -e);
    for (int i = 0; i < 3; i++) {
        const double *m = near.m[i];
        Dd sum = dd_add(dd_add(dd_prod(m[0], p.x), dd_prod(m[1], p.y)), dd_add_d(dd_prod(m[2], p.z), m[3]));
        image[i] = ldexp(sum.hi, e);
    }
    return vec3_make(image[0], image[1], image[2]);
}

/* The greatest distance along each axis from the origin. */
static Vec3 box_reaches(Box b) { return vec3_most(vec3_abs(b.lo), vec3_abs(b.hi)); }

/* Fills a leaf; false if its matrix can't be inverted. */
static bool leaf_init(CsgLeaf *leaf, const CsgToken *token)
{
    leaf->prim = token->prim;
    leaf->to_csg = token->to_csg;
    if (!affine_inverse(&token->to_csg, &leaf->to_leaf)) return false;
    leaf->identity = is_identity(&token->to_csg);
    if (leaf->identity) leaf->to_leaf = token->to_csg;  /* without the negative zeros */
    leaf->bounds = token->prim->ops->bounds(token->prim);
    Vec3 reach = affine_abs_vector(&leaf->to_csg, box_reaches(leaf->bounds));
    Vec3 place = vec3_add(reach, vec3_abs(translation(&leaf->to_csg)));
    leaf->leaf_middle = box_is_empty(leaf->bounds) ? vec3_make(0, 0, 0) : box_middle(leaf->bounds);
    leaf->middle = image_of(&leaf->to_csg, leaf->leaf_middle);
    leaf->spread = vec3_scale(affine_abs_vector(&leaf->to_leaf, place), GAMMA(MATRIX_ROUNDINGS));
    /* the middle's rounding, and that of coming back to it */
    Vec3 middle = vec3_add(vec3_abs(leaf->leaf_middle), affine_abs_vector(&leaf->to_leaf, vec3_abs(leaf->middle)));
    leaf->spread = vec3_at(leaf->spread, GAMMA(1), middle);
    leaf->spread_most = largest(leaf->spread);
    leaf->growth = GAMMA(5) * largest(affine_abs_vector(&leaf->to_leaf, vec3_make(1, 1, 1)));
    leaf->skin = vec3_scale(place, 4 * GAMMA(MATRIX_ROUNDINGS));
    return true;
}

/* Sizes, leaves and boxes, from the operands up. False with *bad (index among the expanded tokens). */
static bool build_up(Csg *csg, Work *work, uint32_t *bad)
{
    uint32_t leaves = 0;
    for (uint32_t i = 0; i < csg->token_count; i++) {
        const CsgToken *token = &csg->token[i];
        Work *w = &work[i];
        if (token->is_leaf) {
            CsgLeaf *leaf = &csg->leaf[leaves];
            if (!leaf_init(leaf, token)) {
                *bad = i;
                return false;
            }
            *w = (Work){.size = 1, .first_leaf = leaves++};
            w->box = box_pad(affine_box(&leaf->to_csg, leaf->bounds), leaf->skin);
            continue;
        }
        const Work *right = w - 1, *left = right - right->size;
        *w = (Work){.size = 1 + left->size + right->size, .first_leaf = left->first_leaf};
        switch (token->op) {
        case CSG_UNION: w->box = box_union(left->box, right->box); break;
        case CSG_DIFF: w->box = left->box; break;
        case CSG_INTERSECT: w->box = box_overlap(left->box, right->box); break;
        }
    }
    return true;
}

/* Puts an operand, a leaf or a gate, under a gate. Far away just the complements are on. */
static void gate_add_operand(Csg *csg, uint32_t gate, bool flip, bool is_and)
{
    csg->gate[gate].threshold = is_and ? csg->gate[gate].threshold + 1 : 1;
    csg->idle[gate].count += flip;
}

/* Complements, gates, shown leaves and the boxes' cuts, from the root down. */
static void build_down(Csg *csg, Work *work, bool *gate_is_and)
{
    uint32_t root = csg->token_count - 1;
    csg->gate[0] = (CsgGate){.parent = NONE};
    gate_is_and[0] = !csg->token[root].is_leaf && csg->token[root].op != CSG_UNION;
    csg->gate_count = 1;
    work[root].shown = NONE;
    work[root].gate = 0;
    for (uint32_t i = root + 1; i-- > 0;) {
        const CsgToken *token = &csg->token[i];
        Work *w = &work[i];
        if (token->is_leaf) {
            CsgLeaf *leaf = &csg->leaf[w->first_leaf];
            leaf->gate = w->gate;
            leaf->flip = w->flip;
            leaf->shown = w->shown == NONE ? w->first_leaf : w->shown;
            gate_add_operand(csg, w->gate, w->flip, gate_is_and[w->gate]);
            continue;
        }
        bool is_and = (token->op != CSG_UNION) != w->flip;
        if (is_and != gate_is_and[w->gate]) {
            uint32_t gate = csg->gate_count++;
            csg->gate[gate] = (CsgGate){.parent = w->gate};
            gate_is_and[gate] = is_and;
            gate_add_operand(csg, w->gate, w->flip, !is_and);
            w->gate = gate;
        }
        Work *right = w - 1, *left = right - right->size;
        bool diff = token->op == CSG_DIFF;
        left->flip = w->flip;
        right->flip = w->flip != diff;
        left->shown = w->shown;
        right->shown = diff && w->shown == NONE ? w->first_leaf : w->shown;
        left->gate = right->gate = w->gate;
        left->box = box_overlap(left->box, w->box);
        right->box = box_overlap(right->box, w->box);
    }
    for (uint32_t g = 0; g < csg->gate_count; g++) csg->idle[g].settled = gate_is_on(csg, csg->idle, g);
}

typedef struct {
    double key;
    CsgItem item;
} SortItem;

static int compare_items(const void *a, const void *b)
{
    const SortItem *x = a, *y = b;
    if (x->key != y->key) return x->key < y->key ? -1 : 1;
    return x->item.leaf < y->item.leaf ? -1 : x->item.leaf > y->item.leaf;
}

/* The hierarchy over items [first, first + count): halves at the median along the longest axis of the middles. It is
 * as deep as the logarithm of their number. */
static void build_node(Csg *csg, SortItem *item, uint32_t first, uint32_t count)
{
    CsgNode *node = &csg->node[csg->node_count++];
    Box box = box_empty(), middles = box_empty();
    for (uint32_t i = first; i < first + count; i++) {
        box = box_union(box, item[i].item.box);
        middles = box_add_point(middles, box_middle(item[i].item.box));
    }
    *node = (CsgNode){.box = box};
    if (count <= LEAVES_PER_NODE) {
        node->first = first;
        node->count = count;
    } else {
        Vec3 extent = vec3_sub(middles.hi, middles.lo);
        int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
        for (uint32_t i = first; i < first + count; i++) item[i].key = vec3_get(box_middle(item[i].item.box), axis);
        qsort(item + first, count, sizeof *item, compare_items);
        build_node(csg, item, first, count / 2);
        build_node(csg, item, first + count / 2, count - count / 2);
    }
    node->skip = csg->node_count;
}

/* The place's error, in CSG space, for rays that start on the leaf within the solid's bounds: their way through these is no
 * longer along any axis than the bounds are. */
static Vec3 departure_error(const CsgLeaf *leaf, double radius)
{
    Vec3 half = vec3_scale(vec3_sub(leaf->bounds.hi, leaf->bounds.lo), 0.5), still = {0, 0, 0};
    Vec3 way = vec3_add(affine_abs_vector(&leaf->to_csg, half), vec3_scale(vec3_make(radius, radius, radius), 2));
    return affine_abs_vector(&leaf->to_csg, place_error(leaf, vec3_add(leaf->middle, way), still, 0));
}

/* Whether a leaf's place is known so badly, for rays from as far as CSG_FAR_ORIGIN times the reach, that lines which
 * SegList.along says nothing of may be in its faces. */
static bool is_coarse(const CsgLeaf *leaf, double reach)
{
    Vec3 far = vec3_scale(vec3_make(reach, reach, reach), 2 * CSG_FAR_ORIGIN + 2), still = {0, 0, 0};
    Vec3 e = place_error(leaf, vec3_add(leaf->middle, far), still, 0), extent = vec3_sub(leaf->bounds.hi, leaf->bounds.lo);
    return !(e.x <= ALONG * extent.x && e.y <= ALONG * extent.y && e.z <= ALONG * extent.z);
}

static bool build_hierarchy(Csg *csg, const Work *work)
{
    SortItem *item = malloc(csg->leaf_count * sizeof *item);
    csg->item = malloc(csg->leaf_count * sizeof *csg->item);
    csg->node = malloc(2 * (size_t)csg->leaf_count * sizeof *csg->node);
    bool ok = item && csg->item && csg->node;
    if (ok) {
        double pad = GAMMA(SLAB_ROUNDINGS) * csg->reach;
        for (uint32_t i = 0; i < csg->token_count; i++) {
            if (!csg->token[i].is_leaf || box_is_empty(work[i].box)) continue;
            Box box = box_pad(work[i].box, vec3_make(pad, pad, pad));
            item[csg->item_count++] = (SortItem){0, {box, work[i].first_leaf}};
        }
        if (csg->item_count > 0) build_node(csg, item, 0, csg->item_count);
        for (uint32_t i = 0; i < csg->item_count; i++) csg->item[i] = item[i].item;
    }
    free(item);
    return ok;
}

static bool build(Csg *csg, const CsgToken *tokens, size_t count, size_t *bad, Err *err)
{
    size_t n = 0;
    for (size_t i = 0; i < count; i++)
        n += tokens[i].is_leaf && tokens[i].prim->ops == &OPS ? ((const Csg *)tokens[i].prim)->token_count : 1;
    if (n > UINT32_MAX / 4) return err_set(err, ERR_LIMIT, "too many operands of constructive solid geometry");
    csg->token_count = (uint32_t)n;
    csg->leaf_count = (uint32_t)(n / 2 + 1);
    csg->token = malloc(n * sizeof *csg->token);
    csg->leaf = calloc(csg->leaf_count, sizeof *csg->leaf);
    csg->gate = calloc(csg->leaf_count, sizeof *csg->gate);
    csg->idle = calloc(csg->leaf_count, sizeof *csg->idle);
    uint32_t *origin = malloc(n * sizeof *origin);
    Work *work = calloc(n, sizeof *work);
    bool *gate_is_and = malloc(csg->leaf_count * sizeof *gate_is_and);
    bool ok = csg->token && csg->leaf && csg->gate && csg->idle && origin && work && gate_is_and;
    if (!ok) err_memory(err, "constructive solid geometry");

    uint32_t bad_token;
    if (ok) {
        copy_tokens(csg, tokens, count, origin);
        ok = build_up(csg, work, &bad_token);
        if (!ok) {
            *bad = origin[bad_token];
            err_set(err, ERR_SCENE, "the matrix of an operand can't be inverted");
        }
    }
    if (ok) {
        assert(work[n - 1].size == n);
        csg->bounds = work[n - 1].box;
        csg->reach = box_reach(csg->bounds);
        csg->centre = box_is_empty(csg->bounds) ? vec3_make(0, 0, 0) : box_middle(csg->bounds);
        csg->radius = box_is_empty(csg->bounds) ? 0 : vec3_max(vec3_sub(csg->bounds.hi, csg->centre));
        for (uint32_t i = 0; i < csg->leaf_count; i++) {
            csg->leaf[i].coarse = is_coarse(&csg->leaf[i], csg->reach);
            csg->leaf[i].departure = departure_error(&csg->leaf[i], csg->radius);
        }
        build_down(csg, work, gate_is_and);
        ok = build_hierarchy(csg, work);
        if (!ok) err_memory(err, "constructive solid geometry");
    }
    free(origin);
    free(work);
    free(gate_is_and);
    return ok;
}

Prim *csg_create(const CsgToken *tokens, size_t count, size_t *bad, Err *err)
{
    assert(count > 0);
    *bad = count;
    Csg *csg = calloc(1, sizeof *csg);
    if (!csg) {
        err_memory(err, "constructive solid geometry");
        return NULL;
    }
    csg->prim.ops = &OPS;
    if (!build(csg, tokens, count, bad, err)) {
        csg_destroy(&csg->prim);
        return NULL;
    }
    return &csg->prim;
}

const Csg *csg_data(const Prim *prim) { return prim->ops == &OPS ? (const Csg *)prim : NULL; }

uint32_t csg_shown_leaf(const Prim *csg, uint32_t leaf) { return ((const Csg *)csg)->leaf[leaf].shown; }

uint32_t csg_leaf_count(const Prim *csg) { return ((const Csg *)csg)->leaf_count; }

static const PrimOps OPS = {
    .name = "constructive solid geometry",
    .closed = true,
    .bounds = csg_bounds,
    .intersect = csg_intersect,
    .occluded = csg_occluded,
    .segments = csg_segments,
    .surface = csg_surface,
    .destroy = csg_destroy,
};
