/* Triangles where they are stiff: watertight at edges and vertices, slivers, extreme sizes, degenerate hierarchies. */
#include "stability/stability.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "accel/mesh_data.h"
#include "accel/mesh_prim.h"
#include "common/rng.h"
#include "support/check.h"
#include "support/mesh_sphere.h"
#include "support/world_fixture.h"

enum { SEED = 20261122 };

static const double OFFSET[] = {0, 1e3, 1e5};

static double uniform(Rng *rng, double lo, double hi) { return lo + (hi - lo) * rng_double(rng); }

static Vec3 random_vector(Rng *rng)
{
    double x = uniform(rng, -1, 1), y = uniform(rng, -1, 1);
    return vec3_make(x, y, uniform(rng, -1, 1));
}

static Scratch scratch_create(void)
{
    Scratch scratch = {.arena = arena_create()};
    CHECK(scratch.arena);
    return scratch;
}

static Prim *prim_of(const Mesh *mesh, bool closed)
{
    Prim *prim = mesh_prim_create(mesh, closed, NULL, NULL);
    CHECK(prim);
    return prim;
}

static uint32_t segment_count(const Prim *prim, const Ray *ray, Scratch *scratch)
{
    arena_reset(scratch->arena);
    SegList list = seg_list(scratch);
    CHECK(prim->ops->segments(prim, ray, &list));
    return list.count;
}

/* Room for printing a ray so that it can be repeated. */
typedef struct { char text[150]; } RayText;

static RayText ray_text(const Ray *ray)
{
    RayText t;
    snprintf(t.text, sizeof t.text, "o %a %a %a d %a %a %a", ray->o.x, ray->o.y, ray->o.z, ray->d.x, ray->d.y, ray->d.z);
    return t;
}

/* -- 24, 25: every way in and every way out once -- */

/* The triangles around each vertex: those of v are list[first[v]] to list[first[v + 1]]. */
typedef struct { uint32_t *first, *list; } Fans;

static Fans fans_create(const Mesh *mesh)
{
    Fans f = {calloc(mesh->position_count + 2, sizeof *f.first), malloc(3 * mesh->triangle_count * sizeof *f.list)};
    CHECK(f.first && f.list);
    for (uint32_t i = 0; i < mesh->triangle_count; i++)
        for (int k = 0; k < 3; k++) f.first[mesh->triangle[i][k] + 2]++;
    for (uint32_t v = 2; v < mesh->position_count + 2; v++) f.first[v] += f.first[v - 1];
    for (uint32_t i = 0; i < mesh->triangle_count; i++)
        for (int k = 0; k < 3; k++) f.list[f.first[mesh->triangle[i][k] + 1]++] = i;
    return f;
}

static void fans_free(Fans f)
{
    free(f.first);
    free(f.list);
}

/* How many triangles around a vertex a ray meets ahead, each asked by itself. */
static uint32_t crossings(const Mesh *mesh, Fans f, uint32_t vertex, const Ray *ray)
{
    Shear shear = shear_of(ray);
    uint32_t n = 0;
    for (uint32_t i = f.first[vertex]; i < f.first[vertex + 1]; i++) {
        const uint32_t *k = mesh->triangle[f.list[i]];
        double t, u, v;
        int facing;
        n += hit_triangle(&shear, &mesh->position[k[0]], &mesh->position[k[1]], &mesh->position[k[2]], &t, &u, &v,
                          &facing) && t > 0;
    }
    return n;
}

/* From inside a convex mesh toward a point of an edge at a vertex, or the vertex itself: one triangle there is met, the
 * line is inside once, and ahead of the first hit there is none. */
static void one_way_out(Row *row, const Mesh *mesh, const Prim *prim, Fans f, uint32_t vertex, const Ray *ray,
                        Scratch *scratch)
{
    Hit hit = {.t = -1};
    bool out = prim->ops->intersect(prim, ray, &hit, scratch);
    Ray on = {ray->o, ray->d, hit.t, INFINITY};
    uint32_t met = crossings(mesh, f, vertex, ray), lines = segment_count(prim, ray, scratch);
    bool again = prim->ops->occluded(prim, &on, scratch);
    row_trial(row, out && met == 1 && lines == 1 && !again, "vertex %u: %u met, %u segments, out %d, again %d; %s", vertex,
              met, lines, out, again, ray_text(ray).text);
}

