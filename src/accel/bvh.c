/* 1. split    the boxes are parted by binned SAH (Wald, "On fast construction of SAH-based bounding volume hierarchies",
 *             2007) into a binary tree: ranges of more than PIECE boxes level by level, all threads at work on one range
 *             as well as on many; what is smaller, a piece, by one thread, many pieces at once.
 *    2. collapse  from the leaves up, the wide nodes of least area are chosen for each subtree and each number of places
 *             that it may take in the node above it (Ylitie, Karras, Laine, "Efficient incoherent ray traversal on GPUs
 *             through compressed wide BVHs", 2017, 3.1).
 *    3. emit     the wide nodes are counted and written, again piece by piece.
 * Minima, maxima and counts don't depend on the order in which they are taken, and everything is cut by sizes that don't
 * depend on the threads: nor does the result. */
#include "accel/bvh.h"

#include <float.h>
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "accel/traverse.h"
#include "common/memory.h"
#include "common/parallel.h"

enum {
    BINS = 32,
    PIECE = 4096,       /* boxes that one thread takes at once */
    MEDIAN_DEPTH = 60,  /* below it ranges are halved by count: bounds the depth whatever the boxes are */
};
_Static_assert(MEDIAN_DEPTH + 32 <= BVH_MAX_DEPTH, "halving ends within 32 levels");

/* ---- boxes as two vectors ---- */

/* The fourth lane holds whatever: it takes part in minima and maxima only. */
typedef struct { Float4 lo, hi; } Box4;

static inline Box4 box4_empty(void) { return (Box4){float4_set(INFINITY), float4_set(-INFINITY)}; }

static inline Box4 box4_of(const BvhRef *ref) { return (Box4){float4_load(ref->lo), float4_load(ref->hi)}; }

static inline Box4 box4_union(Box4 a, Box4 b) { return (Box4){float4_min(a.lo, b.lo), float4_max(a.hi, b.hi)}; }

static BoxF boxf_of(Box4 b) { return (BoxF){{b.lo[0], b.lo[1], b.lo[2]}, {b.hi[0], b.hi[1], b.hi[2]}}; }

static inline Float4 first_three(Float4 a) { return (Float4)((Int4)a & (Int4){-1, -1, -1, 0}); }

/* Twice the centre; the item's number is kept out of the sum, since it would be a subnormal one. Infinite beyond half of
 * the floats' range: such an axis isn't split by SAH. */
static inline Float4 centre_of(Box4 b) { return first_three(b.lo) + b.hi; }

/* Half the surface. */
static inline float half_area(Box4 b)
{
    Float4 d = b.hi - b.lo;
    return d[0] * d[1] + d[1] * d[2] + d[2] * d[0];
}

/* The same of three boxes; no number for an empty one. */
static inline Float4 half_areas(Box4 a, Box4 b, Box4 c)
{
    Float4 p = a.hi - a.lo, q = b.hi - b.lo, r = c.hi - c.lo;
    Float4 x = {p[0], q[0], r[0], 0}, y = {p[1], q[1], r[1], 0}, z = {p[2], q[2], r[2], 0};
    return x * y + y * z + z * x;
}

/* ---- ranges and their splits ---- */

typedef struct {
    Box4 box, centre;   /* of the items' boxes; of centre_of them */
    uint32_t first, count;
} Range;

/* The boxes whose `centre` on the axis, counted in bins from `low`, is below `bin` go left; axis < 0: none was found. */
typedef struct { int axis; float low, scale, bin, cost; } Split;

/* What is known of the two sides of a split, the left one first, once each box has been looked at. */
typedef struct { Box4 box[2], centre[2]; uint32_t left; } Sides;

typedef struct {
    Box4 box[3][BINS];
    uint32_t count[BINS][4];   /* by axis */
} Bins;

static void bins_clear(Bins *bins, uint32_t n)
{
    for (int a = 0; a < 3; a++)
        for (uint32_t i = 0; i < n; i++) bins->box[a][i] = box4_empty();
    memset(bins->count, 0, n * sizeof bins->count[0]);
}

static void bins_merge(Bins *to, const Bins *from, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++)
        for (int a = 0; a < 3; a++) {
            to->box[a][i] = box4_union(to->box[a][i], from->box[a][i]);
            to->count[i][a] += from->count[i][a];
        }
}

