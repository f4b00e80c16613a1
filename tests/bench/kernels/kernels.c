/* The kernels against Embree: the very same triangles and rays, the same threads, taking turns; the median of each.
 *
 *     kernels [--mesh terrain|scan|room|thin] [--triangles N] [--rays camera|shadow|bounce] [--threads N]
 *             [--repeat N] [--size N] [--part rows|build|sweep] [--json FILE]
 *
 * Rays per mesh: size x size (1024) camera rays, in the order in which the renderer makes them, a shadow ray for each hit
 * to a point light, a cosine-distributed bounce for each hit. All numbers are floats, so both trace the same rays.
 * Answers are compared first. A row where rt is wrong about a ray, or Embree about more than EMBREE_WRONG of them, has no
 * speed.
 *
 * rt's time is that of world_intersect and world_occluded in streams of 512 rays, on the World that world_compile makes of
 * a scene with this one mesh: the walk to the object, the way of each ray into the mesh's own space unless the mesh is
 * baked ("moved" or "baked" in the table), and the writing of whole Hits. Embree's is that of its calls; its rays are
 * made ready in the layout that the call wants outside of the time. */
#include <math.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "accel/accel.h"
#include "accel/kernel.h"
#include "accel/mesh_prim.h"
#include "bench/kernels/embree.h"
#include "bench/kernels/judge.h"
#include "bench/kernels/shapes.h"
#include "bench/kernels/workers.h"
#include "common/cpu.h"
#include "common/rng.h"
#include "render/tiles.h"
#include "support/check.h"
#include "support/world_fixture.h"

enum { SEED = 20261126, STREAM = 512, MAX_THREADS = 64, MAX_REPEAT = 99, BUILD_REPEAT = 5, LARGE_REPEAT = 3 };

/* Meshes whose builds are repeated LARGE_REPEAT times only. */
#define LARGE 2000000u

/* New rays start this far off the surface, the world's reach being 1 at most: 2^9 roundings of a float coordinate. */
#define OFFSET 0x1p-15

/* The same t: floats give a t that is off by a few roundings of the coordinates, divided by the cosine. */
#define SAME_T 0x1p-12
#define SAME_PLACE 0x1p-18

/* So many times more may it be off on the same triangle, seen nearly edge on. */
#define GRAZING 64

/* Robust Embree is right but for the rounding of its floats; beyond this share something else is wrong. */
#define EMBREE_WRONG 1e-3

/* Rays about which the two differ that are judged; of more, so many evenly. */
enum { JUDGED = 200 };

typedef enum { CAMERA, SHADOW, BOUNCE, KINDS } Kind;
static const char *const kind_name[KINDS] = {"camera", "shadow", "bounce"};

/* What is measured: rows of the table, and the sweep of one shape over its size. */
typedef struct { const char *mesh; uint32_t triangles; bool row, sweep; } Config;
static const Config configs[] = {
    {"scan", 6000, true, false},      {"scan", 70000, true, false},     {"scan", 1000000, true, false},
    {"room", 70000, true, false},     {"room", 1000000, true, false},   {"thin", 70000, true, false},
    {"thin", 1000000, true, false},   {"terrain", 10000, false, true},  {"terrain", 70000, true, true},
    {"terrain", 300000, false, true}, {"terrain", 1000000, true, true}, {"terrain", 3000000, false, true},
    {"terrain", 10000000, true, true}};

typedef enum { PART_ROWS = 1, PART_BUILD = 2, PART_SWEEP = 4 } Part;

typedef struct {
    const char *mesh, *json;
    uint32_t triangles, threads, repeat, size;
    int rays;        /* a Kind, -1: all */
    unsigned parts;
} Options;

typedef struct {
    const char *mesh, *place;
    uint32_t triangles, threads;
    Kind kind;
    size_t rays, differ[2], judged;             /* differ: from robust, from fast Embree */
    size_t wrong, embree_wrong[2];
    int way[2];
    double rt_s, embree_s[2];                   /* medians */
    double others;                              /* greatest share of wall time that was not the run's own */
} Row;

