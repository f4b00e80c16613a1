#include "tools/outfile.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { MAX_LINKS = 40, MAX_TRIES = 1000 };

#define WRITE_CHUNK ((size_t)1 << 30)  /* write(2) takes less than 2^31 bytes at a time */

struct Outfile {
    char *path;    /* as given: for messages */
    char *target;  /* with symbolic links at its end followed */
    char *temp;    /* room for the temporary file's name */
    int direct;    /* descriptor of a target that is no regular file, or -1 */
    bool exists;
    mode_t mode;   /* of the target if it exists */
};

/* Length of the folder's part of a path, its last slash included. */
static size_t folder_length(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? (size_t)(slash - path) + 1 : 0;
}

/* Replaces *path (malloc'ed) by what the symbolic link there points at. False with errno. */
static bool follow_link(char **path)
{
    char text[4096];
    ssize_t n = readlink(*path, text, sizeof text);
    if (n < 0) return false;
    if ((size_t)n == sizeof text) {
        errno = ENAMETOOLONG;
        return false;
    }
    size_t folder = text[0] == '/' ? 0 : folder_length(*path);
    char *next = malloc(folder + (size_t)n + 1);
    if (!next) return false;
    memcpy(next, *path, folder);
    memcpy(next + folder, text, (size_t)n);
    next[folder + (size_t)n] = '\0';
    free(*path);
    *path = next;
    return true;
}

/* Follows the links at the end of *path, so that a rename replaces the file and not the link to it. A link to a pipe or
 * a device stays: it is opened as it is, and /dev/stdout may point at nothing that has a name. */
static bool follow_links(char **path)
{
    struct stat st;
    if (stat(*path, &st) == 0 && !S_ISREG(st.st_mode)) return true;
    for (int i = 0; i < MAX_LINKS; i++) {
        if (lstat(*path, &st) < 0) return errno == ENOENT;
        if (!S_ISLNK(st.st_mode)) return true;
        if (!follow_link(path)) return false;
    }
    errno = ELOOP;
    return false;
}

/* Creates the temporary file, with a name of its own, beside the target. -1 with errno. */
static int create_temp(Outfile *file)
{
    size_t folder = folder_length(file->target);
    mode_t mode = file->exists ? file->mode & 0777 : 0666;
    for (int i = 0; i < MAX_TRIES; i++) {
        snprintf(file->temp + folder, 32, ".rt-%ld-%d.tmp", (long)getpid(), i);
        int fd = open(file->temp, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
        if (fd >= 0 || errno != EEXIST) return fd;
    }
    return -1;
}

/* Whether the target can be written; for what is no regular file, by opening it. False with errno. */
static bool prepare(Outfile *file)
{
    struct stat st;
    const char *name = file->target + folder_length(file->target);
    if (!*file->target) errno = ENOENT;
    else if (!*name) errno = EISDIR;
    if (!*name) return false;
    if (stat(file->target, &st) == 0) {
        if (!S_ISREG(st.st_mode)) {
            file->direct = open(file->target, O_WRONLY | O_NOCTTY | O_CLOEXEC);
            return file->direct >= 0;
        }
        if (faccessat(AT_FDCWD, file->target, W_OK, AT_EACCESS) < 0) return false;
        file->exists = true;
        file->mode = st.st_mode;
    } else if (errno != ENOENT) {
        return false;
    }
    int fd = create_temp(file);
    if (fd < 0) return false;
    close(fd);
    unlink(file->temp);
    return true;
}

Outfile *outfile_open(const char *path, Err *err)
{
    Outfile *file = calloc(1, sizeof *file);
    if (!file) goto no_memory;
    file->direct = -1;
    file->path = strdup(path);
    file->target = strdup(path);
    if (!file->path || !file->target) goto no_memory;
    if (!follow_links(&file->target)) goto fail;
    file->temp = malloc(folder_length(file->target) + 32);
    if (!file->temp) goto no_memory;
    memcpy(file->temp, file->target, folder_length(file->target));
    if (!prepare(file)) goto fail;
    return file;
no_memory:
    errno = ENOMEM;
fail:
    err_system(err, ERR_OUTPUT, "write", path, errno);
    outfile_abandon(file);
    return NULL;
}

static bool write_all(int fd, const unsigned char *data, size_t size)
{
    while (size > 0) {
        ssize_t n = write(fd, data, size < WRITE_CHUNK ? size : WRITE_CHUNK);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) return false;
        data += n;
        size -= (size_t)n;
    }
    return true;
}

/* Some file systems find out only here that the disk is full; some can't sync at all, which is no failure. */
static bool sync_all(int fd)
{
    return fsync(fd) == 0 || errno == EINVAL || errno == ENOTSUP || errno == ENOSYS;
}

static bool replace(Outfile *file, const void *data, size_t size)
{
    int fd = create_temp(file);
    if (fd < 0) return false;
    /* The umask cut the mode of a file that is to keep its own. */
    bool ok = (!file->exists || fchmod(fd, file->mode & 0777) == 0) && write_all(fd, data, size) && sync_all(fd);
    int error = errno;
    if (close(fd) < 0 && ok) {
        ok = false;
        error = errno;
    }
    if (ok && rename(file->temp, file->target) == 0) return true;
    if (ok) error = errno;
    unlink(file->temp);
    errno = error;
    return false;
}

static bool write_direct(Outfile *file, const void *data, size_t size)
{
    bool ok = write_all(file->direct, data, size);
    int error = errno;
    if (close(file->direct) < 0 && ok) {
        ok = false;
        error = errno;
    }
    file->direct = -1;
    errno = error;
    return ok;
}

bool outfile_commit(Outfile *file, const void *data, size_t size, Err *err)
{
    bool ok = file->direct >= 0 ? write_direct(file, data, size) : replace(file, data, size);
    if (!ok) err_system(err, ERR_OUTPUT, "write", file->path, errno);
    outfile_abandon(file);
    return ok;
}

void outfile_abandon(Outfile *file)
{
    if (!file) return;
    if (file->direct >= 0) close(file->direct);
    free(file->path);
    free(file->target);
    free(file->temp);
    free(file);
}
