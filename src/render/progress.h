/* The progress bar as text: who prints it, and whether there is a terminal, is the caller's business. */
#ifndef RT_RENDER_PROGRESS_H
#define RT_RENDER_PROGRESS_H

#include <stdbool.h>
#include <stddef.h>

typedef struct {
    double start_s, last_s;  /* clock at the beginning and when the bar was last drawn */
} Progress;

Progress progress_start(double now_s);

/* Writes a bar of less than `columns` characters with percentage and time left, without a newline:
 * "[#########               ]  37 %  0:12 left". False, and nothing written, if the last one is less than 0.1 s old. */
bool progress_line(Progress *progress, double now_s, double share, size_t columns, char *text, size_t size);

#endif
