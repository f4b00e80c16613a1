/* The squared error of each pixel's mean, as its two replicates tell it, two bytes a pixel; and its sums by tiles. */
#ifndef RT_RENDER_ERROR_MAP_H
#define RT_RENDER_ERROR_MAP_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "common/err.h"
#include "render/tiles.h"

/* What a tile's pixels add up to. */
typedef struct {
    double sum;          /* of their squared errors, each the mean over the channels */
    double squares;      /* of the squares of those */
    double greatest;     /* |A - B| of a channel */
    double true_sum;     /* of the squared errors against the reference, each the mean over the channels */
} TileError;

typedef struct {
    Tiles tiles;
    uint16_t *code;      /* rows from the top */
    TileError *tile;
} ErrorMap;

/* The upper half of a float that is not negative, without its sign: 8 bits of mantissa, so 0.2 % at most are lost. */
static inline uint16_t error_code(double squared)
{
    float x = squared > (double)3e38f ? 3e38f : (float)squared;
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return (uint16_t)(bits >> 15);
}

static inline double error_of_code(uint16_t code)
{
    uint32_t bits = (uint32_t)code << 15 | (code ? 1u << 14 : 0);
    float x;
    memcpy(&x, &bits, sizeof x);
    return (double)x;
}

/* The difference of two means, of n_a and n_b numbers; 0 if it is within their roundings, n - 1 in a sum and one in the
 * quotient, so that what is the same for all samples differs by nothing. */
static inline double mean_difference(double a, double n_a, double b, double n_b)
{
    double d = a - b;
    return fabs(d) <= 0x1p-53 * (n_a * fabs(a) + n_b * fabs(b)) ? 0 : d;
}

/* False and *err without memory. */
bool error_map_create(ErrorMap *map, uint32_t width, uint32_t height, Err *err);
void error_map_destroy(ErrorMap *map);

/* Stores a pixel's squared error. */
static inline void error_map_put(ErrorMap *map, uint32_t x, uint32_t y, double squared)
{
    map->code[(size_t)y * map->tiles.width + x] = error_code(squared);
}

/* The squared error of a pixel's colour against the true one, 3 floats. */
static inline double true_error(const double colour[3], const float *reference)
{
    double sum = 0;
    for (int k = 0; k < 3; k++) sum += (colour[k] - (double)reference[k]) * (colour[k] - (double)reference[k]);
    return sum / 3;
}

/* The tiles together, summed in their order. */
TileError error_map_sum(const ErrorMap *map);

/* The pixels' standard errors: error[i] is that which a share[i] of the pixels doesn't exceed. False and *err without
 * memory. */
bool error_map_quantiles(const ErrorMap *map, const double *share, double *error, int count, Err *err);

#endif
