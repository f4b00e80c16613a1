#include "render/audit.h"

#include "common/rng.h"
#include "render/sample.h"

enum { LEAST_DRAWS = 1024, MOST_DRAWS = 16384 };

/* Of a picture's samples, between these two. Their rays lie apart from each other and cost twice or three times as much. */
#define AUDIT_PART (1.0 / 100)

/* This part of the draws goes to all pixels alike, so no weight is above 1 / EVEN_PART: a pixel that the replicates
 * wrongly take for finished can't dominate the mean. */
#define EVEN_PART 0.25

#define AUDIT_STREAM 0x6175646974u   /* keeps its random numbers apart from others of the same seed */

uint32_t audit_size(uint64_t samples, double each)
{
    double wanted = AUDIT_PART * (double)samples / each;
    return wanted < LEAST_DRAWS ? LEAST_DRAWS : wanted > MOST_DRAWS ? MOST_DRAWS : (uint32_t)wanted / 2 * 2;
}

/* ---- drawing ---- */

/* The probabilities of a tile's pixels, in the order of its rows. */
typedef struct {
    TileRect rect;
    double share[TILE_PIXELS];
} TileShares;

/* What a picture's draws go by. */
typedef struct {
    const ErrorMap *map;
    double pixels, total;    /* total: of all squared errors */
} Plan;

/* A single pair of replicates tells little about a pixel: its neighbours in the tile count as much as it does. */
static double smoothed(const ErrorMap *map, const TileRect *r, uint32_t x, uint32_t y)
{
    double sum = 0;
    uint32_t x0 = x > r->x0 ? x - 1 : x, x1 = x + 1 < r->x1 ? x + 1 : x;
    uint32_t y0 = y > r->y0 ? y - 1 : y, y1 = y + 1 < r->y1 ? y + 1 : y;
    for (uint32_t j = y0; j <= y1; j++)
        for (uint32_t i = x0; i <= x1; i++) sum += error_of_code(map->code[(size_t)j * map->tiles.width + i]);
    return sum;
}

static uint32_t rect_pixels(const TileRect *r) { return (r->x1 - r->x0) * (r->y1 - r->y0); }

static double even_part(const Plan *plan) { return plan->total > 0 ? EVEN_PART : 1; }

/* The probability that a draw falls into the tile. */
static double tile_share(const Plan *plan, uint32_t tile)
{
    TileRect r = tile_rect(&plan->map->tiles, tile);
    double even = even_part(plan), share = even * rect_pixels(&r) / plan->pixels;
    return plan->total > 0 ? share + (1 - even) * plan->map->tile[tile].sum / plan->total : share;
}

static void tile_shares(const Plan *plan, uint32_t tile, TileShares *s)
{
    const ErrorMap *map = plan->map;
    double even = even_part(plan), sum = 0;
    s->rect = tile_rect(&map->tiles, tile);
    uint32_t n = 0, count = rect_pixels(&s->rect);
    for (uint32_t y = s->rect.y0; y < s->rect.y1; y++)
        for (uint32_t x = s->rect.x0; x < s->rect.x1; x++) sum += s->share[n++] = smoothed(map, &s->rect, x, y);
    double uneven = tile_share(plan, tile) - even * count / plan->pixels;
    for (uint32_t i = 0; i < count; i++)
        s->share[i] = even / plan->pixels + (sum > 0 ? uneven * s->share[i] / sum : uneven / count);
}

