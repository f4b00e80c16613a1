#include "render/adaptive.h"

#include <stdlib.h>

#include "common/cpu.h"
#include "common/memory.h"
#include "render/allocate.h"
#include "render/audit.h"

enum {
    PILOT_LEVEL = 0,         /* every pixel has so many samples (their logarithm) of each replicate at first */
    TURN_TILES = 4,          /* of a thread's turn: pixels that still need samples fill streams together */
    TURN_DRAWS = 32,
};

/* What a pixel has got. */
typedef struct {
    double sum[2][3];        /* of replicates A and B */
    double squares[2];       /* of their samples, all channels */
    uint8_t level[2];
} Sums;

typedef struct {
    const RenderSettings *settings;
    RenderOutcome *outcome;
    ErrorMap guess;          /* what the audit's draws go by: the replicates' errors and those that the spreads foretell */
    Tiles tiles;
    uint64_t pixels;
    Sums *sums;              /* rows from the top */
    uint16_t (*spread)[2];   /* codes of what decides on A, from B's samples, and on B, from A's */
    uint8_t *fresh;          /* a tile got samples in this round */
    SpreadTable *table;
    Allocation *plan;
    AuditDraw *draw;
    uint32_t draws, look;
    void *film;
    atomic_ullong clipped;
    double round_s;          /* when the last round began */
    uint64_t round_samples;  /* what it added */
    double unfinished;       /* share of the pixels that would get more */
    RenderStats *stats;
} Adaptive;

/* ---- a round of samples ---- */

static void take_samples(void *context, const SampleStream *stream)
{
    Adaptive *job = context;
    for (const SampleRun *run = stream->run; run < stream->run + stream->runs; run++) {
        Sums *sums = &job->sums[run->slot / 2];
        double *sum = sums->sum[run->slot % 2];
        for (uint32_t i = run->begin; i < run->end; i++) {
            const double *c = stream->colour[i];
            for (int k = 0; k < 3; k++) sum[k] += c[k];
            sums->squares[run->slot % 2] += c[0] * c[0] + c[1] * c[1] + c[2] * c[2];
        }
    }
}

/* The first `count` samples of both replicates are drawn by twice `count` samples: their numbers are of those. */
static void add_levels(Adaptive *job, SampleStream *stream, uint32_t x, uint32_t y, int replicate, int from, int to)
{
    const RenderSettings *s = job->settings;
    uint32_t first = from < 0 ? 0 : 1u << from, end = 1u << to;
    SampleRun run = {.x = s->x0 + x, .y = s->y0 + y, .slot = 2 * (y * job->tiles.width + x) + (uint32_t)replicate,
                     .number = first + (replicate ? end : 0), .total = 2 * end};
    stream_add_replicate(stream, run, s->seed, (uint32_t)replicate, first, end);
}

/* A machine that has become much slower since the last round can't finish this one. */
static bool is_late(const Adaptive *job)
{
    return job->settings->deadline_s > 0 && cpu_wall_s() > job->settings->deadline_s;
}

/* Calls `each` for the pixels of a turn's tiles, each tile's along its Z curve. */
static uint32_t turn_end(const Adaptive *job, uint32_t turn)
{
    uint32_t end = (turn + 1) * TURN_TILES;
    return end < job->tiles.count ? end : job->tiles.count;
}

static uint32_t turn_count(const Adaptive *job) { return (job->tiles.count + TURN_TILES - 1) / TURN_TILES; }

