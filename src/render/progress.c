#include "render/progress.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define REDRAW_S 0.1

enum { MAX_BAR = 60, MIN_BAR = 4 };

Progress progress_start(double now_s) { return (Progress){.start_s = now_s, .last_s = now_s}; }

/* "1:02:03 left"; nothing while it can't be told. */
static void format_left(double elapsed_s, double share, char *text, size_t size)
{
    double left_s = share > 0 ? ceil(elapsed_s * (1 - share) / share) : INFINITY;
    text[0] = '\0';
    if (!(left_s < 360000)) return;
    unsigned s = (unsigned)left_s;
    if (s >= 3600)
        snprintf(text, size, "  %u:%02u:%02u left", s / 3600, s / 60 % 60, s % 60);
    else
        snprintf(text, size, "  %u:%02u left", s / 60, s % 60);
}

bool progress_line(Progress *progress, double now_s, double share, size_t columns, char *text, size_t size)
{
    if (now_s - progress->last_s < REDRAW_S) return false;
    progress->last_s = now_s;
    share = fmin(fmax(share, 0), 1);

    char tail[48], left[32];
    format_left(now_s - progress->start_s, share, left, sizeof left);
    snprintf(tail, sizeof tail, "%4.0f %%%s", floor(share * 100), left);

    size_t room = columns > strlen(tail) + 3 ? columns - strlen(tail) - 3 : 0;
    if (room < MIN_BAR) {
        snprintf(text, size, "%.*s", (int)(columns > 0 ? columns - 1 : 0), tail);
        return true;
    }
    size_t length = room < MAX_BAR ? room : MAX_BAR, done = (size_t)(share * (double)length);
    char bar[MAX_BAR + 1];
    memset(bar, '#', done);
    memset(bar + done, ' ', length - done);
    bar[length] = '\0';
    snprintf(text, size, "[%s]%s", bar, tail);
    return true;
}
