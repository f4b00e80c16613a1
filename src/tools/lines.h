/* Reading a text file line by line, through a buffer that holds one line: the file may be larger than memory, or a pipe. */
#ifndef RT_TOOLS_LINES_H
#define RT_TOOLS_LINES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "common/err.h"

typedef struct {
    const char *path;    /* borrowed */
    uint64_t number;     /* of the line that lines_next gave last, from 1; its first one if it was continued */
    uint64_t line_count; /* physical lines taken so far */
    bool continued;      /* a backslash at the end of a line that is no # comment joins the next */
    int fd;
    char *buffer;
    size_t capacity, start, end;
    bool at_end;
} Lines;

/* False and *err: ERR_INPUT "can't open PATH: why", ERR_LIMIT. */
bool lines_open(Lines *lines, const char *path, bool continued, Err *err);
void lines_close(Lines *lines);

typedef enum { LINES_LINE, LINES_END, LINES_FAILED } LinesResult;

/* The next line: *text up to *end, where a newline or a zero byte stands; it may hold a carriage return, and, if lines
 * are continued, backslashes with their newlines. A byte order mark is skipped. Valid until the next call.
 * LINES_FAILED and *err: ERR_INPUT for a read error or a zero byte, ERR_LIMIT for a line over 1 GiB or no memory. */
LinesResult lines_next(Lines *lines, const char **text, const char **end, Err *err);

/* ERR_INPUT "PATH:LINE: what" for the line that lines_next gave last. Returns false. */
bool lines_error(const Lines *lines, Err *err, const char *format, ...) __attribute__((format(printf, 3, 4)));

#endif
