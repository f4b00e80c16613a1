/* Meshes as data: faces from tables and files, degenerate triangles, bounds, closedness. */
#include "node/primitive/mesh.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "common/rng.h"
#include "support/alloc_fail.h"
#include "support/test_file.h"

enum { SEED = 31 };

static const Vec3 cube_position[8] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                      {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
static const uint32_t cube_size[6] = {4, 4, 4, 4, 4, 4};
static const uint32_t cube_index[24] = {0, 3, 2, 1, 4, 5, 6, 7, 0, 1, 5, 4, 2, 3, 7, 6, 0, 4, 7, 3, 1, 2, 6, 5};

static Mesh *make(const Vec3 *p, uint32_t count, const uint32_t *size, uint32_t faces, const uint32_t *index)
{
    Err err = {ERR_NONE, ""};
    Mesh *mesh = mesh_from_faces(p, count, size, faces, index, &err);
    if (!mesh) fail_msg("%s", err.text);
    return mesh;
}

/* Whether a mesh of this triangle and a sound one drops it. */
static bool is_dropped(Vec3 a, Vec3 b, Vec3 c)
{
    const Vec3 p[6] = {a, b, c, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    Mesh *mesh = make(p, 6, (const uint32_t[]){3, 3}, 2, (const uint32_t[]){0, 1, 2, 3, 4, 5});
    bool dropped = mesh->dropped == 1;
    assert_int_equal(mesh->triangle_count + mesh->dropped, 2);
    mesh_destroy(mesh);
    return dropped;
}

static void faces_of_a_table(void **state)
{
    (void)state;
    Mesh *cube = make(cube_position, 8, cube_size, 6, cube_index);
    assert_int_equal(cube->triangle_count, 12);
    assert_int_equal(cube->dropped, 0);
    assert_int_equal(cube->triangle[1][0], 0);
    assert_int_equal(cube->triangle[1][1], 2);
    assert_int_equal(cube->triangle[1][2], 1);
    Box box = mesh_bounds(cube);
    assert_true(box.lo.x == 0 && box.lo.y == 0 && box.lo.z == 0 && box.hi.x == 1 && box.hi.y == 1 && box.hi.z == 1);
    mesh_destroy(cube);
    mesh_destroy(NULL);
}

static void faults_of_a_table(void **state)
{
    (void)state;
    static const Vec3 far_away[3] = {{0, 0, 0}, {INFINITY, 0, 0}, {0, 1, 0}};
    static const struct { const Vec3 *p; uint32_t points, size, faces, index[4]; const char *text; } bad[] = {
        {cube_position, 8, 3, 1, {0, 9, 1, 0}, "face 1: vertex 9 of 8"},
        {cube_position, 8, 2, 1, {0, 1, 0, 0}, "face 1 has 2 vertices"},
        {cube_position, 8, 1, 1, {0, 0, 0, 0}, "face 1 has 1 vertex"},
        {cube_position, 8, 0, 1, {0, 0, 0, 0}, "face 1 has 0 vertices"},
        {cube_position, 8, 3, 0, {0, 0, 0, 0}, "no faces"},
        {cube_position, 0, 3, 1, {0, 0, 0, 0}, "face 1: vertex 0 of 0"},
        {cube_position, 8, 3, 1, {0, 1, 1, 0}, "no face has an area"},
        {far_away, 3, 3, 1, {0, 1, 2, 0}, "vertex 1 isn't finite"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        Err err = {ERR_NONE, ""};
        assert_null(mesh_from_faces(bad[i].p, bad[i].points, &bad[i].size, bad[i].faces, bad[i].index, &err));
        assert_int_equal(err.kind, ERR_SCENE);
        assert_string_equal(err.text, bad[i].text);
    }
}

static void triangles_without_area_are_dropped(void **state)
{
    (void)state;
    Vec3 o = {0, 0, 0};
    assert_true(is_dropped(o, o, vec3_make(1, 0, 0)));
    assert_true(is_dropped(o, vec3_make(1, 2, 3), vec3_make(1, 2, 3)));
    assert_true(is_dropped(o, vec3_make(-0.0, 0, 0), vec3_make(1, 0, 0)));
    assert_true(is_dropped(o, vec3_make(1, 2, 3), vec3_make(2, 4, 6)));
    assert_true(is_dropped(vec3_make(0.1, 0.1, 0.1), vec3_make(0.2, 0.2, 0.2), vec3_make(0.7, 0.7, 0.7)));
    assert_true(is_dropped(vec3_make(1e15, 1, 0), vec3_make(1e15 + 1, 2, 0), vec3_make(1e15 + 3, 4, 0)));
    assert_true(is_dropped(o, vec3_make(5e-324, 0, 0), vec3_make(0, 5e-324, 0)));
    assert_true(is_dropped(vec3_make(1e-310, 0, 0), vec3_make(0, 1e-310, 0), o));
}

static void triangles_with_area_are_kept(void **state)
{
    (void)state;
    Vec3 o = {0, 0, 0};
    assert_false(is_dropped(o, vec3_make(1e-160, 0, 0), vec3_make(0, 1e-160, 0)));
    assert_false(is_dropped(o, vec3_make(1e-300, 0, 0), vec3_make(0, 1e-300, 0)));
    assert_false(is_dropped(o, vec3_make(1e300, 0, 0), vec3_make(0, 1e300, 0)));
    assert_false(is_dropped(vec3_make(-1e308, 0, 0), vec3_make(1e308, 0, 0), vec3_make(0, 1e308, 0)));
    assert_false(is_dropped(o, vec3_make(1, 0, 0), vec3_make(0.5, 1e-15, 0)));
    assert_false(is_dropped(o, vec3_make(1, 1, 0), vec3_make(2, 2 + 4.5e-16, 0)));
    assert_false(is_dropped(o, vec3_make(1e6, 0, 0), vec3_make(5e5, 0, 1e-6)));
    assert_false(is_dropped(vec3_make(1e15, 0, 0), vec3_make(1e15 + 1, 0, 0), vec3_make(1e15, 0.125, 0)));
}

/* Multiplying by powers of two changes nothing: the answer is that for the whole range of scales. */
static void degeneracy_has_no_scale(void **state)
{
    (void)state;
    Rng rng = rng_seed(SEED, 0);
    for (int i = 0; i < 2000; i++) {
        Vec3 p[3];
        for (int k = 0; k < 2; k++)
            p[k] = vec3_make(rng_u32(&rng) % 64, rng_u32(&rng) % 64, rng_u32(&rng) % 64);
        double t = (int)(rng_u32(&rng) % 5) - 2;
        p[2] = vec3_at(p[0], t, vec3_sub(p[1], p[0]));
        if (i % 2) p[2].z += i % 4 == 1 ? 0x1p-40 : -0x1p-40;
        bool flat = i % 2 == 0 || (p[0].x == p[1].x && p[0].y == p[1].y) || t == 0 || t == 1;
        if (flat && i % 2) continue;
        for (int e = -900; e <= 900; e += 300) {
            double s = ldexp(1, e);
            if (is_dropped(vec3_scale(p[0], s), vec3_scale(p[1], s), vec3_scale(p[2], s)) != flat)
                fail_msg("seed %d, triangle %d, scale 2^%d", SEED, i, e);
        }
    }
}

static void dropping_keeps_indices_together(void **state)
{
    (void)state;
    Err err = {ERR_NONE, ""};
    Mesh *m = mesh_load_obj(test_file("drop.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\n"
                                                  "f 1/1/1 1/1/1 2/2/1\nf 1/3/1 2/2/1 3/1/1\nf 1 2 4\nf 2 3 4\n"), &err);
    if (!m) fail_msg("%s", err.text);
    assert_int_equal(m->triangle_count, 2);
    assert_int_equal(m->dropped, 2);
    assert_int_equal(m->triangle_uv[0][0], 2);
    assert_int_equal(m->triangle_uv[0][2], 0);
    assert_int_equal(m->triangle_uv[1][0], UINT32_MAX);
    assert_int_equal(m->triangle_normal[0][1], 0);
    assert_int_equal(m->triangle_normal[1][1], UINT32_MAX);
    assert_int_equal(m->triangle[1][0], 1);
    mesh_destroy(m);
    assert_null(mesh_load_obj(test_file("flat.obj", "v 0 0 0\nv 1 0 0\nf 1 2 1\n"), &err));
    assert_int_equal(err.kind, ERR_INPUT);
    assert_string_equal(err.text, test_message("", "flat.obj", ": no face has an area"));
}

static void bounds_are_those_of_the_triangles(void **state)
{
    (void)state;
    Mesh *m = mesh_load_obj(test_file("stray.obj", "v 0 0 0\nv 1 0 -3\nv 0 2 0\nv 99 99 99\nf 1 2 3\n"), NULL);
    assert_non_null(m);
    Box box = mesh_bounds(m);
    assert_true(box.lo.x == 0 && box.lo.y == 0 && box.lo.z == -3 && box.hi.x == 1 && box.hi.y == 2 && box.hi.z == 0);
    mesh_destroy(m);
}

static void a_cube_is_closed(void **state)
{
    (void)state;
    Mesh *cube = make(cube_position, 8, cube_size, 6, cube_index);
    assert_true(mesh_is_closed(cube, NULL));
    mesh_destroy(cube);
}

/* Every face with corners of its own, 0 and -0 mixed. */
static void corners_are_welded_by_value(void **state)
{
    (void)state;
    Vec3 p[24];
    uint32_t index[24];
    for (uint32_t i = 0; i < 24; i++) {
        p[i] = cube_position[cube_index[i]];
        if (i % 3 == 0) p[i] = vec3_make(p[i].x == 0 ? -0.0 : p[i].x, p[i].y, p[i].z == 0 ? -0.0 : p[i].z);
        index[i] = i;
    }
    Mesh *cube = make(p, 24, cube_size, 6, index);
    assert_true(mesh_is_closed(cube, NULL));
    mesh_destroy(cube);
}

static void an_open_edge_is_named(void **state)
{
    (void)state;
    Mesh *box = make(cube_position, 8, cube_size, 5, cube_index);  /* without the face x = 1 */
    Err err = {ERR_NONE, ""};
    assert_false(mesh_is_closed(box, &err));
    assert_int_equal(err.kind, ERR_SCENE);
    assert_string_equal(err.text, "open edge from (1, 0, 0) to (1, 1, 0)");
    mesh_destroy(box);
    uint32_t turned[24];
    memcpy(turned, cube_index, sizeof turned);
    turned[1] = 1;
    turned[3] = 3;  /* the first face the other way round */
    box = make(cube_position, 8, cube_size, 6, turned);
    assert_false(mesh_is_closed(box, &err));
    assert_string_equal(err.text, "open edge from (0, 0, 0) to (1, 0, 0)");
    mesh_destroy(box);
}

/* Two cubes that share an edge: four faces meet there, two in each direction. */
static void four_faces_may_share_an_edge(void **state)
{
    (void)state;
    Vec3 p[16];
    uint32_t size[12], index[48];
    for (uint32_t i = 0; i < 16; i++) p[i] = vec3_add(cube_position[i % 8], i < 8 ? vec3_make(0, 0, 0) : vec3_make(1, 1, 0));
    for (uint32_t i = 0; i < 12; i++) size[i] = 4;
    for (uint32_t i = 0; i < 48; i++) index[i] = cube_index[i % 24] + 8 * (i / 24);
    Mesh *both = make(p, 16, size, 12, index);
    assert_true(mesh_is_closed(both, NULL));
    mesh_destroy(both);
}

/* A double pyramid over 20,000 corners: two vertices with 40,000 edges between them. */
static void vertices_of_many_triangles(void **state)
{
    (void)state;
    enum { N = 20000 };
    Vec3 *p = malloc((N + 2) * sizeof *p);
    uint32_t *size = malloc(2 * N * sizeof *size), *index = malloc(6 * N * sizeof *index);
    assert_true(p && size && index);
    p[N] = vec3_make(0, 1, 0);
    p[N + 1] = vec3_make(0, -1, 0);
    for (uint32_t i = 0; i < N; i++) {
        double angle = 6.283185307179586 * i / N;
        p[i] = vec3_make(cos(angle), 0, sin(angle));
        uint32_t next = (i + 1) % N, *t = index + 6 * i;
        size[2 * i] = size[2 * i + 1] = 3;
        t[0] = next, t[1] = i, t[2] = N;
        t[3] = i, t[4] = next, t[5] = N + 1;
    }
    Mesh *m = make(p, N + 2, size, 2 * N, index);
    assert_true(mesh_is_closed(m, NULL));
    mesh_destroy(m);
    m = make(p, N + 2, size, 2 * N - 1, index);
    assert_false(mesh_is_closed(m, NULL));
    mesh_destroy(m);
    free(p);
    free(size);
    free(index);
}

static void sources_load_once(void **state)
{
    (void)state;
    MeshSource file = {.kind = MESH_FILE, .path = test_file("once.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")};
    assert_true(mesh_source_load(&file, NULL));
    Mesh *first = file.loaded;
    assert_true(mesh_source_load(&file, NULL));
    assert_ptr_equal(file.loaded, first);
    mesh_destroy(first);
    MeshSource mountain = {.kind = MESH_MOUNTAIN, .mountain = {2, 1, 2, 0.1, 2, 5}};
    assert_true(mesh_source_load(&mountain, NULL));
    assert_int_equal(mountain.loaded->triangle_count, 144);
    assert_non_null(mountain.height_bands);
    mesh_destroy(mountain.loaded);
    texture_destroy(mountain.height_bands);
    Err err;
    MeshSource missing = {.kind = MESH_FILE, .path = "build/none.obj"};
    assert_false(mesh_source_load(&missing, &err));
    assert_int_equal(err.kind, ERR_INPUT);
    assert_null(missing.loaded);
}

static void every_allocation_may_fail(void **state)
{
    (void)state;
    const char *path = test_file("fail.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    for (long n = 1, failed = true; failed; n++) {
        Err err = {ERR_NONE, ""};
        alloc_fail_at(n);
        Mesh *made = mesh_from_faces(cube_position, 8, cube_size, 6, cube_index, &err);
        failed = alloc_fail_stop();
        assert_true(!failed == !!made);
        mesh_destroy(made);
        if (failed) assert_int_equal(err.kind, ERR_LIMIT);
    }
    Mesh *cube = make(cube_position, 8, cube_size, 6, cube_index);
    for (long n = 1, failed = true; failed; n++) {
        Err err = {ERR_NONE, ""};
        alloc_fail_at(n);
        bool closed = mesh_is_closed(cube, &err);
        failed = alloc_fail_stop();
        assert_true(closed == !failed);
        if (failed) assert_int_equal(err.kind, ERR_LIMIT);
    }
    mesh_destroy(cube);
    for (long n = 1, failed = true; failed; n++) {
        Err err = {ERR_NONE, ""};
        alloc_fail_at(n);
        Mesh *loaded = mesh_load_obj(path, &err);
        failed = alloc_fail_stop();
        assert_true(loaded || err.kind == ERR_LIMIT);
        mesh_destroy(loaded);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(faces_of_a_table),
        cmocka_unit_test(faults_of_a_table),
        cmocka_unit_test(triangles_without_area_are_dropped),
        cmocka_unit_test(triangles_with_area_are_kept),
        cmocka_unit_test(degeneracy_has_no_scale),
        cmocka_unit_test(dropping_keeps_indices_together),
        cmocka_unit_test(bounds_are_those_of_the_triangles),
        cmocka_unit_test(a_cube_is_closed),
        cmocka_unit_test(corners_are_welded_by_value),
        cmocka_unit_test(an_open_edge_is_named),
        cmocka_unit_test(four_faces_may_share_an_edge),
        cmocka_unit_test(vertices_of_many_triangles),
        cmocka_unit_test(sources_load_once),
        cmocka_unit_test(every_allocation_may_fail),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