/* Fewer for fewer boxes. */
static uint32_t bin_number(uint32_t count)
{
    uint32_t n = 4 + count / 16;
    return n < BINS ? n : BINS;
}

/* Bins per unit of length; 0 on an axis where all centres coincide or can't be told apart. */
static Float4 bin_scale(const Range *r, uint32_t bins)
{
    Float4 extent = r->centre.hi - r->centre.lo, scale = {0, 0, 0, 0};
    for (int a = 0; a < 3; a++) {
        float s = (float)bins / extent[a];
        if (extent[a] > 0 && s <= FLT_MAX) scale[a] = s;
    }
    return scale;
}

static void bins_fill(Bins *bins, const Range *r, uint32_t n, const BvhRef *ref, uint32_t count)
{
    Float4 low = first_three(r->centre.lo), scale = bin_scale(r, n), zero = float4_set(0), top = float4_set((float)(n - 1));
    for (uint32_t i = 0; i < count; i++) {
        Box4 box = box4_of(&ref[i]);
        Float4 place = float4_min(float4_max((centre_of(box) - low) * scale, zero), top);  /* NaN becomes 0 */
        Int4 bin = __builtin_convertvector(place, Int4);
        for (int a = 0; a < 3; a++) {
            Box4 *to = &bins->box[a][bin[a]];
            *to = box4_union(*to, box);
            bins->count[bin[a]][a]++;
        }
    }
}

/* The number of blocks that each of four counts of items fills, `shift` being the logarithm of a block's size. */
static inline Float4 blocks4(Int4 count, uint32_t shift)
{
    int32_t s = (int32_t)shift, up = (1 << s) - 1;
    return __builtin_convertvector((count + (Int4){up, up, up, up}) >> (Int4){s, s, s, s}, Float4);
}

/* What the right side costs that begins with each bin but the first, the three axes side by side. An empty side has an area
 * that is no number. */
static void right_costs(const Bins *bins, uint32_t n, uint32_t shift, Float4 *cost)
{
    Box4 x = box4_empty(), y = x, z = x;
    Int4 count = {0, 0, 0, 0};
    for (uint32_t i = n - 1; i > 0; i--) {
        x = box4_union(x, bins->box[0][i]);
        y = box4_union(y, bins->box[1][i]);
        z = box4_union(z, bins->box[2][i]);
        count += *(const Int4 *)bins->count[i];
        cost[i] = half_areas(x, y, z) * blocks4(count, shift);
    }
}

/* The split of least cost. A cost that is no number isn't less than any. */
static Split best_split(const Bins *bins, const Range *r, uint32_t n, uint32_t shift)
{
    Float4 right[BINS];
    right_costs(bins, n, shift, right);
    Box4 x = box4_empty(), y = x, z = x;
    Int4 count = {0, 0, 0, 0};
    Float4 best = float4_set(INFINITY);
    Int4 at = {0, 0, 0, 0};
    for (uint32_t i = 1; i < n; i++) {
        x = box4_union(x, bins->box[0][i - 1]);
        y = box4_union(y, bins->box[1][i - 1]);
        z = box4_union(z, bins->box[2][i - 1]);
        count += *(const Int4 *)bins->count[i - 1];
        Float4 cost = half_areas(x, y, z) * blocks4(count, shift) + right[i];
        Int4 less = cost < best;
        best = (Float4)((less & (Int4)cost) | (~less & (Int4)best));
        int32_t here = (int32_t)i;
        at = (less & (Int4){here, here, here, here}) | (~less & at);
    }
    Float4 scale = bin_scale(r, n);
    Split split = {.axis = -1, .cost = INFINITY};
    for (int a = 0; a < 3; a++)
        if (best[a] < split.cost) split = (Split){a, r->centre.lo[a], scale[a], (float)at[a], best[a]};
    return split;
}

static Sides sides_empty(void)
{
    Box4 e = box4_empty();
    return (Sides){{e, e}, {e, e}, 0};
}

static void sides_merge(Sides *to, const Sides *from)
{
    for (int i = 0; i < 2; i++) {
        to->box[i] = box4_union(to->box[i], from->box[i]);
        to->centre[i] = box4_union(to->centre[i], from->centre[i]);
    }
    to->left += from->left;
}

static void side_add(Sides *s, int side, const BvhRef *ref, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        Box4 box = box4_of(&ref[i]);
        Float4 c = centre_of(box);
        s->box[side] = box4_union(s->box[side], box);
        s->centre[side] = box4_union(s->centre[side], (Box4){c, c});
    }
}