static void watertight_edges(Row *row, uint64_t trials)
{
    Scratch scratch = scratch_create();
    Rng rng = rng_seed(SEED, 24);
    for (int k = 0; k < 3; k++) {
        Vec3 centre = vec3_make(OFFSET[k], -OFFSET[k], 0.5 * OFFSET[k]);
        Mesh *mesh = mesh_sphere(200, 200, centre);
        Prim *prim = prim_of(mesh, true);
        Fans f = fans_create(mesh);
        uint64_t pass = trials / 3, step = trials >= 480000 ? 1 : 8;  /* in a short run every eighth */
        for (uint64_t done = 0; done < pass;) {
            for (uint32_t i = 0; i < mesh->triangle_count; i += (uint32_t)step)
                for (int side = 0; side < 3; side++) {
                    uint32_t a = mesh->triangle[i][side], b = mesh->triangle[i][(side + 1) % 3];
                    if (a > b) continue;
                    Vec3 p = mesh->position[a], q = mesh->position[b], o = vec3_at(centre, 0.5, random_vector(&rng));
                    double w = done < 3 * (uint64_t)mesh->triangle_count / 2 ? 0.5 : rng_double(&rng);
                    Ray ray = {o, vec3_sub(vec3_at(p, w, vec3_sub(q, p)), o), 0, INFINITY};
                    one_way_out(row, mesh, prim, f, a, &ray, &scratch);
                    done++;
                }
            for (uint32_t v = 0; v < mesh->position_count; v += (uint32_t)step, done++) {
                Vec3 o = vec3_at(centre, 0.5, random_vector(&rng));
                Ray ray = {o, vec3_sub(mesh->position[v], o), 0, INFINITY};
                one_way_out(row, mesh, prim, f, v, &ray, &scratch);
            }
        }
        fans_free(f);
        prim_destroy(prim);
        mesh_destroy(mesh);
    }
    arena_destroy(scratch.arena);
}

/* Random rays, from inside and from outside. The sphere inscribed in the mesh tells which must be hit. */
static void watertight_random(Row *row, uint64_t trials)
{
    Scratch scratch = scratch_create();
    for (int k = 0; k < 3; k++) {
        Rng rng = rng_seed(SEED, 240 + (uint64_t)k);
        Vec3 centre = vec3_make(OFFSET[k], -OFFSET[k], 0.5 * OFFSET[k]);
        Mesh *mesh = mesh_sphere(200, 200, centre);
        Prim *prim = prim_of(mesh, true);
        for (uint64_t i = 0; i < trials / 3; i++) {
            bool inside = i % 2;
            Vec3 o = vec3_at(centre, inside ? 0.5 : 5, random_vector(&rng)), target = vec3_at(centre, 0.55, random_vector(&rng));
            if (!inside && vec3_length(vec3_sub(o, centre)) < 1.5) o = vec3_at(o, 3, vec3_make(0, 1, 0));
            Ray ray = {o, vec3_sub(target, o), 0, INFINITY};
            Hit hit = {.t = -1};
            bool hits = prim->ops->intersect(prim, &ray, &hit, &scratch);
            int ways = hits;
            for (Ray on = ray; hits && ways < 4; ways += hits) {
                on.tmin = hit.t;
                hits = prim->ops->intersect(prim, &on, &hit, &scratch);
            }
            uint32_t lines = segment_count(prim, &ray, &scratch);
            row_trial(row, ways == (inside ? 1 : 2) && lines == 1, "offset %g: %d hits, %u segments; %s", OFFSET[k], ways,
                      lines, ray_text(&ray).text);
        }
        prim_destroy(prim);
        mesh_destroy(mesh);
    }
    arena_destroy(scratch.arena);
}

