/* The hierarchy as a data structure: every box in exactly one leaf, boxes around their contents, bounded depth, the same
 * bytes from any number of threads, and a walk that never misses a box that the ray meets. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

#include "accel/bvh.h"
#include "accel/traverse.h"
#include "common/memory.h"
#include "common/rng.h"
#include "support/alloc_fail.h"

typedef struct { const Bvh *bvh; const BoxF *box; uint8_t *seen; uint32_t max_leaf, deepest; } Check;

static void check_node(Check *c, uint32_t index, const float *lo, const float *hi, uint32_t depth)
{
    const BvhNode *n = &c->bvh->node[index];
    if (depth > c->deepest) c->deepest = depth;
    for (int i = 0; i < BVH_WIDTH; i++) {
        if (i >= n->used) {
            assert_true(n->lo[0][i] == INFINITY && n->hi[0][i] == -INFINITY);
            continue;
        }
        float child_lo[3], child_hi[3];
        for (int a = 0; a < 3; a++) {
            child_lo[a] = n->lo[a][i];
            child_hi[a] = n->hi[a][i];
            assert_true(child_lo[a] >= lo[a] && child_hi[a] <= hi[a]);
        }
        if (!(n->child[i] & BVH_LEAF)) {
            check_node(c, n->child[i], child_lo, child_hi, depth + 1);
            continue;
        }
        assert_true(n->count[i] <= c->max_leaf);
        uint32_t first = n->child[i] & ~BVH_LEAF;
        for (uint32_t k = first; k < first + n->count[i]; k++) {
            uint32_t item = c->bvh->order[k];
            assert_int_equal(c->seen[item], 0);
            c->seen[item] = 1;
            for (int a = 0; a < 3; a++)
                assert_true(c->box[item].lo[a] >= child_lo[a] && c->box[item].hi[a] <= child_hi[a]);
        }
    }
}

/* Boxes of the shapes that break builders. */
enum {
    RANDOM,
    ALL_THE_SAME,
    ONE_CENTRE,       /* of many sizes */
    ONE_HUGE,         /* and many tiny ones */
    FLAT,
    GEOMETRIC,        /* progression towards a corner */
    TINY,             /* 1e-38 and below: areas vanish */
    HUGE_ONES,        /* whose areas and centres overflow */
    POINTS,           /* few different ones */
    KINDS,
};

static BoxF make_box(int kind, uint32_t i, uint32_t n, Rng *rng)
{
    BoxF b;
    for (int a = 0; a < 3; a++) {
        float c = (float)rng_double(rng), r = 0.01f * (float)rng_double(rng);
        if (kind == ALL_THE_SAME) c = 0.5f, r = 0.25f;
        if (kind == ONE_CENTRE) c = 0.5f, r = (float)(i + 1) / (float)n;
        if (kind == ONE_HUGE) r = i == 0 ? 100.0f : 1e-6f;
        if (kind == FLAT && a == 1) c = 0.25f, r = 0;
        if (kind == GEOMETRIC) c = ldexpf(1, -(int)(i % 120)), r = 0;
        if (kind == TINY) c *= 1e-38f, r *= 1e-38f;
        if (kind == HUGE_ONES) c = (c - 0.5f) * 0x1p127f, r *= 0x1p127f;
        if (kind == POINTS) c = floorf(4 * c), r = 0;
        b.lo[a] = c - r;
        b.hi[a] = c + r;
    }
    return b;
}

static BvhSettings plain(uint32_t max_leaf) { return (BvhSettings){.max_leaf = max_leaf, .block = 1, .block_cost = 1}; }

/* Reference i is item i; the caller frees them. */
static BvhRef *refs_of(const BoxF *box, uint32_t n)
{
    BvhRef *ref = memory_array(n + (size_t)1, sizeof *ref);
    assert_non_null(ref);
    for (uint32_t i = 0; i < n; i++) ref[i] = bvh_ref(box[i], i);
    return ref;
}

static Bvh bvh_of(const BoxF *box, uint32_t n, const BvhSettings *settings)
{
    BvhRef *ref = refs_of(box, n);
    Bvh bvh;
    assert_true(bvh_build(&bvh, ref, n, settings, NULL));
    free(ref);
    return bvh;
}

static BoxF *boxes(int kind, uint32_t n)
{
    Rng rng = rng_seed(7, (uint64_t)kind);
    BoxF *box = malloc((n + (size_t)1) * sizeof *box);
    assert_non_null(box);
    for (uint32_t i = 0; i < n; i++) box[i] = make_box(kind, i, n, &rng);
    return box;
}