/* The first `left` boxes are the left side. */
static Sides sides_by_count(const BvhRef *ref, uint32_t count, uint32_t left)
{
    Sides s = sides_empty();
    s.left = left;
    side_add(&s, 0, ref, left);
    side_add(&s, 1, ref + left, count - left);
    return s;
}

/* Leaves `a` alone in the lanes where b is NaN: that is how min and max choose. */
static inline Box4 grow_unless(Box4 a, Float4 lo, Float4 hi, Int4 nan)
{
    return (Box4){float4_min((Float4)((Int4)lo | nan), a.lo), float4_max((Float4)((Int4)hi | nan), a.hi)};
}

/* Puts the left side's boxes first, without a branch that depends on the box (Lomuto's scheme): every box changes places
 * with the first one of the right side, which then ends before or behind it. */
static Sides partition(BvhRef *ref, uint32_t count, const Split *split)
{
    Box4 e = box4_empty(), left_box = e, right_box = e, left_centre = e, right_centre = e;
    uint32_t left = 0;
    const int axis = split->axis;
    for (uint32_t i = 0; i < count; i++) {
        Box4 box = box4_of(&ref[i]), first = box4_of(&ref[left]);
        Float4 c = centre_of(box);
        bool is_left = (ref[i].lo[axis] + ref[i].hi[axis] - split->low) * split->scale < split->bin;
        *(Float4 *)ref[i].lo = first.lo;
        *(Float4 *)ref[i].hi = first.hi;
        *(Float4 *)ref[left].lo = box.lo;
        *(Float4 *)ref[left].hi = box.hi;
        left += is_left;
        int32_t l = -(int32_t)is_left;
        Int4 in_left = {l, l, l, l}, in_right = ~in_left;
        left_box = grow_unless(left_box, box.lo, box.hi, in_right);
        right_box = grow_unless(right_box, box.lo, box.hi, in_left);
        left_centre = grow_unless(left_centre, c, c, in_right);
        right_centre = grow_unless(right_centre, c, c, in_left);
    }
    return (Sides){{left_box, right_box}, {left_centre, right_centre}, left};
}

static Range range_of_side(const Range *r, const Sides *s, int side)
{
    if (side == 0) return (Range){s->box[0], s->centre[0], r->first, s->left};
    return (Range){s->box[1], s->centre[1], r->first + s->left, r->count - s->left};
}

/* ---- the binary tree ---- */

/* Stored in preorder, the left child behind its parent. */
typedef struct {
    float lo[3];
    uint32_t at;      /* inner: distance to the right child; leaf: first box; STUB: the piece that stands here */
    float hi[3];
    uint32_t kind;    /* LEAF and the number of boxes; STUB; else shares (see collapse), with TOP outside of pieces */
} Binary;

#define LEAF 0x80000000u
#define STUB 0x40000000u
#define TOP 0x20000000u

/* The least sum of the areas of the wide nodes by which a subtree can take up to 1, 2, ... 7 places in the one above. */
typedef struct { float cost[BVH_WIDTH - 1]; } Costs;

/* Ranges of more than PIECE boxes, in the order of levels, and what they are parted into. */
typedef struct {
    Range range;
    Split split;
    Sides sides;
    uint32_t left, right;   /* 0: to be a piece */
    uint32_t piece;
} Top;

typedef struct {
    Range range;
    uint32_t depth;
    Binary *node;
    Costs costs;
} Piece;

/* A part of a Top being parted. misplaced_*: the number of its boxes, and of those of the node's parts before it, that
 * are right ones on the left side and left ones on the right side. */
typedef struct {
    uint32_t top, first, count;
    Sides sides;
    uint32_t right_before, right_here, left_before, left_here;
} Chunk;

/* A wide node, and the subtree that is to be written below it. */
typedef struct { const Binary *root; uint32_t node; uint32_t count; uint32_t first; } Emission;

/* What a thread works in. */
typedef struct { Bins bins; Binary node[2 * PIECE]; } Workspace;

