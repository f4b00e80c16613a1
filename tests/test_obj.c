/* OBJ files: every form of SPEC 4, every error with its line, numbers against strtod, memory that runs out. */
#include "tools/obj.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <float.h>
#include <inttypes.h>
#include <locale.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "common/rng.h"
#include "support/alloc_fail.h"
#include "support/test_file.h"

enum { SEED = 4711 };

#define SQUARE "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"

static Obj load(const char *text)
{
    Obj obj;
    Err err = {ERR_NONE, ""};
    if (!obj_load(test_file("a.obj", text), &obj, &err)) fail_msg("%s\n%s", err.text, text);
    return obj;
}

static void assert_triangle(uint32_t (*t)[3], uint32_t i, uint32_t a, uint32_t b, uint32_t c)
{
    assert_int_equal(t[i][0], a);
    assert_int_equal(t[i][1], b);
    assert_int_equal(t[i][2], c);
}

/* The text after the path, which every message begins with. */
static void assert_error(const char *text, const char *expected)
{
    Obj obj;
    Err err = {ERR_NONE, ""};
    const char *path = test_file("bad.obj", text);
    assert_false(obj_load(path, &obj, &err));
    assert_int_equal(err.kind, ERR_INPUT);
    assert_memory_equal(err.text, path, strlen(path));
    assert_string_equal(err.text + strlen(path), expected);
    assert_null(obj.position);
    assert_null(obj.triangle);
}

static void a_plain_triangle(void **state)
{
    (void)state;
    Obj o = load("v 0 0 0\nv 1.5 -2e2 .25\nv 1. +1 -0\nf 1 2 3\n");
    assert_int_equal(o.position_count, 3);
    assert_int_equal(o.triangle_count, 1);
    assert_triangle(o.triangle, 0, 0, 1, 2);
    assert_true(o.position[1].x == 1.5 && o.position[1].y == -200 && o.position[1].z == 0.25);
    assert_true(o.position[2].x == 1 && o.position[2].y == 1 && o.position[2].z == 0 && signbit(o.position[2].z));
    assert_null(o.uv);
    assert_null(o.normal);
    assert_null(o.triangle_uv);
    assert_null(o.triangle_normal);
    obj_free(&o);
}

static void all_forms_of_corners(void **state)
{
    (void)state;
    Obj o = load(SQUARE "vt 0 0\nvt 1 0\nvt .5 1 7\nvn 0 0 2\nvn 1 0 0\n"
                 "f 1 2 3\nf 1/1 2/2 3/3\nf 1//1 2//1 3//2\nf 1/3/2 2/2/1 3/1/1\nf -4/-3/-2 -3/-2 -1\n");
    assert_int_equal(o.triangle_count, 5);
    assert_triangle(o.triangle_uv, 0, OBJ_NONE, OBJ_NONE, OBJ_NONE);
    assert_triangle(o.triangle_normal, 0, OBJ_NONE, OBJ_NONE, OBJ_NONE);
    assert_triangle(o.triangle_uv, 1, 0, 1, 2);
    assert_triangle(o.triangle_uv, 2, OBJ_NONE, OBJ_NONE, OBJ_NONE);
    assert_triangle(o.triangle_normal, 2, 0, 0, 1);
    assert_triangle(o.triangle_uv, 3, 2, 1, 0);
    assert_triangle(o.triangle_normal, 3, 1, 0, 0);
    assert_triangle(o.triangle, 4, 0, 1, 3);
    assert_triangle(o.triangle_uv, 4, 0, 1, OBJ_NONE);
    assert_triangle(o.triangle_normal, 4, 0, OBJ_NONE, OBJ_NONE);
    assert_int_equal(o.uv_count, 3);
    assert_true(o.uv[2][0] == 0.5f && o.uv[2][1] == 1);
    assert_true(o.normal[0][2] == 1 && o.normal[0][0] == 0);
    obj_free(&o);
}

