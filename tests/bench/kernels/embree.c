#include "bench/kernels/embree.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <embree3/rtcore.h>
#ifdef __SSE__
#include <xmmintrin.h>
#endif

#include "common/cpu.h"
#include "support/check.h"

/* Rays that a call for streams gets at once, as many as the renderer's streams have. */
enum { STREAM = 512 };

/* RTCRay and RTCHit in words of four bytes; every layout is arrays of `lanes` of them, one after the other. */
enum { ORG, TNEAR = 3, DIR = 4, TIME = 7, TFAR = 8, MASK = 9, ID = 10, FLAGS = 11, RAY_WORDS = 12,
       NG = 12, U = 15, V = 16, PRIM_ID = 17, GEOM_ID = 18, INST_ID = 19, HIT_WORDS = 20 };
_Static_assert(sizeof(struct RTCRay) == RAY_WORDS * 4 && sizeof(struct RTCRayHit) == HIT_WORDS * 4, "Embree's layout");
_Static_assert(sizeof(struct RTCRayHit16) == 16 * HIT_WORDS * 4, "Embree's layout");

typedef enum { CALL_1, CALL_4, CALL_8, CALL_16, CALL_1M, CALL_NM, CALL_NP } Call;

static const struct { const char *name; uint32_t lanes; } calls[] = {
    {"Intersect1", 1}, {"Intersect4", 4}, {"Intersect8", 8}, {"Intersect16", 16},
    {"Intersect1M", 1}, {"IntersectNM", 16}, {"IntersectNp", STREAM}};

static Call call_of(int way) { return (Call)(way / 4); }
static bool coherent(int way) { return way / 2 % 2; }
static int quality_of(int way) { return way % 2; }

typedef union { float f; uint32_t u; } Word;

struct EmbreeScenes {
    RTCDevice device;
    float (*position)[3];
    uint32_t (*triangle)[3];
    RTCScene scene[2][2];     /* [high][robust] */
};

struct EmbreeRays {
    const EmbreeScenes *scenes;
    const Ray *ray;
    size_t count;
    bool any;
    Call call;
    uint32_t lanes, words;    /* words: of a ray */
    RTCScene scene;
    struct RTCIntersectContext context;
    Word *word;
};

void embree_way_name(int way, char *name, size_t size)
{
    snprintf(name, size, "%s %s %s", calls[call_of(way)].name, coherent(way) ? "coherent" : "incoherent",
             quality_of(way) ? "high" : "medium");
}

static void failed(void *context, enum RTCError code, const char *text)
{
    (void)context;
    fprintf(stderr, "Embree: error %d: %s\n", (int)code, text);
    abort();
}

static RTCDevice device_create(uint32_t threads)
{
    char config[64];
    snprintf(config, sizeof config, "threads=%u", threads);
    RTCDevice device = rtcNewDevice(threads ? config : NULL);
    CHECK(device);
    rtcSetDeviceErrorFunction(device, failed, NULL);
    return device;
}

void embree_describe(char *text, size_t size)
{
    RTCDevice device = device_create(0);
    ssize_t version = rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION);
    const char *width = rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED)  ? "16 (AVX-512)"
                        : rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) ? "8 (AVX or AVX2)"
                                                                                                  : "4 (SSE)";
    snprintf(text, size, "Embree %zd.%zd.%zd, packets of up to %s rays in vector instructions", version / 10000,
             version / 100 % 100, version % 100, width);
    rtcReleaseDevice(device);
}

/* ---- scenes ---- */

static void copy_mesh(EmbreeScenes *s, const Mesh *mesh, int exponent)
{
    /* Embree may read 16 bytes at the last vertex. */
    s->position = malloc((mesh->position_count + (size_t)2) * sizeof *s->position);
    s->triangle = malloc((mesh->triangle_count + (size_t)1) * sizeof *s->triangle);
    CHECK(s->position && s->triangle);
    for (uint32_t i = 0; i < mesh->position_count; i++)
        for (int a = 0; a < 3; a++) s->position[i][a] = (float)ldexp(vec3_get(mesh->position[i], a), -exponent);
    memcpy(s->triangle, mesh->triangle, mesh->triangle_count * sizeof *s->triangle);
}

static RTCGeometry geometry_create(const EmbreeScenes *s, const Mesh *mesh)
{
    RTCGeometry g = rtcNewGeometry(s->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, s->position, 0, sizeof *s->position,
                               mesh->position_count);
    rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, s->triangle, 0, sizeof *s->triangle,
                               mesh->triangle_count);
    rtcCommitGeometry(g);
    return g;
}

