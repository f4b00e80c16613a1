/* Where samples go: how much each pixel still spreads, and how many more it gets so that the whole picture's error falls
 * most for the samples spent.
 *
 * Each pixel has two replicates, A and B. How far A goes is decided from B's samples and the other way round
 * (cross-fitting): a replicate that stopped because its own first samples agreed by chance would be biased, toward 0 by
 * half on a pixel of which 2 % are covered; stopped by the other's, its mean stays right. */
#ifndef RT_RENDER_ALLOCATE_H
#define RT_RENDER_ALLOCATE_H

#include <stdbool.h>
#include <stdint.h>

#include "render/error_map.h"

/* A replicate has 1 << level samples of a pixel: such numbers are stratified best. */
enum { MAX_LEVEL = 20, LEVELS = MAX_LEVEL + 1, GROWTH = 3 };   /* a round adds at most GROWTH levels */

/* Spreads fall into 8 bins an octave: error_code's exponent and 3 bits. */
enum { SPREAD_SHIFT = 5, SPREAD_BINS = (UINT16_MAX + 1) >> SPREAD_SHIFT };

/* How many (pixel, replicate) have each level and spread. */
typedef struct { uint64_t count[LEVELS][SPREAD_BINS]; } SpreadTable;

/* What was decided: the level that each gets. */
typedef struct {
    uint8_t level[LEVELS][SPREAD_BINS];
    uint64_t samples;        /* that are added */
    uint64_t unfinished;     /* (pixel, replicate) that get more */
} Allocation;

/* One replicate of a tile and of the pixels around it, which beyond the picture's edge are those at the edge. */
enum { VIEW_SIDE = TILE + 2, VIEW_PIXELS = VIEW_SIDE * VIEW_SIDE };
typedef struct {
    float mean[3][VIEW_PIXELS];
    float variance[VIEW_PIXELS];    /* of a sample, mean over channels; 0 if there is one sample */
    float samples[VIEW_PIXELS];
} TileView;

/* The variance of a sample of each pixel of the tile, as far as one replicate can tell. */
void spread_of_tile(const TileView *view, float spread[TILE_PIXELS]);

/* Of the mean of 1 << level samples. */
double predicted_variance(double spread, int level);

/* What brings the sum of squared errors, which is `now`, down to `goal` < now, or as far toward it as a round goes. Nothing
 * is added if all spreads are 0. */
void allocate_for_error(const SpreadTable *table, double now, double goal, Allocation *allocation);

/* What adds at most `samples`. */
void allocate_samples(const SpreadTable *table, uint64_t samples, Allocation *allocation);

/* One level more for each. */
void allocate_evenly(const SpreadTable *table, Allocation *allocation);

#endif
