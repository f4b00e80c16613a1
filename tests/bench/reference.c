/* The true error of a picture, by a sampler that has nothing in common with rt's but the tracing of rays:
 *   reference make SCENE WxH SAMPLES OUT    two halves, OUT-1.pfm and OUT-2.pfm, of so many samples a pixel each
 *   reference shrink PICTURE FACTOR HALF.pfm   a half from a picture FACTOR times as wide and high (another program's)
 *   reference judge PICTURE OUT             RMSE of the picture against them, and that figure's standard error
 * Samples are plain random numbers of xoshiro256++ (Blackman, Vigna 2021), each pixel and half a sequence of its own; sums
 * are doubles. With independent halves r1 and r2 the mean of (y - r1)(y - r2) is the mean of (y - truth)^2 without bias,
 * whatever noise the halves have. */
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "common/cpu.h"
#include "common/err.h"
#include "common/parallel.h"
#include "render/shade.h"
#include "scene/compile.h"
#include "scene_lua.h"
#include "tools/image.h"
#include "tools/outfile.h"
#include "tools/pfm.h"

enum { HALVES = 2, SKIPPED_NUMBERS = 8, PATH_LENGTH = 4096 };

/* ---- random numbers ---- */

typedef struct { uint64_t s[4]; } Xoshiro;

static uint64_t rotate(uint64_t x, int k) { return x << k | x >> (64 - k); }

static uint64_t xoshiro_next(Xoshiro *x)
{
    uint64_t *s = x->s, result = rotate(s[0] + s[3], 23) + s[0], t = s[1] << 17;
    s[2] ^= s[0];
    s[3] ^= s[1];
    s[1] ^= s[2];
    s[0] ^= s[3];
    s[2] ^= t;
    s[3] = rotate(s[3], 45);
    return result;
}

static double xoshiro_double(Xoshiro *x) { return (double)(xoshiro_next(x) >> 11) * 0x1p-53; }

/* The state is the pixel and the half beside digits of pi; the first numbers, which still show that, are dropped. */
static Xoshiro xoshiro_seed(uint64_t pixel, uint64_t half)
{
    Xoshiro x = {{0x243f6a8885a308d3u, 0x13198a2e03707344u, pixel * 0x9e3779b97f4a7c15u, half + 1}};
    for (int i = 0; i < SKIPPED_NUMBERS; i++) xoshiro_next(&x);
    return x;
}

/* ---- the reference ---- */

typedef struct {
    Shader *shader;
    Scratch scratch;
    RenderStats stats;
    Ray ray[STREAM_RAYS];
    Rgb missed[STREAM_RAYS];
    double colour[STREAM_RAYS][3];
} Worker;

typedef struct {
    const char *out;
    uint32_t width, height, samples;
    uint32_t renders;         /* calls of gr.render so far; the first one's picture is made */
    /* While it is made: */
    const World *world;
    const RenderJob *job;
    Worker **worker;
    float *film[HALVES];
} Reference;

/* The scene's own option, or the background that SPEC tells: 1 - y / height of blue, y = 0 being the lowest row. */
static Rgb background(const Reference *r, uint32_t y)
{
    const RenderOptions *options = &r->job->options;
    if (options->given & OPTION_BACKGROUND) return options->background;
    return rgb(0.5f, 0.3f, (float)(1 - (double)(r->height - 1 - y) / r->height));
}

static Ray camera_ray(const Reference *r, double x, double y)
{
    Vec3 d = vec3_at(r->world->camera.forward, x / r->width * 2 - 1, r->world->camera.right);
    return (Ray){r->world->camera.eye, vec3_at(d, 1 - y / r->height * 2, r->world->camera.up), 0, INFINITY};
}

/* One pixel of one half. */
static void sample_pixel(const Reference *r, Worker *w, uint32_t x, uint32_t y, uint32_t half)
{
    size_t pixel = (size_t)y * r->width + x;
    Xoshiro random = xoshiro_seed(pixel, half);
    const RenderOptions *options = &r->job->options;
    uint32_t depth = options->given & OPTION_MAX_DEPTH ? options->max_depth : DEFAULT_MAX_DEPTH;
    double sum[3] = {0, 0, 0};
    for (uint32_t done = 0; done < r->samples;) {
        uint32_t n = r->samples - done < STREAM_RAYS ? r->samples - done : STREAM_RAYS;
        for (uint32_t i = 0; i < n; i++) {
            double at_x = xoshiro_double(&random), at_y = xoshiro_double(&random);
            w->ray[i] = camera_ray(r, x + at_x, y + at_y);
            w->missed[i] = background(r, y);
        }
        shade_stream(r->world, w->shader, w->ray, w->missed, n, depth, w->colour, &w->stats, &w->scratch);
        for (uint32_t i = 0; i < n; i++)
            for (int k = 0; k < 3; k++) sum[k] += w->colour[i][k];
        done += n;
    }
    for (int k = 0; k < 3; k++) r->film[half][3 * pixel + (size_t)k] = (float)(sum[k] / r->samples);
}

