/* Files that are replaced whole or not at all. */
#include "tools/outfile.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "support/alloc_fail.h"
#include "support/test_file.h"

static int make_folder(void **state)
{
    (void)state;
    if (system(test_message("rm -rf ", "outfile", "")) != 0) return 1;
    return mkdir(test_path("outfile"), 0777);
}

static void assert_content(const char *path, const char *expected)
{
    size_t size;
    char *data = test_read(path, &size);
    assert_int_equal(size, strlen(expected));
    assert_string_equal(data, expected);
    free(data);
}

static void write_file(const char *path, const char *text)
{
    Err err = {ERR_NONE, ""};
    Outfile *file = outfile_open(path, &err);
    if (!file) fail_msg("%s", err.text);
    if (!outfile_commit(file, text, strlen(text), &err)) fail_msg("%s", err.text);
}

static void assert_refused(const char *path, const char *why)
{
    Err err = {ERR_NONE, ""};
    assert_null(outfile_open(path, &err));
    assert_int_equal(err.kind, ERR_OUTPUT);
    assert_string_equal(err.text, why);
}

static void a_new_file(void **state)
{
    (void)state;
    mode_t old = umask(027);
    write_file(test_path("outfile/new"), "text");
    umask(old);
    assert_content(test_path("outfile/new"), "text");
    struct stat st;
    assert_int_equal(stat(test_path("outfile/new"), &st), 0);
    assert_int_equal(st.st_mode & 0777, 0640);
    assert_int_equal(test_folder_count(test_path("outfile")), 1);
    write_file(test_path("outfile/empty"), "");
    assert_content(test_path("outfile/empty"), "");
}

static void an_old_file_is_replaced_and_keeps_its_mode(void **state)
{
    (void)state;
    test_file("outfile/old", "the old content");
    assert_int_equal(chmod(test_path("outfile/old"), 0604), 0);
    write_file(test_path("outfile/old"), "new");
    assert_content(test_path("outfile/old"), "new");
    struct stat st;
    assert_int_equal(stat(test_path("outfile/old"), &st), 0);
    assert_int_equal(st.st_mode & 0777, 0604);
    assert_int_equal(test_folder_count(test_path("outfile")), 1);
}

static void until_commit_nothing_changes(void **state)
{
    (void)state;
    test_file("outfile/old", "the old content");
    Outfile *file = outfile_open(test_path("outfile/old"), NULL);
    assert_non_null(file);
    assert_content(test_path("outfile/old"), "the old content");
    assert_int_equal(test_folder_count(test_path("outfile")), 1);
    outfile_abandon(file);
    assert_content(test_path("outfile/old"), "the old content");
    assert_int_equal(test_folder_count(test_path("outfile")), 1);
    outfile_abandon(NULL);
}

static void folders_that_cant_be_written(void **state)
{
    (void)state;
    assert_refused(test_path("outfile/none/a.png"),
                   test_message("can't write ", "outfile/none/a.png", ": No such file or directory"));
    assert_refused(test_path("outfile"), test_message("can't write ", "outfile", ": Is a directory"));
    assert_refused(test_path("outfile/"), test_message("can't write ", "outfile/", ": Is a directory"));
    assert_refused("", "can't write : No such file or directory");
    test_file("outfile/file", "");
    assert_refused(test_path("outfile/file/a.png"), test_message("can't write ", "outfile/file/a.png", ": Not a directory"));
    char longest[400] = "";
    snprintf(longest, sizeof longest, "%s", test_path("outfile/"));
    memset(longest + strlen(longest), 'n', 300);
    Err err = {ERR_NONE, ""};
    assert_null(outfile_open(longest, &err));
    assert_non_null(strstr(err.text, ": File name too long"));
    if (geteuid() == 0) return;  /* who may write everything is refused nothing */
    assert_int_equal(chmod(test_path("outfile/file"), 0444), 0);
    assert_refused(test_path("outfile/file"), test_message("can't write ", "outfile/file", ": Permission denied"));
    assert_int_equal(chmod(test_path("outfile"), 0555), 0);
    assert_refused(test_path("outfile/b.png"), test_message("can't write ", "outfile/b.png", ": Permission denied"));
    assert_int_equal(chmod(test_path("outfile"), 0755), 0);
}