typedef struct {
    const char *mesh;
    uint32_t triangles, threads;
    double rt_s, embree_s, rt_bytes, embree_bytes, embree_peak_bytes;  /* bytes: of a triangle */
} BuildRow;

typedef struct { const char *mesh; uint32_t triangles; double rt_ns, embree_ns, fast_ns; } SweepRow;

typedef struct {
    Options options;
    Row row[256];
    BuildRow build[64];
    SweepRow sweep[64];
    uint32_t rows, builds, sweeps;
    char embree[128];
} Bench;

/* A mesh as both have it, and its rays. */
typedef struct {
    const Config *config;
    WorldFixture fixture;
    Shape shape;              /* the fixture's scene owns the mesh */
    EmbreeScenes *scenes;
    Ray *ray[KINDS];
    size_t count[KINDS];
} Subject;

static double to_float(double x) { return (double)(float)x; }

static Vec3 to_floats(Vec3 v) { return vec3_make(to_float(v.x), to_float(v.y), to_float(v.z)); }

/* ---- rt's runs ---- */

typedef struct {
    const World *world;
    const Ray *ray;
    Hit *hit;         /* NULL: occlusion */
    bool *blocked;
    Scratch scratch[MAX_THREADS];
} ProgramRun;

static void program_run_init(ProgramRun *run, const World *world, const Ray *ray, size_t count, bool any)
{
    *run = (ProgramRun){.world = world, .ray = ray};
    if (any)
        run->blocked = calloc(count + 1, sizeof *run->blocked);
    else
        run->hit = calloc(count + 1, sizeof *run->hit);
    CHECK(run->hit || run->blocked);
    for (int i = 0; i < MAX_THREADS; i++) CHECK(run->scratch[i].arena = arena_create());
}

static void program_run_free(ProgramRun *run)
{
    for (int i = 0; i < MAX_THREADS; i++) arena_destroy(run->scratch[i].arena);
    free(run->hit);
    free(run->blocked);
}

static void program_trace(void *context, size_t first, size_t count, uint32_t worker)
{
    ProgramRun *run = context;
    Scratch *scratch = &run->scratch[worker];
    for (size_t i = first, end = first + count; i < end; i += STREAM) {
        size_t n = end - i < STREAM ? end - i : STREAM;
        if (run->hit)
            world_intersect(run->world, run->ray + i, NULL, run->hit + i, n, scratch);
        else
            world_occluded(run->world, run->ray + i, NULL, run->blocked + i, n, scratch);
    }
}

static EmbreeHit program_hit(const ProgramRun *run, size_t i)
{
    if (run->blocked) return (EmbreeHit){run->blocked[i] ? 0 : (double)INFINITY, 0};
    return run->hit[i].object == HIT_NONE ? (EmbreeHit){(double)INFINITY, 0} : (EmbreeHit){run->hit[i].t, run->hit[i].part};
}

/* ---- meshes and rays ---- */

static void make_camera_rays(Subject *s, uint32_t size)
{
    const World *world = s->fixture.world;
    Ray *ray = malloc((size_t)size * size * sizeof *ray);
    CHECK(ray);
    size_t n = 0;
    uint32_t tiles = (size + TILE - 1) / TILE;
    for (uint32_t tile = 0; tile < tiles * tiles; tile++)
        for (uint32_t k = 0; k < TILE * TILE; k++) {
            uint32_t x = tile % tiles * TILE + tile_column(k), y = tile / tiles * TILE + tile_row(k);
            if (x >= size || y >= size) continue;
            Vec3 d = vec3_at(world->camera.forward, 2 * (x + 0.5) / size - 1, world->camera.right);
            d = vec3_at(d, 1 - 2 * (y + 0.5) / size, world->camera.up);
            ray[n++] = (Ray){to_floats(world->camera.eye), to_floats(d), 0, INFINITY};
        }
    s->ray[CAMERA] = ray;
    s->count[CAMERA] = n;
}

