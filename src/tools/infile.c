#include "tools/infile.h"

#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

enum { FIRST_READ = 64 * 1024 };

/* Reads on into *buffer, which holds `capacity` bytes and grows, until the end of the file or `most` bytes. */
static bool read_all(FILE *file, const char *path, InfileAccept *accept, unsigned char **buffer, size_t *used, Err *err)
{
    size_t capacity = FIRST_READ, most = SIZE_MAX;
    for (bool accepted = false;; accepted = true) {
        *used += fread(*buffer + *used, 1, capacity - *used, file);
        if (ferror(file)) return err_system(err, ERR_INPUT, "open", path, errno);
        if (!accepted && !accept(path, *buffer, *used, &most, err)) return false;
        if (*used >= most) *used = most;
        if (*used < capacity || *used == most) return true;
        capacity = capacity <= SIZE_MAX / 2 ? 2 * capacity : SIZE_MAX;
        if (capacity > most) capacity = most;
        unsigned char *more = realloc(*buffer, capacity);
        if (!more) return err_memory(err, path);
        *buffer = more;
    }
}

bool infile_read(const char *path, InfileAccept *accept, unsigned char **data, size_t *size, Err *err)
{
    FILE *file = fopen(path, "rb");
    if (!file) return err_system(err, ERR_INPUT, "open", path, errno);
    unsigned char *buffer = malloc(FIRST_READ);
    size_t used = 0;
    bool ok = buffer ? read_all(file, path, accept, &buffer, &used, err) : err_memory(err, path);
    fclose(file);
    if (ok) {
        *data = buffer;
        *size = used;
    } else {
        free(buffer);
    }
    return ok;
}
