#include "render.h"

#include <stdlib.h>
#include <string.h>

#include "common/cpu.h"
#include "render/adaptive.h"
#include "render/audit.h"
#include "render/crew.h"
#include "render/sample.h"

/* The replicates' first 1, 2, 4, ... samples are pictures of their own: so many there are at most. */
enum { MAX_LEVELS = 16 };

/* A render with a fixed number of samples. Its film lives tile by tile. */
typedef struct {
    const RenderSettings *settings;
    void *film;
    ErrorMap *map;
    ErrorMap guess;          /* what the audit's draws go by; nothing without an audit */
    ReplicateSplit split;    /* with one sample there are no replicates */
    uint32_t levels;
    double *level_error;     /* `levels` for each tile: sum of the pixels' squared errors with 2 << level samples */
    atomic_ullong clipped;
    AuditDraw *draw;
    uint32_t draws;
} Fixed;

/* A tile's sums of samples: all of them, and by replicates. */
typedef struct {
    uint32_t share_a;
    double all[TILE_PIXELS][3];
    double squares[TILE_PIXELS];                 /* of the samples, all channels */
    double part[2][TILE_PIXELS][3];
    double early[MAX_LEVELS][TILE_PIXELS][3];    /* what part[0] was after 1, 2, 4, ... samples */
    double *level_error;
} TileFilm;

static double squared_distance(const double a[3], const double b[3])
{
    double sum = 0;
    for (int k = 0; k < 3; k++) sum += (a[k] - b[k]) * (a[k] - b[k]);
    return sum;
}

/* The first `count` samples of a replicate of the pixel add up to `sum`. */
static void take_level(TileFilm *film, uint32_t pixel, int replicate, uint32_t count, const double sum[3])
{
    int level = 0;
    while (1u << level < count) level++;
    double *early = film->early[level][pixel];
    if (replicate == 0) memcpy(early, sum, sizeof film->early[level][pixel]);
    else film->level_error[level] += squared_distance(early, sum) / 12 / count / count;
}

static void take_tile(void *context, const SampleStream *stream)
{
    TileFilm *film = context;
    for (const SampleRun *run = stream->run; run < stream->run + stream->runs; run++) {
        int replicate = run->number >= film->share_a;
        uint32_t pixel = run->slot, before = run->number - (replicate ? film->share_a : 0);
        double all[3], part[3], squares = film->squares[pixel];
        memcpy(all, film->all[pixel], sizeof all);
        memcpy(part, film->part[replicate][pixel], sizeof part);
        for (uint32_t i = run->begin; i < run->end; i++, before++) {
            const double *c = stream->colour[i];
            for (int k = 0; k < 3; k++) {
                all[k] += c[k];
                part[k] += c[k];
                squares += c[k] * c[k];
            }
            if ((before & (before + 1)) == 0) take_level(film, pixel, replicate, before + 1, part);
        }
        memcpy(film->all[pixel], all, sizeof all);
        memcpy(film->part[replicate][pixel], part, sizeof part);
        film->squares[pixel] = squares;
    }
}

/* The squared error of the pixel's mean over channels. */
static double replicate_error(const TileFilm *film, uint32_t pixel, uint32_t samples, double share, double *greatest)
{
    double n_a = film->share_a, n_b = samples - film->share_a, sum = 0;
    for (int k = 0; k < 3; k++) {
        double d = mean_difference(film->part[0][pixel][k] / n_a, n_a, film->part[1][pixel][k] / n_b, n_b);
        *greatest = fmax(*greatest, fabs(d));
        sum += d * d;
    }
    return sum / 3 * share;
}

/* How far each pixel's sum is from those of its four neighbours in the tile, squared and summed. */
static void find_contrasts(const TileFilm *film, const TileRect *r, double contrast[TILE_PIXELS])
{
    uint32_t width = r->x1 - r->x0, height = r->y1 - r->y0;
    memset(contrast, 0, TILE_PIXELS * sizeof *contrast);
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0, i = y * TILE; x < width; x++, i++) {
            double right = x + 1 < width ? squared_distance(film->all[i], film->all[i + 1]) : 0;
            double below = y + 1 < height ? squared_distance(film->all[i], film->all[i + TILE]) : 0;
            contrast[i] += right + below;
            if (x + 1 < width) contrast[i + 1] += right;
            if (y + 1 < height) contrast[i + TILE] += below;
        }
}