static RTCScene scene_of(const EmbreeScenes *s, RTCGeometry geometry, bool high, bool robust)
{
    RTCScene scene = rtcNewScene(s->device);
    rtcSetSceneBuildQuality(scene, high ? RTC_BUILD_QUALITY_HIGH : RTC_BUILD_QUALITY_MEDIUM);
    rtcSetSceneFlags(scene, robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
    rtcAttachGeometry(scene, geometry);
    return scene;
}

EmbreeScenes *embree_scenes_create(const Mesh *mesh, int exponent)
{
    EmbreeScenes *s = calloc(1, sizeof *s);
    CHECK(s);
    s->device = device_create(0);
    copy_mesh(s, mesh, exponent);
    RTCGeometry geometry = geometry_create(s, mesh);
    for (int high = 0; high < 2; high++)
        for (int robust = 0; robust < 2; robust++) {
            s->scene[high][robust] = scene_of(s, geometry, high, robust);
            rtcCommitScene(s->scene[high][robust]);
        }
    rtcReleaseGeometry(geometry);
    return s;
}

void embree_scenes_destroy(EmbreeScenes *s)
{
    for (int k = 0; k < 4; k++) rtcReleaseScene(s->scene[k / 2][k % 2]);
    rtcReleaseDevice(s->device);
    free(s->position);
    free(s->triangle);
    free(s);
}

static bool count_bytes(void *context, ssize_t bytes, bool post)
{
    (void)post;
    EmbreeBuild *build = context;
    int64_t now = __atomic_add_fetch(&build->bytes, bytes, __ATOMIC_RELAXED), peak = build->peak_bytes;
    while (now > peak && !__atomic_compare_exchange_n(&build->peak_bytes, &peak, now, false, __ATOMIC_RELAXED,
                                                      __ATOMIC_RELAXED)) {}
    return true;
}

EmbreeBuild embree_build(const Mesh *mesh, int exponent, uint32_t threads)
{
    EmbreeBuild build = {0};
    EmbreeScenes s = {.device = device_create(threads)};
    rtcSetDeviceMemoryMonitorFunction(s.device, count_bytes, &build);
    copy_mesh(&s, mesh, exponent);
    RTCGeometry geometry = geometry_create(&s, mesh);
    RTCScene scene = scene_of(&s, geometry, false, true);
    double wall = cpu_wall_s(), cpu = cpu_time_s();
    rtcCommitScene(scene);
    build.wall_s = cpu_wall_s() - wall;
    build.cpu_s = cpu_time_s() - cpu;
    EmbreeBuild result = build;
    rtcReleaseGeometry(geometry);
    rtcReleaseScene(scene);
    rtcReleaseDevice(s.device);
    free(s.position);
    free(s.triangle);
    return result;
}

/* ---- rays ---- */

EmbreeRays *embree_rays_create(const EmbreeScenes *scenes, const Ray *rays, size_t count, bool any)
{
    EmbreeRays *r = calloc(1, sizeof *r);
    CHECK(r);
    *r = (EmbreeRays){.scenes = scenes, .ray = rays, .count = count, .any = any, .words = any ? RAY_WORDS : HIT_WORDS};
    r->word = aligned_alloc(64, (count + STREAM) / STREAM * STREAM * r->words * sizeof *r->word);
    CHECK(r->word);
    return r;
}

void embree_rays_destroy(EmbreeRays *r)
{
    free(r->word);
    free(r);
}

static Word *field(const EmbreeRays *r, size_t index, uint32_t which)
{
    size_t lane = index % r->lanes;
    return r->word + (index - lane) * r->words + which * r->lanes + lane;
}

void embree_rays_prepare(EmbreeRays *r, int way, bool robust)
{
    r->call = call_of(way);
    r->lanes = calls[r->call].lanes;
    r->scene = r->scenes->scene[quality_of(way)][robust];
    rtcInitIntersectContext(&r->context);
    r->context.flags = coherent(way) ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    size_t end = (r->count + STREAM - 1) / STREAM * STREAM;
    for (size_t i = 0; i < end; i++) {
        /* Lanes behind the last ray are inactive: tnear > tfar. */
        static const Ray none = {{0, 0, 0}, {0, 0, 1}, 1, 0};
        const Ray *ray = i < r->count ? &r->ray[i] : &none;
        for (uint32_t a = 0; a < 3; a++) {
            field(r, i, ORG + a)->f = (float)vec3_get(ray->o, (int)a);
            field(r, i, DIR + a)->f = (float)vec3_get(ray->d, (int)a);
        }
        field(r, i, TNEAR)->f = (float)ray->tmin;
        field(r, i, TFAR)->f = (float)ray->tmax;
        field(r, i, TIME)->f = 0;
        field(r, i, MASK)->u = UINT32_MAX;
        field(r, i, ID)->u = (uint32_t)i;
        field(r, i, FLAGS)->u = 0;
        if (r->any) continue;
        for (uint32_t k = NG; k < HIT_WORDS; k++) field(r, i, k)->u = k < PRIM_ID ? 0 : RTC_INVALID_GEOMETRY_ID;
    }
}

static void trace_packets(EmbreeRays *r, size_t first, size_t end)
{
    _Alignas(64) int valid[16];
    for (size_t i = first; i < end; i += r->lanes) {
        void *packet = field(r, i, 0);
        for (uint32_t k = 0; k < r->lanes; k++) valid[k] = i + k < end ? -1 : 0;
        if (r->call == CALL_4)
            r->any ? rtcOccluded4(valid, r->scene, &r->context, packet)
                   : rtcIntersect4(valid, r->scene, &r->context, packet);
        else if (r->call == CALL_8)
            r->any ? rtcOccluded8(valid, r->scene, &r->context, packet)
                   : rtcIntersect8(valid, r->scene, &r->context, packet);
        else
            r->any ? rtcOccluded16(valid, r->scene, &r->context, packet)
                   : rtcIntersect16(valid, r->scene, &r->context, packet);
    }
}

static void trace_pointers(EmbreeRays *r, size_t first, uint32_t count)
{
    float *f = &field(r, first, 0)->f;
    uint32_t *u = &field(r, first, 0)->u;
#define AT(base, which) ((base) + (size_t)STREAM * (which))
    struct RTCRayHitNp p = {
        .ray = {AT(f, ORG), AT(f, ORG + 1), AT(f, ORG + 2), AT(f, TNEAR), AT(f, DIR), AT(f, DIR + 1), AT(f, DIR + 2),
                AT(f, TIME), AT(f, TFAR), AT(u, MASK), AT(u, ID), AT(u, FLAGS)}};
    if (r->any) {
        rtcOccludedNp(r->scene, &r->context, &p.ray, count);
        return;
    }
    p.hit = (struct RTCHitNp){AT(f, NG), AT(f, NG + 1), AT(f, NG + 2), AT(f, U), AT(f, V), AT(u, PRIM_ID),
                              AT(u, GEOM_ID), {AT(u, INST_ID)}};
    rtcIntersectNp(r->scene, &r->context, &p, count);
#undef AT
}

static void trace_stream(EmbreeRays *r, size_t first, uint32_t count)
{
    void *rays = field(r, first, 0);
    size_t stride = r->lanes * r->words * sizeof(Word);
    uint32_t packets = (count + r->lanes - 1) / r->lanes;
    if (r->call == CALL_NP)
        trace_pointers(r, first, count);
    else if (r->call == CALL_1M)
        r->any ? rtcOccluded1M(r->scene, &r->context, rays, count, stride)
               : rtcIntersect1M(r->scene, &r->context, rays, count, stride);
    else
        r->any ? rtcOccludedNM(r->scene, &r->context, rays, r->lanes, packets, stride)
               : rtcIntersectNM(r->scene, &r->context, rays, r->lanes, packets, stride);
}

void embree_rays_trace(void *rays, size_t first, size_t count, uint32_t worker)
{
    (void)worker;
    EmbreeRays copy = *(EmbreeRays *)rays, *r = &copy;
    size_t end = first + count;
#ifdef __SSE__
    unsigned mode = _mm_getcsr();
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _mm_setcsr(_mm_getcsr() | 0x0040);  /* denormals are zero: _MM_SET_DENORMALS_ZERO_MODE without asking for SSE3 */
#endif
    if (r->call == CALL_1) {
        for (size_t i = first; i < end; i++) {
            void *ray = field(r, i, 0);
            r->any ? rtcOccluded1(r->scene, &r->context, ray) : rtcIntersect1(r->scene, &r->context, ray);
        }
    } else if (r->call <= CALL_16) {
        trace_packets(r, first, end);
    } else {
        for (size_t i = first; i < end; i += STREAM)
            trace_stream(r, i, end - i < STREAM ? (uint32_t)(end - i) : STREAM);
    }
#ifdef __SSE__
    _mm_setcsr(mode);
#endif
}

EmbreeHit embree_rays_hit(const EmbreeRays *r, size_t index)
{
    float t = field(r, index, TFAR)->f;
    if (r->any) return (EmbreeHit){t < 0 ? 0 : (double)INFINITY, 0};
    if (field(r, index, GEOM_ID)->u == RTC_INVALID_GEOMETRY_ID) return (EmbreeHit){(double)INFINITY, 0};
    return (EmbreeHit){(double)t, field(r, index, PRIM_ID)->u};
}
