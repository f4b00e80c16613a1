/* Binned SAH (Wald, "On fast construction of SAH-based bounding volume hierarchies", 2007). A wide node is made at once
 * from a range of items: the child of the largest area is split until there are eight or none is worth splitting
 * (Wald, Benthin, Boulos, "Getting rid of packets", 2008), so no binary tree is stored in between. */
#include "accel/bvh.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    BINS = 16,
    MEDIAN_DEPTH = 48,  /* below it ranges are halved by count: bounds the depth whatever the boxes are */
};

typedef struct { BoxF box; uint32_t item; } Ref;

typedef struct {
    BoxF box, centre;   /* of the items' boxes; of their centres */
    uint32_t first, count;
    bool done;          /* stays whole */
} Range;

/* A range that awaits its node. */
typedef struct { Range range; uint32_t node; uint32_t depth; } Task;

typedef struct {
    Ref *ref;
    BvhNode *node;
    uint32_t node_count, node_capacity;
    uint32_t max_leaf;
    float item_cost;
} Build;

static float round_down(double x)
{
    float f = (float)x;
    return (double)f > x ? nextafterf(f, -INFINITY) : f;
}

static float round_up(double x)
{
    float f = (float)x;
    return (double)f < x ? nextafterf(f, INFINITY) : f;
}

BoxF boxf_from_box(Box box)
{
    return (BoxF){{round_down(box.lo.x), round_down(box.lo.y), round_down(box.lo.z)},
                  {round_up(box.hi.x), round_up(box.hi.y), round_up(box.hi.z)}};
}