/* Where the audit should look: where the replicates differ, and where the pixel's samples do or its neighbours, as
 * allocate.c has it. */
static double guess_error(const TileFilm *film, uint32_t pixel, double contrast, double n, double error)
{
    const double *sum = film->all[pixel];
    double squares = film->squares[pixel] - (sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]) / n;
    double spread = n > 1 ? fmax(squares, 0) / (3 * (n - 1)) : 0;
    double floor = contrast / (3 * n * n) * 2 / ((n + 3) * (n + 3));
    return error + fmax(spread, floor) / (n * sqrt(n));
}

static void put_guesses(Fixed *job, const TileFilm *film, uint32_t tile)
{
    TileRect r = tile_rect(&job->map->tiles, tile);
    double sum = 0, contrast[TILE_PIXELS];
    find_contrasts(film, &r, contrast);
    for (uint32_t y = r.y0; y < r.y1; y++)
        for (uint32_t x = r.x0; x < r.x1; x++) {
            double error = error_of_code(job->map->code[(size_t)y * job->map->tiles.width + x]);
            uint32_t pixel = (y - r.y0) * TILE + (x - r.x0);
            double guess = guess_error(film, pixel, contrast[pixel], job->settings->samples, error);
            error_map_put(&job->guess, x, y, guess);
            sum += guess;
        }
    job->guess.tile[tile].sum = sum;
}

static void write_tile(Fixed *job, const TileFilm *film, uint32_t tile)
{
    const RenderSettings *s = job->settings;
    TileRect r = tile_rect(&job->map->tiles, tile);
    TileError error = {0};
    uint32_t clipped = 0;
    for (uint32_t y = r.y0; y < r.y1; y++)
        for (uint32_t x = r.x0; x < r.x1; x++) {
            uint32_t pixel = (y - r.y0) * TILE + (x - r.x0);
            size_t at = (size_t)y * job->map->tiles.width + x;
            double mean[3], e = 0;
            for (int k = 0; k < 3; k++) mean[k] = film->all[pixel][k] / (double)s->samples;
            film_put(s->format, s->srgb, job->film, at, mean);
            clipped += film_clips(mean);
            if (s->samples > 1) e = replicate_error(film, pixel, s->samples, job->split.share, &error.greatest);
            error_map_put(job->map, x, y, e);
            if (s->reference) error.true_sum += true_error(mean, s->reference + 3 * at);
            error.sum += e;
            error.squares += e * e;
        }
    job->map->tile[tile] = error;
    atomic_fetch_add_explicit(&job->clipped, clipped, memory_order_relaxed);
}

static void tile_turn(void *context, uint32_t tile, SampleStream *stream, bool first)
{
    Fixed *job = context;
    const RenderSettings *s = job->settings;
    TileRect r = tile_rect(&job->map->tiles, tile);
    TileFilm film;
    film.share_a = sample_share_a(s->samples);
    film.level_error = job->level_error + (size_t)tile * job->levels;
    memset(film.all, 0, sizeof film.all);
    memset(film.squares, 0, sizeof film.squares);
    memset(film.part, 0, sizeof film.part);
    stream_set_taker(stream, take_tile, &film);
    for (uint32_t k = 0; k < TILE_PIXELS; k++) {
        uint32_t x = r.x0 + tile_column(k), y = r.y0 + tile_row(k);
        if (x >= r.x1 || y >= r.y1) continue;
        stream_add_pixel(stream, s->x0 + x, s->y0 + y, (y - r.y0) * TILE + (x - r.x0), s->samples);
    }
    stream_flush(stream);
    write_tile(job, &film, tile);
    if (s->audits) put_guesses(job, &film, tile);
    if (first && s->progress) s->progress(s->progress_context, (double)tile / job->map->tiles.count);
}

/* ---- the audit ---- */

/* Draws of a turn: enough to fill streams. */
enum { TURN_DRAWS = 32 };

