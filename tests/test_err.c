/* Errors as values: always one line, cut where it is too long. */
#include "common/err.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

static void an_error_is_filled(void **state)
{
    (void)state;
    Err err;
    assert_false(err_set(&err, ERR_INPUT, "%s:%d: what", "a.obj", 7));
    assert_int_equal(err.kind, ERR_INPUT);
    assert_string_equal(err.text, "a.obj:7: what");
    assert_false(err_memory(&err, "a mesh"));
    assert_int_equal(err.kind, ERR_LIMIT);
    assert_string_equal(err.text, "out of memory for a mesh");
    assert_false(err_prefix(&err, "scene.lua:41: "));
    assert_int_equal(err.kind, ERR_LIMIT);
    assert_string_equal(err.text, "scene.lua:41: out of memory for a mesh");
    assert_false(err_prefix(&err, ""));
    assert_false(err_prefix(&err, NULL));
    assert_string_equal(err.text, "scene.lua:41: out of memory for a mesh");
}

static void nobody_need_listen(void **state)
{
    (void)state;
    assert_false(err_set(NULL, ERR_SCENE, "%d", 1));
    assert_false(err_memory(NULL, "a mesh"));
    assert_false(err_prefix(NULL, "scene.lua:41: "));
}

static void a_message_is_one_line(void **state)
{
    (void)state;
    Err err;
    err_set(&err, ERR_INPUT, "can't open %s", "a\nb\tc\x1b[31m\x7f");
    assert_string_equal(err.text, "can't open a?b?c?[31m?");
    err_prefix(&err, "x\ny: ");
    assert_string_equal(err.text, "x?y: can't open a?b?c?[31m?");
    err_set(&err, ERR_INPUT, "%s", "\xc3\xa4.obj");
    assert_string_equal(err.text, "\xc3\xa4.obj");
}

static void a_long_message_is_cut(void **state)
{
    (void)state;
    Err err;
    char text[3000];
    memset(text, 'x', sizeof text);
    text[sizeof text - 1] = '\0';
    err_set(&err, ERR_SCENE, "%s", text);
    assert_int_equal(strlen(err.text), sizeof err.text - 1);
    err_prefix(&err, "a.lua:1: ");
    assert_int_equal(strlen(err.text), sizeof err.text - 1);
    assert_memory_equal(err.text, "a.lua:1: xxx", 12);
    err_prefix(&err, text);
    assert_int_equal(strlen(err.text), sizeof err.text - 1);
}

static void a_system_call_has_its_reason(void **state)
{
    (void)state;
    Err err = {ERR_NONE, ""};
    assert_false(err_system(&err, ERR_OUTPUT, "write", "a.png", ENOSPC));
    assert_int_equal(err.kind, ERR_OUTPUT);
    assert_string_equal(err.text, "can't write a.png: No space left on device");
    assert_false(err_system(&err, ERR_INPUT, "open", "a.obj", ENOMEM));
    assert_int_equal(err.kind, ERR_LIMIT);
    assert_string_equal(err.text, "can't open a.obj: Cannot allocate memory");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_error_is_filled),
        cmocka_unit_test(nobody_need_listen),
        cmocka_unit_test(a_message_is_one_line),
        cmocka_unit_test(a_long_message_is_cut),
        cmocka_unit_test(a_system_call_has_its_reason),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