static void shared_vertex(Row *row, uint64_t trials)
{
    Scratch scratch = scratch_create();
    Rng rng = rng_seed(SEED, 25);
    for (int k = 0; k < 3; k++) {
        Vec3 centre = vec3_make(OFFSET[k], -OFFSET[k], 0.5 * OFFSET[k]);
        Mesh *mesh = mesh_sphere(2, 1000, centre);  /* two pyramids, base to base */
        Prim *prim = prim_of(mesh, true);
        Fans f = fans_create(mesh);
        for (uint64_t i = 0; i < trials / 3; i++) {
            uint32_t pole = i % 2 ? mesh->position_count - 1 : 0, rim = 1 + rng_u32(&rng) % 1000;
            Vec3 o = vec3_at(centre, 0.3, random_vector(&rng)), target = mesh->position[pole];
            if (i % 4 == 3) target = vec3_at(target, rng_double(&rng), vec3_sub(mesh->position[rim], target));
            Ray ray = {o, vec3_sub(target, o), 0, INFINITY};
            if (i % 16 == 0) {  /* asks thousands of triangles */
                one_way_out(row, mesh, prim, f, pole, &ray, &scratch);
                continue;
            }
            uint32_t lines = segment_count(prim, &ray, &scratch);
            row_trial(row, lines == 1, "%u segments; %s", lines, ray_text(&ray).text);
        }
        fans_free(f);
        prim_destroy(prim);
        mesh_destroy(mesh);
    }
    arena_destroy(scratch.arena);
}

/* -- 26: triangles of no area -- */

typedef struct { int count; char text[300]; } Warnings;

static void count_warning(void *context, const char *text)
{
    Warnings *w = context;
    w->count++;
    snprintf(w->text, sizeof w->text, "%s", text);
}

static void degenerate(Row *row, uint64_t trials)
{
    Rng rng = rng_seed(SEED, 26);
    for (uint64_t i = 0; i < trials; i++) {
        enum { MOST = 12 };
        Vec3 position[4 + 3 * MOST] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
        uint32_t index[3 * (4 + MOST)] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3}, size[4 + MOST] = {3, 3, 3, 3};
        uint32_t bad = 1 + rng_u32(&rng) % MOST, n = 4;
        for (uint32_t k = 0; k < bad; k++) {
            /* of few bits, so that all sums and multiples are exact */
            Vec3 a = vec3_scale(vec3_make(rng_u32(&rng) % 64, rng_u32(&rng) % 64, rng_u32(&rng) % 64),
                                ldexp(1, (int)(rng_u32(&rng) % 300) - 150));
            double s = ldexp(1, (int)(rng_u32(&rng) % 20)) * (vec3_max(a) > 0 ? ldexp(1, ilogb(vec3_max(a)) - 20) : 1);
            Vec3 d = vec3_scale(vec3_make(rng_u32(&rng) % 8, rng_u32(&rng) % 8, 1 + rng_u32(&rng) % 7), s);
            uint32_t *tri = index + 3 * (4 + k);
            tri[0] = n;
            tri[1] = n + 1;
            tri[2] = n + 2;
            position[n] = a;
            position[n + 1] = vec3_at(a, 3, d);
            switch (rng_u32(&rng) % 4) {
            case 0: tri[2] = n + rng_u32(&rng) % 2; break;
            case 1: position[n + 2] = position[n + rng_u32(&rng) % 2]; break;
            case 2: position[n + 2] = vec3_at(a, (double)(rng_u32(&rng) % 16) - 8, d); break;
            default:  /* an edge too short for a normal number */
                position[n] = vec3_make(0, 0, 0);
                position[n + 1] = vec3_make(0x1p-1074 * (1 + rng_u32(&rng) % 1000), 0, 0);
                position[n + 2] = vec3_make(0, 1, 0);
            }
            n += 3;
            size[4 + k] = 3;
        }
        Err err = {0};
        Mesh *mesh = mesh_from_faces(position, n, size, 4 + bad, index, &err);
        bool counted = mesh && mesh->dropped == bad && mesh->triangle_count == 4 && mesh_is_closed(mesh, &err);
        row_trial(row, counted, "trial %llu: %u of %u dropped", (unsigned long long)i, mesh ? mesh->dropped : 0, bad);
        if (!mesh || i % 1000) {
            mesh_destroy(mesh);
            continue;
        }
        /* used twice, told of once */
        WorldFixture f;
        fixture_create(&f);
        MeshSource *source = scene_mesh_made(f.scene, MESH_TABLE);
        CHECK(source);
        source->loaded = mesh;
        for (int k = 0; k < 2; k++) {
            Node *node = fixture_node(&f, NULL, NODE_MESH, "broken");
            node->mesh = source;
            node->material = fixture_material(&f, (Rgb){{1, 1, 1}}, (Rgb){{0, 0, 0}}, 1, 0);
        }
        Warnings warnings = {0};
        CompileSettings settings = {.warn = count_warning, .warn_context = &warnings};
        char count[32];
        snprintf(count, sizeof count, " %u degenerate", bad);
        f.world = world_compile(&f.job, &settings, &f.stats, &f.err);
        row_trial(row, f.world && warnings.count == 1 && strstr(warnings.text, count) && f.stats.dropped_triangles == bad,
                  "trial %llu: %d warnings: %.100s", (unsigned long long)i, warnings.count, warnings.text);
        fixture_destroy(&f);
    }
}