static Vec3 random_unit(Rng *rng)
{
    for (;;) {
        double x = 2 * rng_double(rng) - 1, y = 2 * rng_double(rng) - 1, z = 2 * rng_double(rng) - 1;
        Vec3 v = vec3_make(x, y, z);
        double square = vec3_dot(v, v);
        if (square <= 1 && square > 0.01) return vec3_scale(v, 1 / sqrt(square));
    }
}

/* A shadow ray and a bounce for each hit of a camera ray. */
static void make_other_rays(Subject *s)
{
    const World *world = s->fixture.world;
    size_t n = s->count[CAMERA], hits = 0;
    ProgramRun run;
    program_run_init(&run, world, s->ray[CAMERA], n, false);
    program_trace(&run, 0, n, 0);
    s->ray[SHADOW] = malloc((n + 1) * sizeof *s->ray[SHADOW]);
    s->ray[BOUNCE] = malloc((n + 1) * sizeof *s->ray[BOUNCE]);
    CHECK(s->ray[SHADOW] && s->ray[BOUNCE]);
    Vec3 light = vec3_scale(s->shape.light, ldexp(1, -world->exponent));
    for (size_t i = 0; i < n; i++) {
        const Ray *from = &s->ray[CAMERA][i];
        if (run.hit[i].object == HIT_NONE) continue;
        const Vec3 *p = s->shape.mesh->position;
        const uint32_t *k = s->shape.mesh->triangle[run.hit[i].part];
        Vec3 normal = vec3_normalize(vec3_cross(vec3_sub(p[k[1]], p[k[0]]), vec3_sub(p[k[2]], p[k[0]])));
        if (vec3_dot(normal, from->d) > 0) normal = vec3_neg(normal);
        Vec3 o = to_floats(vec3_at(vec3_at(from->o, run.hit[i].t, from->d), OFFSET, normal));
        Rng rng = rng_seed(SEED, i);
        s->ray[SHADOW][hits] = (Ray){o, to_floats(vec3_sub(light, o)), 0, 1};
        s->ray[BOUNCE][hits++] = (Ray){o, to_floats(vec3_add(normal, random_unit(&rng))), 0, INFINITY};
    }
    s->count[SHADOW] = s->count[BOUNCE] = hits;
    program_run_free(&run);
}

static void subject_create(Subject *s, const Config *config)
{
    *s = (Subject){.config = config};
    shape_make(&s->shape, config->mesh, config->triangles);
    WorldFixture *f = &s->fixture;
    fixture_create(f);
    Node *node = fixture_node(f, NULL, NODE_MESH, config->mesh);
    node->mesh = scene_mesh_made(f->scene, MESH_TABLE);
    CHECK(node->mesh);
    node->mesh->loaded = s->shape.mesh;
    node->material = fixture_material(f, rgb(0.5f, 0.5f, 0.5f), rgb(0, 0, 0), 1, 0);
    f->job.eye = s->shape.eye;
    f->job.view = s->shape.view;
    f->job.fov_deg = s->shape.fov_deg;
    f->job.width = f->job.height = 1024;
    CHECK(fixture_compile(f));
}

static void subject_destroy(Subject *s)
{
    for (int k = 0; k < KINDS; k++) free(s->ray[k]);
    if (s->scenes) embree_scenes_destroy(s->scenes);
    fixture_destroy(&s->fixture);
}

/* ---- answers ---- */

static bool same_t(double a, double b, const Ray *ray, double times)
{
    if (a == b) return true;  /* two misses too */
    return fabs(a - b) <= times * (SAME_T * fmin(fabs(a), fabs(b)) + SAME_PLACE / vec3_max(vec3_abs(ray->d)));
}

static bool same_hit(EmbreeHit a, EmbreeHit b, const Ray *ray)
{
    return same_t(a.t, b.t, ray, a.part == b.part ? GRAZING : 1);
}

