#include "tools/lines.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define FIRST_CAPACITY ((size_t)1 << 18)
#define MAX_CAPACITY ((size_t)1 << 30)

bool lines_open(Lines *lines, const char *path, bool continued, Err *err)
{
    *lines = (Lines){.path = path, .continued = continued, .fd = -1};
    lines->fd = open(path, O_RDONLY | O_CLOEXEC);
    if (lines->fd < 0) return err_system(err, ERR_INPUT, "open", path, errno);
    struct stat st;
    if (fstat(lines->fd, &st) == 0 && S_ISDIR(st.st_mode)) {
        lines_close(lines);
        return err_system(err, ERR_INPUT, "open", path, EISDIR);
    }
    lines->capacity = FIRST_CAPACITY;
    lines->buffer = malloc(lines->capacity + 1);
    if (!lines->buffer) {
        lines_close(lines);
        return err_memory(err, path);
    }
    lines->buffer[0] = '\0';
    return true;
}

void lines_close(Lines *lines)
{
    if (lines->fd >= 0) close(lines->fd);
    free(lines->buffer);
    lines->fd = -1;
    lines->buffer = NULL;
}

/* Moves what is left of the buffer to its front and reads more behind it; doubles the buffer if it is full. */
static bool refill(Lines *lines, Err *err)
{
    if (lines->start > 0) {
        memmove(lines->buffer, lines->buffer + lines->start, lines->end - lines->start);
        lines->end -= lines->start;
        lines->start = 0;
    }
    if (lines->end == lines->capacity) {
        if (lines->capacity >= MAX_CAPACITY)
            return err_set(err, ERR_LIMIT, "%s:%" PRIu64 ": the line is longer than the limit of %zu bytes",
                           lines->path, lines->line_count + 1, MAX_CAPACITY);
        char *more = realloc(lines->buffer, 2 * lines->capacity + 1);
        if (!more) return err_memory(err, lines->path);
        lines->buffer = more;
        lines->capacity *= 2;
    }
    ssize_t n;
    do n = read(lines->fd, lines->buffer + lines->end, lines->capacity - lines->end);
    while (n < 0 && errno == EINTR);
    if (n < 0) return err_system(err, ERR_INPUT, "read", lines->path, errno);
    if (n == 0) lines->at_end = true;
    char *fresh = lines->buffer + lines->end;
    fresh[n] = '\0';
    const char *zero = memchr(fresh, '\0', (size_t)n);
    if (zero) {
        uint64_t line = lines->line_count + 1;
        for (const char *p = lines->buffer + lines->start; (p = memchr(p, '\n', (size_t)(zero - p))); p++) line++;
        return err_set(err, ERR_INPUT, "%s:%" PRIu64 ": a zero byte; this is no text file", lines->path, line);
    }
    lines->end += (size_t)n;
    return true;
}

/* Whether the newline at text[n] is preceded by a backslash (a carriage return may stand between). A comment ends with
 * its line: they hold folders' names and drawings. */
static bool joins_next(const char *text, size_t n)
{
    if (n > 0 && text[n - 1] == '\r') n--;
    return n > 0 && text[n - 1] == '\\' && text[strspn(text, " \t")] != '#';
}

LinesResult lines_next(Lines *lines, const char **text, const char **end, Err *err)
{
    size_t length = 0;  /* of the part of the line that has been searched */
    uint64_t taken = 0;
    for (;;) {
        const char *from = lines->buffer + lines->start;
        const char *newline = memchr(from + length, '\n', lines->end - lines->start - length);
        if (newline) {
            length = (size_t)(newline - from);
            taken++;
            if (!lines->continued || !joins_next(from, length)) break;
            length++;
        } else if (lines->at_end) {
            length = lines->end - lines->start;
            if (length == 0) return LINES_END;
            if (from[length - 1] != '\n') taken++;
            break;
        } else {
            length = lines->end - lines->start;
            if (!refill(lines, err)) return LINES_FAILED;
        }
    }
    *text = lines->buffer + lines->start;
    *end = *text + length;
    lines->start += length;
    if (lines->start < lines->end) lines->start++;
    if (lines->line_count == 0 && length >= 3 && memcmp(*text, "\xef\xbb\xbf", 3) == 0) *text += 3;
    lines->number = lines->line_count + 1;
    lines->line_count += taken;
    return LINES_LINE;
}

bool lines_error(const Lines *lines, Err *err, const char *format, ...)
{
    if (!err) return false;
    char what[sizeof err->text];
    va_list args;
    va_start(args, format);
    vsnprintf(what, sizeof what, format, args);
    va_end(args);
    return err_set(err, ERR_INPUT, "%s:%" PRIu64 ": %s", lines->path, lines->number, what);
}