static void pilot_turn(void *context, uint32_t turn, SampleStream *stream, bool first)
{
    Adaptive *job = context;
    stream_set_taker(stream, take_samples, job);
    for (uint32_t tile = turn * TURN_TILES; tile < turn_end(job, turn); tile++) {
        TileRect r = tile_rect(&job->tiles, tile);
        for (uint32_t k = 0; k < TILE_PIXELS; k++) {
            uint32_t x = r.x0 + tile_column(k), y = r.y0 + tile_row(k);
            if (x >= r.x1 || y >= r.y1) continue;
            Sums *sums = &job->sums[y * job->tiles.width + x];
            for (int i = 0; i < 2; i++) {
                sums->level[i] = PILOT_LEVEL;
                add_levels(job, stream, x, y, i, -1, PILOT_LEVEL);
            }
        }
        job->fresh[tile] = 1;
    }
    stream_flush(stream);
    const RenderSettings *s = job->settings;
    if (first && s->progress) s->progress(s->progress_context, 0.5 * turn / turn_count(job));
}

static void round_turn(void *context, uint32_t turn, SampleStream *stream, bool first)
{
    (void)first;
    Adaptive *job = context;
    if (is_late(job)) return;
    stream_set_taker(stream, take_samples, job);
    for (uint32_t tile = turn * TURN_TILES; tile < turn_end(job, turn); tile++) {
        TileRect r = tile_rect(&job->tiles, tile);
        for (uint32_t k = 0; k < TILE_PIXELS; k++) {
            uint32_t x = r.x0 + tile_column(k), y = r.y0 + tile_row(k), pixel = y * job->tiles.width + x;
            if (x >= r.x1 || y >= r.y1) continue;
            for (int i = 0; i < 2; i++) {
                uint8_t *level = &job->sums[pixel].level[i];
                uint8_t wanted = job->plan->level[*level][job->spread[pixel][i] >> SPREAD_SHIFT];
                if (wanted == *level) continue;
                add_levels(job, stream, x, y, i, *level, wanted);
                *level = wanted;
                job->fresh[tile] = 1;
            }
        }
    }
    stream_flush(stream);
}

/* ---- what the samples say ---- */

static uint32_t clamped(int64_t i, uint32_t end) { return i < 0 ? 0 : i >= end ? end - 1 : (uint32_t)i; }

/* The variance of n samples, from their sums. A difference within the roundings of the sums is none. */
static double sample_variance(const Sums *sums, int replicate, double n)
{
    const double *sum = sums->sum[replicate];
    double spread = sums->squares[replicate] - (sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]) / n;
    if (n < 2 || spread <= 2 * (n + 4) * 0x1p-53 * sums->squares[replicate]) return 0;
    return spread / (3 * (n - 1));
}

static void fill_view(const Adaptive *job, const TileRect *r, int replicate, TileView *view)
{
    for (int j = 0, i = 0; j < VIEW_SIDE; j++) {
        const Sums *row = job->sums + (size_t)clamped((int64_t)r->y0 + j - 1, job->tiles.height) * job->tiles.width;
        for (int k = 0; k < VIEW_SIDE; k++, i++) {
            const Sums *sums = &row[clamped((int64_t)r->x0 + k - 1, job->tiles.width)];
            double n = 1u << sums->level[replicate];
            for (int c = 0; c < 3; c++) view->mean[c][i] = (float)(sums->sum[replicate][c] / n);
            view->variance[i] = (float)sample_variance(sums, replicate, n);
            view->samples[i] = (float)n;
        }
    }
}

static bool is_touched(const Adaptive *job, uint32_t tile)
{
    uint32_t across = job->tiles.across, down = job->tiles.count / across, x = tile % across, y = tile / across;
    for (uint32_t j = y > 0 ? y - 1 : 0; j <= y + 1 && j < down; j++)
        for (uint32_t i = x > 0 ? x - 1 : 0; i <= x + 1 && i < across; i++)
            if (job->fresh[j * across + i]) return true;
    return false;
}

/* Of each estimate that an audit makes of a pixel: about as many as a replicate has. */
static uint32_t fresh_samples(const Sums *sums)
{
    return 1u << (sums->level[0] < sums->level[1] ? sums->level[0] : sums->level[1]);
}

