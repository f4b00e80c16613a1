/* The fractal mountain against the words of SPEC 7, which a second, plain subdivision follows here. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "accel/mesh_prim.h"
#include "accel/triangle.h"
#include "common/arena.h"
#include "common/rng.h"
#include "node/primitive/mesh.h"
#include "support/alloc_fail.h"

static Mesh *make(double w, double h, double l, double roughness, uint32_t n, uint64_t seed, double *peak)
{
    Err err = {ERR_NONE, ""};
    Mesh *mesh = mountain_create(w, h, l, roughness, n, seed, peak, &err);
    if (!mesh) fail_msg("%s", err.text);
    return mesh;
}

/* To the last bit, so that it lies on the edge. */
static bool is_middle(double m, double a, double b)
{
    Dd sum = dd_sum(0.5 * a, 0.5 * b);
    return m == sum.hi && sum.lo == 0;
}

static bool is_midpoint(Vec3 m, Vec3 a, Vec3 b)
{
    return is_middle(m.x, a.x, b.x) && is_middle(m.y, a.y, b.y) && is_middle(m.z, a.z, b.z);
}

static void the_pyramid(void **state)
{
    (void)state;
    double peak;
    Mesh *m = make(4, 3, 2, 0.1, 0, 1, &peak);
    assert_int_equal(m->triangle_count, 4);
    assert_int_equal(m->position_count, 5);
    assert_true(peak == 1.01 * 3);
    for (int i = 0; i < 4; i++) {
        Vec3 a = m->position[m->triangle[i][0]], b = m->position[m->triangle[i][1]], c = m->position[m->triangle[i][2]];
        assert_true(a.y == 0 && b.y == 0);
        assert_true(c.x == 2 && c.y == peak && c.z == -1);
        /* counter-clockwise from outside: the normal leads away from the axis, and up */
        Vec3 n = vec3_cross(vec3_sub(b, a), vec3_sub(c, a));
        Vec3 out = vec3_sub(vec3_scale(vec3_add(a, b), 0.5), vec3_make(2, 0, -1));
        assert_true(vec3_dot(n, out) > 0 && n.y > 0);
    }
    Box box = mesh_bounds(m);
    assert_true(box.lo.x == 0 && box.hi.x == 4 && box.lo.z == -2 && box.hi.z == 0 && box.lo.y == 0);
    mesh_destroy(m);
}

static void the_number_of_faces(void **state)
{
    (void)state;
    uint32_t faces = 4;
    for (uint32_t n = 0; n <= 6; n++, faces *= 6) {
        double peak;
        Mesh *m = make(5, 3, 5, 0.3, n, 7, &peak);
        assert_int_equal(m->triangle_count, faces);
        assert_int_equal(m->dropped, 0);
        assert_int_equal(m->position_count, 5 + 3 * (faces - 4) / 5);
        mesh_destroy(m);
    }
}

/* Faces, their order and their corners, followed down from the pyramid. */
static void the_order_of_the_faces(void **state)
{
    (void)state;
    enum { N = 3 };
    double peak;
    const double w = 0.7, h = M_PI, l = 1 / 3.0;  /* of 53 bits, so that all midpoints could be rounded */
    Mesh *before = make(w, h, l, 0.2, 0, 11, &peak), *m = make(w, h, l, 0.2, N, 11, &peak);
    uint32_t count = 4, points = 5;
    uint32_t(*face)[3] = malloc(4 * 216 * sizeof *face), (*next)[3] = malloc(4 * 216 * sizeof *next);
    assert_true(face && next);
    memcpy(face, before->triangle, 4 * sizeof *face);
    for (int n = 0; n < N; n++) {
        for (uint32_t i = 0; i < count; i++) {
            uint32_t v1 = face[i][0], v2 = face[i][1], v3 = face[i][2], m1 = points, m2 = points + 1, m3 = points + 2;
            points += 3;
            const uint32_t six[6][3] = {{v3, v1, m3}, {v3, m3, m2}, {v3, m2, v2}, {v1, m1, m3}, {m3, m1, m2}, {m2, m1, v2}};
            memcpy(next + 6 * i, six, sizeof six);
            const Vec3 *p = m->position;
            assert_true(is_midpoint(p[m1], p[v1], p[v2]));  /* holds for the final positions: none lies off its edge */
            assert_true(is_middle(p[m2].x, p[v2].x, p[v3].x) && is_middle(p[m2].z, p[v2].z, p[v3].z));
            assert_true(is_middle(p[m3].x, p[v3].x, p[v1].x) && is_middle(p[m3].z, p[v3].z, p[v1].z));
        }
        count *= 6;
        void *swap = face;
        face = next;
        next = swap;
    }
    assert_int_equal(m->triangle_count, count);
    assert_memory_equal(m->triangle, face, count * sizeof *face);
    free(face);
    free(next);
    mesh_destroy(m);
    mesh_destroy(before);
}

