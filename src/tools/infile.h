/* Reading a whole file whose head says whether, and how much, to read. */
#ifndef RT_TOOLS_INFILE_H
#define RT_TOOLS_INFILE_H

#include <stdbool.h>
#include <stddef.h>

#include "common/err.h"

/* Judges the first bytes of a file (64 KB, or all if it has fewer) before more of it is read. *most, SIZE_MAX at first, may
 * be lowered: bytes behind that many aren't read. False and *err refuse the file. */
typedef bool InfileAccept(const char *path, const unsigned char *head, size_t size, size_t *most, Err *err);

/* *data is malloc'ed. False and *err: what `accept` said, ERR_INPUT "can't open PATH: why", ERR_LIMIT without memory. */
bool infile_read(const char *path, InfileAccept *accept, unsigned char **data, size_t *size, Err *err);

#endif
