/* Where in a pixel its samples lie: two replicates A and B of an Owen-scrambled Sobol sequence (a (0,2)-sequence in base
 * 2), so that each is stratified and the two are independent. Depends on seed, pixel, replicate and index only. */
#ifndef RT_RENDER_SAMPLE_H
#define RT_RENDER_SAMPLE_H

#include <stdint.h>

typedef struct { double x, y; } Sample2;

/* What scatters the samples of replicate 0 (A) or 1 (B) of a pixel; x, y: the pixel in the whole picture. */
uint64_t sample_key(uint64_t seed, uint32_t x, uint32_t y, uint32_t replicate);

/* The place in [0,1)^2 of sample `index` (from 0) of the replicate with that key. */
Sample2 sample_place(uint64_t key, uint32_t index);

/* The same of many samples: number index[i] of the replicate with the key high[i] 2^32 + low[i], to x[i], y[i]. */
void sample_places(const uint32_t *low, const uint32_t *high, const uint32_t *index, double *x, double *y, uint32_t n);

/* How many of `samples` belong to replicate A; with an odd number it has one more than B. */
static inline uint32_t sample_share_a(uint32_t samples) { return samples - samples / 2; }

#endif
