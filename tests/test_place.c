/* Tests of finding the place in front of a message. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "common/place.h"

static void a_place_is_a_file_and_a_line(void **state)
{
    (void)state;
    assert_int_equal(place_length("a.lua:3: what"), 9);
    assert_int_equal(place_length("dir with blanks/a.lua:41: b.obj:7: what"), 26);
    assert_int_equal(place_length("C:/x.lua:1: what"), 12);
}

static void other_colons_are_no_place(void **state)
{
    (void)state;
    assert_int_equal(place_length(""), 0);
    assert_int_equal(place_length("can't open a.lua: No such file or directory"), 0);
    assert_int_equal(place_length("file.png: it is 3: no more"), 0);
    assert_int_equal(place_length("12: what"), 0);
    assert_int_equal(place_length(":12: what"), 0);
    assert_int_equal(place_length("a.lua:12"), 0);
    assert_int_equal(place_length("a.lua:: what"), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_place_is_a_file_and_a_line),
        cmocka_unit_test(other_colons_are_no_place),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
