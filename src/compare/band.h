/* Separable filters over a picture whose rows come one after another: only the rows within the filter's radius are held. */
#ifndef RT_COMPARE_BAND_H
#define RT_COMPARE_BAND_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    uint32_t width, height;
    uint32_t planes;          /* rows of numbers that the source makes of a row of the picture */
    uint32_t radius;          /* the greatest of the filters' */
    /* Computes row y of every plane, filtered along x already. Called once for every y, in ascending order. */
    void (*source)(void *context, uint32_t y, double *const *plane);
    void *context;
    double *rows;             /* the last 2 radius + 1 rows of each plane */
    double **plane;           /* the pointers that the source gets */
    uint32_t next;            /* the row that the source will be asked for */
} Band;

/* Takes a band whose first six members are set. False without memory; band_destroy is right in either case. */
bool band_create(Band *band);
void band_destroy(Band *band);

/* out[x] is the sum of weight[i] * in[x - radius + i] over the 2 radius + 1 weights. `in` points at the picture's first
 * column and has `radius` further numbers on each side. */
void filter_along_x(const double *in, uint32_t width, const double *weight, uint32_t radius, double *out);

/* The same along y of a plane, for row y. Rows beyond the picture are its first or last. `radius` is at most the band's;
 * y never goes back. */
void filter_along_y(Band *band, uint32_t plane, uint32_t y, const double *weight, uint32_t radius, double *out);

/* Repeats the first and the last number `radius` times, as filter_along_x wants them. */
void extend_row(double *row, uint32_t width, uint32_t radius);

/* Makes weight[0 .. 2 radius] a Gaussian of that standard deviation and of sum 1. */
void gaussian_weights(double *weight, uint32_t radius, double sigma);

#endif
