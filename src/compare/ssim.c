#include "compare/ssim.h"

#include <math.h>
#include <stdlib.h>

#include "compare/band.h"

enum { RADIUS = 5, TAPS = 2 * RADIUS + 1 };

static const double SIGMA = 1.5;

/* (K1 L)^2 and (K2 L)^2 of the paper, with K1 = 0.01, K2 = 0.03 and the range L = 1: they keep the quotient from 0/0. */
static const double C1 = 0.01 * 0.01, C2 = 0.03 * 0.03;

/* What is averaged over the window. */
enum { MEAN_A, MEAN_B, MEAN_AA, MEAN_BB, MEAN_AB, MOMENTS };

typedef struct {
    const Image *a, *b;
    double weight[TAPS];
    double *row[MOMENTS];   /* the picture's row, with RADIUS numbers on each side */
} Source;

static double luma(const Image *image, size_t pixel)
{
    const float *p = image->rgb + 3 * pixel;
    double y = (0.299 * (double)p[0] + 0.587 * (double)p[1] + 0.114 * (double)p[2]) / image->white;
    return fmin(fmax(y, 0), 1);
}

static void source_row(void *context, uint32_t y, double *const *plane)
{
    Source *s = context;
    uint32_t width = s->a->width;
    for (uint32_t x = 0; x < width; x++) {
        size_t pixel = (size_t)y * width + x;
        double a = luma(s->a, pixel), b = luma(s->b, pixel);
        s->row[MEAN_A][x] = a;
        s->row[MEAN_B][x] = b;
        s->row[MEAN_AA][x] = a * a;
        s->row[MEAN_BB][x] = b * b;
        s->row[MEAN_AB][x] = a * b;
    }
    for (int m = 0; m < MOMENTS; m++) {
        extend_row(s->row[m], width, RADIUS);
        filter_along_x(s->row[m], width, s->weight, RADIUS, plane[m]);
    }
}

/* Equation 13 of the paper. */
static double similarity(double a, double b, double aa, double bb, double ab)
{
    double variances = aa - a * a + (bb - b * b), covariance = ab - a * b;
    return (2 * a * b + C1) * (2 * covariance + C2) / ((a * a + b * b + C1) * (variances + C2));
}

static double mean_similarity(Band *band, const Source *s, double *const moment[MOMENTS])
{
    uint32_t width = band->width, height = band->height;
    double sum = 0;
    for (uint32_t y = RADIUS; y + RADIUS < height; y++) {
        double of_row = 0;
        for (uint32_t m = 0; m < MOMENTS; m++) filter_along_y(band, m, y, s->weight, RADIUS, moment[m]);
        for (uint32_t x = RADIUS; x + RADIUS < width; x++)
            of_row += similarity(moment[MEAN_A][x], moment[MEAN_B][x], moment[MEAN_AA][x], moment[MEAN_BB][x],
                                 moment[MEAN_AB][x]);
        sum += of_row;
    }
    return sum / ((double)(width - 2 * RADIUS) * (double)(height - 2 * RADIUS));
}

bool ssim(const Image *a, const Image *b, double *value, Err *err)
{
    *value = (double)NAN;
    if (a->width < TAPS || a->height < TAPS) return true;
    Source source = {.a = a, .b = b};
    Band band = {a->width, a->height, MOMENTS, RADIUS, source_row, &source, NULL, NULL, 0};
    size_t extended = (size_t)a->width + 2 * RADIUS;
    double *memory = malloc((extended + a->width) * MOMENTS * sizeof *memory), *moment[MOMENTS];
    bool ok = band_create(&band) && memory;
    if (ok) {
        gaussian_weights(source.weight, RADIUS, SIGMA);
        for (size_t m = 0; m < MOMENTS; m++) {
            source.row[m] = memory + m * extended + RADIUS;
            moment[m] = memory + MOMENTS * extended + m * a->width;
        }
        *value = mean_similarity(&band, &source, moment);
    }
    band_destroy(&band);
    free(memory);
    return ok || err_memory(err, "the comparison");
}
