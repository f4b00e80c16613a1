#include "render.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "common/cpu.h"
#include "common/parallel.h"
#include "render/sample.h"
#include "render/shade.h"

/* Pixels of a tile's side: a tile's samples share the upper nodes of the BVH, and a 512 x 512 picture has 1,024 of them
 * to spread over threads. */
enum { TILE = 16 };

typedef struct Worker Worker;

typedef struct {
    const World *world;
    const RenderSettings *settings;
    void *film;
    uint32_t tiles_x, tiles_y;
    Worker **worker;         /* one for each thread */
    atomic_bool failed;      /* out of memory: no more tiles */
} Job;

struct Worker {
    Job *job;
    Shader *shader;
    Scratch scratch;
    RenderStats stats;
    bool reports;            /* calls settings->progress */
    /* The stream being filled: its samples belong to the tile's pixels in order. */
    Ray ray[STREAM_RAYS];
    Rgb missed[STREAM_RAYS];
    double colour[STREAM_RAYS][3];
    uint16_t pixel[STREAM_RAYS];
    uint32_t sample[STREAM_RAYS];
    uint32_t count;
    uint32_t x0, y0;         /* of the tile */
    double film[TILE * TILE][3];
};

/* SPEC: (0.5, 0.3, 1 - y/h), y = 0 for the bottom row. */
static Rgb background(const RenderSettings *s, uint32_t row)
{
    if (s->has_background) return s->background;
    double y = (double)(s->height - 1 - row);
    return rgb(0.5f, 0.3f, (float)(1 - y / (double)s->height));
}

static Ray camera_ray(const World *world, const RenderSettings *s, double x, double y)
{
    double right = 2 * x / (double)s->width - 1, up = 1 - 2 * y / (double)s->height;
    Vec3 d = vec3_at(vec3_at(world->camera.forward, right, world->camera.right), up, world->camera.up);
    return (Ray){world->camera.eye, d, 0, INFINITY};
}

static bool comes_before(const RenderStats *a, const RenderStats *b)
{
    if (a->first_y != b->first_y) return a->first_y < b->first_y;
    if (a->first_x != b->first_x) return a->first_x < b->first_x;
    return a->first_sample < b->first_sample;
}

/* Adds those of s to *sum and keeps the first place of all. */
static void add_not_finite(RenderStats *sum, const RenderStats *s)
{
    if (s->not_finite && (!sum->not_finite || comes_before(s, sum))) {
        sum->first_x = s->first_x;
        sum->first_y = s->first_y;
        sum->first_sample = s->first_sample;
    }
    sum->not_finite += s->not_finite;
}

static void flush(Worker *w)
{
    const RenderSettings *s = w->job->settings;
    shade_stream(w->job->world, w->shader, w->ray, w->missed, w->count, s->max_depth, w->colour, &w->stats, &w->scratch);
    for (uint32_t i = 0; i < w->count; i++) {
        const double *c = w->colour[i];
        if (!isfinite(c[0] + c[1] + c[2])) {
            uint32_t x = w->x0 + w->pixel[i] % TILE, y = w->y0 + w->pixel[i] / TILE;
            add_not_finite(&w->stats, &(RenderStats){.not_finite = 1, .first_x = x, .first_y = y,
                                                     .first_sample = w->sample[i]});
            continue;
        }
        for (int k = 0; k < 3; k++) w->film[w->pixel[i]][k] += c[k];
    }
    w->stats.samples += w->count;
    w->count = 0;
}

static void write_tile(const Worker *w, uint32_t x0, uint32_t y0, uint32_t x1, uint32_t y1)
{
    const RenderSettings *s = w->job->settings;
    for (uint32_t y = y0; y < y1; y++)
        for (uint32_t x = x0; x < x1; x++) {
            const double *sum = w->film[(y - y0) * TILE + (x - x0)];
            double mean[3];
            for (int k = 0; k < 3; k++) mean[k] = sum[k] / (double)s->samples;
            film_put(s->format, s->srgb, w->job->film, (size_t)(y - s->y0) * (s->x1 - s->x0) + (x - s->x0), mean);
        }
}

static void add_sample(Worker *w, Ray ray, Rgb miss, uint16_t pixel, uint32_t sample)
{
    w->ray[w->count] = ray;
    w->missed[w->count] = miss;
    w->pixel[w->count] = pixel;
    w->sample[w->count] = sample;
    if (++w->count == STREAM_RAYS) flush(w);
}