/* -- 28: fine detail on a huge ground -- */

/* Whether a ray, beyond its start, meets the box grown by `by`. */
static bool meets_box(Vec3 o, Vec3 d, Vec3 lo, Vec3 hi, double by)
{
    double near = 0, far = INFINITY;
    for (int a = 0; a < 3; a++) {
        double x = vec3_get(d, a), p = (vec3_get(lo, a) - by - vec3_get(o, a)) / x, q = (vec3_get(hi, a) + by - vec3_get(o, a)) / x;
        near = fmax(near, fmin(p, q));
        far = fmin(far, fmax(p, q));
    }
    return near <= far;
}

/* A ground of two triangles and a box of 1e-3 on it. Rays down are stopped; from where they arrive, rays to a light are
 * stopped by the box alone. What passes the box's edges at less than the error of the ground's points says nothing. */
static void fine_detail(Row *row, uint64_t trials)
{
    Scratch scratch = scratch_create();
    Rng rng = rng_seed(SEED, 28);
    const double half = 5e6, size = 1e-3;
    for (int at = 0; at < 2; at++) {
        double x0 = at ? 1234.5 : 0, z0 = at ? -4321.25 : 0;
        Vec3 lo = vec3_make(x0, 0, z0), hi = vec3_add(lo, vec3_make(size, size, size));
        Vec3 position[12] = {{-half, 0, -half}, {half, 0, -half}, {half, 0, half}, {-half, 0, half}};
        for (uint32_t k = 0; k < 8; k++)
            position[4 + k] = vec3_make(k & 1 ? hi.x : lo.x, k & 2 ? hi.y : lo.y, k & 4 ? hi.z : lo.z);
        uint32_t faces[8] = {3, 3, 4, 4, 4, 4, 4, 4};
        uint32_t index[] = {0, 2, 1, 0, 3, 2, 4, 5, 9, 8, 6, 10, 11, 7, 4, 6, 7, 5, 8, 9, 11, 10, 4, 8, 10, 6, 5, 7, 11, 9};
        Mesh *mesh = mesh_from_faces(position, 12, faces, 8, index, NULL);
        CHECK(mesh);
        Prim *prim = prim_of(mesh, false);
        for (uint64_t i = 0; i < trials / 2; i++) {
            double away = size * exp2(uniform(&rng, -2, i % 4 ? 4 : 30));
            Vec3 target = vec3_make(x0 + away * uniform(&rng, -1, 1), 0, z0 + away * uniform(&rng, -1, 1));
            if (i % 8 == 0) target.z = target.x;  /* on the diagonal */
            Vec3 o = vec3_add(target, vec3_scale(vec3_make(uniform(&rng, -1, 1), uniform(&rng, 0.01, 1), uniform(&rng, -1, 1)),
                                                 exp2(uniform(&rng, -8, 20))));
            if (fabs(o.x) > half || fabs(o.z) > half || fabs(target.x) > half || fabs(target.z) > half) continue;
            Ray ray = {o, vec3_sub(target, o), 0, INFINITY};
            Hit hit;
            bool stopped = prim->ops->intersect(prim, &ray, &hit, &scratch);
            Surface s = {0};
            if (stopped) prim->ops->surface(prim, &ray, &hit, &s);
            /* the ray is stopped no lower than the error of the ground's points */
            bool tight = stopped && (hit.t - 1) * -ray.d.y <= s.p_err.y;
            if (!row_trial(row, tight, "leak: %s", ray_text(&ray).text) || hit.part > 1) continue;
            Vec3 n = vec3_normalize(s.n), start = vec3_at(s.p, vec3_dot(vec3_abs(n), s.p_err), n);
            Vec3 light = vec3_make(uniform(&rng, -1, 1), pow(10, -uniform(&rng, 0, 6)), uniform(&rng, -1, 1));
            if (i % 2) light = vec3_sub(vec3_add(vec3_scale(vec3_add(lo, hi), 0.5), vec3_scale(random_vector(&rng), size)), start);
            if (!(light.y > 0)) continue;
            Ray shadow = {start, light, 0, INFINITY};
            double margin = 2 * vec3_max(s.p_err) + 0x1p-40 * away;
            bool surely = meets_box(s.p, light, lo, hi, -margin), perhaps = meets_box(s.p, light, lo, hi, margin);
            if (surely != perhaps) continue;
            bool dark = prim->ops->occluded(prim, &shadow, &scratch);
            row_trial(row, dark == surely, "%s: %s", dark ? "acne" : "light through the box", ray_text(&shadow).text);
        }
        prim_destroy(prim);
        mesh_destroy(mesh);
    }
    arena_destroy(scratch.arena);
}

