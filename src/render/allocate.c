/* With n samples of variance s^2 whose mean has the variance s^2 n^-r, the sum of all pixels' variances falls most for the
 * samples spent where the next one brings most, r s^2 n^-(r+1): all pixels end at the same rate, so n ~ (s^2)^(1/(r+1)).
 * r is 1 for independent samples, 3/2 for stratified ones across an edge (Mitchell, "Consequences of stratified sampling in
 * graphics", 1996), which is where most of a picture's error is. Only the ratios between pixels depend on r: the
 * replicates' differences say what the whole really has. */
#include "render/allocate.h"

#define RATE 1.5

/* ---- how a pixel spreads ---- */

/* The least and greatest of each pixel's 3 x 3 neighbourhood. */
static void extremes(const float *plane, float least[TILE_PIXELS], float greatest[TILE_PIXELS])
{
    float low[VIEW_SIDE][TILE], high[VIEW_SIDE][TILE];
    for (int y = 0; y < VIEW_SIDE; y++)
        for (int x = 0; x < TILE; x++) {
            const float *p = plane + y * VIEW_SIDE + x;
            float a = p[0] < p[1] ? p[0] : p[1], b = p[0] > p[1] ? p[0] : p[1];
            low[y][x] = a < p[2] ? a : p[2];
            high[y][x] = b > p[2] ? b : p[2];
        }
    for (int y = 0; y < TILE; y++)
        for (int x = 0; x < TILE; x++) {
            float a = low[y][x] < low[y + 1][x] ? low[y][x] : low[y + 1][x];
            float b = high[y][x] > high[y + 1][x] ? high[y][x] : high[y + 1][x];
            least[y * TILE + x] = a < low[y + 2][x] ? a : low[y + 2][x];
            greatest[y * TILE + x] = b > high[y + 2][x] ? b : high[y + 2][x];
        }
}

/* The mean of each pixel's neighbourhood. */
static void neighbour_means(const float *plane, float mean[TILE_PIXELS])
{
    float row[VIEW_SIDE][TILE];
    for (int y = 0; y < VIEW_SIDE; y++)
        for (int x = 0; x < TILE; x++) {
            const float *p = plane + y * VIEW_SIDE + x;
            row[y][x] = p[0] + p[1] + p[2];
        }
    for (int y = 0; y < TILE; y++)
        for (int x = 0; x < TILE; x++) mean[y * TILE + x] = (row[y][x] + row[y + 1][x] + row[y + 2][x]) * (1 / 9.0f);
}

/* A pixel's own variance from n samples counts n - 1 times, its neighbours' once. Whatever it says, it is not taken to be
 * less than this floor: let the neighbourhood's colours be c apart, so that an edge is near, and half of such pixels have
 * a piece of the other colour of an area k in [0,1], all k alike. n samples agree with the probability 2/(n+1) if there
 * is a piece and 1 if not, so if they do, there is one with 2/(n+3); it has the variance c^2 E k (1-k) =
 * c^2 (n+1)/((n+2)(n+3)) then (Laplace's rule of succession), so c^2 2/(n+3)^2 is expected. Where the neighbourhood is of
 * one colour the floor is 0. The edge may be any edge, of an object, a shadow or a texture: one that shows in no colour
 * makes no error. */
void spread_of_tile(const TileView *view, float spread[TILE_PIXELS])
{
    float contrast[TILE_PIXELS] = {0}, least[TILE_PIXELS], greatest[TILE_PIXELS], around[TILE_PIXELS];
    for (int k = 0; k < 3; k++) {
        extremes(view->mean[k], least, greatest);
        for (int i = 0; i < TILE_PIXELS; i++)
            contrast[i] += (greatest[i] - least[i]) * (greatest[i] - least[i]) * (1 / 3.0f);
    }
    neighbour_means(view->variance, around);
    for (int y = 0; y < TILE; y++)
        for (int x = 0; x < TILE; x++) {
            int i = y * TILE + x, own = (y + 1) * VIEW_SIDE + x + 1;
            float n = view->samples[own], floor = contrast[i] * 2 / ((n + 3) * (n + 3));
            float seen = (view->variance[own] * (n - 1) + around[i]) / n;
            spread[i] = seen > floor ? seen : floor;
        }
}

/* ---- who gets how much ---- */

double predicted_variance(double spread, int level) { return spread * exp2(-RATE * level); }

static double spread_of_bin(int bin)
{
    return bin == 0 ? 0 : error_of_code((uint16_t)((bin << SPREAD_SHIFT) | 1 << (SPREAD_SHIFT - 1)));
}

/* The least level from `level` on at which a sample more brings no more than `bar`. */
static int wanted_level(double spread, int level, double bar)
{
    double gain = spread * exp2(-(RATE + 1) * level);
    while (gain > bar && level < MAX_LEVEL) {
        gain *= exp2(-(RATE + 1));
        level++;
    }
    return level;
}

/* What it would come to if every one got what it wants at once. */
typedef struct { double samples, variance; } Total;

static Total total_at(const SpreadTable *table, double bar)
{
    Total total = {0, 0};
    for (int level = 0; level < LEVELS; level++)
        for (int bin = 1; bin < SPREAD_BINS; bin++) {
            if (table->count[level][bin] == 0) continue;
            double spread = spread_of_bin(bin), count = (double)table->count[level][bin];
            int wanted = wanted_level(spread, level, bar);
            total.samples += count * (exp2(wanted) - exp2(level));
            total.variance += count * predicted_variance(spread, wanted);
        }
    return total;
}

static void allocate_above(const SpreadTable *table, double bar, Allocation *a)
{
    a->samples = a->unfinished = 0;
    for (int level = 0; level < LEVELS; level++)
        for (int bin = 0; bin < SPREAD_BINS; bin++) {
            int wanted = wanted_level(spread_of_bin(bin), level, bar);
            if (wanted > level + GROWTH) wanted = level + GROWTH;
            a->level[level][bin] = (uint8_t)wanted;
            if (wanted == level) continue;
            a->samples += table->count[level][bin] * ((1u << wanted) - (1u << level));
            a->unfinished += table->count[level][bin];
        }
}

/* Halving the logarithm's interval finds bars to a step that is finer than the bins. */
enum { BAR_LEAST = -200, BAR_MOST = 140, BAR_STEPS = 14 };

void allocate_for_error(const SpreadTable *table, double now, double goal, Allocation *allocation)
{
    double scale = now / total_at(table, INFINITY).variance, low = BAR_LEAST, high = BAR_MOST;
    for (int i = 0; i < BAR_STEPS; i++) {
        double middle = (low + high) / 2;
        if (scale * total_at(table, exp2(middle)).variance <= goal) low = middle;
        else high = middle;
    }
    allocate_above(table, exp2(low), allocation);
}

void allocate_samples(const SpreadTable *table, uint64_t samples, Allocation *allocation)
{
    double low = BAR_LEAST, high = BAR_MOST;
    for (int i = 0; i < BAR_STEPS; i++) {
        double middle = (low + high) / 2;
        if (total_at(table, exp2(middle)).samples <= (double)samples) high = middle;
        else low = middle;
    }
    allocate_above(table, exp2(high), allocation);
}

void allocate_evenly(const SpreadTable *table, Allocation *a)
{
    a->samples = a->unfinished = 0;
    for (int level = 0; level < LEVELS; level++)
        for (int bin = 0; bin < SPREAD_BINS; bin++) {
            int more = level < MAX_LEVEL;
            a->level[level][bin] = (uint8_t)(level + more);
            if (!more) continue;
            a->samples += table->count[level][bin] << level;
            a->unfinished += table->count[level][bin];
        }
}