/* Spreads, errors by the replicates, and their sums. */
static void look_turn(void *context, uint32_t tile, SampleStream *stream, bool first)
{
    (void)stream, (void)first;
    Adaptive *job = context;
    if (!is_touched(job, tile)) return;
    TileRect r = tile_rect(&job->tiles, tile);
    TileView view;
    float spread[2][TILE_PIXELS];
    for (int i = 0; i < 2; i++) {
        fill_view(job, &r, i, &view);
        spread_of_tile(&view, spread[i]);
    }
    TileError error = {0}, guess = {0};
    for (uint32_t y = r.y0; y < r.y1; y++)
        for (uint32_t x = r.x0; x < r.x1; x++) {
            uint32_t pixel = y * job->tiles.width + x, own = (y - r.y0) * TILE + (x - r.x0);
            const Sums *sums = &job->sums[pixel];
            double n_a = 1u << sums->level[0], n_b = 1u << sums->level[1], squared = 0;
            for (int k = 0; k < 3; k++) {
                double d = mean_difference(sums->sum[0][k] / n_a, n_a, sums->sum[1][k] / n_b, n_b);
                error.greatest = fmax(error.greatest, fabs(d));
                squared += d * d / 12;
            }
            for (int i = 0; i < 2; i++) job->spread[pixel][i] = error_code((double)spread[1 - i][own]);
            error_map_put(&job->outcome->map, x, y, squared);
            error.sum += squared;
            error.squares += squared * squared;
            double foretold = (predicted_variance((double)spread[1][own], sums->level[0]) +
                               predicted_variance((double)spread[0][own], sums->level[1])) / 4;
            error_map_put(&job->guess, x, y, squared + foretold);
            guess.sum += squared + foretold;
            guess.squares += (squared + foretold) * fresh_samples(sums);
        }
    job->outcome->map.tile[tile] = error;
    job->guess.tile[tile] = guess;
}

static void count_spreads(Adaptive *job)
{
    *job->table = (SpreadTable){.count = {{0}}};
    for (uint64_t pixel = 0; pixel < job->pixels; pixel++)
        for (int i = 0; i < 2; i++)
            job->table->count[job->sums[pixel].level[i]][job->spread[pixel][i] >> SPREAD_SHIFT]++;
}

static bool look(Adaptive *job, Crew *crew, TileError *sum, Err *err)
{
    if (!crew_run(crew, job->tiles.count, look_turn, job, err)) return false;
    memset(job->fresh, 0, job->tiles.count);
    count_spreads(job);
    *sum = error_map_sum(&job->outcome->map);
    return true;
}

/* ---- the audit ---- */

static void picture_colour(const Sums *sums, double colour[3])
{
    for (int k = 0; k < 3; k++)
        colour[k] = (sums->sum[0][k] / (1u << sums->level[0]) + sums->sum[1][k] / (1u << sums->level[1])) / 2;
}

static void audit_turn(void *context, uint32_t turn, SampleStream *stream, bool first)
{
    (void)first;
    Adaptive *job = context;
    uint32_t begin = turn * TURN_DRAWS, end = begin + TURN_DRAWS < job->draws ? begin + TURN_DRAWS : job->draws;
    stream_set_taker(stream, audit_take_fresh, job->draw);
    for (uint32_t i = begin; i < end; i++) audit_add_fresh(stream, job->draw, i, job->settings->seed, job->look);
    stream_flush(stream);
}

static double least_samples(const Adaptive *job)
{
    for (int level = 0; level < LEVELS; level++)
        for (int bin = 0; bin < SPREAD_BINS; bin++)
            if (job->table->count[level][bin] > 0) return 2.0 * (1u << level);
    return 0;
}

/* Fresh samples that a draw takes on average: the guess, by which draws go, has their sums weighted by it in `squares`. */
static double fresh_each(const Adaptive *job)
{
    TileError guess = error_map_sum(&job->guess);
    return guess.sum > 0 ? 2 * guess.squares / guess.sum : least_samples(job);
}

static uint32_t draw_count(const Adaptive *job) { return audit_size(job->stats->samples, fresh_each(job)); }

static double fresh_total(const Adaptive *job) { return draw_count(job) * fresh_each(job); }

