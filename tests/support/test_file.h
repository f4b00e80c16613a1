/* Files that tests write, in a folder of each process' own below build/test-tmp/, which its end removes: two runs don't
 * disturb each other. Each function ends the program with a message if it can't. */
#ifndef RT_TESTS_SUPPORT_TEST_FILE_H
#define RT_TESTS_SUPPORT_TEST_FILE_H

#include <stddef.h>

/* The folder, a slash and the name; the folder is made. Valid until the eighth call after this one. */
const char *test_path(const char *name);

/* A message about such a file, its path between the two texts. Valid until the next call. */
const char *test_message(const char *before, const char *name, const char *after);

/* Writes a file and returns its path, as test_path does. */
const char *test_file(const char *name, const char *text);
const char *test_file_bytes(const char *name, const void *data, size_t size);

/* A whole file, malloc'ed, with a zero byte behind it; size may be NULL. */
char *test_read(const char *path, size_t *size);

/* How many entries a folder has, without "." and "..". */
size_t test_folder_count(const char *path);

#endif