/* -- 38: hierarchies of the shapes that break builders, against the search of all triangles -- */

enum { HEAP_SAME, HEAP_CENTRED, HEAP_ONE_HUGE, HEAP_FLAT, HEAPS };

static Mesh heap_create(int kind, uint32_t count, Rng *rng)
{
    Mesh m = {.position = malloc(3 * (size_t)count * sizeof(Vec3)), .triangle = malloc(count * sizeof *m.triangle),
              .position_count = 3 * count, .triangle_count = count};
    CHECK(m.position && m.triangle);
    for (uint32_t i = 0; i < count; i++) {
        Vec3 at = random_vector(rng), p = random_vector(rng), q = random_vector(rng);
        Vec3 corner[3] = {vec3_at(at, 0.1, p), vec3_at(at, 0.1, q), vec3_at(at, 0.1, random_vector(rng))};
        switch (kind) {
        case HEAP_SAME:
            corner[0] = vec3_make(-1, -1, 0.1);
            corner[1] = vec3_make(1, -1, 0.3);
            corner[2] = vec3_make(0, 1, -0.2);
            break;
        case HEAP_CENTRED:  /* the middles of their boxes all in the origin */
            corner[0] = p;
            corner[1] = vec3_neg(p);
            corner[2] = vec3_make(0.5 * p.x * q.x, 0.5 * p.y * q.y, 0.5 * p.z * q.z);
            break;
        case HEAP_ONE_HUGE:
            for (int k = 0; k < 3; k++) corner[k] = vec3_at(at, i ? 1e-2 : 1e5, vec3_sub(corner[k], at));
            break;
        default: {  /* in planes across an axis, on a grid */
            int axis = (int)(rng_u32(rng) % 3);
            double level = (double)(rng_u32(rng) % 9) / 4 - 1;
            for (int k = 0; k < 3; k++) {
                double c[3] = {rint(4 * corner[k].x) / 4 + (k == 1 ? 0.25 : 0), rint(4 * corner[k].y) / 4 + (k == 2 ? 0.25 : 0),
                               rint(4 * corner[k].z) / 4 + (k == 0 ? 0.25 : 0)};
                c[axis] = level;
                corner[k] = vec3_make(c[0], c[1], c[2]);
            }
        }
        }
        for (uint32_t k = 0; k < 3; k++) {
            m.position[3 * i + k] = corner[k];
            m.triangle[i][k] = 3 * i + k;
        }
    }
    return m;
}

/* The nearest hit, and of equal ones the first, by asking all triangles. */
static Hit search_all(const Mesh *m, const Ray *ray)
{
    Hit best = {.t = INFINITY, .part = HIT_NONE};
    Shear shear = shear_of(ray);
    for (uint32_t i = 0; i < m->triangle_count; i++) {
        const uint32_t *k = m->triangle[i];
        double t, u, v;
        int facing;
        if (!hit_triangle(&shear, &m->position[k[0]], &m->position[k[1]], &m->position[k[2]], &t, &u, &v, &facing)) continue;
        if (t > ray->tmin && t <= ray->tmax && t < best.t) best = (Hit){.t = t, .u = u, .v = v, .part = i};
    }
    return best;
}

