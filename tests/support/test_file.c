#include "support/test_file.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#include "support/check.h"

#define FOLDER "build/test-tmp/"

const char *test_path(const char *name)
{
    static char path[8][512];
    static unsigned next;
    CHECK(mkdir("build", 0777) == 0 || errno == EEXIST);
    CHECK(mkdir(FOLDER, 0777) == 0 || errno == EEXIST);
    char *p = path[next++ % 8];
    CHECK(snprintf(p, sizeof path[0], FOLDER "%s", name) < (int)sizeof path[0]);
    return p;
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