static bool right(EmbreeHit hit, const Truth *truth, const Ray *ray, bool any)
{
    if (any) return isfinite(hit.t) == isfinite(truth->with_edges) || isfinite(hit.t) == isfinite(truth->without_edges);
    return same_t(hit.t, truth->with_edges, ray, 1) || same_t(hit.t, truth->without_edges, ray, 1);
}

/* Compares all answers, then has those that differ judged. `embree` holds robust and fast answers. */
static void compare(Row *row, const Subject *s, const ProgramRun *run, EmbreeHit *const embree[2])
{
    const Ray *ray = s->ray[row->kind];
    size_t different = 0, judged = 0, stride;
    bool any = row->kind == SHADOW;
    for (size_t i = 0; i < row->rays; i++) {
        bool differs = false;
        for (int f = 0; f < 2; f++)
            if (!same_hit(program_hit(run, i), embree[f][i], &ray[i])) {
                row->differ[f]++;
                differs = true;
            }
        different += differs;
    }
    stride = different / JUDGED + 1;
    different = 0;
    for (size_t i = 0; i < row->rays; i++) {
        EmbreeHit ours = program_hit(run, i);
        bool same[2] = {same_hit(ours, embree[0][i], &ray[i]), same_hit(ours, embree[1][i], &ray[i])};
        if ((same[0] && same[1]) || different++ % stride) continue;
        Truth truth = judge_ray(s->shape.mesh, s->fixture.world->exponent, &ray[i]);
        bool wrong = !right(ours, &truth, &ray[i], any);
        judged++;
        row->wrong += wrong;
        for (int f = 0; f < 2; f++) row->embree_wrong[f] += !same[f] && !right(embree[f][i], &truth, &ray[i], any);
        if (wrong)
            fprintf(stderr, "rt is wrong: %s %u %s ray %zu: t %.17g triangle %u, true t %.17g or %.17g\n", row->mesh,
                    row->triangles, kind_name[row->kind], i, ours.t, ours.part, truth.with_edges, truth.without_edges);
    }
    row->judged = judged;
}

static bool row_is_right(const Row *row)
{
    double limit = EMBREE_WRONG * (double)row->rays;
    return row->wrong == 0 && (double)row->differ[0] <= limit && (double)row->differ[1] <= limit;
}

/* ---- times ---- */

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *x, uint32_t n)
{
    qsort(x, n, sizeof *x, by_size);
    return n % 2 ? x[n / 2] : (x[n / 2 - 1] + x[n / 2]) / 2;
}

/* Every PROBE-th chunk of the rays: chosen from the whole picture. */
enum { PROBE = 4, FINALISTS = 4 };

static void trace_sample(void *rays, size_t first, size_t count, uint32_t worker)
{
    embree_rays_trace(rays, PROBE * first, count, worker);
}

static double time_way(EmbreeRays *rays, Workers *workers, size_t count, int way, bool robust)
{
    embree_rays_prepare(rays, way, robust);
    if (count < PROBE * WORK_CHUNK) return workers_run(workers, embree_rays_trace, rays, count).cpu_s;
    return workers_run(workers, trace_sample, rays, count / (PROBE * WORK_CHUNK) * WORK_CHUNK).cpu_s;
}

/* The fastest way, robust and fast: each is tried once, the FINALISTS best of them twice more. */
static void find_best(EmbreeRays *rays, Workers *workers, size_t count, int best[2])
{
    for (int f = 0; f < 2; f++) {
        double time[EMBREE_WAYS];
        int order[EMBREE_WAYS];
        for (int way = 0; way < EMBREE_WAYS; way++) {
            time[way] = time_way(rays, workers, count, way, f == 0);
            int k = way;
            for (; k > 0 && time[order[k - 1]] > time[way]; k--) order[k] = order[k - 1];
            order[k] = way;
        }
        best[f] = order[0];
        for (int i = 0; i < 2 * FINALISTS; i++) {
            int way = order[i % FINALISTS];
            time[way] = fmin(time[way], time_way(rays, workers, count, way, f == 0));
        }
        for (int i = 1; i < FINALISTS; i++)
            if (time[order[i]] < time[best[f]]) best[f] = order[i];
    }
}

