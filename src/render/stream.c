#include "render/stream.h"

#include <math.h>
#include <stdlib.h>

#include "common/wide.h"
#include "render/sample.h"

SampleStream *stream_create(const World *world, const RenderSettings *settings)
{
    SampleStream *stream = calloc(1, sizeof *stream);
    if (!stream) return NULL;
    stream->world = world;
    stream->settings = settings;
    stream->shader = shader_create();
    stream->scratch.arena = arena_create();
    if (stream->shader && stream->scratch.arena) return stream;
    stream_destroy(stream);
    return NULL;
}

void stream_destroy(SampleStream *stream)
{
    if (!stream) return;
    shader_destroy(stream->shader);
    arena_destroy(stream->scratch.arena);
    free(stream);
}

void stream_set_taker(SampleStream *stream, StreamTaker *take, void *context)
{
    stream->take = take;
    stream->context = context;
}

/* SPEC: (0.5, 0.3, 1 - y/h), y = 0 for the bottom row. */
static Rgb background(const RenderSettings *s, uint32_t row)
{
    if (s->has_background) return s->background;
    double y = (double)(s->height - 1 - row);
    return rgb(0.5f, 0.3f, (float)(1 - y / (double)s->height));
}

/* The directions of the camera rays through points of the picture. */
WIDE static void camera_directions(const World *world, double width, double height, const double *restrict x,
                                   const double *restrict y, Ray *restrict ray, uint32_t n)
{
    Vec3 forward = world->camera.forward, to_right = world->camera.right, to_up = world->camera.up;
    for (uint32_t i = 0; i < n; i++) {
        double right = 2 * x[i] / width - 1, up = 1 - 2 * y[i] / height;
        ray[i].d = vec3_at(vec3_at(forward, right, to_right), up, to_up);
    }
}

/* The rays of all samples. */
static void make_rays(SampleStream *s)
{
    sample_places(s->low, s->high, s->index, s->x, s->y, s->count);
    for (const SampleRun *run = s->run; run < s->run + s->runs; run++) {
        double x = run->x, y = run->y;
        if (run->centre) s->x[run->begin] = s->y[run->begin] = 0.5;
        for (uint32_t i = run->begin; i < run->end; i++) {
            s->x[i] += x;
            s->y[i] += y;
        }
    }
    for (uint32_t i = 0; i < s->count; i++) {
        s->ray[i].o = s->world->camera.eye;
        s->ray[i].tmin = 0;
        s->ray[i].tmax = INFINITY;
    }
    camera_directions(s->world, s->settings->width, s->settings->height, s->x, s->y, s->ray, s->count);
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
        sum->first_total = s->first_total;
    }
    sum->not_finite += s->not_finite;
}

void stats_add(RenderStats *sum, const RenderStats *s)
{
    sum->camera_rays += s->camera_rays;
    sum->shadow_rays += s->shadow_rays;
    sum->mirror_rays += s->mirror_rays;
    sum->samples += s->samples;
    sum->dropped += s->dropped;
    add_not_finite(sum, s);
}

static void count_not_finite(SampleStream *s, const SampleRun *run, uint32_t i)
{
    add_not_finite(&s->stats, &(RenderStats){.not_finite = 1, .first_x = run->x, .first_y = run->y,
                                             .first_sample = run->number + (i - run->begin), .first_total = run->total});
}

void stream_flush(SampleStream *s)
{
    if (s->count == 0) return;
    make_rays(s);
    shade_stream(s->world, s->shader, s->ray, s->missed, s->count, s->settings->max_depth, s->colour, &s->stats,
                 &s->scratch);
    for (uint32_t r = 0; r < s->runs; r++)
        for (uint32_t i = s->run[r].begin; i < s->run[r].end; i++) {
            double *c = s->colour[i];
            if (isfinite(c[0] + c[1] + c[2])) continue;
            count_not_finite(s, &s->run[r], i);
            c[0] = c[1] = c[2] = 0;
        }
    s->stats.samples += s->count;
    s->take(s->context, s);
    s->count = s->runs = 0;
}

/* Begins a run that has room for at least one sample. */
static SampleRun *begin_run(SampleStream *s, const SampleRun *like)
{
    if (s->count == STREAM_RAYS) stream_flush(s);
    SampleRun *run = &s->run[s->runs++];
    *run = *like;
    run->begin = run->end = s->count;
    return run;
}

void stream_add_replicate(SampleStream *stream, SampleRun like, uint64_t seed, uint32_t replicate, uint32_t first,
                          uint32_t end)
{
    Rgb miss = background(stream->settings, like.y);
    uint64_t key = like.centre ? 0 : sample_key(seed, like.x, like.y, replicate);
    for (uint32_t i = first; i < end;) {
        SampleRun *run = begin_run(stream, &like);
        uint32_t room = STREAM_RAYS - stream->count, n = end - i < room ? end - i : room;
        for (uint32_t stop = i + n; i < stop; i++, stream->count++) {
            stream->low[stream->count] = (uint32_t)key;
            stream->high[stream->count] = (uint32_t)(key >> 32);
            stream->index[stream->count] = i;
            stream->missed[stream->count] = miss;
        }
        run->end = stream->count;
        like.number += n;
    }
}

void stream_add_pixel(SampleStream *stream, uint32_t x, uint32_t y, uint32_t slot, uint32_t samples)
{
    uint64_t seed = stream->settings->seed;
    SampleRun like = {.x = x, .y = y, .slot = slot, .total = samples, .centre = samples == 1};
    uint32_t share_a = sample_share_a(samples);
    stream_add_replicate(stream, like, seed, 0, 0, share_a);
    like.number = share_a;
    stream_add_replicate(stream, like, seed, 1, 0, samples - share_a);
}
