/* Triangles: watertight and exactly once at edges and vertices, the same hits as a search of all of them, and segments
 * that say what the closed mesh encloses. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

#include "accel/mesh_prim.h"
#include "common/rng.h"
#include "node/primitive/primitive.h"
#include "support/mesh_sphere.h"

static Vec3 random_vector(Rng *rng)
{
    return vec3_make(2 * rng_double(rng) - 1, 2 * rng_double(rng) - 1, 2 * rng_double(rng) - 1);
}

static int set_up(void **state)
{
    static Scratch scratch;
    scratch = (Scratch){arena_create(), false};
    *state = &scratch;
    return 0;
}

static int tear_down(void **state)
{
    arena_destroy(((Scratch *)*state)->arena);
    return 0;
}

static uint32_t segment_count(const Prim *prim, const Ray *ray, Scratch *scratch)
{
    arena_reset(scratch->arena);
    SegList list = seg_list(scratch);
    assert_true(prim->ops->segments(prim, ray, &list));
    return list.count;
}

/* From inside, every ray leaves once; the line has one segment. */
static void one_way_in_one_way_out(void **state)
{
    Scratch *scratch = *state;
    const double offsets[] = {0, 1e3, 1e5};
    for (int k = 0; k < 3; k++) {
        Vec3 centre = vec3_make(offsets[k], -offsets[k], 0.5 * offsets[k]);
        Mesh *m = mesh_sphere(60, 60, centre);
        Prim *p = mesh_prim_create(m, true, NULL, NULL);
        Rng rng = rng_seed(21, (uint64_t)k);
        uint32_t wrong = 0;
        for (uint32_t i = 0; i < 60000; i++) {
            Vec3 o = vec3_at(centre, 0.5, random_vector(&rng)), target;
            const uint32_t *tri = m->triangle[rng_u32(&rng) % m->triangle_count];
            switch (i % 3) {
            case 0: target = m->position[tri[0]]; break;  /* a vertex */
            case 1: {                                     /* a point of an edge */
                double w = i % 2 ? 0.5 : rng_double(&rng);
                target = vec3_at(m->position[tri[0]], w, vec3_sub(m->position[tri[1]], m->position[tri[0]]));
                break;
            }
            default: target = vec3_add(o, random_vector(&rng));
            }
            Ray ray = {o, vec3_sub(target, o), 0, INFINITY};
            Hit hit;
            wrong += !p->ops->intersect(p, &ray, &hit, scratch);
            wrong += segment_count(p, &ray, scratch) != 1;
        }
        assert_int_equal(wrong, 0);
        prim_destroy(p);
        mesh_destroy(m);
    }
}

/* Axis-parallel rays through the vertices of a grid-like closed mesh: many exact zeros. */
static void grid_box_is_tight(void **state)
{
    Scratch *scratch = *state;
    enum { N = 8 };
    Mesh m = {0};
    m.position = malloc(6 * (N + 1) * (N + 1) * sizeof *m.position);
    m.triangle = malloc(12 * N * N * sizeof *m.triangle);
    for (int face = 0; face < 6; face++) {
        int axis = face / 2, side = face % 2;
        uint32_t base = m.position_count;
        for (int i = 0; i <= N; i++)
            for (int j = 0; j <= N; j++) {
                double c[3];
                c[axis] = side;
                c[(axis + 1) % 3] = (double)i / N;
                c[(axis + 2) % 3] = (double)j / N;
                m.position[m.position_count++] = vec3_make(c[0], c[1], c[2]);
            }
        for (uint32_t i = 0; i < N; i++)
            for (uint32_t j = 0; j < N; j++) {
                uint32_t a = base + i * (N + 1) + j, b = a + N + 1, c = a + 1, d = b + 1;
                uint32_t out[2][3] = {{a, b, d}, {a, d, c}}, in[2][3] = {{a, d, b}, {a, c, d}};
                for (int k = 0; k < 2; k++)
                    for (int n = 0; n < 3; n++) m.triangle[m.triangle_count + (uint32_t)k][n] = side ? out[k][n] : in[k][n];
                m.triangle_count += 2;
            }
    }
    Err err;
    assert_true(mesh_is_closed(&m, &err));
    Prim *p = mesh_prim_create(&m, true, NULL, NULL);
    for (int axis = 0; axis < 3; axis++)
        for (int i = 0; i <= 2 * N; i++)
            for (int j = 0; j <= 2 * N; j++) {
                double o[3], d[3] = {0, 0, 0};
                o[axis] = 0.3;
                d[axis] = i % 2 ? 1 : -1;
                o[(axis + 1) % 3] = i / (2.0 * N);
                o[(axis + 2) % 3] = j / (2.0 * N);
                Ray ray = {{o[0], o[1], o[2]}, {d[0], d[1], d[2]}, 0, INFINITY};
                bool strictly_inside = i > 0 && j > 0 && i < 2 * N && j < 2 * N;
                uint32_t n = segment_count(p, &ray, scratch);
                if (strictly_inside)
                    assert_int_equal(n, 1);
                else
                    assert_true(n <= 1);
            }
    prim_destroy(p);
    free(m.position);
    free(m.triangle);
}

