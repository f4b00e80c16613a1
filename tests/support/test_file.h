/* Files that tests write, below build/test-tmp/. Each function ends the program with a message if it can't. */
#ifndef RT_TESTS_SUPPORT_TEST_FILE_H
#define RT_TESTS_SUPPORT_TEST_FILE_H

#include <stddef.h>

/* "build/test-tmp/" and the name; the folder is made. Valid until the eighth call after this one. */
const char *test_path(const char *name);

/* Writes a file and returns its path, as test_path does. */
const char *test_file(const char *name, const char *text);
const char *test_file_bytes(const char *name, const void *data, size_t size);

/* A whole file, malloc'ed, with a zero byte behind it; size may be NULL. */
char *test_read(const char *path, size_t *size);

/* How many entries a folder has, without "." and "..". */
size_t test_folder_count(const char *path);

#endif
