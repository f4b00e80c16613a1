/* Writing a file so that a failure leaves the old one whole: into a temporary file beside it, then renamed. */
#ifndef RT_TOOLS_OUTFILE_H
#define RT_TOOLS_OUTFILE_H

#include <stdbool.h>
#include <stddef.h>

#include "common/err.h"

typedef struct Outfile Outfile;

/* Makes the temporary file and removes it again, so that a missing or read-only folder is found out before the work and
 * a program killed during the work leaves nothing behind. A path that is no regular file (/dev/null) is written directly;
 * through symbolic links the file at their end is written. NULL and *err (ERR_OUTPUT "can't write PATH: why";
 * ERR_LIMIT without memory). */
Outfile *outfile_open(const char *path, Err *err);

/* Writes the temporary file, syncs and renames it, and frees. False and *err (ERR_OUTPUT); the old file is untouched
 * then. */
bool outfile_commit(Outfile *file, const void *data, size_t size, Err *err);

/* Frees without having written anything. NULL is allowed. */
void outfile_abandon(Outfile *file);

#endif
