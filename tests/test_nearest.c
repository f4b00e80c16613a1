/* Tests of the names that misspelt ones are taken for. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "tools/nearest.h"

static const char *const names[] = {"sphere", "cube", "cone", "cylinder", "fractal_mountain", "nh_sphere", "nh_box"};

static const char *nearest(const char *wrong) { return nearest_name(wrong, names, sizeof names / sizeof names[0]); }

static void each_kind_of_slip_is_found(void **state)
{
    (void)state;
    assert_string_equal(nearest("spere"), "sphere");             /* left out */
    assert_string_equal(nearest("sphhere"), "sphere");           /* put in */
    assert_string_equal(nearest("sphexe"), "sphere");            /* replaced */
    assert_string_equal(nearest("shpere"), "sphere");            /* swapped */
    assert_string_equal(nearest("Sphere"), "sphere");            /* case */
    assert_string_equal(nearest("fractalMountain"), "fractal_mountain");
    assert_string_equal(nearest("cone"), "cone");
}

static void a_tie_goes_to_the_first(void **state)
{
    (void)state;
    assert_string_equal(nearest("cune"), "cube");
}

static void what_is_far_has_no_name(void **state)
{
    (void)state;
    assert_null(nearest("teapot"));
    assert_null(nearest(""));
    assert_null(nearest("xyz"));
    char longer[200];
    memset(longer, 'x', sizeof longer - 1);
    longer[sizeof longer - 1] = '\0';
    assert_null(nearest(longer));
    assert_null(nearest_name("a", NULL, 0));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_kind_of_slip_is_found),
        cmocka_unit_test(a_tie_goes_to_the_first),
        cmocka_unit_test(what_is_far_has_no_name),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