static void polygons_are_fans(void **state)
{
    (void)state;
    Obj o = load(SQUARE "v 0 2 0\nf 1 2 3 4 5\n");
    assert_int_equal(o.triangle_count, 3);
    assert_triangle(o.triangle, 0, 0, 1, 2);
    assert_triangle(o.triangle, 1, 0, 2, 3);
    assert_triangle(o.triangle, 2, 0, 3, 4);
    obj_free(&o);
}

static void negative_indices_count_from_the_last_vertex(void **state)
{
    (void)state;
    Obj o = load("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 5 5\nf -4 -2 -1\n");
    assert_triangle(o.triangle, 0, 0, 1, 2);
    assert_triangle(o.triangle, 1, 0, 2, 3);
    obj_free(&o);
}

static void faces_may_come_before_their_vertices(void **state)
{
    (void)state;
    Obj o = load("f 1/1 2/1 3/1\nvt 0 0\n" SQUARE);
    assert_triangle(o.triangle, 0, 0, 1, 2);
    obj_free(&o);
    assert_error("v 0 0 0\nf 1 2 3\nf 1 9 5\nf 1 2 9\nv 0 0 0\nv 0 0 0\n", ":3: vertex 9 of 3");
}

static void other_statements_are_passed_over(void **state)
{
    (void)state;
    Obj o = load("# a comment\nmtllib C:\\things\\a.mtl\no thing\ng a b\ns off\nusemtl steel\n" SQUARE
                 "vp 0.3 0.1\np 1 2\nl 1 2 3\nvertex\nfoo 1 2\n  \t\n\nf 1 2 3 # behind a face\n");
    assert_int_equal(o.triangle_count, 1);
    obj_free(&o);
}

