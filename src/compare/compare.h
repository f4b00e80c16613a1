/* How far two pictures are apart, in several measures; and whether that is near enough. */
#ifndef RT_COMPARE_COMPARE_H
#define RT_COMPARE_COMPARE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "common/err.h"
#include "tools/image.h"

/* What is asked for. A difference is that of a channel, as a share of white; a level is 1/255 of it. */
typedef struct {
    bool linear;                /* for FLIP the values are linear light */
    double tolerance;           /* levels: a pixel differs if a channel does by more */
    bool only_edges;            /* a pixel that differs must be within `reach` pixels of an edge */
    uint32_t reach;
    double max_rmse, max_diff;  /* INFINITY: any */
    double max_share;           /* percent of the pixels that may differ; 100: all */
} CompareSettings;

CompareSettings compare_defaults(void);

typedef struct {
    double rmse;                /* over pixels and channels, as a share of white */
    double psnr_db;             /* INFINITY for equal pictures */
    double ssim;                /* NaN for a side below 11 */
    double flip;
    double max_diff;            /* the greatest difference, and the first pixel that has it */
    uint32_t max_x, max_y;
    uint64_t pixels, differing;
    uint64_t stray;             /* differing ones away from edges, if these are asked for, and the first of them */
    uint32_t stray_x, stray_y;
} Comparison;

/* The pictures are of one size. Values aren't clamped, but for SSIM and FLIP. False and *err (ERR_LIMIT) without memory. */
bool compare_images(const Image *a, const Image *b, const CompareSettings *settings, Comparison *result, Err *err);

/* A line for each measure. */
void compare_text(const Comparison *result, const CompareSettings *settings, char *text, size_t size);

/* Whether the pictures are as near as asked for; if not, *text gets a line for each reason, and is "" otherwise. */
bool compare_passes(const Comparison *result, const CompareSettings *settings, char *text, size_t size);

/* Where they differ: 3 bytes a pixel, from black (not at all) over red and yellow to white (by `greatest`, > 0 or no pixel
 * differs), by the square root, so that small differences show. */
void compare_heat_map(const Image *a, const Image *b, double greatest, uint8_t *rgb);

#endif