static void measure_row(Row *row, EmbreeRays *rays, ProgramRun *run, uint32_t repeat)
{
    Workers *workers = workers_create(row->threads);
    double time[3][MAX_REPEAT];
    for (uint32_t i = 0; i < repeat; i++)
        for (int k = 0; k < 3; k++) {
            if (k > 0) embree_rays_prepare(rays, row->way[k - 1], k == 1);
            WorkTime t = k > 0 ? workers_run(workers, embree_rays_trace, rays, row->rays)
                               : workers_run(workers, program_trace, run, row->rays);
            time[k][i] = t.cpu_s;
            row->others = fmax(row->others, 1 - t.cpu_s / t.wall_s);
        }
    row->rt_s = median(time[0], repeat);
    for (int f = 0; f < 2; f++) row->embree_s[f] = median(time[1 + f], repeat);
    workers_destroy(workers);
}

static double mrays(const Row *row, double s) { return (double)row->rays / s * 1e-6; }

static void print_row(const Row *row)
{
    char way[2][64];
    for (int f = 0; f < 2; f++) embree_way_name(row->way[f], way[f], sizeof way[f]);
    printf("%-8s %8u %-6s %-5s %7zu %2u ", row->mesh, row->triangles, kind_name[row->kind], row->place, row->rays,
           row->threads);
    if (row_is_right(row))
        printf("%7.2f %7.2f %7.2f %6.2f %6.2f", mrays(row, row->rt_s), mrays(row, row->embree_s[0]),
               mrays(row, row->embree_s[1]), row->embree_s[0] / row->rt_s, row->embree_s[1] / row->rt_s);
    else
        printf("%37s", "wrong answers, no speed");
    printf(" %5zu %5zu %5zu %3zu %3zu %3zu  %s | %s%s\n", row->differ[0], row->differ[1], row->judged, row->wrong,
           row->embree_wrong[0], row->embree_wrong[1], way[0], way[1], row->others > 0.2 ? "  (others ran)" : "");
    fflush(stdout);
}

static void measure_kind(Bench *b, const Subject *s, Kind kind, bool sweep_only)
{
    size_t count = s->count[kind];
    ProgramRun run;
    program_run_init(&run, s->fixture.world, s->ray[kind], count, kind == SHADOW);
    EmbreeRays *rays = embree_rays_create(s->scenes, s->ray[kind], count, kind == SHADOW);
    Row row = {.mesh = s->config->mesh, .triangles = s->shape.mesh->triangle_count, .kind = kind, .rays = count,
               .place = s->fixture.world->objects[0].in_world ? "baked" : "moved"};
    Workers *one = workers_create(1);
    find_best(rays, one, count, row.way);
    workers_run(one, program_trace, &run, count);
    EmbreeHit *answer[2];
    for (int f = 0; f < 2; f++) {
        answer[f] = malloc((count + 1) * sizeof *answer[f]);
        CHECK(answer[f]);
        embree_rays_prepare(rays, row.way[f], f == 0);
        workers_run(one, embree_rays_trace, rays, count);
        for (size_t i = 0; i < count; i++) answer[f][i] = embree_rays_hit(rays, i);
    }
    compare(&row, s, &run, answer);
    workers_destroy(one);
    for (uint32_t threads = 1; threads <= 2; threads++) {
        row.threads = b->options.threads ? b->options.threads : threads;
        row.others = 0;
        if (sweep_only) row.threads = 1;
        measure_row(&row, rays, &run, b->options.repeat);
        print_row(&row);
        if (!sweep_only) b->row[b->rows++] = row;
        if (s->config->sweep && b->options.parts & PART_SWEEP && kind == CAMERA && row.threads == 1 &&
            row_is_right(&row)) {
            double ns = 1e9 / (double)count;
            b->sweep[b->sweeps++] =
                (SweepRow){row.mesh, row.triangles, ns * row.rt_s, ns * row.embree_s[0], ns * row.embree_s[1]};
        }
        if (sweep_only || b->options.threads) break;
    }
    for (int f = 0; f < 2; f++) free(answer[f]);
    embree_rays_destroy(rays);
    program_run_free(&run);
}