static void take_picture(void *context, const SampleStream *stream)
{
    AuditDraw *draw = context;
    for (const SampleRun *run = stream->run; run < stream->run + stream->runs; run++)
        for (uint32_t i = run->begin; i < run->end; i++)
            for (int k = 0; k < 3; k++) draw[run->slot].picture[k] += stream->colour[i][k];
}

/* The picture's own colours aren't kept: the samples of the pixels that were drawn are traced again. */
static void audit_turn(void *context, uint32_t turn, SampleStream *stream, bool first)
{
    (void)first;
    Fixed *job = context;
    const RenderSettings *s = job->settings;
    uint32_t begin = turn * TURN_DRAWS, end = begin + TURN_DRAWS < job->draws ? begin + TURN_DRAWS : job->draws;
    stream_set_taker(stream, take_picture, job->draw);
    for (uint32_t i = begin; i < end; i++)
        stream_add_pixel(stream, s->x0 + job->draw[i].x, s->y0 + job->draw[i].y, i, s->samples);
    stream_flush(stream);
    stream_set_taker(stream, audit_take_fresh, job->draw);
    for (uint32_t i = begin; i < end; i++) {
        for (int k = 0; k < 3; k++) job->draw[i].picture[k] /= (double)s->samples;
        audit_add_fresh(stream, job->draw, i, s->seed, 0);
    }
    stream_flush(stream);
}

static uint64_t picture_pixels(const ErrorMap *map) { return (uint64_t)map->tiles.width * map->tiles.height; }

/* The greatest power of two that isn't above n >= 1: so many samples are stratified best. */
static uint32_t power_below(uint32_t n)
{
    uint32_t power = 1;
    while (power <= n / 2) power *= 2;
    return power;
}

static bool audit_fixed(Fixed *job, Crew *crew, RenderStats *stats, MeanSquare *square, bool *agrees, Err *err)
{
    const RenderSettings *s = job->settings;
    uint64_t pixels = picture_pixels(job->map);
    uint32_t each = power_below(sample_share_a(s->samples));
    job->draws = audit_size(pixels * s->samples, s->samples + 2.0 * each);
    job->draw = malloc(job->draws * sizeof *job->draw);
    if (!job->draw) return err_memory(err, "the audit");
    audit_pick(&job->guess, s->seed, 0, job->draw, job->draws);
    for (uint32_t i = 0; i < job->draws; i++) {
        job->draw[i].samples = each;
        job->draw[i].picture_samples = s->samples;
    }
    bool ok = crew_run(crew, (job->draws + TURN_DRAWS - 1) / TURN_DRAWS, audit_turn, job, err);
    *square = audit_mean_square(job->draw, job->draws);
    *agrees = audit_agrees(job->draw, job->draws);
    free(job->draw);
    RenderStats fresh = crew_take_stats(crew);
    stats->audit_rays = stats_rays(&fresh);
    stats->audit_samples = fresh.samples;
    return ok;
}

/* ---- the whole ---- */

static void note_time(CurvePoint *point, const RenderSettings *s)
{
    point->wall_s = cpu_wall_s() - s->start_s;
    point->cpu_s = cpu_time_s();
}

/* The pictures of fewer samples, which took their part of the time since `begin`. */
static bool add_levels(const Fixed *job, const CurvePoint *begin, const CurvePoint *end, RenderOutcome *outcome, Err *err)
{
    uint32_t samples = job->settings->samples;
    for (uint32_t level = 0; level < job->levels && 2u << level < samples; level++) {
        double part = (double)(2u << level) / samples, sum = 0;
        for (uint32_t tile = 0; tile < job->map->tiles.count; tile++)
            sum += job->level_error[(size_t)tile * job->levels + level];
        CurvePoint point = {
            .wall_s = begin->wall_s + part * (end->wall_s - begin->wall_s),
            .cpu_s = begin->cpu_s + part * (end->cpu_s - begin->cpu_s),
            .rays = (uint64_t)(part * (double)end->rays),
            .samples = picture_pixels(job->map) * (2u << level),
            .predicted = sqrt(sum / (double)picture_pixels(job->map)),
            .greatest_diff = NAN,
            .unfinished = 1,
        };
        if (!outcome_add_point(outcome, &point, err)) return false;
    }
    return true;
}