static void a_comment_ends_with_its_line(void **state)
{
    (void)state;
    Obj o = load("# C:\\folder\\\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    assert_int_equal(o.position_count, 3);
    obj_free(&o);
}

static void line_ends(void **state)
{
    (void)state;
    Obj a = load("v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 3\r\n");
    Obj b = load("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3");
    Obj c = load("\xef\xbb\xbfv 0 0 0\nv 1 \\\n 0 0\nv 0 1\\\r\n 0\nf 1\\\n2 \\\n\\\n3\\\n");
    Obj d = load("\tv\t0 0  0 \n v 1 0 0\t\nv 0 1 0\n\tf 1 2 3 ");
    const Obj *all[] = {&a, &b, &c, &d};
    for (int i = 0; i < 4; i++) {
        assert_int_equal(all[i]->position_count, 3);
        assert_int_equal(all[i]->triangle_count, 1);
        assert_triangle(all[i]->triangle, 0, 0, 1, 2);
        assert_memory_equal(all[i]->position, a.position, 3 * sizeof *a.position);
    }
    obj_free(&a);
    obj_free(&b);
    obj_free(&c);
    obj_free(&d);
    assert_error("v 0 0 \\\n 0\nv 1 0 0\nv 0 0\\\n x\n", ":4: 'x' is not a number");
}

static void further_numbers_are_ignored(void **state)
{
    (void)state;
    Obj o = load("v 0 0 0 1\nv 1 0 0 0.5 0.25 0.125\nv 0 1 0 1.0 1 1 1\nvt 0.25\nvt 1 2 3\nf 1/1 2/2 3/1\n");
    assert_int_equal(o.position_count, 3);
    assert_true(o.uv[0][0] == 0.25f && o.uv[0][1] == 0 && o.uv[1][1] == 2);
    obj_free(&o);
}

static void zero_normals_are_none(void **state)
{
    (void)state;
    Obj o = load(SQUARE "vn 0 0 0\nvn 0 1e-300 0\nvn 3e300 0 4e300\nf 1//1 2//2 3//3\n");
    assert_triangle(o.triangle_normal, 0, OBJ_NONE, 1, 2);
    assert_true(o.normal[1][1] == 1 && o.normal[2][0] == 0.6f && o.normal[2][2] == 0.8f);
    obj_free(&o);
}

static void texture_vertices_stay_finite(void **state)
{
    (void)state;
    Obj o = load(SQUARE "vt 1e300 -1e300\nf 1/1 2/1 3/1\n");
    assert_true(o.uv[0][0] == FLT_MAX && o.uv[0][1] == -FLT_MAX);
    obj_free(&o);
}

static void errors_name_the_line(void **state)
{
    (void)state;
    static const char *const bad[][2] = {
        {"f 1 2 4\n", ":5: vertex 4 of 3"},
        {"f 1 2 0\n", ":5: vertex 0; they are counted from 1"},
        {"f 1 2 -4\n", ":5: vertex -4 of 3 so far"},
        {"f 1 2 99999999999999999999\n", ":5: vertex 99999999999999999999 of 3"},
        {"f 1/1 2/1 3/2\n", ":5: texture vertex 2 of 1"},
        {"f 1/-2 2/1 3/1\n", ":5: texture vertex -2 of 1 so far"},
        {"f 1//1 2//1 3//1\n", ":5: normal 1 of 0"},
        {"f 1/0/1 2 3\n", ":5: texture vertex 0; they are counted from 1"},
        {"f 1 2\n", ":5: a face of two vertices"},
        {"f 1\n", ":5: a face of one vertex"},
        {"f\n", ":5: a face without vertices"},
        {"f # 1 2 3\n", ":5: a face without vertices"},
        {"f 1 2 three\n", ":5: 'three' is not a corner of a face"},
        {"f 1 2 3.5\n", ":5: '3.5' is not a corner of a face"},
        {"f 1 2 3/1/1/1\n", ":5: '3/1/1/1' is not a corner of a face"},
        {"f 1 2 3/1//\n", ":5: '3/1//' is not a corner of a face"},
        {"f 1 2 /1\n", ":5: '/1' is not a corner of a face"},
        {"f 1 2 -\n", ":5: '-' is not a corner of a face"},
        {"v 1 2\n", ":5: a vertex needs three coordinates"},
        {"v\n", ":5: a vertex needs three coordinates"},
        {"v 1 2 three\n", ":5: 'three' is not a number"},
        {"v 1 2 3x\n", ":5: '3x' is not a number"},
        {"v 1 2 1e\n", ":5: '1e' is not a number"},
        {"v 1 2 1e+\n", ":5: '1e+' is not a number"},
        {"v 1 2 .\n", ":5: '.' is not a number"},
        {"v 1 2 -\n", ":5: '-' is not a number"},
        {"v 1 2 1.2.3\n", ":5: '1.2.3' is not a number"},
        {"v 1 2 0x10\n", ":5: '0x10' is not a number"},
        {"v 1 2 1,5\n", ":5: '1,5' is not a number"},
        {"v 1 2 3 red\n", ":5: 'red' is not a number"},
        {"v 1 2 nan\n", ":5: 'nan' is not a finite number"},
        {"v 1 -Inf 2\n", ":5: '-Inf' is not a finite number"},
        {"v 1 1e999 2\n", ":5: '1e999' is not a finite number"},
        {"v 1 2 aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa\n",
         ":5: 'aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa...' is not a number"},
        {"vt\n", ":5: a texture vertex needs a coordinate"},
        {"vt u\n", ":5: 'u' is not a number"},
        {"vn 1 2\n", ":5: a normal needs three coordinates"},
        {"vn 1 2 nan\n", ":5: 'nan' is not a finite number"},
        {"", ": no faces"},
        {"l 1 2\nl 2 3\n", ": no faces"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        char text[256];
        snprintf(text, sizeof text, "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\n%s", bad[i][0]);
        assert_error(text, bad[i][1]);
    }
    assert_error("", ": no faces");
    assert_error("\n\r\n", ": no faces");
}

static void files_that_cant_be_read(void **state)
{
    (void)state;
    Obj obj;
    Err err;
    assert_false(obj_load("build/none/none.obj", &obj, &err));
    assert_int_equal(err.kind, ERR_INPUT);
    assert_string_equal(err.text, "can't open build/none/none.obj: No such file or directory");
    assert_false(obj_load("src", &obj, &err));
    assert_string_equal(err.text, "can't open src: Is a directory");
    const char *path = test_file_bytes("zero.obj", "v 0 0 0\nv 1\0 0 0\n", 17);
    assert_false(obj_load(path, &obj, &err));
    assert_int_equal(err.kind, ERR_INPUT);
    assert_string_equal(err.text, test_message("", "zero.obj", ":2: a zero byte; this is no text file"));
    assert_false(obj_load("/dev/zero", &obj, &err));
    assert_string_equal(err.text, "/dev/zero:1: a zero byte; this is no text file");
}

/* Decimal texts of random doubles, cut and spread in many ways, must read as strtod reads them. */
static void numbers_are_rounded_correctly(void **state)
{
    (void)state;
    enum { COUNT = 60000 };
    static const char *const hard[] = {
        "9007199254740993", "9007199254740992.9999999999999999", "1e22", "1e23", "123456789012345678e-5",
        "0.1", "2.2250738585072011e-308", "4.9e-324", "2e-324", "1.7976931348623157e308", "0.000000000000000000000001",
        "100000000000000000000000000000", "9223372036854775807e-19", "9999999999999999999e-19", "9999999999999999999e19",
        "0.30000001192092896", "00000000000000000000000001.5", "1.00000000000000000000000000000", "0e999999999999",
        "0.0e-999999999999", "1e-999999999", "8.5e-1", "18446744073709551615", "18446744073709551616e-10"};
    char *text = malloc(COUNT * 64 + 64), *at = text;
    double *expected = malloc(3 * COUNT * sizeof *expected);
    assert_non_null(text);
    assert_non_null(expected);
    Rng rng = rng_seed(SEED, 0);
    uint32_t count = 0;
    for (uint32_t i = 0; i < COUNT; i++) {
        char number[48];
        if (i < sizeof hard / sizeof *hard) {
            snprintf(number, sizeof number, "%s", hard[i]);
        } else if (i % 4 == 0) {
            double x = ldexp(rng_double(&rng) - 0.5, (int)(rng_u32(&rng) % 1800) - 900);
            snprintf(number, sizeof number, "%.*g", 1 + (int)(rng_u32(&rng) % 20), x);
        } else if (i % 4 == 1) {
            uint64_t digits = ((uint64_t)rng_u32(&rng) << 32 | rng_u32(&rng)) >> rng_u32(&rng) % 64;
            snprintf(number, sizeof number, "%" PRIu64 "e%d", digits, (int)(rng_u32(&rng) % 60) - 40);
        } else {
            double x = 200 * rng_double(&rng) - 100;
            snprintf(number, sizeof number, "%.*f", (int)(rng_u32(&rng) % 18), x);
        }
        expected[count++] = strtod(number, NULL);
        at += sprintf(at, "v 0 %s 0\n", number);
    }
    at += sprintf(at, "f 1 2 3\n");
    Obj obj;
    Err err = {ERR_NONE, ""};
    if (!obj_load(test_file("numbers.obj", text), &obj, &err)) fail_msg("%s", err.text);
    assert_int_equal(obj.position_count, count);
    for (uint32_t i = 0; i < count; i++)
        if (memcmp(&obj.position[i].y, &expected[i], sizeof(double)) != 0)
            fail_msg("seed %d, number %u: %.17g instead of %.17g", SEED, i, obj.position[i].y, expected[i]);
    obj_free(&obj);
    free(expected);
    free(text);
}

/* Where a locale with a decimal comma is installed, it must change nothing. */
static void the_locale_does_not_matter(void **state)
{
    (void)state;
    static const char *const comma[] = {"de_DE.UTF-8", "fr_FR.UTF-8", "de_DE", "C.UTF-8"};
    for (size_t i = 0; i < sizeof comma / sizeof *comma && !setlocale(LC_ALL, comma[i]); i++) {}
    Obj o = load("v 0.5 1.234567890123456789012 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    assert_true(o.position[0].x == 0.5 && o.position[0].y == 0x1.3c0ca428c59fbp+0);
    obj_free(&o);
    setlocale(LC_ALL, "C");
}

static void one_line_of_many_megabytes(void **state)
{
    (void)state;
    const size_t size = (size_t)100 << 20;
    char *text = malloc(size + 64), *at = text;
    assert_non_null(text);
    at += sprintf(at, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf");
    uint64_t corners = 0;
    for (; (size_t)(at - text) < size; corners++) at += sprintf(at, " %d", 1 + (int)(corners % 3));
    *at++ = '\n';
    *at = '\0';
    Obj obj;
    Err err = {ERR_NONE, ""};
    if (!obj_load(test_file("long.obj", text), &obj, &err)) fail_msg("%s", err.text);
    assert_int_equal(obj.triangle_count, corners - 2);
    obj_free(&obj);
    memset(text, 'x', size);
    memcpy(text, "\nv 1 2 ", 7);
    text[size] = '\0';
    assert_false(obj_load(test_file("long.obj", text), &obj, &err));
    assert_string_equal(err.text,
                        test_message("", "long.obj", ":2: 'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx...' is not a number"));
    memset(text + 7, '1', size - 7);
    assert_false(obj_load(test_file("long.obj", text), &obj, &err));
    assert_string_equal(err.text,
                        test_message("", "long.obj", ":2: '1111111111111111111111111111111111111111...' is not a finite number"));
    free(text);
    unlink(test_path("long.obj"));
}

/* Bytes of a good file replaced, removed and doubled at random: an answer or an error, nothing else. */
static void damaged_files_do_no_harm(void **state)
{
    (void)state;
    static const char good[] = SQUARE "vt 0 0\nvt 1e0 .5\nvn 0 0 1\nf 1/1/1 2/2/1 3//1 -1 \\\n 1\nl 1 2\nf 1 2 3\n";
    static const char bytes[] = "0123456789-+.e/ \\\n\r#vftn\xff";
    Rng rng = rng_seed(SEED, 1);
    for (int i = 0; i < 3000; i++) {
        char text[sizeof good];
        memcpy(text, good, sizeof good);
        for (uint32_t k = 1 + rng_u32(&rng) % 6; k > 0; k--)
            text[rng_u32(&rng) % (sizeof good - 1)] = bytes[rng_u32(&rng) % (sizeof bytes - 1)];
        Obj obj;
        Err err = {ERR_NONE, ""};
        if (obj_load(test_file("damaged.obj", text), &obj, &err)) {
            for (uint32_t t = 0; t < obj.triangle_count; t++)
                for (int c = 0; c < 3; c++) assert_true(obj.triangle[t][c] < obj.position_count);
            obj_free(&obj);
        } else {
            assert_int_equal(err.kind, ERR_INPUT);
        }
    }
}

static void every_allocation_may_fail(void **state)
{
    (void)state;
    const char *path = test_file("fail.obj", SQUARE "f 1 2 3\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1 4/1/1\n");
    for (long n = 1;; n++) {
        Obj obj;
        Err err = {ERR_NONE, ""};
        alloc_fail_at(n);
        bool done = obj_load(path, &obj, &err);
        if (!alloc_fail_stop()) {
            assert_true(done);
            obj_free(&obj);
            assert_true(n > 6);
            break;
        }
        if (done) {  /* giving memory back may fail without harm */
            obj_free(&obj);
            continue;
        }
        assert_int_equal(err.kind, ERR_LIMIT);
        assert_string_equal(err.text, test_message("out of memory for ", "fail.obj", ""));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_plain_triangle),
        cmocka_unit_test(all_forms_of_corners),
        cmocka_unit_test(polygons_are_fans),
        cmocka_unit_test(negative_indices_count_from_the_last_vertex),
        cmocka_unit_test(faces_may_come_before_their_vertices),
        cmocka_unit_test(other_statements_are_passed_over),
        cmocka_unit_test(a_comment_ends_with_its_line),
        cmocka_unit_test(line_ends),
        cmocka_unit_test(further_numbers_are_ignored),
        cmocka_unit_test(zero_normals_are_none),
        cmocka_unit_test(texture_vertices_stay_finite),
        cmocka_unit_test(errors_name_the_line),
        cmocka_unit_test(files_that_cant_be_read),
        cmocka_unit_test(numbers_are_rounded_correctly),
        cmocka_unit_test(the_locale_does_not_matter),
        cmocka_unit_test(one_line_of_many_megabytes),
        cmocka_unit_test(damaged_files_do_no_harm),
        cmocka_unit_test(every_allocation_may_fail),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