typedef struct {
    BvhRef *ref;
    uint32_t count;
    const BvhSettings *settings;
    uint32_t shift;             /* of the block */
    uint32_t threads;
    Top *top;
    uint32_t top_count, top_capacity;
    uint32_t level_first, level_end;   /* the level being parted */
    Chunk *chunk;
    Bins *bins;                 /* one for each chunk */
    uint32_t chunk_count;
    Piece *piece;
    uint32_t piece_count;
    Workspace **workspace;      /* one for each thread */
    Binary *root;               /* the tops and stubs, in preorder */
    Emission *emission;
    uint32_t emission_count;
    BvhNode *node;
    uint32_t node_count;
    uint32_t *order;
    atomic_bool failed;         /* no memory */
} Build;

/* Whether a range that may be a leaf is better parted, its sides costing `sides` and its node as much as a wide one. */
static bool pays(const Build *b, const Range *r, float sides)
{
    float area = half_area(r->box);
    float whole = b->settings->block_cost * (float)((r->count + b->settings->block - 1) >> b->shift) * area;
    return area + b->settings->block_cost * sides < whole;
}

/* Whether SAH can make a leaf of the range without trying. Parting adds a node and leaves at least a block of no area. */
static bool is_surely_leaf(const Build *b, const Range *r)
{
    return r->count == 1 || (r->count <= b->settings->max_leaf && !pays(b, r, 0));
}

/* ---- collapse ---- */

/* Where a node may take i places, 2 to 8, its left child gets `share` of them; 0: one place fewer is no worse. */
static inline uint32_t share_of(uint32_t shares, uint32_t i) { return shares >> (3 * (i - 2)) & 7; }

static uint32_t collapse(float area, const Costs *left, const Costs *right, Costs *costs)
{
    uint32_t shares = 0;
    float parted[BVH_WIDTH + 1];
    for (uint32_t i = 2; i <= BVH_WIDTH; i++) {
        uint32_t share = 1;
        parted[i] = INFINITY;
        for (uint32_t k = 1; k < i; k++) {
            float cost = left->cost[k - 1] + right->cost[i - k - 1];
            if (cost < parted[i]) {
                parted[i] = cost;
                share = k;
            }
        }
        shares |= share << (3 * (i - 2));
    }
    costs->cost[0] = area + parted[BVH_WIDTH];
    for (uint32_t i = 2; i < BVH_WIDTH; i++) {
        costs->cost[i - 1] = parted[i];
        if (!(parted[i] < costs->cost[i - 2])) {
            costs->cost[i - 1] = costs->cost[i - 2];
            shares &= ~(7u << (3 * (i - 2)));
        }
    }
    return shares;
}

static void set_box(Binary *n, Box4 box)
{
    BoxF f = boxf_of(box);
    memcpy(n->lo, f.lo, sizeof n->lo);
    memcpy(n->hi, f.hi, sizeof n->hi);
}

/* ---- pieces ---- */

typedef struct { const Build *build; Workspace *space; uint32_t count; } PieceBuild;

static bool split_small(const PieceBuild *p, const Range *r, uint32_t depth, Sides *sides)
{
    const Build *b = p->build;
    BvhRef *ref = b->ref + r->first;
    bool must = r->count > b->settings->max_leaf;
    if (depth < MEDIAN_DEPTH && !is_surely_leaf(b, r)) {
        uint32_t bins = bin_number(r->count);
        bins_clear(&p->space->bins, bins);
        bins_fill(&p->space->bins, r, bins, ref, r->count);
        Split split = best_split(&p->space->bins, r, bins, b->shift);
        if (split.axis >= 0 && (must || pays(b, r, split.cost))) {
            *sides = partition(ref, r->count, &split);
            return true;
        }
    }
    if (must) *sides = sides_by_count(ref, r->count, r->count / 2);
    return must;
}

static Costs build_piece(PieceBuild *p, const Range *r, uint32_t depth)
{
    Binary *n = &p->space->node[p->count++];
    Sides sides;
    set_box(n, r->box);
    if (!split_small(p, r, depth, &sides)) {
        n->at = r->first;
        n->kind = LEAF | r->count;
        return (Costs){{0}};
    }
    Range side = range_of_side(r, &sides, 0);
    Costs costs, left = build_piece(p, &side, depth + 1);
    n->at = (uint32_t)(&p->space->node[p->count] - n);
    side = range_of_side(r, &sides, 1);
    Costs right = build_piece(p, &side, depth + 1);
    n->kind = collapse(half_area(r->box), &left, &right, &costs);
    return costs;
}