/* One draw in each of `count` equal parts of the probability (stratified, Cochran 1977, 5A.12). */
void audit_pick(const ErrorMap *map, uint64_t seed, uint32_t look, AuditDraw *draw, uint32_t count)
{
    Plan plan = {map, (double)map->tiles.width * map->tiles.height, error_map_sum(map).sum};
    Rng rng = rng_seed(hash64(seed) ^ AUDIT_STREAM, look);
    TileShares shares = {.share = {0}};
    uint32_t tile = 0, known = UINT32_MAX, last = map->tiles.count - 1;
    double before = 0, inside = tile_share(&plan, 0);
    for (uint32_t i = 0; i < count; i++) {
        double at = (i + rng_double(&rng)) / count;
        while (at >= before + inside && tile < last) {
            before += inside;
            inside = tile_share(&plan, ++tile);
        }
        if (known != tile) tile_shares(&plan, tile, &shares);
        known = tile;
        uint32_t pixel = 0, end = rect_pixels(&shares.rect) - 1;
        for (double left = at - before; pixel < end && left >= shares.share[pixel];) left -= shares.share[pixel++];
        uint32_t across = shares.rect.x1 - shares.rect.x0;
        draw[i] = (AuditDraw){.x = shares.rect.x0 + pixel % across, .y = shares.rect.y0 + pixel / across,
                              .weight = 1 / (plan.pixels * shares.share[pixel])};
    }
}

/* ---- fresh samples ---- */

/* Replicates 0 and 1 are the picture's. */
void audit_add_fresh(SampleStream *stream, AuditDraw *draw, uint32_t i, uint64_t seed, uint32_t look)
{
    const AuditDraw *d = &draw[i];
    const RenderSettings *s = stream->settings;
    uint64_t own = hash64(hash64(seed) ^ AUDIT_STREAM) + look;
    for (uint32_t k = 0; k < 2; k++) {
        SampleRun run = {.x = s->x0 + d->x, .y = s->y0 + d->y, .slot = 2 * i + k, .total = d->samples};
        stream_add_replicate(stream, run, own, 2 + 2 * i + k, 0, d->samples);
    }
}

void audit_take_fresh(void *context, const SampleStream *stream)
{
    AuditDraw *draw = context;
    for (const SampleRun *run = stream->run; run < stream->run + stream->runs; run++) {
        double *sum = draw[run->slot / 2].fresh[run->slot % 2];
        for (uint32_t i = run->begin; i < run->end; i++)
            for (int k = 0; k < 3; k++) sum[k] += stream->colour[i][k];
    }
}

/* ---- estimates ---- */

/* Newton's method on erfc, from the left of the root, where the function is convex and the steps can't pass it. */
double normal_quantile(double alpha)
{
    double z = 0;
    for (int i = 0; i < 60; i++) {
        double step = (erfc(z * M_SQRT1_2) - alpha) / (sqrt(2 / M_PI) * exp(-z * z / 2));
        z += step;
        if (fabs(step) < 0x1p-40) break;
    }
    return z;
}

/* Mean and spread of sums of squares go up and down together, so q - z s .. q + z s would be too low too often; their
 * logarithm is nearer to normal: q e^(-z s/q) .. q e^(z s/q). Where q is less than z s the upper end goes on as a straight
 * line, which meets that curve at q = z s. */
Estimate root_estimate(MeanSquare square, double alpha)
{
    if (isnan(square.mean)) return (Estimate){NAN, NAN, NAN};
    double q = fmax(square.mean, 0), reach = normal_quantile(alpha) * square.deviation;
    if (!(reach > 0)) return (Estimate){sqrt(q), sqrt(q), sqrt(q)};
    double high = q < reach ? q + (M_E - 1) * reach : q * exp(reach / q);
    return (Estimate){sqrt(q), q > 0 ? sqrt(q * exp(-reach / q)) : 0, sqrt(high)};
}

/* y - r1 or y - r2 of a channel. */
static double fresh_difference(const AuditDraw *d, int estimate, int channel)
{
    double mean = d->fresh[estimate][channel] / d->samples;
    return mean_difference(d->picture[channel], d->picture_samples, mean, d->samples);
}

static double draw_value(const AuditDraw *d)
{
    double sum = 0;
    for (int k = 0; k < 3; k++) sum += fresh_difference(d, 0, k) * fresh_difference(d, 1, k);
    return d->weight * sum / 3;
}

/* The draws are one from each stratum. Two neighbouring strata together hold two, whose difference gives the variance
 * within both and, as a surplus, half the squared difference between them (Cochran 1977, 5A.12: collapsed strata). */