/* Small enough for one thread's piece, and large enough for many. */
static void every_item_once(void **state)
{
    (void)state;
    static const uint32_t counts[] = {2, 3, 5, 1000, 4096, 4097, 60000};
    static const BvhSettings settings[] = {{2, 1, 4, 1}, {4, 4, 1, 2}, {255, 1, 0.01f, 3}, {1, 1, 1, 1}, {8, 8, 0.5f, 1}};
    for (int kind = 0; kind < KINDS; kind++)
        for (size_t k = 0; k < sizeof counts / sizeof counts[0]; k++) {
            uint32_t n = counts[k];
            const BvhSettings *s = &settings[((size_t)kind + k) % (sizeof settings / sizeof settings[0])];
            BoxF *box = boxes(kind, n);
            uint8_t *seen = calloc(n, 1);
            Bvh bvh = bvh_of(box, n, s);
            Check c = {&bvh, box, seen, s->max_leaf, 0};
            assert_int_equal(bvh.item_count, n);
            check_node(&c, 0, bvh.bounds.lo, bvh.bounds.hi, 1);
            for (uint32_t i = 0; i < n; i++) assert_int_equal(seen[i], 1);
            assert_true(c.deepest <= BVH_MAX_DEPTH);
            bvh_free(&bvh);
            free(box);
            free(seen);
        }
}

static void nothing_and_one(void **state)
{
    (void)state;
    BvhSettings settings = plain(4);
    Bvh bvh;
    assert_true(bvh_build(&bvh, NULL, 0, &settings, NULL));
    assert_null(bvh.node);
    bvh_free(&bvh);
    BoxF one = {{0, 0, 0}, {1, 1, 1}};
    bvh = bvh_of(&one, 1, &settings);
    assert_int_equal(bvh.node_count, 1);
    assert_int_equal(bvh.node[0].used, 1);
    assert_int_equal(bvh.node[0].count[0], 1);
    bvh_free(&bvh);
}

/* Byte by byte, the order of the items too. */
static void same_for_any_threads(void **state)
{
    (void)state;
    static const uint32_t threads[] = {2, 3, 7};
    enum { N = 50000 };
    for (int kind = 0; kind < KINDS; kind++) {
        BoxF *box = boxes(kind, N);
        BvhSettings settings = {4, 4, 1, 1};
        Bvh one = bvh_of(box, N, &settings);
        for (int k = 0; k < 3; k++) {
            settings.threads = threads[k];
            Bvh many = bvh_of(box, N, &settings);
            assert_int_equal(many.node_count, one.node_count);
            assert_memory_equal(many.node, one.node, one.node_count * sizeof *one.node);
            assert_memory_equal(many.order, one.order, N * sizeof *one.order);
            bvh_free(&many);
        }
        bvh_free(&one);
        free(box);
    }
}

/* An item that comes in several boxes is in the leaves of each. */
static void items_in_parts(void **state)
{
    (void)state;
    enum { N = 10000 };
    Rng rng = rng_seed(11, 0);
    BvhRef *ref = memory_array(2 * N, sizeof *ref);
    BoxF *box = malloc(2 * N * sizeof *box);
    uint8_t *seen = calloc(2 * N, 1);
    assert_true(ref && box && seen);
    for (uint32_t i = 0; i < 2 * N; i++) {
        box[i] = make_box(0, i, 2 * N, &rng);
        ref[i] = bvh_ref(box[i], i / 2);
    }
    Bvh bvh;
    BvhSettings settings = {4, 4, 1, 2};
    assert_true(bvh_build(&bvh, ref, 2 * N, &settings, NULL));
    assert_int_equal(bvh.item_count, 2 * N);
    for (uint32_t i = 0; i < 2 * N; i++) {
        assert_true(seen[bvh.order[i]] < 2);
        seen[bvh.order[i]]++;
    }
    for (uint32_t i = 0; i < N; i++) assert_int_equal(seen[i], 2);
    bvh_free(&bvh);
    free(ref);
    free(box);
    free(seen);
}

