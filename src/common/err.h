/* Errors as values: a function that can fail returns false and fills an Err; only Main.c prints it. */
#ifndef RT_COMMON_ERR_H
#define RT_COMMON_ERR_H

#include <stdbool.h>

/* The kinds are the exit codes of the program. */
typedef enum {
    ERR_NONE = 0,
    ERR_SCENE = 1,   /* the script or the scene is wrong */
    ERR_USAGE = 2,   /* the command line */
    ERR_INPUT = 3,   /* a file can't be opened or parsed */
    ERR_OUTPUT = 4,  /* the output can't be written */
    ERR_LIMIT = 5,   /* memory or another limit, named in the text */
    ERR_TIME = 6,    /* the time limit came before the error asked for */
} ErrKind;

typedef struct {
    ErrKind kind;
    char text[1024];  /* one line, without "rt: " and without a newline; a longer one is cut */
} Err;

/* Fills *err (which may be NULL) and returns false, so that `return err_set(...)` reads well. */
bool err_set(Err *err, ErrKind kind, const char *format, ...) __attribute__((format(printf, 3, 4)));

/* The same for a failed allocation of `what`: kind ERR_LIMIT, "out of memory for WHAT". */
bool err_memory(Err *err, const char *what);

/* The same for a system call that failed with `error`, an errno: "can't open PATH: why" for the verb "open"; ENOMEM is
 * of the kind ERR_LIMIT whatever `kind` is. */
bool err_system(Err *err, ErrKind kind, const char *verb, const char *path, int error);

/* Puts the place in front of the text: "scene.lua:41: " (as luaL_where writes it, or ""). */
bool err_prefix(Err *err, const char *where);

#endif