static void piece_turn(void *context, uint32_t i, uint32_t worker)
{
    Build *b = context;
    Piece *piece = &b->piece[i];
    Workspace **space = &b->workspace[worker];
    if (atomic_load_explicit(&b->failed, memory_order_relaxed)) return;
    if (!*space) *space = memory_array(1, sizeof **space);
    if (*space) {
        PieceBuild p = {b, *space, 0};
        piece->costs = build_piece(&p, &piece->range, piece->depth);
        piece->node = malloc(p.count * sizeof *piece->node);
        if (piece->node) memcpy(piece->node, (*space)->node, p.count * sizeof *piece->node);
    }
    if (!piece->node) atomic_store_explicit(&b->failed, true, memory_order_relaxed);
}

/* ---- the top ---- */

static bool is_large(const Top *t) { return t->range.count > PIECE; }

static bool add_top(Build *b, Range range)
{
    if (b->top_count == b->top_capacity) {
        uint32_t capacity = 2 * b->top_capacity + 16;
        Top *top = memory_array(capacity, sizeof *top);
        if (!top) return false;
        if (b->top_count) memcpy(top, b->top, b->top_count * sizeof *top);
        free(b->top);
        b->top = top;
        b->top_capacity = capacity;
    }
    b->top[b->top_count++] = (Top){.range = range};
    return true;
}

/* Cuts the large ranges of the level into chunks. */
static void make_chunks(Build *b)
{
    b->chunk_count = 0;
    for (uint32_t i = b->level_first; i < b->level_end; i++) {
        const Range *r = &b->top[i].range;
        if (!is_large(&b->top[i])) continue;
        for (uint32_t k = 0; k < parallel_chunks(r->count); k++) {
            uint32_t begin = k * PARALLEL_CHUNK, end = parallel_chunk_end(k, r->count);
            b->chunk[b->chunk_count++] = (Chunk){.top = i, .first = r->first + begin, .count = end - begin};
        }
    }
}

static void bounds_turn(void *context, uint32_t i, uint32_t worker)
{
    (void)worker;
    Build *b = context;
    uint32_t first = i * PARALLEL_CHUNK;
    b->chunk[i].sides = sides_by_count(b->ref + first, parallel_chunk_end(i, b->count) - first, 0);
}

static void bins_turn(void *context, uint32_t i, uint32_t worker)
{
    (void)worker;
    Build *b = context;
    const Chunk *c = &b->chunk[i];
    bins_clear(&b->bins[i], BINS);
    bins_fill(&b->bins[i], &b->top[c->top].range, BINS, b->ref + c->first, c->count);
}

static void partition_turn(void *context, uint32_t i, uint32_t worker)
{
    (void)worker;
    Build *b = context;
    Chunk *c = &b->chunk[i];
    const Top *t = &b->top[c->top];
    if (t->split.axis >= 0) {
        c->sides = partition(b->ref + c->first, c->count, &t->split);
    } else {
        uint32_t middle = t->range.first + t->range.count / 2, end = c->first + c->count;
        uint32_t left = middle <= c->first ? 0 : middle >= end ? c->count : middle - c->first;
        c->sides = sides_by_count(b->ref + c->first, c->count, left);
    }
}

/* Chooses the split of the range that the chunks [first, end) cut. */
static void choose_split(Build *b, uint32_t first, uint32_t end, uint32_t depth)
{
    Top *t = &b->top[b->chunk[first].top];
    t->split = (Split){.axis = -1};
    if (depth >= MEDIAN_DEPTH) return;
    for (uint32_t k = first + 1; k < end; k++) bins_merge(&b->bins[first], &b->bins[k], BINS);
    t->split = best_split(&b->bins[first], &t->range, BINS, b->shift);
}

/* Sums up what the chunks [first, end) have found and how many of their boxes are on the wrong side. */
static void gather_sides(Build *b, uint32_t first, uint32_t end)
{
    Top *t = &b->top[b->chunk[first].top];
    t->sides = sides_empty();
    for (uint32_t k = first; k < end; k++) sides_merge(&t->sides, &b->chunk[k].sides);
    uint32_t boundary = t->range.first + t->sides.left, right = 0, left = 0;
    for (uint32_t k = first; k < end; k++) {
        Chunk *c = &b->chunk[k];
        uint32_t middle = c->first + c->sides.left, stop = c->first + c->count;
        c->right_before = right;
        c->left_before = left;
        c->right_here = middle >= boundary ? 0 : (stop < boundary ? stop : boundary) - middle;
        c->left_here = middle <= boundary ? 0 : middle - (c->first > boundary ? c->first : boundary);
        right += c->right_here;
        left += c->left_here;
    }
}