MeanSquare audit_mean_square(const AuditDraw *draw, uint32_t count)
{
    double sum = 0, differences = 0;
    for (uint32_t i = 0; i + 1 < count; i += 2) {
        double a = draw_value(&draw[i]), b = draw_value(&draw[i + 1]);
        sum += a + b;
        differences += (a - b) * (a - b);
    }
    return (MeanSquare){sum / count, sqrt(differences) / count};
}

/* With errors a and b of A and B a pixel's e = (A - B)^2 / 4 is -a b beside the squared error of (A + B) / 2, whatever the
 * errors' distribution. So its deviation is that of a b, whose E (a b)^2 = 4 (E e)^2 is a share of E e^2 that depends on
 * the distribution: 4/3 for normal errors whose channels go together. Stratified samples of an edge differ only in the
 * strata that it crosses: there D = A - B is a sum of m numbers -1, 0, 1 with E D_j^2 = 2 p (1 - p), and for p even in
 * [0,1] the share is 4/3 (1 + 1/(5 m)): at most 8/5. */
#define PRODUCT_SHARE 1.6

MeanSquare replicate_mean_square(const TileError *sum, uint64_t pixels, double doubt)
{
    double n = (double)pixels, mean = sum->sum / n;
    return (MeanSquare){mean, hypot(sqrt(PRODUCT_SHARE * sum->squares) / n, doubt * mean)};
}

/* The sum of n samples of a (0,2)-sequence, in variances of one, if the mean of 2^k has 2^(-rate k): it is that of
 * blocks of 2^k, one for each binary digit of n, each stratified in itself. */
static double variance_of_sum(uint32_t n, double rate)
{
    double sum = 0;
    for (int k = 0; k < 32; k++)
        if (n >> k & 1) sum += exp2((2 - rate) * k);
    return sum;
}

static double split_share(double n_a, double n_b, double of_a, double of_b)
{
    return (of_a + of_b) / (of_a / (n_a * n_a) + of_b / (n_b * n_b)) / ((n_a + n_b) * (n_a + n_b));
}

/* Equal parts have a quarter for certain. Otherwise it depends on the rate at which the variance falls: 3/2 across an edge
 * (Mitchell 1996), 1 for what is finer than the samples; what lies between is the doubt. */
ReplicateSplit replicate_split(uint32_t n_a, uint32_t n_b)
{
    double at_edges = split_share(n_a, n_b, variance_of_sum(n_a, 1.5), variance_of_sum(n_b, 1.5));
    return (ReplicateSplit){at_edges, fabs(split_share(n_a, n_b, n_a, n_b) / at_edges - 1)};
}

/* How rarely two figures may differ by chance as much as they do before the replicates' isn't believed any more. */
#define CONTRADICTION 0.01

/* Given the picture, the replicates' sum over all pixels has the smaller spread, the audit's mean is right whatever the
 * replicates have in common. Each counts by its inverse variance; the audit's is that of its relative deviation, as an
 * audit that finds little by chance finds its spread small too and would get too much weight. */
MeanSquare agreed_mean_square(MeanSquare audit, MeanSquare replicates)
{
    double its = replicates.deviation * replicates.deviation;
    double deviation = audit.mean > 0 ? audit.deviation / audit.mean * replicates.mean : audit.deviation;
    double mine = deviation * deviation;
    double apart = fabs(audit.mean - replicates.mean);
    if (apart > normal_quantile(CONTRADICTION) * hypot(fmax(audit.deviation, deviation), sqrt(its))) return audit;
    if (!(mine + its > 0)) return audit;
    return (MeanSquare){(audit.mean * its + replicates.mean * mine) / (mine + its), sqrt(mine * its / (mine + its))};
}

double audit_unseen(uint64_t pixels, double samples, double alpha)
{
    return -expm1(log(alpha) / samples) / sqrt((double)pixels);
}

bool audit_agrees(const AuditDraw *draw, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++)
        for (int k = 0; k < 3; k++)
            if (fresh_difference(&draw[i], 0, k) != 0 || fresh_difference(&draw[i], 1, k) != 0) return false;
    return true;
}
