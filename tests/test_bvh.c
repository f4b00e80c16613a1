/* The hierarchy as a data structure: every item in exactly one leaf, boxes around their contents, bounded depth, and a
 * walk that never misses a box that the ray meets. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

#include "accel/bvh.h"
#include "accel/traverse.h"
#include "common/rng.h"

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
        if (n->count[i] == 0) {
            check_node(c, n->child[i], child_lo, child_hi, depth + 1);
            continue;
        }
        assert_true(n->count[i] <= c->max_leaf);
        for (uint32_t k = n->child[i]; k < n->child[i] + n->count[i]; k++) {
            uint32_t item = c->bvh->order[k];
            assert_int_equal(c->seen[item], 0);
            c->seen[item] = 1;
            for (int a = 0; a < 3; a++)
                assert_true(c->box[item].lo[a] >= child_lo[a] && c->box[item].hi[a] <= child_hi[a]);
        }
    }
}

/* Boxes of the shapes that break builders: kind 0 random, 1 all the same, 2 all centres in one point, 3 one huge and
 * many tiny, 4 flat, 5 on a geometric progression, 6 few. */
static BoxF make_box(int kind, uint32_t i, uint32_t n, Rng *rng)
{
    BoxF b;
    for (int a = 0; a < 3; a++) {
        float c = (float)rng_double(rng), r = 0.01f * (float)rng_double(rng);
        if (kind == 1) c = 0.5f, r = 0.25f;
        if (kind == 2) c = 0.5f, r = (float)(i + 1) / (float)n;
        if (kind == 3) r = i == 0 ? 100.0f : 1e-6f;
        if (kind == 4 && a == 1) c = 0.25f, r = 0;
        if (kind == 5) c = ldexpf(1, -(int)(i % 120)), r = 0;
        b.lo[a] = c - r;
        b.hi[a] = c + r;
    }
    return b;
}

static void every_item_once(void **state)
{
    (void)state;
    for (int kind = 0; kind <= 6; kind++) {
        uint32_t n = kind == 6 ? 3 : 20000, max_leaf = kind % 2 ? 4 : 2;
        Rng rng = rng_seed(7, (uint64_t)kind);
        BoxF *box = malloc(n * sizeof *box);
        uint8_t *seen = calloc(n, 1);
        for (uint32_t i = 0; i < n; i++) box[i] = make_box(kind, i, n, &rng);
        Bvh bvh;
        assert_true(bvh_build(&bvh, box, n, max_leaf, 1, NULL));
        Check c = {&bvh, box, seen, max_leaf, 0};
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
    Bvh bvh;
    assert_true(bvh_build(&bvh, NULL, 0, 4, 1, NULL));
    assert_null(bvh.node);
    bvh_free(&bvh);
    BoxF one = {{0, 0, 0}, {1, 1, 1}};
    assert_true(bvh_build(&bvh, &one, 1, 4, 1, NULL));
    assert_int_equal(bvh.node[0].used, 1);
    assert_int_equal(bvh.node[0].count[0], 1);
    bvh_free(&bvh);
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

static bool note(void *context, uint32_t first, uint32_t count)
{
    Found *f = context;
    for (uint32_t i = first; i < first + count; i++) f->found[f->bvh->order[i]] = 1;
    return true;
}

static void walk_is_generous(void **state)
{
    (void)state;
    enum { N = 300 };
    for (int kind = 0; kind <= 5; kind++) {
        Rng rng = rng_seed(9, (uint64_t)kind);
        BoxF box[N];
        for (uint32_t i = 0; i < N; i++) box[i] = make_box(kind, i, N, &rng);
        Bvh bvh;
        assert_true(bvh_build(&bvh, box, N, 1, 1, NULL));
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
        cmocka_unit_test(rounding_is_outward),
        cmocka_unit_test(walk_is_generous),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