/* ---- builds ---- */

/* The processors that this process may use, the first `threads` of them from now on; the former set in *before. */
static void allow_processors(uint32_t threads, cpu_set_t *before)
{
    CHECK(sched_getaffinity(0, sizeof *before, before) == 0);
    cpu_set_t set;
    CPU_ZERO(&set);
    for (size_t i = 0; i < CPU_SETSIZE && threads > 0; i++)
        if (CPU_ISSET(i, before)) {
            CPU_SET(i, &set);
            threads--;
        }
    CHECK(sched_setaffinity(0, sizeof set, &set) == 0);
}

/* Seconds of one thread are processor time, of more threads by the clock. */
static void measure_build(Bench *b, Subject *s, uint32_t threads)
{
    uint32_t triangles = s->shape.mesh->triangle_count, repeat = triangles > LARGE ? LARGE_REPEAT : BUILD_REPEAT;
    BuildRow row = {.mesh = s->config->mesh, .triangles = triangles, .threads = threads};
    double time[2][BUILD_REPEAT];
    for (uint32_t i = 0; i < repeat; i++) {
        cpu_set_t before;
        allow_processors(threads, &before);
        CHECK(fixture_compile(&s->fixture));
        CHECK(sched_setaffinity(0, sizeof before, &before) == 0);
        const CompileStats *stats = &s->fixture.stats;
        time[0][i] = threads == 1 ? stats->bvh_cpu_s : stats->bvh_wall_s;
        EmbreeBuild build = embree_build(s->shape.mesh, s->fixture.world->exponent, threads);
        time[1][i] = threads == 1 ? build.cpu_s : build.wall_s;
        row.embree_bytes = (double)build.bytes / triangles;
        row.embree_peak_bytes = (double)build.peak_bytes / triangles;
    }
    row.rt_s = median(time[0], repeat);
    row.embree_s = median(time[1], repeat);
    row.rt_bytes = (double)mesh_prim_bytes(s->fixture.world->objects[0].prim) / triangles;
    b->build[b->builds++] = row;
}

static void print_builds(const Bench *b)
{
    if (b->builds == 0) return;
    printf("\nBuild (Embree: robust, medium quality), million triangles a second; bytes of a triangle without vertices and "
           "indices\n%-8s %8s %7s %8s %8s %6s %8s %8s %8s\n",
           "mesh", "triangles", "threads", "rt", "Embree", "ratio", "rt bytes", "Embree", "its peak");
    for (uint32_t i = 0; i < b->builds; i++) {
        const BuildRow *r = &b->build[i];
        printf("%-8s %9u %7u %8.2f %8.2f %6.2f %8.1f %8.1f %8.1f\n", r->mesh, r->triangles, r->threads,
               r->triangles / r->rt_s * 1e-6, r->triangles / r->embree_s * 1e-6, r->embree_s / r->rt_s, r->rt_bytes,
               r->embree_bytes, r->embree_peak_bytes);
    }
}

static void print_sweep(const Bench *b)
{
    if (b->sweeps == 0) return;
    printf("\nNanoseconds of a camera ray, one thread\n%-8s %9s %8s %8s %8s\n", "mesh", "triangles", "rt", "Embree", "fast");
    for (uint32_t i = 0; i < b->sweeps; i++)
        printf("%-8s %9u %8.1f %8.1f %8.1f\n", b->sweep[i].mesh, b->sweep[i].triangles, b->sweep[i].rt_ns,
               b->sweep[i].embree_ns, b->sweep[i].fast_ns);
}

/* ---- the whole ---- */