/* A pixel's samples: those of replicate A, then those of B. One sample is the pixel's centre. */
static void add_pixel(Worker *w, uint32_t x, uint32_t y, uint16_t pixel)
{
    const RenderSettings *s = w->job->settings;
    const World *world = w->job->world;
    Rgb miss = background(s, y);
    if (s->samples == 1) {
        add_sample(w, camera_ray(world, s, x + 0.5, y + 0.5), miss, pixel, 0);
        return;
    }
    uint32_t share_a = sample_share_a(s->samples);
    uint64_t key = sample_key(s->seed, x, y, 0);
    for (uint32_t i = 0; i < s->samples; i++) {
        if (i == share_a) key = sample_key(s->seed, x, y, 1);
        Sample2 at = sample_place(key, i < share_a ? i : i - share_a);
        add_sample(w, camera_ray(world, s, x + at.x, y + at.y), miss, pixel, i);
    }
}

/* The even bits of a number, moved together: pixels in the order of a Z curve (Morton 1966) stay near each other. */
static uint32_t even_bits(uint32_t x)
{
    x &= 0x55;
    x = (x | x >> 1) & 0x33;
    return (x | x >> 2) & 0x0f;
}

static void render_tile(Worker *w, uint32_t tile)
{
    const RenderSettings *s = w->job->settings;
    uint32_t x0 = s->x0 + tile % w->job->tiles_x * TILE, y0 = s->y0 + tile / w->job->tiles_x * TILE;
    uint32_t x1 = x0 + TILE < s->x1 ? x0 + TILE : s->x1, y1 = y0 + TILE < s->y1 ? y0 + TILE : s->y1;
    memset(w->film, 0, sizeof w->film);
    w->x0 = x0;
    w->y0 = y0;
    for (uint32_t k = 0; k < TILE * TILE; k++) {
        uint32_t x = x0 + even_bits(k), y = y0 + even_bits(k >> 1);
        if (x >= x1 || y >= y1) continue;
        add_pixel(w, x, y, (uint16_t)((y - y0) * TILE + (x - x0)));
    }
    if (w->count) flush(w);
    write_tile(w, x0, y0, x1, y1);
}

static void tile_turn(void *context, uint32_t tile, uint32_t worker)
{
    Job *job = context;
    Worker *w = job->worker[worker];
    if (atomic_load_explicit(&job->failed, memory_order_relaxed)) return;
    render_tile(w, tile);
    if (w->scratch.out_of_memory) atomic_store_explicit(&job->failed, true, memory_order_relaxed);
    double share = (double)tile / (job->tiles_x * job->tiles_y);
    if (w->reports) job->settings->progress(job->settings->progress_context, share);
}

static void worker_destroy(Worker *w)
{
    if (!w) return;
    shader_destroy(w->shader);
    arena_destroy(w->scratch.arena);
    free(w);
}

static Worker *worker_create(Job *job)
{
    Worker *w = calloc(1, sizeof *w);
    if (!w) return NULL;
    w->job = job;
    w->shader = shader_create();
    w->scratch.arena = arena_create();
    if (w->shader && w->scratch.arena) return w;
    worker_destroy(w);
    return NULL;
}

static void add_stats(RenderStats *sum, const RenderStats *s)
{
    sum->camera_rays += s->camera_rays;
    sum->shadow_rays += s->shadow_rays;
    sum->mirror_rays += s->mirror_rays;
    sum->samples += s->samples;
    add_not_finite(sum, s);
}

bool render(const World *world, const RenderSettings *settings, void *film, RenderStats *stats, Err *err)
{
    double wall = cpu_wall_s(), cpu = cpu_time_s();
    *stats = (RenderStats){0};
    Job job = {.world = world, .settings = settings, .film = film};
    job.tiles_x = (settings->x1 - settings->x0 + TILE - 1) / TILE;
    job.tiles_y = (settings->y1 - settings->y0 + TILE - 1) / TILE;
    uint32_t tiles = job.tiles_x * job.tiles_y, wanted = settings->threads < tiles ? settings->threads : tiles;
    Worker **worker = calloc(wanted, sizeof *worker);
    if (!worker) return err_memory(err, "the render threads");

    uint32_t n = 0;
    while (n < wanted && (worker[n] = worker_create(&job))) n++;
    job.worker = worker;
    if (n > 0) {
        worker[0]->reports = settings->progress != NULL;
        stats->threads = parallel_for(n, tiles, tile_turn, &job);
    }
    for (uint32_t i = 0; i < n; i++) {
        add_stats(stats, &worker[i]->stats);
        worker_destroy(worker[i]);
    }
    free(worker);
    stats->wall_s = cpu_wall_s() - wall;
    stats->cpu_s = cpu_time_s() - cpu;
    if (n == 0) return err_memory(err, "the render threads");
    if (atomic_load(&job.failed)) return err_memory(err, "the rays' scratch memory");
    return true;
}
