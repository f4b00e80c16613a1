/* Tests of the progress bar's text. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "render/progress.h"

static char text[128];

static bool line(Progress *p, double now_s, double share, size_t columns)
{
    memset(text, '?', sizeof text);
    return progress_line(p, now_s, share, columns, text, sizeof text);
}

static void it_is_drawn_at_most_ten_times_a_second(void **state)
{
    (void)state;
    Progress p = progress_start(50);
    int drawn = 0;
    for (int i = 1; i <= 4096; i++) drawn += line(&p, 50 + i / 1024.0, i / 4096.0, 80);
    assert_in_range(drawn, 36, 40);
    assert_false(line(&p, 50, 1, 80));
}

static void it_tells_the_share_and_the_time_left(void **state)
{
    (void)state;
    Progress p = progress_start(100);
    assert_true(line(&p, 130, 0.25, 40));
    assert_string_equal(text, "[#####               ]  25 %  1:30 left");
}

static void hours_have_minutes_too(void **state)
{
    (void)state;
    Progress p = progress_start(0);
    assert_true(line(&p, 1000, 0.1, 80));
    assert_non_null(strstr(text, " 10 %  2:30:00 left"));
}

static void what_cannot_be_told_is_left_out(void **state)
{
    (void)state;
    Progress p = progress_start(0);
    assert_true(line(&p, 1, 0, 80));
    assert_null(strstr(text, "left"));
    assert_non_null(strstr(text, "   0 %"));
    assert_true(line(&p, 2, 1.5, 80));
    assert_non_null(strstr(text, "] 100 %  0:00 left"));
}

static void it_fits_any_width(void **state)
{
    (void)state;
    for (size_t columns = 0; columns < 300; columns++) {
        Progress p = progress_start(0);
        assert_true(line(&p, 2, 0.5, columns));
        assert_true(strlen(text) < columns || columns == 0);
        assert_true(columns > 0 || *text == '\0');
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_is_drawn_at_most_ten_times_a_second),
        cmocka_unit_test(it_tells_the_share_and_the_time_left),
        cmocka_unit_test(hours_have_minutes_too),
        cmocka_unit_test(what_cannot_be_told_is_left_out),
        cmocka_unit_test(it_fits_any_width),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