static BoxF boxf_empty(void)
{
    return (BoxF){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
}

static inline void boxf_grow(BoxF *a, const BoxF *b)
{
    for (int i = 0; i < 3; i++) {
        a->lo[i] = b->lo[i] < a->lo[i] ? b->lo[i] : a->lo[i];
        a->hi[i] = b->hi[i] > a->hi[i] ? b->hi[i] : a->hi[i];
    }
}

static inline float centre(const BoxF *b, int axis) { return 0.5f * b->lo[axis] + 0.5f * b->hi[axis]; }

static inline void grow_centre(BoxF *a, const BoxF *b)
{
    for (int i = 0; i < 3; i++) {
        float c = centre(b, i);
        a->lo[i] = c < a->lo[i] ? c : a->lo[i];
        a->hi[i] = c > a->hi[i] ? c : a->hi[i];
    }
}

/* Half the surface; 0 for an empty box. */
static float half_area(const BoxF *b)
{
    float x = b->hi[0] - b->lo[0], y = b->hi[1] - b->lo[1], z = b->hi[2] - b->lo[2];
    return x >= 0 ? x * y + y * z + z * x : 0;
}

static Range range_of(const Ref *ref, uint32_t first, uint32_t count)
{
    Range r = {boxf_empty(), boxf_empty(), first, count, false};
    for (uint32_t i = first; i < first + count; i++) {
        boxf_grow(&r.box, &ref[i].box);
        grow_centre(&r.centre, &ref[i].box);
    }
    return r;
}

typedef struct { BoxF box; uint32_t count; } Bin;

typedef struct { int axis; uint32_t bin; float cost; } Split;  /* cost: sum of area times count of the two sides */

/* A scale for `bin_of`; 0 if all centres coincide on that axis. */
static float bin_scale(const Range *r, int axis)
{
    float extent = r->centre.hi[axis] - r->centre.lo[axis];
    float scale = (float)BINS / extent;
    return extent > 0 && isfinite(scale) ? scale : 0;
}

static inline uint32_t bin_of(float c, float low, float scale)
{
    float b = (c - low) * scale;
    uint32_t i = b > 0 ? (uint32_t)b : 0;
    return i < BINS ? i : BINS - 1;
}

static void best_on_axis(const Bin *bin, int axis, Split *best)
{
    float right_area[BINS];
    uint32_t right_count[BINS];
    BoxF box = boxf_empty();
    uint32_t count = 0;
    for (uint32_t i = BINS - 1; i > 0; i--) {
        boxf_grow(&box, &bin[i].box);
        count += bin[i].count;
        right_area[i] = half_area(&box);
        right_count[i] = count;
    }
    box = boxf_empty();
    count = 0;
    for (uint32_t i = 1; i < BINS; i++) {
        boxf_grow(&box, &bin[i - 1].box);
        count += bin[i - 1].count;
        if (count == 0 || right_count[i] == 0) continue;
        float cost = half_area(&box) * (float)count + right_area[i] * (float)right_count[i];
        if (cost < best->cost) *best = (Split){axis, i, cost};
    }
}

static Split best_split(const Build *b, const Range *r)
{
    Bin bin[3][BINS];
    float scale[3];
    for (int a = 0; a < 3; a++) {
        scale[a] = bin_scale(r, a);
        for (int i = 0; i < BINS; i++) bin[a][i] = (Bin){boxf_empty(), 0};
    }
    for (uint32_t i = r->first; i < r->first + r->count; i++) {
        const BoxF *box = &b->ref[i].box;
        for (int a = 0; a < 3; a++) {
            Bin *to = &bin[a][bin_of(centre(box, a), r->centre.lo[a], scale[a])];
            boxf_grow(&to->box, box);
            to->count++;
        }
    }
    Split best = {-1, 0, INFINITY};
    for (int a = 0; a < 3; a++)
        if (scale[a] > 0) best_on_axis(bin[a], a, &best);
    return best;
}

/* Reorders the range and returns the number of items on the left side. */
static uint32_t partition(const Build *b, const Range *r, const Split *split)
{
    float low = r->centre.lo[split->axis], scale = bin_scale(r, split->axis);
    Ref *i = b->ref + r->first, *j = i + r->count;
    while (i < j) {
        if (bin_of(centre(&i->box, split->axis), low, scale) < split->bin) {
            i++;
        } else {
            Ref t = *--j;
            *j = *i;
            *i = t;
        }
    }
    return (uint32_t)(i - (b->ref + r->first));
}

/* Splits r into itself (left) and *right; false, and r->done, if it should stay whole. */
static bool split_range(const Build *b, Range *r, uint32_t depth, Range *right)
{
    bool must = r->count > b->max_leaf;
    uint32_t left = 0;
    if (r->count > 1 && depth < MEDIAN_DEPTH) {
        Split split = best_split(b, r);
        float whole = b->item_cost * (float)r->count * half_area(&r->box);
        float parted = half_area(&r->box) + b->item_cost * split.cost;
        if (split.axis >= 0 && (must || parted < whole)) left = partition(b, r, &split);
    }
    if (left == 0) {
        if (!must) {
            r->done = true;
            return false;
        }
        left = r->count / 2;  /* all centres coincide, or too deep */
    }
    *right = range_of(b->ref, r->first + left, r->count - left);
    *r = range_of(b->ref, r->first, left);
    return true;
}

static uint32_t add_node(Build *b)
{
    if (b->node_count == b->node_capacity) {
        uint32_t capacity = b->node_capacity + b->node_capacity / 2 + 16;
        BvhNode *node = aligned_alloc(64, capacity * sizeof *node);
        if (!node) return UINT32_MAX;
        if (b->node_count) memcpy(node, b->node, b->node_count * sizeof *node);
        free(b->node);
        b->node = node;
        b->node_capacity = capacity;
    }
    BvhNode *n = &b->node[b->node_count];
    memset(n, 0, sizeof *n);
    for (int a = 0; a < 3; a++)
        for (int i = 0; i < BVH_WIDTH; i++) {
            n->lo[a][i] = INFINITY;
            n->hi[a][i] = -INFINITY;
        }
    return b->node_count++;
}

static int largest(const Range *child, int n)
{
    int best = -1;
    float best_area = -1;
    for (int i = 0; i < n; i++) {
        if (child[i].done) continue;
        float area = half_area(&child[i].box);
        if (area > best_area) {
            best_area = area;
            best = i;
        }
    }
    return best;
}

/* The children by the far corners of their boxes' middles along each octant's diagonal. */
static void order_children(BvhNode *node)
{
    for (uint32_t octant = 0; octant < 4; octant++) {
        float key[BVH_WIDTH];
        uint32_t order[BVH_WIDTH];
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

/* Fills the task's node and pushes the tasks of its inner children. */
static bool make_node(Build *b, const Task *task, Task *stack, uint32_t *top)
{
    Range child[BVH_WIDTH];
    int n = 1, i;
    child[0] = task->range;
    while (n < BVH_WIDTH && (i = largest(child, n)) >= 0)
        if (split_range(b, &child[i], task->depth, &child[n])) n++;
    /* What is still too large for a leaf becomes a node of its own. */
    for (i = 0; i < n; i++) {
        uint32_t inner = 0;
        if (child[i].count > b->max_leaf) {
            inner = add_node(b);
            if (inner == UINT32_MAX) return false;
            stack[(*top)++] = (Task){child[i], inner, task->depth + 1};
        }
        BvhNode *node = &b->node[task->node];
        for (int a = 0; a < 3; a++) {
            node->lo[a][i] = child[i].box.lo[a];
            node->hi[a][i] = child[i].box.hi[a];
        }
        node->child[i] = inner ? inner : BVH_LEAF | child[i].first;
        node->count[i] = inner ? 0 : (uint8_t)child[i].count;
    }
    b->node[task->node].used = (uint8_t)n;
    order_children(&b->node[task->node]);
    return true;
}

bool bvh_build(Bvh *bvh, const BoxF *box, uint32_t count, uint32_t max_leaf, float item_cost, Err *err)
{
    *bvh = (Bvh){.bounds = boxf_empty()};
    if (count == 0) return true;
    Build b = {.max_leaf = max_leaf, .item_cost = item_cost};
    b.node_capacity = count / 8 + 16;
    b.node = aligned_alloc(64, b.node_capacity * sizeof *b.node);
    b.ref = malloc((size_t)count * sizeof *b.ref);
    bvh->order = malloc((size_t)count * sizeof *bvh->order);
    if (!b.node || !b.ref || !bvh->order) goto fail;
    for (uint32_t i = 0; i < count; i++) b.ref[i] = (Ref){box[i], i};

    /* Depth first: at most 7 tasks wait on each level. Medians below MEDIAN_DEPTH end within 32 levels. */
    Task stack[BVH_WIDTH * BVH_MAX_DEPTH];
    uint32_t top = 0;
    stack[top++] = (Task){range_of(b.ref, 0, count), add_node(&b), 0};
    bvh->bounds = stack[0].range.box;
    while (top > 0) {
        Task task = stack[--top];
        if (!make_node(&b, &task, stack, &top)) goto fail;
    }
    for (uint32_t i = 0; i < count; i++) bvh->order[i] = b.ref[i].item;
    free(b.ref);
    bvh->node = b.node;
    bvh->node_count = b.node_count;
    bvh->item_count = count;
    bvh_set_root(bvh);
    return true;

fail:
    free(b.ref);
    free(b.node);
    free(bvh->order);
    *bvh = (Bvh){.bounds = boxf_empty()};
    return err_memory(err, "the bounding volume hierarchy");
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