/* Exchanges the misplaced right boxes of a chunk with the misplaced left ones that have the same places among theirs:
 * those stand further behind. */
static void exchange_turn(void *context, uint32_t i, uint32_t worker)
{
    (void)worker;
    Build *b = context;
    const Chunk *c = &b->chunk[i], *from = c;
    if (c->right_here == 0) return;
    while (from->left_before + from->left_here <= c->right_before) from++;
    uint32_t skip = c->right_before - from->left_before;
    BvhRef *right = b->ref + c->first + c->sides.left;
    for (uint32_t k = 0; k < c->right_here; k++) {
        while (skip == from->left_here) {
            from++;
            skip = 0;
        }
        BvhRef *left = b->ref + from->first + from->sides.left - from->left_here + skip++;
        BvhRef t = right[k];
        right[k] = *left;
        *left = t;
    }
}

/* Where the chunks end that cut the same range as this one. */
static uint32_t range_end(const Build *b, uint32_t first)
{
    uint32_t end = first;
    while (end < b->chunk_count && b->chunk[end].top == b->chunk[first].top) end++;
    return end;
}

/* Parts the large ranges of the level; their sides are the next level. */
static bool split_level(Build *b, uint32_t depth)
{
    make_chunks(b);
    parallel_for(b->threads, b->chunk_count, bins_turn, b);
    for (uint32_t first = 0, end; first < b->chunk_count; first = end) {
        end = range_end(b, first);
        choose_split(b, first, end, depth);
    }
    parallel_for(b->threads, b->chunk_count, partition_turn, b);
    for (uint32_t first = 0, end; first < b->chunk_count; first = end) {
        end = range_end(b, first);
        gather_sides(b, first, end);
    }
    parallel_for(b->threads, b->chunk_count, exchange_turn, b);
    for (uint32_t i = b->level_first; i < b->level_end; i++) {
        if (!is_large(&b->top[i])) continue;
        for (int side = 0; side < 2; side++)
            if (!add_top(b, range_of_side(&b->top[i].range, &b->top[i].sides, side))) return false;
        b->top[i].left = b->top_count - 2;
        b->top[i].right = b->top_count - 1;
    }
    b->level_first = b->level_end;
    b->level_end = b->top_count;
    return true;
}

static bool split_top(Build *b)
{
    /* A level has at most one chunk more than whole ones for each of its large ranges, which hold more than a chunk. */
    uint32_t chunks = 2 * parallel_chunks(b->count);
    b->chunk = memory_array(chunks, sizeof *b->chunk);
    if (!b->chunk) return false;
    parallel_for(b->threads, parallel_chunks(b->count), bounds_turn, b);
    Sides all = sides_empty();
    for (uint32_t i = 0; i < parallel_chunks(b->count); i++) sides_merge(&all, &b->chunk[i].sides);
    if (!add_top(b, (Range){all.box[1], all.centre[1], 0, b->count})) return false;
    b->level_end = 1;
    if (b->count > PIECE && !(b->bins = memory_array(chunks, sizeof *b->bins))) return false;
    for (uint32_t depth = 0; b->level_first < b->level_end; depth++)
        if (!split_level(b, depth)) return false;
    return true;
}

/* ---- both together ---- */

/* Gives the pieces below a top their places in order. */
static void number_pieces(Build *b, uint32_t top, uint32_t depth)
{
    Top *t = &b->top[top];
    if (t->left) {
        number_pieces(b, t->left, depth + 1);
        number_pieces(b, t->right, depth + 1);
    } else {
        t->piece = b->piece_count;
        b->piece[b->piece_count++] = (Piece){.range = t->range, .depth = depth};
    }
}

static bool build_pieces(Build *b)
{
    b->piece = memory_array(b->top_count, sizeof *b->piece);
    b->workspace = calloc(b->threads, sizeof *b->workspace);
    if (!b->piece || !b->workspace) return false;
    number_pieces(b, 0, 0);
    parallel_for(b->threads, b->piece_count, piece_turn, b);
    return !atomic_load(&b->failed);
}