static void row_turn(void *context, uint32_t turn, uint32_t worker)
{
    const Reference *r = context;
    for (uint32_t x = 0; x < r->width; x++) sample_pixel(r, r->worker[worker], x, turn / HALVES, turn % HALVES);
}

static bool make_worker(Worker **worker, Err *err)
{
    Worker *w = *worker = calloc(1, sizeof *w);
    if (!w) return err_memory(err, "a worker");
    w->shader = shader_create();
    w->scratch.arena = arena_create();
    return (w->shader && w->scratch.arena) || err_memory(err, "a worker");
}

static void free_worker(Worker *w)
{
    if (!w) return;
    shader_destroy(w->shader);
    arena_destroy(w->scratch.arena);
    free(w);
}

static void half_path(char path[PATH_LENGTH], const char *out, int half)
{
    snprintf(path, PATH_LENGTH, "%s-%d.pfm", out, half + 1);
}

static bool write_half(const char *path, const float *rgb, uint32_t width, uint32_t height, Err *err)
{
    uint8_t *data;
    size_t size;
    Outfile *file = outfile_open(path, err);
    if (!file) return false;
    if (!pfm_encode(rgb, width, height, &data, &size, err)) {
        outfile_abandon(file);
        return false;
    }
    bool ok = outfile_commit(file, data, size, err);
    free(data);
    return ok;
}

static bool sample_all(Reference *r, Err *err)
{
    uint32_t threads = cpu_allowed();
    Worker **worker = calloc(threads, sizeof *worker);
    bool ok = worker != NULL || err_memory(err, "the workers");
    for (uint32_t i = 0; ok && i < threads; i++) ok = make_worker(&worker[i], err);
    for (int i = 0; ok && i < HALVES; i++) {
        r->film[i] = calloc((size_t)r->width * r->height * 3, sizeof *r->film[i]);
        ok = r->film[i] || err_memory(err, "the reference");
    }
    if (ok) {
        r->worker = worker;
        parallel_for(threads, r->height * HALVES, row_turn, r);
        for (uint32_t i = 0; ok && i < threads; i++) ok = !worker[i]->scratch.out_of_memory || err_memory(err, "the rays");
    }
    for (int i = 0; ok && i < HALVES; i++) {
        char path[PATH_LENGTH];
        half_path(path, r->out, i);
        ok = write_half(path, r->film[i], r->width, r->height, err);
    }
    for (uint32_t i = 0; worker && i < threads; i++) free_worker(worker[i]);
    free(worker);
    for (int i = 0; i < HALVES; i++) free(r->film[i]);
    return ok;
}

static void ignore_warning(void *context, const char *text)
{
    (void)context;
    (void)text;
}

/* The sink of the script. */
static bool make_job(void *context, const RenderJob *asked, Err *err)
{
    Reference *r = context;
    if (r->renders++ > 0) return true;
    RenderJob job = *asked;
    job.width = r->width;
    job.height = r->height;
    CompileSettings settings = {.warn = ignore_warning, .threads = cpu_allowed(), .split = true};
    CompileStats stats;
    World *world = world_compile(&job, &settings, &stats, err);
    if (!world) return false;
    r->job = &job;
    r->world = world;
    bool ok = sample_all(r, err);
    world_destroy(world);
    return ok;
}

static bool make(char **argv, Err *err)
{
    Reference r = {.out = argv[3]};
    if (sscanf(argv[1], "%ux%u", &r.width, &r.height) != 2 || sscanf(argv[2], "%u", &r.samples) != 1 || r.width == 0 ||
        r.height == 0 || r.samples == 0)
        return err_set(err, ERR_USAGE, "%s %s: no size and samples", argv[1], argv[2]);
    SceneScript script = {.script = argv[0]};
    RenderSink sink = {.render = make_job, .warn = ignore_warning, .context = &r};
    return scene_lua_run(&script, &sink, err) && (r.renders > 0 || err_set(err, ERR_SCENE, "%s renders nothing", argv[0]));
}