static void compare_with_search(Row *row, const char *name, const Mesh *mesh, const Prim *prim, const Ray *ray,
                                Scratch *scratch)
{
    Hit truth = search_all(mesh, ray), hit = {.t = INFINITY, .part = HIT_NONE};
    bool found = prim->ops->intersect(prim, ray, &hit, scratch), any = prim->ops->occluded(prim, ray, scratch);
    bool exists = truth.part != HIT_NONE;
    row_trial(row, found == exists && any == exists && hit.part == truth.part && (!found || hit.t == truth.t),
              "%s: triangle %u, not %u; %s", name, hit.part, truth.part, ray_text(ray).text);
}

/* Toward a corner of one of the triangles; often in the planes of faces of its box, with zeros of both signs. */
static Ray heap_ray(const Mesh *mesh, Rng *rng)
{
    const uint32_t *k = mesh->triangle[rng_u32(rng) % mesh->triangle_count];
    Vec3 target = mesh->position[k[rng_u32(rng) % 3]], from = vec3_scale(random_vector(rng), 3);
    if (rng_u32(rng) % 2) target = vec3_at(target, 0.3, vec3_sub(mesh->position[k[0]], target));
    double o[3] = {from.x, from.y, from.z}, d[3];
    for (int a = 0; a < 3; a++) {
        d[a] = vec3_get(target, a) - o[a];
        if (rng_u32(rng) % 4) continue;
        o[a] = vec3_get(target, a);
        d[a] = rng_u32(rng) % 2 ? 0.0 : -0.0;
    }
    if (d[0] == 0 && d[1] == 0 && d[2] == 0) d[rng_u32(rng) % 3] = 1;
    return (Ray){{o[0], o[1], o[2]}, {d[0], d[1], d[2]}, 0, INFINITY};
}

static void heaps(Row *row, uint64_t trials)
{
    static const char *const NAME[HEAPS] = {"all the same", "one centre", "one huge", "flat"};
    Scratch scratch = scratch_create();
    Rng rng = rng_seed(SEED, 38);
    for (int kind = 0; kind < HEAPS; kind++) {
        Mesh mesh = heap_create(kind, 250, &rng);
        Prim *prim = prim_of(&mesh, false);
        for (uint64_t i = 0; i < trials / HEAPS; i++) {
            Ray ray = heap_ray(&mesh, &rng);
            compare_with_search(row, NAME[kind], &mesh, prim, &ray, &scratch);
        }
        prim_destroy(prim);
        free(mesh.position);
        free(mesh.triangle);
    }
    arena_destroy(scratch.arena);
}

static void large_heaps(Row *row, uint64_t trials)
{
    static const char *const NAME[HEAPS] = {"all the same", "one centre", "one huge", "flat"};
    Scratch scratch = scratch_create();
    Rng rng = rng_seed(SEED, 380);
    uint32_t count = trials < 400 ? 100000 : 1000000;
    for (int kind = 0; kind < HEAPS; kind++) {
        Mesh mesh = heap_create(kind, count, &rng);
        Prim *prim = prim_of(&mesh, false);
        for (uint64_t i = 0; i < trials / HEAPS; i++) {
            Ray ray = heap_ray(&mesh, &rng);
            compare_with_search(row, NAME[kind], &mesh, prim, &ray, &scratch);
        }
        prim_destroy(prim);
        free(mesh.position);
        free(mesh.triangle);
    }
    arena_destroy(scratch.arena);
}

#define EMBREE "Embree: 2e-5 of rays leak at edges or hit twice"

const StabilityCase mesh_cases[] = {
    {24, "mesh 200 x 200: edge midpoints, vertices", "analytic", EMBREE, 60000, 1000000, 10000000, watertight_edges},
    {24, "mesh 200 x 200: random rays", "analytic", EMBREE, 60000, 1000000, 100000000, watertight_random},
    {25, "vertex shared by 1000 triangles", "analytic", EMBREE, 15000, 1000000, 10000000, shared_vertex},
    {26, "triangles of no area: dropped, one warning", "analytic", "", 20000, 1000000, 10000000, degenerate},
    {28, "ground 1e7 wide with 1e-3 detail", "analytic", "", 200000, 2000000, 100000000, fine_detail},
    {38, "BVH: same, one centre, one huge, flat", "analytic", "", 60000, 1000000, 10000000, heaps},
    {38, "BVH: the same of 1,000,000 triangles", "analytic", "", 60, 800, 10000, large_heaps},
    {0},
};