static void measure(Bench *b, const Config *config)
{
    const Options *o = &b->options;
    bool row = config->row && o->parts & PART_ROWS, sweep = config->sweep && o->parts & PART_SWEEP;
    bool build = config->row && o->parts & PART_BUILD;
    if (o->mesh && strcmp(o->mesh, config->mesh) != 0) return;
    if (o->triangles && o->triangles != config->triangles) return;
    if (!row && !sweep && !build) return;
    Subject s;
    subject_create(&s, config);
    for (uint32_t threads = 1; build && threads <= 2; threads++)
        if (!o->threads || o->threads == threads) measure_build(b, &s, threads);
    if (row || sweep) {
        make_camera_rays(&s, o->size);
        make_other_rays(&s);
        s.scenes = embree_scenes_create(s.shape.mesh, s.fixture.world->exponent);
        for (Kind k = 0; k < KINDS; k++)
            if ((row || k == CAMERA) && (o->rays < 0 || o->rays == (int)k)) measure_kind(b, &s, k, !row);
    }
    subject_destroy(&s);
}

static void write_json(const Bench *b)
{
    FILE *f = fopen(b->options.json, "w");
    CHECK(f);
    fprintf(f, "{\"embree\": \"%s\", \"kernel\": \"%s\", \"repeat\": %u,\n\"rows\": [", b->embree, kernel_best(NULL)->name,
            b->options.repeat);
    for (uint32_t i = 0; i < b->rows; i++) {
        const Row *r = &b->row[i];
        char way[2][64];
        for (int k = 0; k < 2; k++) embree_way_name(r->way[k], way[k], sizeof way[k]);
        fprintf(f, "%s\n{\"mesh\": \"%s\", \"triangles\": %u, \"rays\": \"%s\", \"threads\": %u, \"count\": %zu, \"place\": "
                   "\"%s\", \"differ\": %zu, \"differ_fast\": %zu, \"judged\": %zu, \"rt_wrong\": %zu, \"embree_wrong\": "
                   "%zu, \"embree_fast_wrong\": %zu, \"embree_way\": \"%s\", \"embree_fast_way\": \"%s\", \"others\": %.3f",
                i ? "," : "", r->mesh, r->triangles, kind_name[r->kind], r->threads, r->rays, r->place, r->differ[0],
                r->differ[1], r->judged, r->wrong, r->embree_wrong[0], r->embree_wrong[1], way[0], way[1], r->others);
        if (row_is_right(r))
            fprintf(f, ", \"rt_mrays\": %.4g, \"embree_mrays\": %.4g, \"embree_fast_mrays\": %.4g, \"ratio\": %.4g, "
                       "\"ratio_fast\": %.4g}",
                    mrays(r, r->rt_s), mrays(r, r->embree_s[0]), mrays(r, r->embree_s[1]), r->embree_s[0] / r->rt_s,
                    r->embree_s[1] / r->rt_s);
        else
            fprintf(f, ", \"rt_mrays\": null, \"embree_mrays\": null, \"embree_fast_mrays\": null, \"ratio\": null, "
                       "\"ratio_fast\": null}");
    }
    fprintf(f, "],\n\"build\": [");
    for (uint32_t i = 0; i < b->builds; i++) {
        const BuildRow *r = &b->build[i];
        fprintf(f, "%s\n{\"mesh\": \"%s\", \"triangles\": %u, \"threads\": %u, \"rt_s\": %.4g, \"embree_s\": %.4g, "
                   "\"rt_mtris\": %.4g, \"embree_mtris\": %.4g, \"ratio\": %.4g, \"rt_bytes\": %.4g, \"embree_bytes\": %.4g, "
                   "\"embree_peak_bytes\": %.4g}",
                i ? "," : "", r->mesh, r->triangles, r->threads, r->rt_s, r->embree_s, r->triangles / r->rt_s * 1e-6,
                r->triangles / r->embree_s * 1e-6, r->embree_s / r->rt_s, r->rt_bytes, r->embree_bytes,
                r->embree_peak_bytes);
    }
    fprintf(f, "],\n\"sweep\": [");
    for (uint32_t i = 0; i < b->sweeps; i++)
        fprintf(f, "%s\n{\"mesh\": \"%s\", \"triangles\": %u, \"rt_ns\": %.4g, \"embree_ns\": %.4g, \"embree_fast_ns\": %.4g}",
                i ? "," : "", b->sweep[i].mesh, b->sweep[i].triangles, b->sweep[i].rt_ns, b->sweep[i].embree_ns,
                b->sweep[i].fast_ns);
    fprintf(f, "]}\n");
    CHECK(fclose(f) == 0);
}