/* Writes a top and what is below it to *out, which moves on. */
static Costs flatten(const Build *b, uint32_t top, Binary **out)
{
    const Top *t = &b->top[top];
    Binary *n = (*out)++;
    if (!t->left) {
        *n = (Binary){.at = t->piece, .kind = STUB};
        return b->piece[t->piece].costs;
    }
    Costs costs, left = flatten(b, t->left, out);
    n->at = (uint32_t)(*out - n);
    Costs right = flatten(b, t->right, out);
    set_box(n, t->range.box);
    n->kind = TOP | collapse(half_area(t->range.box), &left, &right, &costs);
    return costs;
}

/* ---- emit ---- */

static const Binary *enter(const Build *b, const Binary *n) { return n->kind & STUB ? b->piece[n->at].node : n; }

static bool is_leaf(const Binary *n) { return n->kind & LEAF; }

/* Adds the nodes to `child` by which a subtree takes up to `places` places of a wide node; returns their number with it. */
static uint32_t gather(const Build *b, const Binary *n, uint32_t places, const Binary **child, uint32_t count)
{
    n = enter(b, n);
    uint32_t share = 0;
    if (!is_leaf(n))
        while (places > 1 && (share = share_of(n->kind, places)) == 0) places--;
    if (share == 0) {
        child[count] = n;
        return count + 1;
    }
    count = gather(b, n + 1, share, child, count);
    return gather(b, n + n->at, places - share, child, count);
}

static uint32_t children(const Build *b, const Binary *root, const Binary **child)
{
    return gather(b, root, BVH_WIDTH, child, 0);
}

/* The number of wide nodes below that of a subtree; in the top only those in the top and the first of each emission. */
static uint32_t count_below(const Build *b, const Binary *root)
{
    const Binary *child[BVH_WIDTH];
    uint32_t count = 0;
    for (uint32_t n = children(b, root, child); n-- > 0;) {
        if (is_leaf(child[n])) continue;
        count++;
        if ((root->kind & TOP) == (child[n]->kind & TOP)) count += count_below(b, child[n]);
    }
    return count;
}

/* The children by the middles of their boxes along each octant's diagonal. */
static void order_children(BvhNode *node)
{
    for (uint32_t octant = 0; octant < 4; octant++) {
        float key[BVH_WIDTH] = {0};
        uint32_t order[BVH_WIDTH] = {0};
        for (uint32_t i = 0; i < BVH_WIDTH; i++) {
            float k = 0;
            for (uint32_t a = 0; a < 3; a++) {
                float c = node->lo[a][i] + node->hi[a][i];
                k += octant >> a & 1 ? -c : c;
            }
            if (i >= node->used) k = -INFINITY;
            uint32_t at = i;
            for (; at > 0 && key[at - 1] < k; at--) {
                key[at] = key[at - 1];
                order[at] = order[at - 1];
            }
            key[at] = k;
            order[at] = i;
        }
        node->order[octant] = 0;
        for (uint32_t i = 0; i < BVH_WIDTH; i++) node->order[octant] |= order[i] << (3 * i);
    }
}

static void write_node(BvhNode *to, const Binary *const *child, uint32_t n, uint32_t first)
{
    for (uint32_t i = 0; i < BVH_WIDTH; i++) {
        const Binary *c = i < n ? child[i] : NULL;
        for (int a = 0; a < 3; a++) {
            to->lo[a][i] = c ? c->lo[a] : INFINITY;
            to->hi[a][i] = c ? c->hi[a] : -INFINITY;
        }
        to->child[i] = !c ? 0 : is_leaf(c) ? BVH_LEAF | c->at : first++;
        to->count[i] = c && is_leaf(c) ? (uint8_t)(c->kind & 0xff) : 0;
    }
    to->used = (uint8_t)n;
    order_children(to);
}

/* Writes the wide node `node` of a subtree and those below it, which are numbered from *next on, siblings next to each
 * other. In the top, what is below a piece's nodes is left to emissions. */
static void emit(Build *b, const Binary *root, uint32_t node, uint32_t *next)
{
    const Binary *child[BVH_WIDTH];
    uint32_t n = children(b, root, child), first = *next;
    memset(&b->node[node], 0, sizeof *b->node);
    write_node(&b->node[node], child, n, first);
    for (uint32_t i = 0; i < n; i++) *next += !is_leaf(child[i]);
    for (uint32_t i = 0; i < n; i++) {
        if (is_leaf(child[i])) continue;
        if ((root->kind & TOP) == (child[i]->kind & TOP))
            emit(b, child[i], first, next);
        else
            b->emission[b->emission_count++] = (Emission){.root = child[i], .node = first};
        first++;
    }
}