/* The lift of m2 and m3 over the edge's length: its spread is the roughness, and never more than 1.5. */
static void the_lifts(void **state)
{
    (void)state;
    static const double roughness[] = {0.01, 0.1, 0.4, 50};
    for (int k = 0; k < 4; k++) {
        double sum = 0, squares = 0, greatest = 0;
        int count = 0, at_limit = 0;
        for (uint64_t seed = 0; seed < 2000; seed++) {
            double peak;
            Mesh *m = make(4, 3, 2, roughness[k], 1, seed, &peak);
            double edge = sqrt(2 * 2 + 3 * 3 + 1 * 1);
            for (uint32_t i = 5; i < m->position_count; i++) {
                if ((i - 5) % 3 == 0) continue;
                double share = (m->position[i].y - 1.5) / edge;
                sum += share;
                squares += share * share;
                greatest = fmax(greatest, fabs(share));
                at_limit += fabs(share) > 1.499;
                count++;
            }
            mesh_destroy(m);
        }
        double sigma = roughness[k];
        assert_true(greatest <= 1.5 + 1e-12);
        if (k < 3) {
            assert_true(fabs(sum / count) < 5 * sigma / sqrt(count));
            assert_true(fabs(sqrt(squares / count) / sigma - 1) < 0.03);
        } else {
            assert_true(at_limit > 0.95 * count);
        }
    }
}

static void the_peak_is_the_greatest(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 50; seed++) {
        double peak, second = 0;
        Mesh *m = make(5, 3, 5, 0.8, 3, seed, &peak);
        for (uint32_t i = 0; i < m->position_count; i++) {
            assert_true(m->position[i].y <= peak);
            if (i != 4) second = fmax(second, m->position[i].y);
        }
        assert_true(m->position[4].y == peak);
        if (second > 3) assert_true(peak >= 1.005 * second);
        mesh_destroy(m);
    }
}

static void texture_coordinates(void **state)
{
    (void)state;
    double peak;
    Mesh *m = make(5, 3, 8, 0.2, 2, 1, &peak);
    assert_int_equal(m->uv_count, m->position_count);
    for (uint32_t i = 0; i < m->triangle_count; i++) {
        for (int k = 0; k < 3; k++) {
            Vec3 p = m->position[m->triangle[i][k]];
            const float *uv = m->uv[m->triangle_uv[i][k]];
            assert_true(uv[0] == (float)(p.x / 5) && uv[1] == (float)(p.z / 8));
        }
    }
    mesh_destroy(m);
}

static void the_seed_decides(void **state)
{
    (void)state;
    double peak;
    Mesh *a = make(5, 3, 5, 0.2, 3, 42, &peak), *b = make(5, 3, 5, 0.2, 3, 42, &peak), *c = make(5, 3, 5, 0.2, 3, 43, &peak);
    size_t size = a->position_count * sizeof *a->position;
    assert_memory_equal(a->position, b->position, size);
    assert_memory_not_equal(a->position, c->position, size);
    mesh_destroy(a);
    mesh_destroy(b);
    mesh_destroy(c);
}

