/* Tests of the summary line and of the statistics as JSON. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "render/report.h"

static RenderReport example(void)
{
    RenderReport r = {.file = "temple.png", .where = "temple.lua:9: ", .width = 1024, .height = 1024, .samples = 9};
    r.compile.load_wall_s = 0.5;
    r.compile.bvh_cpu_s = 1;
    r.render.camera_rays = 20000000;
    r.render.shadow_rays = 10000000;
    r.render.mirror_rays = 1200000;
    r.render.threads = 2;
    r.render.wall_s = 2.5;
    r.render.cpu_s = 4.9;
    r.encode.wall_s = r.encode.cpu_s = 0.1;
    return r;
}

static void the_summary_is_one_line(void **state)
{
    (void)state;
    char text[256];
    RenderReport r = example();
    report_summary(&r, text, sizeof text);
    assert_string_equal(text, "temple.png: 1024 x 1024, 9 samples, 31.2 M rays in 3.1 s (CPU 6.0 s), 2 threads");
}

static void one_is_no_plural(void **state)
{
    (void)state;
    char text[256];
    RenderReport r = example();
    r.samples = r.render.threads = 1;
    r.compile.load_wall_s = r.encode.wall_s = 0;
    r.render.wall_s = 0.25;
    r.render.camera_rays = 1;
    r.render.shadow_rays = r.render.mirror_rays = 0;
    report_summary(&r, text, sizeof text);
    assert_string_equal(text, "temple.png: 1024 x 1024, 1 sample, 1 ray in 0.25 s (CPU 6.0 s), 1 thread");
}

static void counts_keep_three_digits(void **state)
{
    (void)state;
    const struct { uint64_t count; const char *text; } rows[] = {
        {0, ", 0 rays"}, {999, ", 999 rays"}, {1000, ", 1.00 k rays"}, {9994, ", 9.99 k rays"}, {9996, ", 10.0 k rays"},
        {99960, ", 100 k rays"}, {999499, ", 999 k rays"}, {999500, ", 1.00 M rays"}, {UINT64_MAX, ", 18446744 T rays"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        char text[256];
        RenderReport r = example();
        r.render.camera_rays = rows[i].count;
        r.render.shadow_rays = r.render.mirror_rays = 0;
        report_summary(&r, text, sizeof text);
        if (!strstr(text, rows[i].text)) fail_msg("%s has no%s", text, rows[i].text);
    }
}

/* The JSON of a report with the renders given. */
static const char *json_of(Report *report, const RenderReport *renders, size_t count)
{
    const char *text;
    size_t size;
    Err err = {ERR_NONE, ""};
    for (size_t i = 0; i < count; i++) report_add(report, &renders[i]);
    assert_true(report_finish(report, &text, &size, &err));
    assert_int_equal(strlen(text), size);
    return text;
}

static void no_render_is_an_empty_array(void **state)
{
    (void)state;
    Report *report = report_create("a.lua");
    assert_string_equal(json_of(report, NULL, 0), "{\n  \"script\": \"a.lua\",\n  \"renders\": []\n}\n");
    report_destroy(report);
}

static void names_are_escaped(void **state)
{
    (void)state;
    Report *report = report_create("a\"b\\c\n\x01.lua");
    assert_non_null(strstr(json_of(report, NULL, 0), "\"a\\\"b\\\\c\\u000a\\u0001.lua\""));
    report_destroy(report);
    report = report_create("\xc3\xa4 \xe2\x82\xac \xf0\x9f\x99\x82 \xff \xc3( \xed\xa0\x80 \xc0\x80 \xe2\x82");
    assert_non_null(strstr(json_of(report, NULL, 0), "\"\xc3\xa4 \xe2\x82\xac \xf0\x9f\x99\x82 \\ufffd \\ufffd( "
                                                     "\\ufffd\\ufffd\\ufffd \\ufffd\\ufffd \\ufffd\\ufffd\""));
    report_destroy(report);
}

static void everything_asked_for_is_in_it(void **state)
{
    (void)state;
    const char *const keys[] = {"script", "load", "compile", "bvh", "render", "encode", "wall_s", "cpu_s", "camera",
                                "shadow", "mirror", "meshes", "textures", "named", "loaded", "nodes", "triangles",
                                "peak_memory_bytes", "\"place\": \"temple.lua:9\"", "\"file\": null"};
    RenderReport r[2] = {example(), example()};
    r[1].file = NULL;
    Report *report = report_create("a.lua");
    const char *text = json_of(report, r, 2);
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; i++)
        if (!strstr(text, keys[i])) fail_msg("no %s in %s", keys[i], text);
    report_destroy(report);
    report_destroy(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_summary_is_one_line),
        cmocka_unit_test(one_is_no_plural),
        cmocka_unit_test(counts_keep_three_digits),
        cmocka_unit_test(no_render_is_an_empty_array),
        cmocka_unit_test(names_are_escaped),
        cmocka_unit_test(everything_asked_for_is_in_it),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