static void a_folder_that_vanishes(void **state)
{
    (void)state;
    assert_int_equal(mkdir(test_path("outfile/gone"), 0777), 0);
    Outfile *file = outfile_open(test_path("outfile/gone/a"), NULL);
    assert_non_null(file);
    assert_int_equal(rmdir(test_path("outfile/gone")), 0);
    Err err;
    assert_false(outfile_commit(file, "x", 1, &err));
    assert_int_equal(err.kind, ERR_OUTPUT);
    assert_string_equal(err.text, test_message("can't write ", "outfile/gone/a", ": No such file or directory"));
}

static void devices_are_written_directly(void **state)
{
    (void)state;
    write_file("/dev/null", "nothing");
    struct stat st;
    assert_int_equal(stat("/dev/null", &st), 0);
    assert_true(S_ISCHR(st.st_mode));
    Err err;
    Outfile *file = outfile_open("/dev/full", &err);
    assert_non_null(file);
    assert_false(outfile_commit(file, "x", 1, &err));
    assert_int_equal(err.kind, ERR_OUTPUT);
    assert_string_equal(err.text, "can't write /dev/full: No space left on device");
}

static void links_survive(void **state)
{
    (void)state;
    assert_int_equal(mkdir(test_path("outfile/deep"), 0777), 0);
    test_file("outfile/deep/file", "old");
    assert_int_equal(symlink("deep/second", test_path("outfile/first")), 0);
    assert_int_equal(symlink("file", test_path("outfile/deep/second")), 0);
    write_file(test_path("outfile/first"), "new");
    struct stat st;
    assert_int_equal(lstat(test_path("outfile/first"), &st), 0);
    assert_true(S_ISLNK(st.st_mode));
    assert_int_equal(lstat(test_path("outfile/deep/file"), &st), 0);
    assert_true(S_ISREG(st.st_mode));
    assert_content(test_path("outfile/deep/file"), "new");
    assert_int_equal(symlink("deep/created", test_path("outfile/dangling")), 0);
    write_file(test_path("outfile/dangling"), "made");
    assert_content(test_path("outfile/deep/created"), "made");
    assert_int_equal(symlink("loop", test_path("outfile/loop")), 0);
    assert_refused(test_path("outfile/loop"), test_message("can't write ", "outfile/loop", ": Too many levels of symbolic links"));
    assert_int_equal(symlink("/dev/null", test_path("outfile/null")), 0);
    write_file(test_path("outfile/null"), "nothing");
}

/* A commit that fails, here for a folder that stands in the way, leaves no temporary file. */
static void a_failed_commit_leaves_nothing(void **state)
{
    (void)state;
    Outfile *file = outfile_open(test_path("outfile/a"), NULL);
    assert_non_null(file);
    assert_int_equal(mkdir(test_path("outfile/a"), 0777), 0);
    Err err;
    assert_false(outfile_commit(file, "x", 1, &err));
    assert_string_equal(err.text, test_message("can't write ", "outfile/a", ": Is a directory"));
    assert_int_equal(test_folder_count(test_path("outfile")), 1);
}

static void every_allocation_may_fail(void **state)
{
    (void)state;
    for (long n = 1;; n++) {
        Err err = {ERR_NONE, ""};
        alloc_fail_at(n);
        Outfile *file = outfile_open(test_path("outfile/a"), &err);
        bool failed = alloc_fail_stop();
        assert_true(failed == !file);
        outfile_abandon(file);
        if (!failed) break;
        assert_int_equal(err.kind, ERR_LIMIT);
        assert_string_equal(err.text, test_message("can't write ", "outfile/a", ": Cannot allocate memory"));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(a_new_file, make_folder),
        cmocka_unit_test_setup(an_old_file_is_replaced_and_keeps_its_mode, make_folder),
        cmocka_unit_test_setup(until_commit_nothing_changes, make_folder),
        cmocka_unit_test_setup(folders_that_cant_be_written, make_folder),
        cmocka_unit_test_setup(a_folder_that_vanishes, make_folder),
        cmocka_unit_test_setup(devices_are_written_directly, make_folder),
        cmocka_unit_test_setup(links_survive, make_folder),
        cmocka_unit_test_setup(a_failed_commit_leaves_nothing, make_folder),
        cmocka_unit_test_setup(every_allocation_may_fail, make_folder),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
