#include "common/err.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* A message is one line: control characters (a file name may hold a newline) become '?'. */
static void make_one_line(char *text)
{
    for (; *text; text++)
        if ((unsigned char)*text < 0x20 || *text == 0x7f) *text = '?';
}

bool err_set(Err *err, ErrKind kind, const char *format, ...)
{
    if (!err) return false;
    err->kind = kind;
    va_list args;
    va_start(args, format);
    vsnprintf(err->text, sizeof err->text, format, args);
    va_end(args);
    make_one_line(err->text);
    return false;
}

bool err_memory(Err *err, const char *what)
{
    return err_set(err, ERR_LIMIT, "out of memory for %s", what);
}

bool err_system(Err *err, ErrKind kind, const char *verb, const char *path, int error)
{
    return err_set(err, error == ENOMEM ? ERR_LIMIT : kind, "can't %s %s: %s", verb, path, strerror(error));
}

bool err_prefix(Err *err, const char *where)
{
    if (!err || !where || !*where) return false;
    char text[sizeof err->text];
    memcpy(text, err->text, sizeof text);
    int n = snprintf(err->text, sizeof err->text, "%s", where);
    if (n >= 0 && (size_t)n < sizeof err->text) snprintf(err->text + n, sizeof err->text - (size_t)n, "%s", text);
    make_one_line(err->text);
    return false;
}
