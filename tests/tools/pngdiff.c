/* Compares two pictures: pngdiff [--tolerance LEVELS] [--share PERCENT] [--edges PIXELS] A.png B.png
 * A pixel differs if a channel does by more than LEVELS (0). Passes (exit 0) if at most PERCENT (0) of the pixels differ
 * and, with --edges, each of these lies within that many pixels of an edge of half its size or more in either picture.
 * Exit 1 if not, 2 on misuse. */
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tools/png.h"

static int level_difference(const uint8_t *a, const uint8_t *b)
{
    int most = 0;
    for (int i = 0; i < 3; i++) {
        int d = abs(a[i] - b[i]);
        if (d > most) most = d;
    }
    return most;
}

static const uint8_t *pixel(const Png *png, uint32_t x, uint32_t y)
{
    return png->rgb + 3 * ((size_t)y * png->width + x);
}

/* Whether two neighbours within `reach` pixels of (x, y) differ by `step` levels or more. */
static bool near_step(const Png *png, uint32_t x, uint32_t y, uint32_t reach, int step)
{
    uint32_t x0 = x > reach ? x - reach : 0, x1 = x + reach < png->width ? x + reach : png->width - 1;
    uint32_t y0 = y > reach ? y - reach : 0, y1 = y + reach < png->height ? y + reach : png->height - 1;
    for (uint32_t j = y0; j <= y1; j++) {
        for (uint32_t i = x0; i <= x1; i++) {
            if (i < x1 && level_difference(pixel(png, i, j), pixel(png, i + 1, j)) >= step) return true;
            if (j < y1 && level_difference(pixel(png, i, j), pixel(png, i, j + 1)) >= step) return true;
        }
    }
    return false;
}

typedef struct {
    int tolerance;
    double percent;
    bool only_edges;
    uint32_t reach;
} Limits;

/* An edge that lies a fraction of a pixel elsewhere changes a pixel by no more than the step at the edge, but for the
 * shading: half is asked for. */
static bool compare(const Png *a, const Png *b, const Limits *limits)
{
    if (a->width != b->width || a->height != b->height) {
        printf("%ux%u and %ux%u\n", a->width, a->height, b->width, b->height);
        return false;
    }
    size_t differing = 0, stray = 0;
    int most = 0;
    uint32_t most_at[2] = {0, 0}, stray_at[2] = {0, 0};
    for (uint32_t y = 0; y < a->height; y++) {
        for (uint32_t x = 0; x < a->width; x++) {
            int d = level_difference(pixel(a, x, y), pixel(b, x, y));
            if (d > most) {
                most = d;
                most_at[0] = x;
                most_at[1] = y;
            }
            if (d <= limits->tolerance) continue;
            differing++;
            int step = d / 2 > limits->tolerance ? d / 2 : limits->tolerance + 1;
            if (limits->only_edges && !near_step(a, x, y, limits->reach, step) &&
                !near_step(b, x, y, limits->reach, step)) {
                if (!stray++) {
                    stray_at[0] = x;
                    stray_at[1] = y;
                }
            }
        }
    }
    size_t pixels = (size_t)a->width * a->height;
    double share = 100.0 * (double)differing / (double)pixels;
    printf("%zu of %zu pixels (%.3f %%) differ by more than %d levels, most by %d at %u,%u", differing, pixels, share,
           limits->tolerance, most, most_at[0], most_at[1]);
    if (stray) printf("; %zu not at an edge, the first at %u,%u", stray, stray_at[0], stray_at[1]);
    printf("\n");
    return share <= limits->percent && stray == 0;
}

int main(int argc, char **argv)
{
    Limits limits = {0};
    int i = 1;
    for (; i + 1 < argc && strncmp(argv[i], "--", 2) == 0; i += 2) {
        if (strcmp(argv[i], "--tolerance") == 0) {
            limits.tolerance = atoi(argv[i + 1]);
        } else if (strcmp(argv[i], "--share") == 0) {
            limits.percent = atof(argv[i + 1]);
        } else if (strcmp(argv[i], "--edges") == 0) {
            limits.only_edges = true;
            limits.reach = (uint32_t)atoi(argv[i + 1]);
        } else {
            break;
        }
    }
    if (argc - i != 2 || limits.tolerance < 0) {
        fprintf(stderr, "usage: pngdiff [--tolerance LEVELS] [--share PERCENT] [--edges PIXELS] A.png B.png\n");
        return 2;
    }
    Err err;
    Png a = {0}, b = {0};
    int status = 2;
    if (png_load(argv[i], &a, &err) && png_load(argv[i + 1], &b, &err)) {
        status = compare(&a, &b, &limits) ? 0 : 1;
    } else {
        printf("%s\n", err.text);
    }
    png_free(&a);
    png_free(&b);
    return status;
}