static bool whole(const char *text, uint32_t least, uint32_t most, uint32_t *value)
{
    char *end;
    long x = strtol(text, &end, 10);
    if (*text == '\0' || *end != '\0' || x < (long)least || x > (long)most) return false;
    *value = (uint32_t)x;
    return true;
}

static bool read_option(Options *o, const char *name, const char *value)
{
    static const char *const parts[] = {"rows", "build", "sweep"};
    if (strcmp(name, "--mesh") == 0) {
        o->mesh = value;
        for (size_t i = 0; i < sizeof configs / sizeof *configs; i++)
            if (strcmp(value, configs[i].mesh) == 0) return true;
        return false;
    }
    if (strcmp(name, "--triangles") == 0) return whole(value, 1, UINT32_MAX / 2, &o->triangles);
    if (strcmp(name, "--threads") == 0) return whole(value, 1, MAX_THREADS, &o->threads);
    if (strcmp(name, "--repeat") == 0) return whole(value, 1, MAX_REPEAT, &o->repeat);
    if (strcmp(name, "--size") == 0) return whole(value, 1, 8192, &o->size);
    if (strcmp(name, "--rays") == 0)
        for (int k = 0; k < KINDS; k++)
            if (strcmp(value, kind_name[k]) == 0) {
                o->rays = k;
                return true;
            }
    if (strcmp(name, "--part") == 0)
        for (int k = 0; k < 3; k++)
            if (strcmp(value, parts[k]) == 0) {
                o->parts = 1u << k;
                return true;
            }
    if (strcmp(name, "--json") == 0) {
        o->json = value;
        return true;
    }
    return false;
}

int main(int argc, char **argv)
{
    static Bench b = {.options = {.repeat = 5, .size = 1024, .rays = -1, .parts = PART_ROWS | PART_BUILD | PART_SWEEP}};
    for (int i = 1; i < argc; i += 2)
        if (i + 1 == argc || !read_option(&b.options, argv[i], argv[i + 1])) {
            fprintf(stderr, "kernels: %s %s: not an option with a value that it may have (see the head of kernels.c)\n",
                    argv[i], i + 1 < argc ? argv[i + 1] : "");
            return 2;
        }
    embree_describe(b.embree, sizeof b.embree);
    printf("rt: kernel %s. %s.\nMillion rays a second (processor time of the threads), median of %u; rt / Embree at its best, "
           "robust and in any mode (fast).\nThe whole path through world_intersect or world_occluded in streams of %d rays.\n"
           "differ: from robust, from fast; of these judged by all triangles in quad; wrong: rt, robust, fast.\n",
           kernel_best(NULL)->name, b.embree, b.options.repeat, STREAM);
    printf("%-8s %8s %-6s %-5s %7s %2s %7s %7s %7s %6s %6s %11s %5s %11s  %s\n", "mesh", "triangle", "rays", "place", "count",
           "th", "rt", "robust", "fast", "ratio", "rfast", "differ", "judge", "wrong", "Embree's ways, robust | fast");
    for (size_t i = 0; i < sizeof configs / sizeof *configs; i++) measure(&b, &configs[i]);
    print_sweep(&b);
    print_builds(&b);
    if (b.options.json) write_json(&b);
    for (uint32_t i = 0; i < b.rows; i++)
        if (!row_is_right(&b.row[i])) return 1;
    return 0;
}