static bool judge_fixed(Fixed *job, const CurvePoint *begin, Crew *crew, RenderStats *stats, RenderOutcome *outcome,
                        Err *err)
{
    const RenderSettings *s = job->settings;
    bool has_replicates = s->samples > 1;
    TileError sum = error_map_sum(job->map);
    uint64_t pixels = picture_pixels(job->map);
    CurvePoint point = {.predicted = NAN, .greatest_diff = NAN, .audited = s->audits, .rays = stats_rays(stats)};
    note_time(&point, s);
    if (!add_levels(job, begin, &point, outcome, err)) return false;
    MeanSquare square = {NAN, NAN};
    bool agrees = sum.sum == 0;
    if (has_replicates) {
        if (!outcome_set_pixel_error(outcome, err)) return false;
        square = replicate_mean_square(&sum, pixels, job->split.doubt);
        point.predicted = sqrt(square.mean);
        point.greatest_diff = sum.greatest;
    }
    if (s->audits) {
        MeanSquare audited;
        bool fresh_agree = false;
        if (!audit_fixed(job, crew, stats, &audited, &fresh_agree, err)) return false;
        agrees = agrees && fresh_agree;
        point.audit = root_estimate(audited, ERROR_ALPHA);
        square = has_replicates ? agreed_mean_square(audited, square) : audited;
    }
    outcome->rmse = root_estimate(square, ERROR_ALPHA);
    if (agrees && (has_replicates || s->audits))
        point.audit.high = outcome->rmse.high = audit_unseen(pixels, s->samples, ERROR_ALPHA);
    outcome->clipped = job->clipped;
    outcome_set_true_error(outcome, s);
    note_time(&point, s);
    point.rays += stats->audit_rays;
    point.samples = stats->samples;
    return outcome_add_point(outcome, &point, err);
}

static bool render_fixed(Crew *crew, const RenderSettings *s, void *film, RenderStats *stats, RenderOutcome *outcome,
                         Err *err)
{
    Fixed job = {.settings = s, .film = film, .map = &outcome->map};
    CurvePoint begin;
    note_time(&begin, s);
    if (s->samples > 1) job.split = replicate_split(sample_share_a(s->samples), s->samples / 2);
    while (2u << job.levels <= s->samples) job.levels++;
    job.level_error = calloc((size_t)job.map->tiles.count * job.levels + 1, sizeof *job.level_error);
    if (!job.level_error) return err_memory(err, "the curve of error");
    bool ok = (!s->audits || error_map_create(&job.guess, job.map->tiles.width, job.map->tiles.height, err)) &&
              crew_run(crew, job.map->tiles.count, tile_turn, &job, err);
    *stats = crew_take_stats(crew);
    ok = ok && judge_fixed(&job, &begin, crew, stats, outcome, err);
    error_map_destroy(&job.guess);
    free(job.level_error);
    return ok;
}

bool render(const World *world, const RenderSettings *settings, void *film, RenderStats *stats, RenderOutcome *outcome,
            Err *err)
{
    double wall = cpu_wall_s(), cpu = cpu_time_s();
    *stats = (RenderStats){0};
    *outcome = (RenderOutcome){.point = NULL};
    Crew crew;
    if (!error_map_create(&outcome->map, settings->x1 - settings->x0, settings->y1 - settings->y0, err)) return false;
    uint32_t tiles = outcome->map.tiles.count, threads = settings->threads < tiles ? settings->threads : tiles;
    bool ok = crew_create(&crew, world, settings, threads, err);
    if (ok) {
        ok = settings->samples ? render_fixed(&crew, settings, film, stats, outcome, err)
                               : render_adaptive(&crew, settings, film, stats, outcome, err);
        stats->threads = crew.threads;
        crew_destroy(&crew);
    }
    if (!ok) outcome_destroy(outcome);
    stats->wall_s = cpu_wall_s() - wall;
    stats->cpu_s = cpu_time_s() - cpu;
    return ok;
}