static bool audit(Adaptive *job, Crew *crew, Err *err)
{
    const RenderSettings *s = job->settings;
    free(job->draw);
    job->draws = draw_count(job);
    job->draw = malloc(job->draws * sizeof *job->draw);
    if (!job->draw) return err_memory(err, "the audit");
    audit_pick(&job->guess, s->seed, job->look, job->draw, job->draws);
    for (uint32_t i = 0; i < job->draws; i++) {
        AuditDraw *d = &job->draw[i];
        const Sums *sums = &job->sums[d->y * job->tiles.width + d->x];
        d->samples = fresh_samples(sums);
        d->picture_samples = (1u << sums->level[0]) + (1u << sums->level[1]);
        picture_colour(sums, d->picture);
    }
    if (!crew_run(crew, (job->draws + TURN_DRAWS - 1) / TURN_DRAWS, audit_turn, job, err)) return false;
    RenderStats fresh = crew_take_stats(crew);
    job->stats->audit_rays += stats_rays(&fresh);
    job->stats->audit_samples += fresh.samples;
    job->look++;
    return true;
}

/* ---- the goals ---- */

/* The error may be found small enough at several looks; what all of them may be wrong with together is ERROR_ALPHA:
 * 4/5 of it at the first, a fifth of what the one before had at each further one. */
#define LATER_LOOK 0.2

static double look_alpha(uint32_t look_number) { return ERROR_ALPHA * (1 - LATER_LOOK) * pow(LATER_LOOK, look_number); }

/* Pixels that both replicates wrongly take for finished are pairs that agree, and rounds end when the replicates agree by
 * chance: their mean square is up to this share of itself too low (29 scenes at 256 x 256, make calibration: 4 to 10 % on
 * average). The middle is taken, and the deviation of what is spread evenly. */
#define REPLICATES_LOW 0.15
#define REPLICATES_RAISE (1 + REPLICATES_LOW / 2)
#define REPLICATES_DOUBT (REPLICATES_LOW / REPLICATES_RAISE / sqrt(12))

/* The outcome's interval reaches above the replicates' figure, which the rounds go by, so they aim lower. On the scenes of
 * Assets an audited mean square has a relative standard deviation of 4 to 7 / sqrt(draws), and less together with the
 * replicates'; half of that is the deviation of the RMSE. The half width of the interval is 2.05 of that, and the outcome
 * is 0.85 of it above the replicates' in one case of five. */
#define AUDIT_SPREAD 5
#define AUDIT_REACH (2.05 + 0.85)

static double audit_margin(const Adaptive *job)
{
    if (!job->settings->audits) return 1;
    MeanSquare audited = {1, AUDIT_SPREAD / sqrt(draw_count(job))};
    double deviation = agreed_mean_square(audited, (MeanSquare){1, REPLICATES_DOUBT}).deviation;
    return exp(-AUDIT_REACH * deviation / 2) / sqrt(REPLICATES_RAISE);
}

/* What the picture's error is. A picture all of whose samples agree has what they can have missed. */
static bool judge(Adaptive *job, Crew *crew, const TileError *sum, CurvePoint *point, Estimate *rmse, Err *err)
{
    double alpha = look_alpha(job->look);
    MeanSquare square = replicate_mean_square(sum, job->pixels, REPLICATES_DOUBT);
    square.mean *= REPLICATES_RAISE;
    square.deviation *= REPLICATES_RAISE;
    bool agrees = sum->sum == 0;
    point->audited = job->settings->audits;
    if (point->audited) {
        if (!audit(job, crew, err)) return false;
        MeanSquare audited = audit_mean_square(job->draw, job->draws);
        agrees = agrees && audit_agrees(job->draw, job->draws);
        point->audit = root_estimate(audited, alpha);
        square = agreed_mean_square(audited, square);
    }
    *rmse = root_estimate(square, alpha);
    if (agrees) point->audit.high = rmse->high = audit_unseen(job->pixels, least_samples(job), alpha);
    return true;
}

