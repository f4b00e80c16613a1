/* Cut triangles: their boxes cover them, the budget holds, the result is the same for any number of threads, and a mesh is
 * traced the same whether it is cut or not, whole lines included. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "accel/mesh_prim.h"
#include "accel/mesh_split.h"
#include "common/memory.h"
#include "common/rng.h"
#include "support/alloc_fail.h"

static double between(Rng *rng, double a, double b) { return a + (b - a) * rng_double(rng); }

static Vec3 point(Rng *rng, double reach)
{
    double x = between(rng, -reach, reach), y = between(rng, -reach, reach);
    return vec3_make(x, y, between(rng, -reach, reach));
}

/* Closed tetrahedra: small ones, and `beams` that are a hundred times as long as wide. */
static Mesh *solids(uint32_t small, uint32_t beams, double scale)
{
    uint32_t n = small + beams;
    Rng rng = rng_seed(31, n);
    Mesh *m = calloc(1, sizeof *m);
    assert_non_null(m);
    m->position = malloc(4 * n * sizeof *m->position);
    m->triangle = malloc(4 * n * sizeof *m->triangle);
    assert_true(m->position && m->triangle);
    static const uint32_t face[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
    for (uint32_t i = 0; i < n; i++) {
        Vec3 *p = &m->position[4 * i], at = point(&rng, 1);
        for (int k = 0; k < 3; k++) p[k] = vec3_add(at, point(&rng, 0.01));
        p[3] = i < small ? vec3_add(at, point(&rng, 0.01)) : point(&rng, 1);
        Vec3 n3 = vec3_cross(vec3_sub(p[1], p[0]), vec3_sub(p[2], p[0]));
        bool inward = vec3_dot(n3, vec3_sub(p[3], p[0])) > 0;
        for (int k = 0; k < 4; k++) p[k] = vec3_scale(p[k], scale);
        for (int f = 0; f < 4; f++)
            for (int k = 0; k < 3; k++) m->triangle[4 * i + (uint32_t)f][k] = 4 * i + face[f][inward || k == 0 ? k : 3 - k];
    }
    m->position_count = m->triangle_count = 4 * n;
    return m;
}

static SplitMesh split_mesh(const Mesh *m)
{
    return (SplitMesh){m->position, (const uint32_t (*)[3])m->triangle, m->triangle_count, mesh_bounds(m)};
}

static BvhRef *whole(const Mesh *m)
{
    BvhRef *ref = memory_array(m->triangle_count, sizeof *ref);
    assert_non_null(ref);
    for (uint32_t i = 0; i < m->triangle_count; i++) {
        Box b = box_empty();
        for (int k = 0; k < 3; k++) b = box_add_point(b, m->position[m->triangle[i][k]]);
        ref[i] = bvh_ref(boxf_from_box(b), i);
    }
    return ref;
}

static BvhRef *cut(const Mesh *m, uint32_t threads, uint32_t *count)
{
    SplitMesh split = split_mesh(m);
    BvhRef *ref = whole(m);
    *count = m->triangle_count;
    assert_true(mesh_split(&split, threads, &ref, count));
    return ref;
}

static bool holds(const BvhRef *r, const __float128 p[3])
{
    for (int a = 0; a < 3; a++)
        if (p[a] < r->lo[a] || p[a] > r->hi[a]) return false;
    return true;
}

/* Random points of each triangle that was cut, in quad precision, its corners and points of its edges among them. */
static void boxes_cover_triangles(void **state)
{
    (void)state;
    static const double scales[] = {1, 0x1p-30, 1e9};
    for (int k = 0; k < 3; k++) {
        Mesh *m = solids(3000, 20, scales[k]);
        uint32_t count, cut_ones = 0;
        BvhRef *ref = cut(m, 1, &count);
        assert_true(count > m->triangle_count + m->triangle_count / 20);
        assert_true(count <= m->triangle_count + SPLIT_BUDGET * m->triangle_count);
        Rng rng = rng_seed(32, (uint64_t)k);
        for (uint32_t first = 0, end; first < count; first = end) {
            for (end = first + 1; end < count && ref[end].item == ref[first].item;) end++;
            assert_true(first == 0 || ref[first].item == ref[first - 1].item + 1);
            if (end == first + 1) continue;
            cut_ones++;
            const uint32_t *t = m->triangle[ref[first].item];
            for (int i = 0; i < 400; i++) {
                double u = between(&rng, 0, 1), v = between(&rng, 0, 1);
                if (u + v > 1) u = 1 - u, v = 1 - v;
                if (i % 4 == 1) v = 0;
                if (i % 4 == 2) v = 1 - u;
                if (i < 3) u = i == 1, v = i == 2;
                __float128 p[3];
                for (int a = 0; a < 3; a++) {
                    __float128 c[3];
                    for (int n = 0; n < 3; n++) c[n] = vec3_get(m->position[t[n]], a);
                    p[a] = (1 - (__float128)u - v) * c[0] + u * c[1] + v * c[2];
                }
                bool held = false;
                for (uint32_t n = first; n < end; n++) held |= holds(&ref[n], p);
                assert_true(held);
            }
        }
        assert_true(cut_ones > 20);
        free(ref);
        mesh_destroy(m);
    }
}

static void same_for_any_threads(void **state)
{
    (void)state;
    Mesh *m = solids(5000, 30, 1);
    uint32_t count;
    BvhRef *one = cut(m, 1, &count);
    for (uint32_t threads = 2; threads <= 7; threads += threads == 3 ? 4 : 1) {
        uint32_t n;
        BvhRef *many = cut(m, threads, &n);
        assert_int_equal(n, count);
        assert_memory_equal(many, one, n * sizeof *many);
        free(many);
    }
    free(one);
    mesh_destroy(m);
}

/* Nothing that is no longer than its neighbours is cut, nor are flat meshes and points. */
static void what_need_not_be_cut(void **state)
{
    (void)state;
    uint32_t count;
    Mesh *m = solids(2000, 0, 1);
    free(cut(m, 1, &count));
    assert_int_equal(count, m->triangle_count);
    for (uint32_t i = 0; i < m->position_count; i++) m->position[i] = vec3_make(1, 2, 3);
    free(cut(m, 1, &count));
    assert_int_equal(count, m->triangle_count);
    mesh_destroy(m);
    m = solids(0, 1, 1);
    m->triangle_count = 1;
    free(cut(m, 1, &count));
    assert_int_equal(count, 1);
    m->triangle_count = 0;
    free(cut(m, 1, &count));
    assert_int_equal(count, 0);
    mesh_destroy(m);
}

static void without_memory(void **state)
{
    (void)state;
    Mesh *m = solids(2000, 10, 1);
    SplitMesh split = split_mesh(m);
    BvhRef *ref = whole(m), *before = ref;
    for (long n = 1;; n++) {
        uint32_t count = m->triangle_count;
        alloc_fail_at(n);
        bool done = mesh_split(&split, 1, &ref, &count);
        if (!alloc_fail_stop()) {
            assert_true(done && n == 4 && count > m->triangle_count);
            break;
        }
        assert_false(done);
        assert_ptr_equal(ref, before);
        assert_int_equal(count, m->triangle_count);
    }
    free(ref);
    mesh_destroy(m);
}

static void traced_the_same(void **state)
{
    (void)state;
    Scratch scratch = {arena_create(), false};
    Mesh *m = solids(1000, 40, 1);
    Prim *plain = mesh_prim_create(m, true, NULL, NULL);
    MeshSettings settings = {.threads = 2, .split = true};
    Prim *split = mesh_prim_create(m, true, &settings, NULL);
    assert_true(scratch.arena && plain && split);
    Rng rng = rng_seed(33, 0);
    uint32_t hits = 0, segments = 0;
    for (int i = 0; i < 20000; i++) {
        Vec3 o = point(&rng, 1.5), to = point(&rng, 1);
        if (i % 3 == 0) to = m->position[rng_u32(&rng) % m->position_count];
        Ray ray = {o, vec3_sub(to, o), 0, INFINITY};
        Hit a, b;
        bool found = plain->ops->intersect(plain, &ray, &a, &scratch);
        assert_int_equal(split->ops->intersect(split, &ray, &b, &scratch), found);
        assert_int_equal(split->ops->occluded(split, &ray, &scratch), found);
        if (found) assert_true(a.t == b.t && a.u == b.u && a.v == b.v && a.part == b.part);
        hits += found;
        arena_reset(scratch.arena);
        SegList whole_list = seg_list(&scratch), cut_list = seg_list(&scratch);
        assert_true(plain->ops->segments(plain, &ray, &whole_list));
        assert_true(split->ops->segments(split, &ray, &cut_list));
        assert_int_equal(cut_list.count, whole_list.count);
        for (uint32_t k = 0; k < cut_list.count; k++) {
            assert_true(cut_list.seg[k].in.t == whole_list.seg[k].in.t);
            assert_true(cut_list.seg[k].out.t == whole_list.seg[k].out.t);
        }
        segments += cut_list.count;
    }
    assert_true(hits > 2000 && segments > 2000);
    prim_destroy(plain);
    prim_destroy(split);
    mesh_destroy(m);
    arena_destroy(scratch.arena);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(boxes_cover_triangles), cmocka_unit_test(same_for_any_threads),
        cmocka_unit_test(what_need_not_be_cut),  cmocka_unit_test(without_memory),
        cmocka_unit_test(traced_the_same),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