/* A soup of random triangles against the search of all of them: one triangle at a time is a mesh without a tree. */
static void equals_brute_force(void **state)
{
    Scratch *scratch = *state;
    enum { N = 400 };
    Rng rng = rng_seed(22, 0);
    Mesh soup = {.position = malloc(3 * N * sizeof(Vec3)), .triangle = malloc(N * sizeof *soup.triangle)};
    for (uint32_t i = 0; i < N; i++) {
        Vec3 at = random_vector(&rng);
        for (uint32_t j = 0; j < 3; j++) {
            soup.position[3 * i + j] = vec3_at(at, i % 5 == 0 ? 1 : 0.1, random_vector(&rng));
            soup.triangle[i][j] = 3 * i + j;
        }
    }
    soup.position_count = 3 * N;
    soup.triangle_count = N;
    Prim *all = mesh_prim_create(&soup, false, NULL, NULL), *single[N];
    Mesh one[N];
    for (uint32_t i = 0; i < N; i++) {
        one[i] = soup;
        one[i].triangle = soup.triangle + i;
        one[i].triangle_count = 1;
        single[i] = mesh_prim_create(&one[i], false, NULL, NULL);
    }
    for (int k = 0; k < 4000; k++) {
        Ray ray = {vec3_scale(random_vector(&rng), 2), random_vector(&rng), 0, INFINITY};
        ray.d = vec3_scale(ray.d, ldexp(1, (int)(rng_u32(&rng) % 40) - 20));
        Hit best = {.t = INFINITY, .part = HIT_NONE}, hit;
        for (uint32_t i = 0; i < N; i++)
            if (single[i]->ops->intersect(single[i], &ray, &hit, scratch) && hit.t < best.t) {
                best = hit;
                best.part = i;
            }
        Hit found = {.t = INFINITY, .part = HIT_NONE};
        bool any = all->ops->intersect(all, &ray, &found, scratch);
        assert_int_equal(any, best.part != HIT_NONE);
        assert_int_equal(all->ops->occluded(all, &ray, scratch), any);
        if (any) {
            assert_int_equal(found.part, best.part);
            assert_true(found.t == best.t && found.u == best.u && found.v == best.v);
            ray.tmax = found.t;
            assert_true(all->ops->occluded(all, &ray, scratch));
            ray.tmax = nextafter(found.t, 0);
            assert_false(all->ops->occluded(all, &ray, scratch));
        }
    }
    for (uint32_t i = 0; i < N; i++) prim_destroy(single[i]);
    prim_destroy(all);
    free(soup.position);
    free(soup.triangle);
}

/* A ray that leaves the surface on its outer side, from outside the error bound, doesn't meet a convex mesh again. */
static void leaving_rays_are_free(void **state)
{
    Scratch *scratch = *state;
    Mesh *m = mesh_sphere(40, 40, vec3_make(3, -7, 100));
    Prim *p = mesh_prim_create(m, true, NULL, NULL);
    Rng rng = rng_seed(23, 0);
    uint32_t hits = 0, again = 0;
    for (int i = 0; i < 40000; i++) {
        Vec3 centre = vec3_make(3, -7, 100), o = vec3_add(centre, vec3_scale(random_vector(&rng), 4));
        Ray ray = {o, vec3_sub(vec3_add(centre, random_vector(&rng)), o), 0, INFINITY};
        Hit hit;
        if (!p->ops->intersect(p, &ray, &hit, scratch)) continue;
        Surface s;
        p->ops->surface(p, &ray, &hit, true, &s);
        Vec3 n = vec3_normalize(s.n), d = random_vector(&rng);
        if (vec3_dot(d, n) < 0) d = vec3_neg(d);
        if (i % 2) d = vec3_sub(d, vec3_scale(n, vec3_dot(d, n) * (1 - 1e-9)));  /* grazing */
        Ray leave = {vec3_at(s.p, vec3_dot(vec3_abs(n), s.p_err), n), d, 0, INFINITY};
        hits++;
        again += p->ops->occluded(p, &leave, scratch);
    }
    assert_true(hits > 20000);
    assert_int_equal(again, 0);
    prim_destroy(p);
    mesh_destroy(m);
}