/* Without roughness the faces along the old edges have no area. */
static void a_smooth_mountain(void **state)
{
    (void)state;
    double peak;
    Mesh *m = make(4, 4, 4, 0, 0, 1, &peak);
    mesh_destroy(m);
    m = make(4, 0, 4, 0, 2, 1, &peak);  /* flat: its heights are exact, and so is every midpoint */
    assert_true(peak == 0);
    assert_int_equal(m->triangle_count, 4 * 4 * 4);
    assert_int_equal(m->dropped, 0);
    mesh_destroy(m);
    m = make(0, 0, 0, 0.5, 2, 1, &peak);
    assert_int_equal(m->triangle_count, 0);
    mesh_destroy(m);
}

static void extremes_stay_finite(void **state)
{
    (void)state;
    static const double size[] = {1, 1e-300, 5e-324, 1e300, 1.7e308};
    static const double roughness[] = {0, 1e-300, 1e308};
    for (int s = 0; s < 5; s++) {
        for (int r = 0; r < 3; r++) {
            double peak;
            Mesh *m = make(size[s], size[s], size[s], roughness[r], 4, 3, &peak);
            assert_true(isfinite(peak));
            for (uint32_t i = 0; i < m->position_count; i++) {
                Vec3 p = m->position[i];
                assert_true(isfinite(p.x) && isfinite(p.y) && isfinite(p.z));
                assert_true(isfinite(m->uv[i][0]) && isfinite(m->uv[i][1]));
            }
            mesh_destroy(m);
        }
    }
}

typedef struct { int down, up; bool ahead; } Crossings;  /* ahead: one of them after the line's origin */

static Crossings crossings_of(const Mesh *m, const Ray *ray)
{
    Shear shear = shear_of(ray);
    Crossings c = {0};
    for (uint32_t i = 0; i < m->triangle_count; i++) {
        const Vec3 *p[3];
        TriangleCut cut;
        for (int k = 0; k < 3; k++) p[k] = &m->position[m->triangle[i][k]];
        if (!triangle_cut(&shear, p[0], p[1], p[2], &cut)) continue;
        ++*(triangle_entered(&shear, &cut) ? &c.down : &c.up);
        double err;
        c.ahead = c.ahead || triangle_t(&shear, p[0], p[1], p[2], &err) > 0;
    }
    return c;
}

typedef struct { const Mesh *mesh; const Prim *prim; Scratch scratch; double w, l; uint32_t rays; } Watertight;

/* With the base the faces close a body. A line that crosses the base inside goes down through the faces once more often
 * than up, one that passes it as often; a vertical one meets a single face. One to the base's edge is no matter. */
static void passes_faces_once(Watertight *w, Ray ray)
{
    double t = -ray.o.y / ray.d.y, x = ray.o.x + t * ray.d.x, z = ray.o.z + t * ray.d.z;
    double near = fmax(fabs(x / w->w - 0.5), fabs(z / w->l + 0.5)) - 0.5;
    if (fabs(near) < 0x1p-30) return;
    Crossings c = crossings_of(w->mesh, &ray);
    bool vertical = ray.d.x == 0 && ray.d.z == 0;
    Hit hit;
    bool hits = w->prim->ops->intersect(w->prim, &ray, &hit, &w->scratch);
    if (c.down - c.up != (near < 0) || (vertical && c.up > 0) || hits != c.ahead)
        fail_msg("o %a %a %a d %a %a %a: %d times down, %d up, %s", ray.o.x, ray.o.y, ray.o.z, ray.d.x, ray.d.y, ray.d.z,
                 c.down, c.up, hits ? "hit" : "missed");
    w->rays++;
}

/* Rays in the vertical plane of an edge, through ends, quarters and middle of it: nothing is rounded where the sizes have
 * few bits, so they lie in it exactly, and in all faces that stand on that edge. */