/* Each allocation fails once, on whichever thread. */
static void without_memory(void **state)
{
    (void)state;
    static const uint32_t counts[] = {1, 3000, 30000};
    for (int k = 0; k < 3; k++) {
        BoxF *box = boxes(0, counts[k]);
        BvhRef *ref = refs_of(box, counts[k]);
        BvhSettings settings = {4, 4, 1, 2};
        Err err;
        Bvh bvh;
        for (long n = 1;; n++) {
            for (uint32_t i = 0; i < counts[k]; i++) ref[i] = bvh_ref(box[i], i);
            alloc_fail_at(n);
            bool done = bvh_build(&bvh, ref, counts[k], &settings, &err);
            if (!alloc_fail_stop()) {
                assert_true(done && n > 5);
                break;
            }
            assert_false(done);
            assert_int_equal(err.kind, ERR_LIMIT);
            assert_null(bvh.node);
            assert_null(bvh.order);
        }
        bvh_free(&bvh);
        free(box);
        free(ref);
    }
}

static void rounding_is_outward(void **state)
{
    (void)state;
    Rng rng = rng_seed(8, 0);
    for (int i = 0; i < 100000; i++) {
        double x = ldexp(rng_double(&rng) - 0.5, (int)(rng_u32(&rng) % 100) - 50);
        BoxF b = boxf_from_box((Box){{x, x, x}, {x, x, x}});
        assert_true((double)b.lo[0] <= x && (double)b.hi[0] >= x);
        assert_true(b.hi[0] <= nextafterf(b.lo[0], INFINITY));
    }
}

/* The exact slab test, in long double: entry and exit of the line, all exact for these inputs' purposes. */
static bool meets(const BoxF *b, const Ray *r)
{
    long double t0 = 0, t1 = INFINITY;
    for (int a = 0; a < 3; a++) {
        long double o = vec3_get(r->o, a), d = vec3_get(r->d, a);
        if (d == 0) {
            if (o < b->lo[a] || o > b->hi[a]) return false;
            continue;
        }
        long double x = (b->lo[a] - o) / d, y = (b->hi[a] - o) / d;
        t0 = fmaxl(t0, fminl(x, y));
        t1 = fminl(t1, fmaxl(x, y));
    }
    return t0 <= t1;
}

typedef struct { const Bvh *bvh; uint8_t *found; } Found;

static bool note(void *context, uint32_t first)
{
    Found *f = context;
    f->found[f->bvh->order[first]] = 1;
    return true;
}

static void walk_is_generous(void **state)
{
    (void)state;
    enum { N = 300 };
    for (int kind = RANDOM; kind <= GEOMETRIC; kind++) {
        Rng rng = rng_seed(9, (uint64_t)kind);
        BoxF box[N];
        for (uint32_t i = 0; i < N; i++) box[i] = make_box(kind, i, N, &rng);
        BvhSettings settings = plain(1);
        Bvh bvh = bvh_of(box, N, &settings);
        for (int k = 0; k < 3000; k++) {
            double scale = ldexp(1, (int)(rng_u32(&rng) % 60) - 30);
            double o[3], d[3];
            for (int a = 0; a < 3; a++) {
                o[a] = 3 * rng_double(&rng) - 1;
                const BoxF *to = &box[rng_u32(&rng) % N];
                double target = rng_u32(&rng) % 2 ? (double)to->lo[a] : (double)to->hi[a];
                d[a] = (target - o[a]) * scale;
                if (rng_u32(&rng) % 4 == 0) {  /* in the plane of a face */
                    o[a] = target;
                    d[a] = rng_u32(&rng) % 2 ? 0.0 : -0.0;
                }
            }
            Ray ray = {{o[0], o[1], o[2]}, {d[0], d[1], d[2]}, 0, INFINITY};
            if (d[0] == 0 && d[1] == 0 && d[2] == 0) continue;
            uint8_t found[N] = {0};
            Found f = {&bvh, found};
            SlabRay slab;
            slab_ray_init(&slab, &ray);
            float tmax = INFINITY;
            slab_walk(&bvh, &slab, 0, &tmax, note, &f);
            for (uint32_t i = 0; i < N; i++)
                if (meets(&box[i], &ray) && !found[i]) fail_msg("kind %d ray %d: box %u missed", kind, k, i);
        }
        bvh_free(&bvh);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_item_once),
        cmocka_unit_test(nothing_and_one),
        cmocka_unit_test(same_for_any_threads),
        cmocka_unit_test(items_in_parts),
        cmocka_unit_test(without_memory),
        cmocka_unit_test(rounding_is_outward),
        cmocka_unit_test(walk_is_generous),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