static void baked_equals_separate(void **state)
{
    Scratch *scratch = *state;
    Mesh *a = mesh_sphere(10, 12, vec3_make(0, 0, 0)), *b = mesh_sphere(6, 5, vec3_make(0, 0, 0));
    BakedMesh baked[2] = {{.mesh = a, .to_world = affine_translate(2, 0, 0)}, {.mesh = b, .to_world = affine_scale(1, 2, 1)}};
    for (int i = 0; i < 2; i++) assert_true(affine_inverse(&baked[i].to_world, &baked[i].to_object));
    Prim *all = mesh_prim_bake(baked, 2, NULL, NULL);
    Ray to_a = {{2, 0.1, 10}, {0, 0, -1}, 0, INFINITY}, to_b = {{0, 1.5, 10}, {0, 0, -1}, 0, INFINITY};
    Hit hit;
    assert_true(all->ops->intersect(all, &to_a, &hit, scratch));
    assert_int_equal(hit.leaf, 0);
    assert_true(all->ops->intersect(all, &to_b, &hit, scratch));
    assert_int_equal(hit.leaf, 1);
    assert_false(all->ops->closed);

    /* point and normal in the part's own space, and the map there */
    Surface s, separate;
    Prim *alone = mesh_prim_create(b, false, NULL, NULL);
    Ray local = {affine_point(&baked[1].to_object, to_b.o), affine_vector(&baked[1].to_object, to_b.d), 0, INFINITY};
    Hit own;
    all->ops->surface(all, &to_b, &hit, true, &s);
    assert_true(alone->ops->intersect(alone, &local, &own, scratch));
    alone->ops->surface(alone, &local, &own, true, &separate);
    Vec3 p, n;
    const Affine *to_own = all->ops->own(all, &hit, &p, &n);
    assert_memory_equal(to_own, &baked[1].to_object, sizeof *to_own);
    assert_true(vec3_length(vec3_sub(p, separate.p)) < 1e-14);
    assert_true(vec3_length(vec3_sub(p, affine_point(to_own, s.p))) < 1e-14);
    assert_true(vec3_length(vec3_cross(n, separate.ns)) < 1e-14 * vec3_length(n) * vec3_length(separate.ns));
    prim_destroy(alone);
    prim_destroy(all);
    mesh_destroy(a);
    mesh_destroy(b);
}

/* Many parts, some of a few triangles, some of many: each hit tells the one that it lies in. */
static void baked_parts_are_found(void **state)
{
    Scratch *scratch = *state;
    enum { PARTS = 300 };
    Mesh *small = mesh_sphere(2, 3, vec3_make(0, 0, 0)), *large = mesh_sphere(12, 12, vec3_make(0, 0, 0));
    BakedMesh baked[PARTS];
    for (int i = 0; i < PARTS; i++) {
        baked[i] = (BakedMesh){.mesh = i % 50 == 7 ? large : small, .to_world = affine_translate(4 * i, 0, 0)};
        assert_true(affine_inverse(&baked[i].to_world, &baked[i].to_object));
    }
    Prim *all = mesh_prim_bake(baked, PARTS, NULL, NULL);
    for (int i = 0; i < PARTS; i++) {
        Ray ray = {{4 * i + 0.01, 5, 0.02}, {0, -1, 0}, 0, INFINITY};
        Hit hit;
        assert_true(all->ops->intersect(all, &ray, &hit, scratch));
        assert_int_equal(hit.leaf, i);
    }
    prim_destroy(all);
    mesh_destroy(small);
    mesh_destroy(large);
}

/* At least an index and two floats for a triangle, at most some five hundred bytes; nothing for what is no mesh. */
static void tells_its_bytes(void **state)
{
    (void)state;
    Mesh *m = mesh_sphere(40, 40, vec3_make(0, 0, 0));
    Prim *p = mesh_prim_create(m, true, NULL, NULL), *sphere = sphere_create();
    assert_true(mesh_prim_bytes(p) > (uint64_t)m->triangle_count * 12 && mesh_prim_bytes(p) < (uint64_t)m->triangle_count * 500);
    assert_int_equal(mesh_prim_bytes(sphere), 0);
    prim_destroy(sphere);
    prim_destroy(p);
    mesh_destroy(m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_way_in_one_way_out), cmocka_unit_test(grid_box_is_tight),
        cmocka_unit_test(equals_brute_force),     cmocka_unit_test(leaving_rays_are_free),
        cmocka_unit_test(baked_equals_separate),  cmocka_unit_test(baked_parts_are_found),
        cmocka_unit_test(tells_its_bytes),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