/* ---- halves of other programs ---- */

/* Each pixel is the mean of factor x factor. */
static bool shrink(char **argv, Err *err)
{
    uint32_t factor;
    Image image;
    if (sscanf(argv[1], "%u", &factor) != 1 || factor == 0) return err_set(err, ERR_USAGE, "%s: no factor", argv[1]);
    if (!image_load(argv[0], &image, err)) return false;
    uint32_t width = image.width / factor, height = image.height / factor;
    float *rgb = malloc(((size_t)width * height * 3 + 1) * sizeof *rgb);
    bool ok = rgb || err_memory(err, "the half");
    for (uint32_t y = 0; ok && y < height; y++)
        for (uint32_t i = 0; i < 3 * width; i++) {
            double sum = 0;
            for (uint32_t row = y * factor; row < (y + 1) * factor; row++)
                for (uint32_t x = i / 3 * factor; x < (i / 3 + 1) * factor; x++)
                    sum += (double)image.rgb[3 * ((size_t)row * image.width + x) + i % 3];
            rgb[(size_t)y * width * 3 + i] = (float)(sum / image.white / ((double)factor * factor));
        }
    ok = ok && write_half(argv[2], rgb, width, height, err);
    free(rgb);
    image_free(&image);
    return ok;
}

/* ---- the judgement ---- */

typedef struct { double rmse, standard_error; } TrueError;

/* With r1 = truth + n1, r2 = truth + n2 and e = y - truth, (y - r1)(y - r2) = e^2 - e (n1 + n2) + n1 n2. Beside m, the mean
 * of the halves, and d, their difference, whose squares are on average twice the noise's, the noise's share of the variance
 * is ((y - m) d)^2 + d^4 / 12: the mean of d^4 is 12 times the square of the noise's variance if it is Gaussian. Channels of
 * a pixel are one draw, pixels are independent. */
static TrueError judge(const Image *y, const Image *r1, const Image *r2)
{
    size_t pixels = (size_t)y->width * y->height;
    double sum = 0, variance = 0;
    for (size_t i = 0; i < pixels; i++) {
        double cross = 0, square = 0;
        for (size_t k = 3 * i; k < 3 * i + 3; k++) {
            double a = (double)y->rgb[k] / y->white - (double)r1->rgb[k], b = (double)y->rgb[k] / y->white - (double)r2->rgb[k];
            sum += a * b;
            cross += (a + b) / 2 * (a - b);
            square += (a - b) * (a - b);
        }
        variance += cross * cross + square * square / 12;
    }
    double count = 3 * (double)pixels, rmse = sqrt(fmax(0, sum / count));
    double mse_error = sqrt(variance) / count;
    return (TrueError){rmse, rmse > 0 ? mse_error / (2 * rmse) : sqrt(mse_error)};
}

static bool judge_picture(char **argv, Err *err)
{
    Image image[3] = {{.rgb = NULL}};
    char path[HALVES][PATH_LENGTH];
    for (int i = 0; i < HALVES; i++) half_path(path[i], argv[1], i);
    bool ok = image_load(argv[0], &image[0], err) && image_load(path[0], &image[1], err) && image_load(path[1], &image[2], err);
    for (int i = 1; ok && i < 3; i++)
        if (image[i].width != image[0].width || image[i].height != image[0].height)
            ok = err_set(err, ERR_USAGE, "%s and %s differ in size", argv[0], path[i - 1]);
    if (ok) {
        TrueError e = judge(&image[0], &image[1], &image[2]);
        printf("%.9g %.9g\n", e.rmse, e.standard_error);
    }
    for (int i = 0; i < 3; i++) image_free(&image[i]);
    return ok;
}

int main(int argc, char **argv)
{
    static const struct { const char *name; int words; bool (*run)(char **argv, Err *err); } command[] = {
        {"make", 4, make}, {"shrink", 3, shrink}, {"judge", 2, judge_picture},
    };
    Err err = {ERR_USAGE, "make SCENE WxH SAMPLES OUT | shrink PICTURE FACTOR HALF.pfm | judge PICTURE OUT"};
    for (size_t i = 0; i < sizeof command / sizeof command[0]; i++)
        if (argc == command[i].words + 2 && strcmp(argv[1], command[i].name) == 0 && command[i].run(argv + 2, &err)) return 0;
    fprintf(stderr, "reference: %s\n", err.text);
    return (int)err.kind;
}