static void count_turn(void *context, uint32_t i, uint32_t worker)
{
    (void)worker;
    Build *b = context;
    b->emission[i].count = count_below(b, b->emission[i].root);
}

static void emit_turn(void *context, uint32_t i, uint32_t worker)
{
    (void)worker;
    Build *b = context;
    uint32_t next = b->emission[i].first;
    emit(b, b->emission[i].root, b->emission[i].node, &next);
}

static bool emit_all(Build *b)
{
    b->root = malloc(b->top_count * sizeof *b->root);
    if (!b->root) return false;
    Binary *out = b->root;
    flatten(b, 0, &out);
    const Binary *root = enter(b, b->root);
    uint32_t top = 1, next = 1;
    if (root->kind & TOP) top += count_below(b, root);
    b->emission = malloc(top * sizeof *b->emission);
    b->node = memory_array(top, sizeof *b->node);
    if (!b->emission || !b->node) return false;
    if (root->kind & TOP)
        emit(b, root, 0, &next);
    else
        b->emission[b->emission_count++] = (Emission){.root = root};
    parallel_for(b->threads, b->emission_count, count_turn, b);
    for (uint32_t i = 0; i < b->emission_count; i++) {
        b->emission[i].first = next;
        next += b->emission[i].count;
    }
    BvhNode *node = memory_array(next, sizeof *node);
    if (!node) return false;
    memcpy(node, b->node, top * sizeof *node);
    free(b->node);
    b->node = node;
    b->node_count = next;
    parallel_for(b->threads, b->emission_count, emit_turn, b);
    return true;
}

static void order_turn(void *context, uint32_t i, uint32_t worker)
{
    (void)worker;
    Build *b = context;
    for (uint32_t k = i * PARALLEL_CHUNK; k < parallel_chunk_end(i, b->count); k++) b->order[k] = b->ref[k].item;
}

static void free_build(Build *b)
{
    for (uint32_t i = 0; b->workspace && i < b->threads; i++) free(b->workspace[i]);
    for (uint32_t i = 0; i < b->piece_count; i++) free(b->piece[i].node);
    free(b->workspace);
    free(b->piece);
    free(b->chunk);
    free(b->bins);
    free(b->top);
    free(b->root);
    free(b->emission);
}

bool bvh_build(Bvh *bvh, BvhRef *ref, uint32_t count, const BvhSettings *settings, Err *err)
{
    *bvh = (Bvh){.bounds = boxf_of(box4_empty())};
    if (count == 0) return true;
    Build b = {.ref = ref, .count = count, .settings = settings};
    b.threads = settings->threads ? settings->threads : 1;
    b.shift = (uint32_t)__builtin_ctz(settings->block);
    b.order = malloc((size_t)count * sizeof *b.order);
    bool ok = b.order && split_top(&b) && build_pieces(&b) && emit_all(&b);
    if (ok) {
        parallel_for(b.threads, parallel_chunks(count), order_turn, &b);
        *bvh = (Bvh){.node = b.node, .node_count = b.node_count, .order = b.order, .item_count = count,
                     .bounds = boxf_of(b.top[0].range.box)};
    } else {
        free(b.node);
        free(b.order);
        err_memory(err, "the bounding volume hierarchy");
    }
    if (ok) bvh_set_root(bvh);
    free_build(&b);
    return ok;
}

void bvh_set_root(Bvh *bvh)
{
    const BvhNode *root = bvh->node;
    bvh->root = bvh->node_count == 1 && root->used == 1 ? root->child[0] : 0;
}

void bvh_name_items(Bvh *bvh)
{
    for (uint32_t i = 0; i < bvh->node_count; i++) {
        BvhNode *node = &bvh->node[i];
        for (int k = 0; k < node->used; k++)
            if (node->child[k] & BVH_LEAF) node->child[k] = BVH_LEAF | bvh->order[node->child[k] & ~BVH_LEAF];
    }
    free(bvh->order);
    bvh->order = NULL;
    if (bvh->node_count) bvh_set_root(bvh);
}

void bvh_free(Bvh *bvh)
{
    free(bvh->node);
    free(bvh->order);
    *bvh = (Bvh){0};
}
