/* The audit: how wrong a finished picture is, by fresh samples of a few of its pixels.
 *
 * For a pixel whose true colour is c and whose colour in the picture is y, two independent unbiased estimates r1 and r2
 * of c give E (y - r1)(y - r2) = (y - c)^2, whatever bias y has. Pixels are drawn with known probabilities, more of them
 * where the replicates differ; each product is divided by its pixel's probability (Hansen, Hurwitz 1943), so the mean is
 * an unbiased estimate of the picture's mean squared error whatever the replicates say. */
#ifndef RT_RENDER_AUDIT_H
#define RT_RENDER_AUDIT_H

#include "render/crew.h"
#include "render/error_map.h"
#include "render/error_report.h"

typedef struct {
    uint32_t x, y;           /* in the rendered part */
    double weight;           /* 1 / (pixels * probability) */
    uint32_t samples;        /* of each estimate */
    double picture[3];       /* the pixel's colour, */
    double picture_samples;  /* the mean of so many */
    double fresh[2][3];      /* sums of r1 and r2 */
} AuditDraw;

/* How many pixels are drawn for a picture of so many samples, if a draw takes `each`: even, few beside the picture's,
 * enough for an interval. */
uint32_t audit_size(uint64_t samples, double each);

/* Draws `count` pixels, in the order of the tiles: fills their x, y and weight. The numbers depend on seed and look. */
void audit_pick(const ErrorMap *map, uint64_t seed, uint32_t look, AuditDraw *draw, uint32_t count);

/* Adds the fresh samples of draw[i] to the stream, whose taker is audit_take_fresh with the draws as its context. */
void audit_add_fresh(SampleStream *stream, AuditDraw *draw, uint32_t i, uint64_t seed, uint32_t look);
StreamTaker audit_take_fresh;

/* A mean squared error and its standard error. */
typedef struct { double mean, deviation; } MeanSquare;

MeanSquare audit_mean_square(const AuditDraw *draw, uint32_t count);

/* By the replicates, for `pixels` pixels whose errors add up to *sum: right if both are unbiased and independent. It may be
 * off by `doubt`, a share of itself, in ways that its spread doesn't tell. */
MeanSquare replicate_mean_square(const TileError *sum, uint64_t pixels, double doubt);

/* Replicates of n_a and n_b samples whose means differ by d: what the mean of all samples has of d^2 as its variance, and
 * how far, of itself, that may be off. */
typedef struct { double share, doubt; } ReplicateSplit;
ReplicateSplit replicate_split(uint32_t n_a, uint32_t n_b);

/* Both together, or the audit's alone where they contradict each other. */
MeanSquare agreed_mean_square(MeanSquare audit, MeanSquare replicates);

/* RMSE and its interval that fails with probability `alpha`. */
Estimate root_estimate(MeanSquare square, double alpha);

/* The z with which a normal variable lies outside [-z, z] with probability alpha, in (0,1). */
double normal_quantile(double alpha);

/* What can have been missed where every sample of every pixel agreed: with probability 1 - alpha the RMSE is at most
 * this. Let pixels have areas k that no sample met and that differ by 1, as white does from black; n samples a pixel miss
 * an area k with probability at most (1 - k)^n, so all of them do with probability alpha or more only if the (1 - k)^n
 * multiply to alpha or more. The sum of k^2 is then greatest if it is all one pixel's: k = 1 - alpha^(1/n). */
double audit_unseen(uint64_t pixels, double samples, double alpha);

/* Picture and estimates agree in every draw. */
bool audit_agrees(const AuditDraw *draw, uint32_t count);

#endif