static void edges_of(Watertight *w, const Vec3 *a, const Vec3 *b, Rng *rng)
{
    double dx = b->x - a->x, dz = b->z - a->z;
    for (int quarter = 0; quarter <= 4; quarter++) {
        double part = 0.25 * quarter, x = a->x + part * dx, y = a->y + part * (b->y - a->y), z = a->z + part * dz;
        passes_faces_once(w, (Ray){{x, 1e5, z}, {0, -1, 0}, 0, INFINITY});
        double down = exp2(8 * rng_double(rng) - 2);
        passes_faces_once(w, (Ray){{x - 64 * dx, y + 64 * down, z - 64 * dz}, {dx, -down, dz}, 0, INFINITY});
        passes_faces_once(w, (Ray){{x - 0.5 * dx, y + 0.5 * down, z - 0.5 * dz}, {dx, -down, dz}, 0, INFINITY});
    }
}

static void rays_in_the_planes_of_edges(void **state)
{
    (void)state;
    static const double roughness[] = {0, 0.1, 0.3, 4};
    static const double size[][3] = {{2, 1, 2}, {5, 3, 7}, {0.1, 0.7, 1 / 3.0}};
    Rng rng = rng_seed(42, 6);
    Watertight w = {.scratch = {.arena = arena_create()}};
    assert_non_null(w.scratch.arena);
    for (uint32_t i = 0; i < 4 * 3 * 3; i++) {
        const double *s = size[i / 4 % 3];
        double peak;
        Mesh *m = make(s[0], s[1], s[2], roughness[i % 4], 1 + i / 12, 3 + i / 12, &peak);
        Prim *prim = mesh_prim_create(m, false, NULL, NULL);
        assert_non_null(prim);
        w.mesh = m, w.prim = prim, w.w = s[0], w.l = s[2];
        for (uint32_t k = 0; k < 100; k++) {
            const uint32_t *face = m->triangle[rng_u32(&rng) % m->triangle_count];
            uint32_t corner = rng_u32(&rng) % 3;
            edges_of(&w, &m->position[face[corner]], &m->position[face[(corner + 1) % 3]], &rng);
        }
        prim_destroy(prim);
        mesh_destroy(m);
    }
    assert_true(w.rays > 40000);
    arena_destroy(w.scratch.arena);
}

static void too_many_subdivisions(void **state)
{
    (void)state;
    double peak;
    Err err = {ERR_NONE, ""};
    assert_null(mountain_create(1, 1, 1, 0.1, 10, 1, &peak, &err));
    assert_int_equal(err.kind, ERR_LIMIT);
    assert_string_equal(err.text, "10 subdivisions of a mountain; the limit is 9");
    assert_null(mountain_create(1, 1, 1, 0.1, UINT32_MAX, 1, &peak, &err));
    assert_string_equal(err.text, "4294967295 subdivisions of a mountain; the limit is 9");
}

static void every_allocation_may_fail(void **state)
{
    (void)state;
    for (long n = 1, failed = true; failed; n++) {
        Err err = {ERR_NONE, ""};
        double peak;
        alloc_fail_at(n);
        Mesh *m = mountain_create(5, 3, 5, 0.1, 2, 1, &peak, &err);
        failed = alloc_fail_stop();
        assert_true(!failed == !!m);
        mesh_destroy(m);
        if (!failed) continue;
        assert_int_equal(err.kind, ERR_LIMIT);
        assert_string_equal(err.text, "out of memory for a mountain");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_pyramid),
        cmocka_unit_test(the_number_of_faces),
        cmocka_unit_test(the_order_of_the_faces),
        cmocka_unit_test(the_lifts),
        cmocka_unit_test(the_peak_is_the_greatest),
        cmocka_unit_test(texture_coordinates),
        cmocka_unit_test(the_seed_decides),
        cmocka_unit_test(a_smooth_mountain),
        cmocka_unit_test(extremes_stay_finite),
        cmocka_unit_test(rays_in_the_planes_of_edges),
        cmocka_unit_test(too_many_subdivisions),
        cmocka_unit_test(every_allocation_may_fail),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
