#include "support/test_file.h"

#include <dirent.h>
#include <errno.h>
#include <ftw.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "support/check.h"

#define PARENT "build/test-tmp"

static char own_folder[] = PARENT "/XXXXXX";

static int remove_entry(const char *path, const struct stat *st, int kind, struct FTW *place)
{
    (void)st, (void)kind, (void)place;
    return remove(path);
}

static void remove_folder(void) { nftw(own_folder, remove_entry, 8, FTW_DEPTH | FTW_PHYS); }

static void make_folder(void)
{
    CHECK(mkdir("build", 0777) == 0 || errno == EEXIST);
    CHECK(mkdir(PARENT, 0777) == 0 || errno == EEXIST);
    CHECK(mkdtemp(own_folder) != NULL);
    CHECK(atexit(remove_folder) == 0);
}

const char *test_path(const char *name)
{
    static char path[8][512];
    static unsigned next;
    static bool is_made;
    if (!is_made) make_folder();
    is_made = true;
    char *p = path[next++ % 8];
    CHECK(snprintf(p, sizeof path[0], "%s/%s", own_folder, name) < (int)sizeof path[0]);
    return p;
}

const char *test_message(const char *before, const char *name, const char *after)
{
    static char text[1024];
    CHECK(snprintf(text, sizeof text, "%s%s%s", before, test_path(name), after) < (int)sizeof text);
    return text;
}

const char *test_file_bytes(const char *name, const void *data, size_t size)
{
    const char *path = test_path(name);
    FILE *file = fopen(path, "wb");
    CHECK(file != NULL);
    CHECK(fwrite(data, 1, size, file) == size);
    CHECK(fclose(file) == 0);
    return path;
}

const char *test_file(const char *name, const char *text) { return test_file_bytes(name, text, strlen(text)); }

char *test_read(const char *path, size_t *size)
{
    FILE *file = fopen(path, "rb");
    CHECK(file != NULL);
    CHECK(fseek(file, 0, SEEK_END) == 0);
    size_t length = (size_t)ftell(file);
    rewind(file);
    char *data = malloc(length + 1);
    CHECK(data != NULL);
    CHECK(fread(data, 1, length, file) == length);
    data[length] = '\0';
    fclose(file);
    if (size) *size = length;
    return data;
}

size_t test_folder_count(const char *path)
{
    DIR *folder = opendir(path);
    CHECK(folder != NULL);
    size_t count = 0;
    for (struct dirent *e; (e = readdir(folder));) count += strcmp(e->d_name, ".") != 0 && strcmp(e->d_name, "..") != 0;
    closedir(folder);
    return count;
}