static void note(const Adaptive *job, const TileError *sum, CurvePoint *point)
{
    *point = (CurvePoint){.wall_s = cpu_wall_s() - job->settings->start_s, .cpu_s = cpu_time_s(),
                          .rays = stats_rays(job->stats) + job->stats->audit_rays, .samples = job->stats->samples,
                          .predicted = sqrt(sum->sum / (double)job->pixels), .greatest_diff = sum->greatest,
                          .unfinished = job->unfinished};
}

/* The audit's time and rays belong to the finished picture. */
static void note_end(Adaptive *job, CurvePoint *point)
{
    point->wall_s = cpu_wall_s() - job->settings->start_s;
    point->cpu_s = cpu_time_s();
    point->rays = stats_rays(job->stats) + job->stats->audit_rays;
    point->unfinished = job->unfinished = 0;
}

static bool is_in_reach(const Adaptive *job, const TileError *sum, double goal)
{
    if (sum->sum > 0) return sqrt(sum->sum / (double)job->pixels) <= goal;
    return audit_unseen(job->pixels, least_samples(job), ERROR_ALPHA) <= job->settings->error_goal;
}

/* ---- the clock ---- */

/* A round may take this part of the time that is left, so that the next one goes by a speed measured anew; less than that
 * part of the whole is left alone. */
#define ROUND_PART 0.6
#define IDLE_PART 0.03

/* To write a pixel, PNG's compression included. */
#define WRITE_S 2e-7

/* Samples per second of the last round, what came after it included. */
static double speed(const Adaptive *job)
{
    return (double)job->round_samples / fmax(cpu_wall_s() - job->round_s, 1e-9);
}

/* The time left for rounds: the audit's and that for writing the picture is not. */
static double time_left(const Adaptive *job)
{
    const RenderSettings *s = job->settings;
    if (s->deadline_s == 0) return INFINITY;
    double audit_s = s->audits ? fresh_total(job) / speed(job) : 0;
    return s->deadline_s - cpu_wall_s() - audit_s - WRITE_S * (double)job->pixels;
}

static bool is_over(const Adaptive *job)
{
    const RenderSettings *s = job->settings;
    return time_left(job) <= IDLE_PART * (s->deadline_s - s->start_s);
}

/* ---- the rounds ---- */

static bool end(Adaptive *job, CurvePoint *point, Err *err)
{
    note_end(job, point);
    return outcome_add_point(job->outcome, point, err);
}

/* What the next round adds; false if it would be nothing. */
static bool plan(Adaptive *job, double squared, double goal)
{
    double affordable = ROUND_PART * time_left(job) * speed(job);
    if (squared == 0) allocate_evenly(job->table, job->plan);
    else if (goal > 0) allocate_for_error(job->table, squared, goal * goal * (double)job->pixels, job->plan);
    if (goal > 0 && squared > 0 && job->plan->samples == 0) allocate_evenly(job->table, job->plan);
    bool is_dear = (double)job->plan->samples > affordable;
    if (squared == 0 && is_dear) return false;
    if (squared > 0 && (goal == 0 || is_dear)) allocate_samples(job->table, (uint64_t)affordable, job->plan);
    job->unfinished = (double)job->plan->unfinished / (2 * (double)job->pixels);
    return job->plan->samples > 0;
}

static bool run_round(Adaptive *job, Crew *crew, CrewTurn *turn, Err *err)
{
    job->round_s = cpu_wall_s();
    if (!crew_run(crew, turn_count(job), turn, job, err)) return false;
    RenderStats round = crew_take_stats(crew);
    stats_add(job->stats, &round);
    job->round_samples = round.samples;
    return true;
}

