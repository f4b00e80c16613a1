#include "compare/band.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static uint32_t ring_rows(const Band *band) { return 2 * band->radius + 1; }

static double *ring_row(const Band *band, uint32_t plane, uint32_t y)
{
    return band->rows + ((size_t)plane * ring_rows(band) + y % ring_rows(band)) * band->width;
}

bool band_create(Band *band)
{
    band->rows = malloc((size_t)band->planes * ring_rows(band) * band->width * sizeof *band->rows);
    band->plane = malloc(band->planes * sizeof *band->plane);
    band->next = 0;
    return band->rows && band->plane;
}

void band_destroy(Band *band)
{
    free(band->rows);
    free(band->plane);
}

/* Has the source compute all rows that filters of the band's radius need for row y. */
static void advance(Band *band, uint32_t y)
{
    for (; band->next <= y + band->radius && band->next < band->height; band->next++) {
        for (uint32_t p = 0; p < band->planes; p++) band->plane[p] = ring_row(band, p, band->next);
        band->source(band->context, band->next, band->plane);
    }
}

static void add_weighted(double *restrict out, const double *restrict in, double weight, uint32_t width)
{
    for (uint32_t x = 0; x < width; x++) out[x] += weight * in[x];
}

void filter_along_x(const double *in, uint32_t width, const double *weight, uint32_t radius, double *out)
{
    memset(out, 0, width * sizeof *out);
    for (uint32_t i = 0; i <= 2 * radius; i++) add_weighted(out, in - radius + i, weight[i], width);
}

void filter_along_y(Band *band, uint32_t plane, uint32_t y, const double *weight, uint32_t radius, double *out)
{
    advance(band, y);
    memset(out, 0, band->width * sizeof *out);
    for (uint32_t i = 0; i <= 2 * radius; i++) {
        uint32_t row = y + i < radius ? 0 : y + i - radius;
        if (row >= band->height) row = band->height - 1;
        add_weighted(out, ring_row(band, plane, row), weight[i], band->width);
    }
}

void extend_row(double *row, uint32_t width, uint32_t radius)
{
    for (uint32_t i = 1; i <= radius; i++) {
        *(row - i) = row[0];
        row[width - 1 + i] = row[width - 1];
    }
}

void gaussian_weights(double *weight, uint32_t radius, double sigma)
{
    double sum = 0;
    for (uint32_t i = 0; i <= 2 * radius; i++) {
        double x = (double)i - (double)radius;
        weight[i] = exp(-x * x / (2 * sigma * sigma));
        sum += weight[i];
    }
    for (uint32_t i = 0; i <= 2 * radius; i++) weight[i] /= sum;
}
