/* Triangles where they are stiff: watertight at edges and vertices, slivers, extreme sizes, degenerate hierarchies. */
#include "stability/ray_check.h"

#include <mpfr.h>
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

/* The program's test of one triangle, at any t. */
static bool cross_triangle(const Shear *shear, const Vec3 *a, const Vec3 *b, const Vec3 *c, double *t, double *u, double *v)
{
    TriangleCut cut;
    if (!triangle_cut(shear, a, b, c, &cut)) return false;
    double err;
    *t = triangle_t(shear, a, b, c, &err);
    *u = cut.u;
    *v = cut.v;
    return true;
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
        n += cross_triangle(&shear, &mesh->position[k[0]], &mesh->position[k[1]], &mesh->position[k[2]], &t, &u, &v) && t > 0;
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
        uint64_t pass = (trials + 2) / 3, step = trials >= 480000 ? 1 : 8;  /* in a short run every eighth */
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
        for (uint64_t i = 0; i < (trials + 2) / 3; i++) {
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
        for (uint64_t i = 0; i < (trials + 2) / 3; i++) {
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

/* -- 27: signs and places of well-shaped triangles and slivers -- */

/* Of 1 about the origin or 1e-3 at 1e5 from it, or 1e7 about it; its height a millionth of its length, or of the same size. */
static double random_triangle(Rng *rng, Vec3 v[3])
{
    static const double SIZE[] = {1, 1e-3, 1e7}, AWAY[] = {1, 1e5, 0.1};
    uint32_t place = rng_u32(rng) % 3;
    double size = SIZE[place], height = size * (rng_u32(rng) % 2 ? 1e-6 : uniform(rng, 0.3, 1));
    Vec3 along = random_direction(rng), up = vec3_normalize(vec3_cross(along, random_direction(rng)));
    v[0] = vec3_scale(random_vector(rng), AWAY[place]);
    v[1] = vec3_at(v[0], size, along);
    v[2] = vec3_at(vec3_at(v[0], size * uniform(rng, -0.5, 1.5), along), height, up);
    return size;
}

/* Toward the target from far or near, at any angle or nearly in the triangle's plane; of any length. */
static Ray ray_toward(Rng *rng, Vec3 target, const Vec3 v[3], double size)
{
    Vec3 from = random_direction(rng), n = vec3_normalize(vec3_cross(vec3_sub(v[1], v[0]), vec3_sub(v[2], v[0])));
    if (rng_u32(rng) % 2) from = vec3_at(vec3_cross(from, n), exp2(-uniform(rng, 0, 40)), n);
    Vec3 o = vec3_at(target, size * exp2(uniform(rng, -8, 20)), from), d = vec3_sub(target, o);
    return (Ray){o, rng_u32(rng) % 2 ? d : vec3_scale(d, exp2(uniform(rng, -60, 60))), 0, INFINITY};
}

/* For determinants without rounding, of coordinates within 2^-300 to 2^100 and a shift of 2^-1200 squared. */
enum { EXACT_BITS = 4200 };
typedef struct { mpfr_t o[3], p[3], q[3], term, sum; } Volume;

static void volume_open(Volume *m)
{
    for (int i = 0; i < 3; i++) mpfr_inits2(EXACT_BITS, m->o[i], m->p[i], m->q[i], (mpfr_ptr)NULL);
    mpfr_inits2(EXACT_BITS, m->term, m->sum, (mpfr_ptr)NULL);
}

static void volume_close(Volume *m)
{
    for (int i = 0; i < 3; i++) mpfr_clears(m->o[i], m->p[i], m->q[i], (mpfr_ptr)NULL);
    mpfr_clears(m->term, m->sum, (mpfr_ptr)NULL);
}

/* The sign of d . ((p - o) x (q - o)), o being shifted by 2^-1200 along the axis x and its square along y if asked to. */
static int volume_sign(Volume *m, const Ray *ray, Vec3 p, Vec3 q, bool shifted, int x, int y)
{
    int inexact = 0;
    for (int i = 0; i < 3; i++) {
        mpfr_set_d(m->o[i], vec3_get(ray->o, i), MPFR_RNDN);
        mpfr_set_ui_2exp(m->term, 1, i == x ? -1200 : -2400, MPFR_RNDN);
        if (shifted && (i == x || i == y)) inexact |= mpfr_add(m->o[i], m->o[i], m->term, MPFR_RNDN);
        inexact |= mpfr_d_sub(m->p[i], vec3_get(p, i), m->o[i], MPFR_RNDN);
        inexact |= mpfr_d_sub(m->q[i], vec3_get(q, i), m->o[i], MPFR_RNDN);
    }
    mpfr_set_zero(m->sum, 1);
    for (int i = 0; i < 3; i++)
        for (int k = 1; k < 3; k++) {
            inexact |= mpfr_mul(m->term, m->p[(i + k) % 3], m->q[(i + 3 - k) % 3], MPFR_RNDN);
            inexact |= mpfr_mul_d(m->term, m->term, k == 1 ? vec3_get(ray->d, i) : -vec3_get(ray->d, i), MPFR_RNDN);
            inexact |= mpfr_add(m->sum, m->sum, m->term, MPFR_RNDN);
        }
    CHECK(!inexact);
    return mpfr_sgn(m->sum);
}

/* The true signs of the edges opposite to each corner, those of zero determinants by an actual shift; the triangle's if they
 * are the same, else 0. */
static int true_signs(Volume *m, const Vec3 v[3], const Ray *ray, const Shear *s, int truth[3])
{
    for (int i = 0; i < 3; i++) {
        Vec3 p = v[(i + 2) % 3], q = v[(i + 1) % 3];
        truth[i] = volume_sign(m, ray, p, q, false, 0, 0);
        if (truth[i] == 0) truth[i] = volume_sign(m, ray, p, q, true, (int)s->kx, (int)s->ky);
        if (vec3_get(ray->d, (int)s->kz) < 0) truth[i] = -truth[i];
    }
    return truth[0] == truth[1] && truth[0] == truth[2] ? truth[0] : 0;
}

/* All edges and the triangle as a whole against the exact signs. */
static void check_signs(Row *row, Volume *m, const Vec3 v[3], const Ray *ray)
{
    Shear s = shear_of(ray);
    double z, edge[3], value[3];
    Sheared h[3] = {shear(&s, &v[0]), shear(&s, &v[1]), shear(&s, &v[2])};
    double margin = edge_margin(h[0], h[1], h[2], &z);
    int truth[3], sign[3], certain[3], facing = true_signs(m, v, ray, &s, truth);
    bool right = true;
    for (int i = 0; i < 3; i++) {
        int p = (i + 2) % 3, q = (i + 1) % 3;
        edge[i] = edge_function(h[p], h[q]);
        certain[i] = edge_sign(&s, &v[p], &v[q], &value[i]);
        sign[i] = edge[i] > margin ? 1 : edge[i] < -margin ? -1 : certain[i];
        right = right && sign[i] == truth[i] && certain[i] == truth[i] && edge_sign(&s, &v[q], &v[p], &z) == -truth[i];
    }
    TriangleCut cut;
    bool crosses = triangle_cut(&s, &v[0], &v[1], &v[2], &cut);
    right = right && (crosses ? cut.facing : 0) == facing;
    row_trial(row, right, "signs %d %d %d, not %d %d %d; %s", sign[0], sign[1], sign[2], truth[0], truth[1], truth[2],
              ray_text(ray).text);
}

/* Two whole numbers below 2^50 and a b' - b a' = their greatest common divisor, by Euclid. */
static void bezout(Rng *rng, double *a, double *b, double *a2, double *b2)
{
    int64_t p = (int64_t)(rng_u32(rng) | 1) << 17 | rng_u32(rng) % 0x20000;
    int64_t q = (int64_t)(rng_u32(rng) | 1) << 17 | rng_u32(rng) % 0x20000;
    int64_t x = p, y = q, fx = 1, fy = 0, gx = 0, gy = 1;  /* x = fx p + gx q */
    while (y != 0) {
        int64_t n = x / y, rest = x - n * y, f = fx - n * fy, g = gx - n * gy;
        x = y, fx = fy, gx = gy;
        y = rest, fy = f, gy = g;
    }
    *a = (double)p;
    *b = (double)q;
    *a2 = (double)-gx;
    *b2 = (double)fx;
}

/* An edge that the ray passes at 2^-100 to 2^-150 of its determinant's terms, which double-double may not tell from 0: with
 * d = (a, b, 0), p - o = (k a, k b, s) and q - o = (a', b', r) it is s (a b' - b a'). */
static Ray nearly_singular(Rng *rng, Vec3 v[3], int corner)
{
    double a, b, a2, b2, k = 1 + rng_u32(rng) % 4;
    bezout(rng, &a, &b, &a2, &b2);
    double s = ldexp(1 + rng_u32(rng) % 8, (int)(rng_u32(rng) % 48)), r = ldexp(1 + rng_u32(rng), 17) + rng_u32(rng) % 0x20000;
    double o[3], d[3] = {a, b, 0}, p[3] = {k * a, k * b, s}, q[3] = {a2, b2, r};
    for (int i = 0; i < 3; i++) {
        o[i] = rng_u32(rng) % 1024;
        p[i] += o[i];
        q[i] += o[i];
    }
    int x = (int)(rng_u32(rng) % 3), y = (x + 1) % 3, z = (x + 2) % 3;
    v[corner] = vec3_make(p[x], p[y], p[z]);
    v[(corner + 1) % 3] = vec3_make(q[x], q[y], q[z]);
    v[(corner + 2) % 3] = vec3_scale(random_vector(rng), 0x1p50);
    return (Ray){vec3_make(o[x], o[y], o[z]), vec3_make(d[x], d[y], d[z]), 0, INFINITY};
}

/* Rays past an edge at 2^-60 to 1 of the triangle's size, through it, and through a vertex; and nearer than 2^-100. */
static void exact_signs(Row *row, uint64_t trials)
{
    Rng rng = rng_seed(SEED, 27);
    Volume m;
    volume_open(&m);
    for (uint64_t i = 0; i < trials; i++) {
        Vec3 v[3];
        Ray ray;
        int k = (int)(rng_u32(&rng) % 3);
        if (i % 8 == 3) {
            ray = nearly_singular(&rng, v, k);
        } else if (i % 4 == 0) {  /* on whole numbers, so that points of edges, origins and directions are exact */
            for (int j = 0; j < 3; j++)
                v[j] = vec3_make(2 * (rng_u32(&rng) % 64), 2 * (rng_u32(&rng) % 64), 2 * (rng_u32(&rng) % (i % 8 ? 64 : 2)));
            Vec3 target = i % 16 ? vec3_scale(vec3_add(v[k], v[(k + 1) % 3]), 0.5) : v[k];
            Vec3 o = vec3_make(rng_u32(&rng) % 64, rng_u32(&rng) % 64, rng_u32(&rng) % 64);
            Vec3 d = vec3_sub(target, o);
            if (rng_u32(&rng) % 4 == 0) d = vec3_sub(v[(k + 1) % 3], v[k]);  /* along an edge */
            if (!(vec3_max(vec3_abs(d)) > 0)) d.z = 1;
            ray = (Ray){o, vec3_scale(d, ldexp(1, (int)(rng_u32(&rng) % 100) - 50)), 0, INFINITY};
        } else {
            double size = random_triangle(&rng, v), off = size * exp2(-uniform(&rng, 0, 60)) * (rng_u32(&rng) % 2 ? 1 : -1);
            Vec3 side = vec3_sub(v[(k + 1) % 3], v[k]), across = vec3_cross(side, vec3_cross(side, vec3_sub(v[(k + 2) % 3], v[k])));
            Vec3 target = vec3_at(v[k], i % 16 == 1 ? 0 : rng_double(&rng), side);
            if (i % 16 != 2) target = vec3_at(target, off, vec3_normalize(across));
            ray = ray_toward(&rng, target, v, size);
        }
        check_signs(row, &m, v, &ray);
    }
    volume_close(&m);
    mpfr_free_cache();
}

/* The crossing with the plane of a triangle, from the coordinates as given. */
typedef struct {
    Quad t, n[3];
    double moves;  /* of t, to first order, when each component of the ray moves by its own size in the worst direction */
    double fuzz;   /* of t, by quad's own rounding */
} PlaneTruth;

static PlaneTruth plane_truth(const Vec3 v[3], const Ray *ray)
{
    Quad e[3], f[3], to[3], top = 0, slope = 0, sum = 0, sizes = 0;
    PlaneTruth truth;
    for (int i = 0; i < 3; i++) {
        Quad a = vec3_get(v[0], i);
        e[i] = vec3_get(v[1], i) - a;
        f[i] = vec3_get(v[2], i) - a;
        to[i] = a - vec3_get(ray->o, i);
    }
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        truth.n[i] = e[j] * f[k] - e[k] * f[j];
        top += truth.n[i] * to[i];
        slope += truth.n[i] * vec3_get(ray->d, i);
    }
    truth.t = top / slope;
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        Quad way = q_abs(truth.t * vec3_get(ray->d, i));
        sum += q_abs(truth.n[i]) * (q_abs(vec3_get(ray->o, i)) + way);
        sizes += (q_abs(e[j] * f[k]) + q_abs(e[k] * f[j])) * (q_abs(to[i]) + way);
    }
    truth.moves = (double)(sum / q_abs(slope));
    truth.fuzz = (double)(0x1p-110 * sizes / q_abs(slope));
    return truth;
}

/* t within 4 ulps where its condition number is at most 16; its bound true, and at most 64 times what that explains. */
enum { T_ULPS = 4, T_CONDITION = 16, T_SLACK = 64 };

static void check_place(Row *row, const Mesh *mesh, const Prim *prim, const Ray *ray, const Edge *edge)
{
    Vec3 v[3];
    for (int i = 0; i < 3; i++) v[i] = mesh->position[mesh->triangle[edge->part][i]];
    PlaneTruth truth = plane_truth(v, ray);
    double size = fabs((double)truth.t), off = fmax(0, (double)q_abs(truth.t - edge->t) - truth.fuzz);
    double ulps = off / (nextafter(size, INFINITY) - size), loose = edge->t_err / (UNIT_ROUNDOFF * truth.moves + truth.fuzz);
    bool measured = truth.moves <= T_CONDITION * size;
    if (measured) row->t_ulps = fmax(row->t_ulps, ulps);
    row_trial(row, off <= edge->t_err && loose <= T_SLACK && (!measured || ulps <= T_ULPS),
              "t %.3g ulps, of its bound %.3g, bound / explained %.3g; %s", ulps, off / edge->t_err, loose, ray_text(ray).text);

    /* the point: on the plane within its bound, that being some roundings of the triangle's coordinates */
    Hit hit = {.t = edge->t, .u = edge->u, .v = edge->v, .part = edge->part};
    Surface s;
    prim->ops->surface(prim, ray, &hit, true, &s);
    Quad n[3] = {truth.n[0], truth.n[1], truth.n[2]}, height = 0, allowed = 0;
    for (int i = 0; i < 3; i++) {
        height += n[i] * ((Quad)vec3_get(s.p, i) - vec3_get(v[0], i));
        allowed += q_abs(n[i]) * vec3_get(s.p_err, i);
    }
    double reach = vec3_max(vec3_most(vec3_abs(v[0]), vec3_most(vec3_abs(v[1]), vec3_abs(v[2]))));
    double wide = vec3_max(s.p_err) / (UNIT_ROUNDOFF * reach), angle = angle_ulps(s.n, n);
    row->n_ulps = fmax(row->n_ulps, angle);
    row_trial(row, q_abs(height) <= allowed && wide <= T_SLACK && angle <= T_SLACK,
              "point %.3g of its bound, of %.3g roundings, normal %.3g; %s", (double)(q_abs(height) / allowed), wide, angle,
              ray_text(ray).text);
}

static uint32_t true_crossings(Volume *m, const Mesh *mesh, const Ray *ray)
{
    Shear s = shear_of(ray);
    uint32_t n = 0;
    for (uint32_t i = 0; i < mesh->triangle_count; i++) {
        Vec3 v[3];
        int truth[3];
        for (int k = 0; k < 3; k++) v[k] = mesh->position[mesh->triangle[i][k]];
        n += true_signs(m, v, ray, &s, truth) != 0;
    }
    return n;
}

/* Through triangles and slivers that are a face of a tetrahedron each; nearly parallel rays whose target was rounded may
 * miss it. */
static void places(Row *row, uint64_t trials)
{
    Scratch scratch = scratch_create();
    Rng rng = rng_seed(SEED, 270);
    Volume m;
    volume_open(&m);
    for (uint64_t i = 0; i < trials; i += 16) {
        Vec3 v[4];
        double size = random_triangle(&rng, v);
        v[3] = vec3_at(v[0], size, vec3_normalize(vec3_cross(vec3_sub(v[2], v[0]), vec3_sub(v[1], v[0]))));
        uint32_t faces[4] = {3, 3, 3, 3}, index[12] = {0, 1, 2, 0, 3, 1, 1, 3, 2, 2, 3, 0};
        Mesh *mesh = mesh_from_faces(v, 4, faces, 4, index, NULL);
        CHECK(mesh);
        Prim *prim = prim_of(mesh, true);
        for (int k = 0; k < 16; k++) {
            double b = uniform(&rng, 0.1, 0.8), c = uniform(&rng, 0.1, 0.9 - b);
            Vec3 target = vec3_at(vec3_at(v[0], b, vec3_sub(v[1], v[0])), c, vec3_sub(v[2], v[0]));
            Ray ray = ray_toward(&rng, target, v, size);
            arena_reset(scratch.arena);
            SegList list = seg_list(&scratch);
            CHECK(prim->ops->segments(prim, &ray, &list));
            bool right = list.count == 1 || 2 * list.count == true_crossings(&m, mesh, &ray);
            if (!row_trial(row, right, "%u segments; %s", list.count, ray_text(&ray).text) || list.count != 1) continue;
            const Edge *in = &list.seg[0].in, *out = &list.seg[0].out, *first = in->t > 0 ? in : out->t > 0 ? out : NULL;
            check_place(row, mesh, prim, &ray, in);
            check_place(row, mesh, prim, &ray, out);
            Hit hit = {.t = 0};
            bool found = prim->ops->intersect(prim, &ray, &hit, &scratch), same = found == (first != NULL);
            if (found && same) {
                Ray to = ray, before = ray;
                to.tmax = hit.t;
                before.tmax = nextafter(hit.t, 0);
                same = hit.t == first->t && prim->ops->occluded(prim, &to, &scratch) &&
                       !prim->ops->occluded(prim, &before, &scratch);
            }
            row_trial(row, same, "intersect and occluded aren't the first edge; %s", ray_text(&ray).text);
        }
        prim_destroy(prim);
        mesh_destroy(mesh);
    }
    volume_close(&m);
    mpfr_free_cache();
    arena_destroy(scratch.arena);
}

/* -- 28: fine detail on a huge ground -- */

/* Whether a ray, beyond its start and before `far`, meets the box grown by `by`. */
static bool meets_box(const Quad o[3], Vec3 d, Quad far, Vec3 lo, Vec3 hi, double by)
{
    Quad near = 0;
    for (int a = 0; a < 3; a++) {
        Quad x = vec3_get(d, a), p = (vec3_get(lo, a) - (Quad)by - o[a]) / x, q = (vec3_get(hi, a) + (Quad)by - o[a]) / x;
        near = q_max(near, q_min(p, q));
        far = q_min(far, q_max(p, q));
    }
    return near <= far;
}

/* A point of the ground is the corner with two edges of up to 1e7 added: the weight of each has 3 roundings (a quotient and
 * its terms'), the product one, the sums two, so 10 of the greatest coordinate, those of the ray among them. 16 to spare. */
static double fine_tolerance(const Ray *ray, double half)
{
    return 16 * UNIT_ROUNDOFF * fmax(2 * half, fmax(vec3_max(vec3_abs(ray->o)), vec3_max(vec3_abs(ray->d))));
}

/* A ground of two triangles and a box of 1e-3 on it. Rays down are stopped where they truly cross the ground, or by the box
 * before; from there, rays to a light are stopped by the box alone, and as their own coordinates have it: quad leaves open
 * those alone that pass an edge of the box at 2^-90. */
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
            Quad t = -(Quad)o.y / ray.d.y, from[3] = {o.x, o.y, o.z}, truth[3];
            for (int k = 0; k < 3; k++) truth[k] = k == 1 ? 0 : from[k] + t * vec3_get(ray.d, k);
            if (q_abs(truth[0]) > half || q_abs(truth[2]) > half) continue;
            double tolerance = fine_tolerance(&ray, half);
            bool box = meets_box(from, ray.d, t, lo, hi, tolerance), within = meets_box(from, ray.d, 0, lo, hi, tolerance);
            bool box_surely = !within && meets_box(from, ray.d, t, lo, hi, -tolerance);  /* from within, its floor is the ground */
            Hit hit;
            bool stopped = prim->ops->intersect(prim, &ray, &hit, &scratch), ground = stopped && hit.part <= 1;
            Surface s = {0};
            if (stopped) prim->ops->surface(prim, &ray, &hit, true, &s);
            double ulp = nextafter((double)t, INFINITY) - (double)t;
            bool tight = stopped && (ground ? !box_surely && s.p.y == 0 && q_abs(hit.t - t) <= T_ULPS * (Quad)ulp &&
                                                  q_abs(s.p.x - truth[0]) <= tolerance && q_abs(s.p.z - truth[2]) <= tolerance
                                            : box && hit.t <= t + T_ULPS * (Quad)ulp);
            if (!row_trial(row, tight, "leak: %s", ray_text(&ray).text) || !ground) continue;
            Vec3 n = vec3_normalize(s.n), start = vec3_at(s.p, vec3_dot(vec3_abs(n), s.p_err), n);
            Vec3 light = vec3_make(uniform(&rng, -1, 1), pow(10, -uniform(&rng, 0, 6)), uniform(&rng, -1, 1));
            if (i % 2) light = vec3_sub(vec3_add(vec3_scale(vec3_add(lo, hi), 0.5), vec3_scale(random_vector(&rng), size)), start);
            if (!(light.y > 0)) continue;
            Ray shadow = {start, light, 0, INFINITY};
            Quad begin[3] = {start.x, start.y, start.z};
            bool surely = meets_box(begin, light, INFINITY, lo, hi, -0x1p-90);
            row->undecided += surely != meets_box(begin, light, INFINITY, lo, hi, 0x1p-90);
            if (surely != meets_box(begin, light, INFINITY, lo, hi, 0x1p-90)) continue;
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
        if (!cross_triangle(&shear, &m->position[k[0]], &m->position[k[1]], &m->position[k[2]], &t, &u, &v)) continue;
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
    {27, "slivers 1e6:1, rays nearly parallel: signs", "MPFR", "", 100000, 2000000, 20000000, exact_signs},
    {27, "slivers 1e6:1, rays nearly parallel: t, n", "quad", "", 50000, 2000000, 100000000, places},
    {28, "ground 1e7 wide with 1e-3 detail", "quad", "", 200000, 2000000, 100000000, fine_detail},
    {38, "BVH: same, one centre, one huge, flat", "analytic", "", 60000, 1000000, 10000000, heaps},
    {38, "BVH: the same of 1,000,000 triangles", "analytic", "", 60, 800, 10000, large_heaps},
    {0},
};
