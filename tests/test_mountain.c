/* The fractal mountain against the words of SPEC 7, which a second, plain subdivision follows here. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "node/primitive/mesh.h"
#include "support/alloc_fail.h"

static Mesh *make(double w, double h, double l, double roughness, uint32_t n, uint64_t seed, double *peak)
{
    Err err = {ERR_NONE, ""};
    Mesh *mesh = mountain_create(w, h, l, roughness, n, seed, peak, &err);
    if (!mesh) fail_msg("%s", err.text);
    return mesh;
}

static bool is_midpoint(Vec3 m, Vec3 a, Vec3 b)
{
    return m.x == 0.5 * a.x + 0.5 * b.x && m.y == 0.5 * a.y + 0.5 * b.y && m.z == 0.5 * a.z + 0.5 * b.z;
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
    Mesh *before = make(4, 3, 2, 0.2, 0, 11, &peak), *m = make(4, 3, 2, 0.2, N, 11, &peak);
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
            assert_true(p[m2].x == 0.5 * p[v2].x + 0.5 * p[v3].x && p[m2].z == 0.5 * p[v2].z + 0.5 * p[v3].z);
            assert_true(p[m3].x == 0.5 * p[v3].x + 0.5 * p[v1].x && p[m3].z == 0.5 * p[v3].z + 0.5 * p[v1].z);
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
        cmocka_unit_test(too_many_subdivisions),
        cmocka_unit_test(every_allocation_may_fail),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