/* Rounds until the goal is reached or the time is over. An audit that finds too much says how much lower to aim. */
static bool reach_goals(Adaptive *job, Crew *crew, Err *err)
{
    const double wanted = job->settings->error_goal;
    double calibrated = wanted;
    Estimate *rmse = &job->outcome->rmse;
    for (;;) {
        TileError sum;
        CurvePoint point;
        if (!look(job, crew, &sum, err)) return false;
        double goal = calibrated * audit_margin(job);
        note(job, &sum, &point);
        bool over = is_over(job);
        if (over || (wanted > 0 && is_in_reach(job, &sum, goal))) {
            if (!judge(job, crew, &sum, &point, rmse, err)) return false;
            job->outcome->ended_by_clock = over && !(rmse->high <= wanted);
            if (over || rmse->high <= wanted) return end(job, &point, err);
            goal = fmin(goal, point.predicted) * wanted / rmse->high;
            calibrated = goal / audit_margin(job);
            point.audited = false;    /* what decided on going on is no measurement to fit a line through */
        }
        bool goes_on = wanted > 0 || sum.sum > 0 ? plan(job, sum.sum, goal) : false;
        point.unfinished = job->unfinished;
        if (!goes_on) {
            if (!judge(job, crew, &sum, &point, rmse, err)) return false;
            job->outcome->ended_by_clock = wanted > 0 && !(rmse->high <= wanted);
            return end(job, &point, err);
        }
        if (!outcome_add_point(job->outcome, &point, err)) return false;
        if (!run_round(job, crew, round_turn, err)) return false;
    }
}

/* ---- the whole ---- */

static void write_turn(void *context, uint32_t tile, SampleStream *stream, bool first)
{
    (void)stream, (void)first;
    Adaptive *job = context;
    const RenderSettings *s = job->settings;
    TileRect r = tile_rect(&job->tiles, tile);
    uint32_t clipped = 0;
    double true_sum = 0;
    for (uint32_t y = r.y0; y < r.y1; y++)
        for (uint32_t x = r.x0; x < r.x1; x++) {
            double colour[3];
            size_t pixel = (size_t)y * job->tiles.width + x;
            picture_colour(&job->sums[pixel], colour);
            film_put(s->format, s->srgb, job->film, pixel, colour);
            clipped += film_clips(colour);
            if (s->reference) true_sum += true_error(colour, s->reference + 3 * pixel);
        }
    job->outcome->map.tile[tile].true_sum = true_sum;
    atomic_fetch_add_explicit(&job->clipped, clipped, memory_order_relaxed);
}

static bool create(Adaptive *job, Err *err)
{
    job->sums = memory_array(job->pixels, sizeof *job->sums);
    job->spread = malloc(job->pixels * sizeof *job->spread);
    job->fresh = calloc(job->tiles.count, 1);
    job->table = malloc(sizeof *job->table);
    job->plan = malloc(sizeof *job->plan);
    if (!job->sums || !job->spread || !job->fresh || !job->table || !job->plan)
        return err_memory(err, "the film");
    memset(job->sums, 0, job->pixels * sizeof *job->sums);
    return true;
}

bool render_adaptive(Crew *crew, const RenderSettings *settings, void *film, RenderStats *stats, RenderOutcome *outcome,
                     Err *err)
{
    const Tiles *tiles = &outcome->map.tiles;
    uint64_t pixels = (uint64_t)tiles->width * tiles->height;
    Adaptive job = {.settings = settings, .outcome = outcome, .tiles = *tiles, .pixels = pixels, .film = film,
                    .stats = stats, .unfinished = 1};
    bool ok = error_map_create(&job.guess, tiles->width, tiles->height, err) && create(&job, err) &&
              run_round(&job, crew, pilot_turn, err) && reach_goals(&job, crew, err) &&
              crew_run(crew, tiles->count, write_turn, &job, err) && outcome_set_pixel_error(outcome, err);
    outcome->clipped = job.clipped;
    outcome_set_true_error(outcome, settings);
    error_map_destroy(&job.guess);
    free(job.sums);
    free(job.spread);
    free(job.fresh);
    free(job.table);
    free(job.plan);
    free(job.draw);
    return ok;
}
