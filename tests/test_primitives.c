/* Laws that every primitive keeps, run over a list of all of them, also against the oracle of their crossings in
 * __float128. A failing ray is printed in full (hexadecimal) with its seed. */
#include "node/primitive/primitive.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "common/numeric.h"
#include "common/rng.h"
#include "support/oracle.h"

/* -- the list of primitives -- */

typedef struct Row {
    const char *name;
    Prim *(*make)(void);
    bool convex;
    double ulps;               /* how far t may be from the truth */
    OracleTruth *truth;        /* NULL: none is known */
    OracleDistance *distance;  /* of p from the surface; NULL: none */
    double minor;              /* of a torus */
} Row;

#define TORUS(suffix, radius)                                  \
    static Prim *torus_##suffix(void) { return torus_create(radius); }
TORUS(thread, 1e-6)
TORUS(thin, 0.05)
TORUS(half, 0.5)
TORUS(fat, 1 - 1e-12)
TORUS(horn, 1)
TORUS(spindle, 1.3)
TORUS(apple, 20)

static const Row ROWS[] = {
    {"sphere", sphere_create, true, 4, sphere_truth, sphere_distance, 0},
    {"cube", cube_create, true, 4, cube_truth, cube_distance, 0},
    {"cylinder", cylinder_create, true, 4, cylinder_truth, cylinder_distance, 0},
    {"cone", cone_create, true, 4, cone_truth, cone_distance, 0},
    {"torus 1e-6", torus_thread, false, 16, torus_truth, torus_distance, 1e-6},
    {"torus 0.05", torus_thin, false, 16, torus_truth, torus_distance, 0.05},
    {"torus 0.5", torus_half, false, 16, torus_truth, torus_distance, 0.5},
    {"torus 1-1e-12", torus_fat, false, 16, torus_truth, torus_distance, 1 - 1e-12},
    {"torus 1", torus_horn, false, 16, torus_truth, torus_distance, 1},
    {"torus 1.3", torus_spindle, false, 16, torus_truth, torus_distance, 1.3},
    {"torus 20", torus_apple, false, 16, torus_truth, torus_distance, 20},
};

enum { ROW_COUNT = sizeof ROWS / sizeof ROWS[0] };

typedef struct {
    const Row *row;
    Prim *prim;
    Scratch scratch;
    uint64_t seed;
    Ray ray;        /* the one being tried: what a failure prints */
} Case;

static bool failed(const Case *c, const char *law)
{
    const Ray *r = &c->ray;
    print_error("%s: %s (seed %llu)\n  o = {%a, %a, %a}, d = {%a, %a, %a}, tmin %a tmax %a\n", c->row->name, law,
                (unsigned long long)c->seed, r->o.x, r->o.y, r->o.z, r->d.x, r->d.y, r->d.z, r->tmin, r->tmax);
    return false;
}

#define LAW(condition, law) do { if (!(condition)) return failed(c, law); } while (0)

/* -- random rays -- */

static double uniform(Rng *rng, double lo, double hi) { return lo + (hi - lo) * rng_double(rng); }

static Vec3 random_direction(Rng *rng)
{
    for (;;) {
        Vec3 v = vec3_make(uniform(rng, -1, 1), uniform(rng, -1, 1), uniform(rng, -1, 1));
        double l = vec3_dot(v, v);
        if (l > 0.01 && l < 1) return vec3_scale(v, 1 / sqrt(l));
    }
}

/* Mostly moderate, sometimes an exact 0, -0, a subnormal or any power of ten. */
static void spoil_component(Rng *rng, double *x)
{
    switch (rng_u32(rng) % 40) {
    case 0: *x = 0; break;
    case 1: *x = -0.0; break;
    case 2: *x *= 5e-324 * 0x1p60; break;
    case 3: *x *= pow(10, uniform(rng, -300, 0)); break;
    case 4: *x *= 1e-300; break;
    default: break;
    }
}

static Vec3 random_inside(Rng *rng, Box b)
{
    return vec3_make(uniform(rng, b.lo.x, b.hi.x), uniform(rng, b.lo.y, b.hi.y), uniform(rng, b.lo.z, b.hi.z));
}

/* Rays towards the box: from far, near, inside, with exact zeros, along the axes, of all lengths. */
static Ray random_ray(Rng *rng, Box b, double reach_decades)
{
    Vec3 target = random_inside(rng, b), d = random_direction(rng), o;
    uint32_t kind = rng_u32(rng) % 16;
    double distance = pow(10, uniform(rng, -3, reach_decades));
    if (kind < 3) {
        d = vec3_make(0, 0, 0);
        double *axis = kind == 0 ? &d.x : kind == 1 ? &d.y : &d.z;
        *axis = rng_u32(rng) % 2 ? 1 : -1;
    }
    if (kind == 3) target = vec3_make(0, 0, 0);
    if (kind == 4) target = vec3_make(round(target.x), target.y, round(target.z));
    if (kind == 5) target = vec3_make(round(2 * target.x) / 2, round(2 * target.y) / 2, round(2 * target.z) / 2);
    o = kind == 6 ? target : vec3_at(target, -distance, d);
    spoil_component(rng, &d.x);
    spoil_component(rng, &d.y);
    spoil_component(rng, &d.z);
    if (rng_u32(rng) % 4 == 0) d = vec3_scale(d, pow(10, uniform(rng, -200, 200)));
    if (!(vec3_max(vec3_abs(d)) > 0)) d.y = 1;
    return (Ray){o, d, rng_u32(rng) % 4 ? 0 : -INFINITY, INFINITY};
}

/* A ray that touches the unit sphere about a point, or the rim of a cylinder, but for 2^-k. */
static Ray tangent_ray(Rng *rng, double radius)
{
    Vec3 n = random_direction(rng), d = vec3_cross(n, random_direction(rng));
    double gap = ldexp(1, -(int)(10 + rng_u32(rng) % 43)), side = rng_u32(rng) % 2 ? 1 : -1;
    Vec3 o = vec3_at(vec3_scale(n, radius * (1 + side * gap)), uniform(rng, -10, 10), d);
    return (Ray){o, d, -INFINITY, INFINITY};
}

static Ray draw(Rng *rng, const Case *c, double decades)
{
    Box b = c->prim->ops->bounds(c->prim);
    if (rng_u32(rng) % 16 == 0) return tangent_ray(rng, c->row->minor > 0 ? 1 + c->row->minor : 1);
    return random_ray(rng, b, decades);
}

/* -- laws of one ray -- */

static bool hit_of(const Case *c, const Ray *ray, Hit *hit)
{
    *hit = (Hit){.object = HIT_NONE};
    return c->prim->ops->intersect(c->prim, ray, hit, (Scratch *)&c->scratch);
}

static bool same_hit(bool a, bool b, const Hit *x, const Hit *y)
{
    return a == b && (!a || (x->t == y->t && x->u == y->u && x->v == y->v && x->part == y->part));
}

static bool finite3(Vec3 v) { return isfinite(v.x) && isfinite(v.y) && isfinite(v.z); }

static bool law_segments(Case *c)
{
    const PrimOps *ops = c->prim->ops;
    if (!ops->segments) return true;
    SegList list = seg_list(&c->scratch);
    LAW(ops->segments(c->prim, &c->ray, &list), "segments failed");
    double last = -INFINITY;
    const Edge *first = NULL;
    for (uint32_t i = 0; i < list.count; i++) {
        const Edge *edge[2] = {&list.seg[i].in, &list.seg[i].out};
        LAW(i == 0 || edge[0]->t >= last, "segments overlap");
        LAW(edge[0]->t <= edge[1]->t, "a segment runs backwards");
        last = edge[1]->t;
        for (int k = 0; k < 2; k++) {
            LAW(isfinite(edge[k]->t) && edge[k]->t_err >= 0, "an edge isn't finite");
            LAW(finite3(edge[k]->n) && vec3_max(vec3_abs(edge[k]->n)) > 0, "an edge without a normal");
            LAW(edge[k]->leaf == 0 || !c->row->truth, "a leaf number");
            if (!first && edge[k]->t > c->ray.tmin) first = edge[k];
        }
    }
    LAW(!c->row->convex || list.count <= 1, "two segments through a convex solid");
    Hit hit;
    bool found = hit_of(c, &c->ray, &hit), expected = first && first->t <= c->ray.tmax;
    LAW(found == expected, "intersect and segments disagree");
    LAW(!found || (hit.t == first->t && hit.u == first->u && hit.v == first->v && hit.part == first->part),
        "the first edge past tmin isn't the hit");
    return true;
}

static bool law_hit(Case *c)
{
    const PrimOps *ops = c->prim->ops;
    Hit hit, other;
    bool found = hit_of(c, &c->ray, &hit);
    if (ops->occluded) LAW(ops->occluded(c->prim, &c->ray, &c->scratch) == found, "occluded disagrees");
    if (!found) return true;
    LAW(hit.t > c->ray.tmin && hit.t <= c->ray.tmax, "t out of range");
    LAW(hit.object == HIT_NONE, "the world's index was touched");

    Ray clipped = c->ray;
    clipped.tmax = hit.t;
    LAW(same_hit(found, hit_of(c, &clipped, &other), &hit, &other), "tmax = t loses the hit");
    clipped.tmax = nextafter(hit.t, -INFINITY);
    if (clipped.tmax > clipped.tmin) LAW(!hit_of(c, &clipped, &other), "a hit beyond tmax");
    clipped = c->ray;
    clipped.tmin = hit.t;
    LAW(!hit_of(c, &clipped, &other) || other.t > hit.t, "a hit at tmin");

    Ray doubled = c->ray;
    doubled.d = vec3_scale(doubled.d, 2);
    doubled.tmin /= 2;
    doubled.tmax /= 2;
    bool normal = fabs(hit.t) > 0x1p-1000 && vec3_max(vec3_abs(c->ray.d)) < 0x1p1000;
    if (normal) LAW(hit_of(c, &doubled, &other) && other.t == hit.t / 2, "doubling the direction doesn't halve t");

    Surface s;
    ops->surface(c->prim, &c->ray, &hit, true, &s);
    LAW(finite3(s.p) && finite3(s.p_err) && finite3(s.n) && finite3(s.ns), "a surface that isn't finite");
    LAW(isfinite(s.u) && isfinite(s.v) && s.u >= 0 && s.u <= 1 && s.v >= 0 && s.v <= 1, "texture coordinates");
    LAW(vec3_max(vec3_abs(s.n)) > 0, "no normal");
    Box b = ops->bounds(c->prim);
    LAW(s.p.x >= b.lo.x - s.p_err.x && s.p.x <= b.hi.x + s.p_err.x && s.p.y >= b.lo.y - s.p_err.y &&
        s.p.y <= b.hi.y + s.p_err.y && s.p.z >= b.lo.z - s.p_err.z && s.p.z <= b.hi.z + s.p_err.z, "out of bounds");
    if (c->row->distance) {
        /* p_err is a box: it must reach the surface along the normal */
        double l = sqrt(vec3_dot(s.n, s.n));
        double reach = vec3_dot(vec3_abs(s.n), s.p_err) / l;
        LAW((double)q_abs(c->row->distance(c->row->minor, &s, hit.part)) <= reach * (1 + 0x1p-20), "p_err is too small");
    }
    if (c->row->convex) {
        double away = (vec3_dot(vec3_abs(s.n), s.p_err) + 0x1p-50) / vec3_dot(s.n, s.n);
        Rng rng = rng_seed(c->seed, 77);
        for (int i = 0; i < 3; i++) {
            Ray leave = {vec3_at(s.p, away, s.n), random_direction(&rng), 0, INFINITY};
            if (vec3_dot(leave.d, s.n) < 0) leave.d = vec3_neg(leave.d);
            LAW(!hit_of(c, &leave, &other), "a leaving ray hits again");
        }
    }
    return true;
}

static double ulps_between(double t, Quad truth)
{
    double ulp = nextafter(fabs((double)truth), INFINITY) - fabs((double)truth);
    return (double)(q_abs(truth - t) / ulp);
}

/* Largest ulps seen, for the record. */
typedef struct { double ulps, bound_use; long hits; } Worst;

static bool law_truth(Case *c, Worst *worst)
{
    if (!c->row->truth) return true;
    Truth truth;
    c->row->truth(c->row->minor, &c->ray, &truth);
    for (int i = 0; i < truth.n; i++)
        if (q_abs(truth.t[i]) > 0x1p1000 || q_abs(truth.t[i]) < 0x1p-1000) return true;
    SegList list = seg_list(&c->scratch);
    LAW(c->prim->ops->segments(c->prim, &c->ray, &list), "segments failed");
    if (!truth_decided(&truth)) return true;
    if (2 * (int)list.count != truth.n) print_error("%u segments, truth %d crossings, sure %g\n", list.count, truth.n,
                                                    (double)truth.sure);
    LAW(2 * (int)list.count == truth.n, "the number of crossings is wrong");
    for (int i = 0; i < truth.n; i++) {
        const Edge *edge = i % 2 ? &list.seg[i / 2].out : &list.seg[i / 2].in;
        double off = fmax(0, (double)(q_abs(truth.t[i] - edge->t) - truth.err[i]));
        if (!(off <= edge->t_err)) print_error("crossing %d: t %a off by %g, t_err %g\n", i, edge->t, off, edge->t_err);
        LAW(off <= edge->t_err, "t is further from the truth than t_err");
        double ulps = off > 0 ? ulps_between(edge->t, truth.t[i]) : 0;
        /* a torus is a quartic: next to the origin t has an absolute error, and t_err alone is promised */
        if (c->row->minor > 0 && fabs(edge->t) * vec3_length(c->ray.d) < 0x1p-24) ulps = 0;
        if (ulps > worst->ulps) worst->ulps = ulps;
        if (off > 0 && off / edge->t_err > worst->bound_use) worst->bound_use = off / edge->t_err;
        worst->hits++;
        if (ulps > c->row->ulps)
            print_error("crossing %d: t %a is %.1f ulps off, sure %g\n", i, edge->t, ulps, (double)truth.sure);
        LAW(ulps <= c->row->ulps, "t is too many ulps off");
    }
    return true;
}

/* -- the tests: every law over every primitive -- */

static void case_open(Case *c, const Row *row)
{
    *c = (Case){.row = row, .prim = row->make(), .scratch = {.arena = arena_create()}};
    assert_non_null(c->prim);
    assert_non_null(c->scratch.arena);
}

static void case_close(Case *c)
{
    prim_destroy(c->prim);
    arena_destroy(c->scratch.arena);
}

static void test_laws(void **state)
{
    (void)state;
    for (int r = 0; r < ROW_COUNT; r++) {
        Case c;
        case_open(&c, &ROWS[r]);
        for (uint64_t seed = 0; seed < 60000; seed++) {
            Rng rng = rng_seed(seed, 1);
            c.seed = seed;
            c.ray = draw(&rng, &c, 6);
            arena_reset(c.scratch.arena);
            assert_true(law_segments(&c) && law_hit(&c));
            c.ray.tmin = uniform(&rng, 0, 2);
            c.ray.tmax = c.ray.tmin + uniform(&rng, 0, 2);
            assert_true(law_segments(&c) && law_hit(&c));
        }
        case_close(&c);
    }
}

static void run_truth(uint64_t rays, double decades, uint64_t stream)
{
    for (int r = 0; r < ROW_COUNT; r++) {
        Case c;
        Worst worst = {0};
        case_open(&c, &ROWS[r]);
        /* the quartic's oracle bisects: it costs fifty times as much */
        uint64_t tries = ROWS[r].minor > 0 ? rays / 20 : rays;
        for (uint64_t seed = 0; seed < tries; seed++) {
            Rng rng = rng_seed(seed, stream);
            c.seed = seed;
            c.ray = draw(&rng, &c, decades);
            arena_reset(c.scratch.arena);
            assert_true(law_truth(&c, &worst));
        }
        print_message("%-14s %ld crossings, worst %.2f ulps, %.3f of t_err\n", c.row->name, worst.hits, worst.ulps,
                      worst.bound_use);
        case_close(&c);
    }
}

static void test_truth_near(void **state) { (void)state; run_truth(20000, 3, 2); }
static void test_truth_far(void **state) { (void)state; run_truth(8000, 12, 3); }

/* Seen from 10^2 to 10^12 radii: rays aimed across the limb, the truth deciding each. */
static void test_limb_from_afar(void **state)
{
    (void)state;
    for (int r = 0; r < ROW_COUNT; r++) {
        Case c;
        Worst worst = {0};
        case_open(&c, &ROWS[r]);
        double radius = c.row->minor > 0 ? 1 + c.row->minor : 1;
        for (uint64_t seed = 0; seed < (c.row->minor > 0 ? 200 : 8000); seed++) {
            Rng rng = rng_seed(seed, 4);
            double far = pow(10, 2 + (double)(seed % 11));
            Vec3 away = random_direction(&rng), side = vec3_normalize(vec3_cross(away, random_direction(&rng)));
            c.seed = seed;
            c.ray.o = vec3_scale(away, far);
            double gap = (rng_u32(&rng) % 2 ? 1 : -1) * pow(10, uniform(&rng, -17, 0));
            Vec3 aim = vec3_scale(side, radius * (1 + gap));
            c.ray.d = vec3_sub(aim, c.ray.o);
            c.ray.tmin = 0;
            c.ray.tmax = INFINITY;
            arena_reset(c.scratch.arena);
            assert_true(law_truth(&c, &worst) && law_segments(&c) && law_hit(&c));
        }
        case_close(&c);
    }
}

/* Rays that start on, an ulp inside and an ulp outside a surface point. */
static void test_from_the_surface(void **state)
{
    (void)state;
    for (int r = 0; r < ROW_COUNT; r++) {
        Case c;
        Worst worst = {0};
        case_open(&c, &ROWS[r]);
        for (uint64_t seed = 0; seed < (c.row->minor > 0 ? 400 : 10000); seed++) {
            Rng rng = rng_seed(seed, 5);
            Hit hit;
            c.seed = seed;
            c.ray = random_ray(&rng, c.prim->ops->bounds(c.prim), 1);
            if (!hit_of(&c, &c.ray, &hit)) continue;
            Surface s;
            c.prim->ops->surface(c.prim, &c.ray, &hit, true, &s);
            double *axis[3] = {&s.p.x, &s.p.y, &s.p.z}, *p = axis[rng_u32(&rng) % 3];
            uint32_t where = rng_u32(&rng) % 3;
            if (where) *p = nextafter(*p, where == 1 ? INFINITY : -INFINITY);
            c.ray = (Ray){s.p, random_direction(&rng), 0, INFINITY};
            arena_reset(c.scratch.arena);
            assert_true(law_truth(&c, &worst) && law_segments(&c) && law_hit(&c));
        }
        case_close(&c);
    }
}

/* -- single cases -- */

static uint32_t crossings_of(Prim *prim, Vec3 o, Vec3 d, double t[4])
{
    Scratch scratch = {.arena = arena_create()};
    assert_non_null(scratch.arena);
    SegList list = seg_list(&scratch);
    Ray ray = {o, d, 0, INFINITY};
    assert_true(prim->ops->segments(prim, &ray, &list));
    assert_true(list.count <= 2);
    for (uint32_t i = 0; i < list.count; i++) {
        t[2 * i] = list.seg[i].in.t;
        t[2 * i + 1] = list.seg[i].out.t;
        assert_true(vec3_max(vec3_abs(list.seg[i].in.n)) > 0 && vec3_max(vec3_abs(list.seg[i].out.n)) > 0);
    }
    uint32_t n = 2 * list.count;
    arena_destroy(scratch.arena);
    return n;
}

static void test_cylinder_along_the_side(void **state)
{
    (void)state;
    Prim *prim = cylinder_create();
    assert_non_null(prim);
    double t[4];
    Vec3 down = {0, -1, 0};
    assert_int_equal(crossings_of(prim, vec3_make(0.5, 3, 0), down, t), 2);
    assert_true(t[0] == 2 && t[1] == 4);
    assert_int_equal(crossings_of(prim, vec3_make(nextafter(1, 0), 3, 0), down, t), 2);
    assert_int_equal(crossings_of(prim, vec3_make(1, 3, 0), down, t), 2);
    assert_int_equal(crossings_of(prim, vec3_make(nextafter(1, 2), 3, 0), down, t), 0);
    assert_int_equal(crossings_of(prim, vec3_make(0, 3, -1), down, t), 2);
    assert_int_equal(crossings_of(prim, vec3_make(5, 1, 0), vec3_make(-1, 0, 0), t), 2);
    assert_int_equal(crossings_of(prim, vec3_make(5, nextafter(1, 2), 0), vec3_make(-1, 0, 0), t), 0);
    prim_destroy(prim);
}

static void test_cube_face_planes(void **state)
{
    (void)state;
    Prim *prim = cube_create();
    assert_non_null(prim);
    double t[4];
    for (int plane = 0; plane < 2; plane++)
        for (int sign = 0; sign < 2; sign++) {
            Vec3 d = {sign ? -1 : 1, sign ? -0.0 : 0.0, 0};
            assert_int_equal(crossings_of(prim, vec3_make(-2, plane, 0.5), d, t), 2);
            assert_int_equal(crossings_of(prim, vec3_make(-2, plane, plane), d, t), 2);
        }
    assert_int_equal(crossings_of(prim, vec3_make(-2, nextafter(1, 2), 0.5), vec3_make(1, 0, 0), t), 0);
    assert_int_equal(crossings_of(prim, vec3_make(-2, -5e-324, 0.5), vec3_make(1, 0, 0), t), 0);
    prim_destroy(prim);
}

static void test_cone_apex_and_side(void **state)
{
    (void)state;
    Prim *prim = cone_create();
    assert_non_null(prim);
    double t[4];
    /* through the apex: steep, from either end; flat, touching it */
    assert_int_equal(crossings_of(prim, vec3_make(0, 2, 0), vec3_make(0, -1, 0), t), 2);
    assert_true(t[0] == 2 && t[1] == 3);
    assert_int_equal(crossings_of(prim, vec3_make(0.25, 0.5, 0), vec3_make(-0.5, -1, 0), t), 2);
    assert_true(t[0] == 0.5 && t[1] == 1.5);
    assert_int_equal(crossings_of(prim, vec3_make(-1, 0.5, 0), vec3_make(1, -0.5, 0), t), 0);
    assert_int_equal(crossings_of(prim, vec3_make(-1, 0, 0), vec3_make(1, 0, 0), t), 0);
    /* along a line of the side, beside it, and parallel to it inside */
    assert_int_equal(crossings_of(prim, vec3_make(-1, 1, 0), vec3_make(1, -1, 0), t), 2);
    assert_true(t[0] == 1 && t[1] == 2);
    assert_int_equal(crossings_of(prim, vec3_make(-1, 1, 0x1p-40), vec3_make(1, -1, 0), t), 0);
    assert_int_equal(crossings_of(prim, vec3_make(-1, 0.5, 0), vec3_make(1, -1, 0), t), 2);
    assert_true(t[0] == 0.75 && t[1] == 1.5);
    /* from the apex itself */
    assert_int_equal(crossings_of(prim, vec3_make(0, 0, 0), vec3_make(0.25, -1, 0), t), 2);
    assert_true(t[0] == 0 && t[1] == 1);
    prim_destroy(prim);
}

static void test_torus_axes(void **state)
{
    (void)state;
    double t[4];
    Prim *ring = torus_create(0.5), *horn = torus_create(1), *spindle = torus_create(1.25);
    assert_true(ring && horn && spindle);
    Vec3 up = {0, 1, 0}, right = {1, 0, 0};
    assert_int_equal(crossings_of(ring, vec3_make(0, -3, 0), up, t), 0);
    assert_int_equal(crossings_of(horn, vec3_make(0, -3, 0), up, t), 0);
    /* the sheets meet at y = +-0.75 */
    assert_int_equal(crossings_of(spindle, vec3_make(0, -3, 0), up, t), 2);
    assert_true(t[0] == 2.25 && t[1] == 3.75);
    assert_int_equal(crossings_of(ring, vec3_make(-3, 0, 0), right, t), 4);
    assert_true(t[0] == 1.5 && t[1] == 2.5 && t[2] == 3.5 && t[3] == 4.5);
    assert_int_equal(crossings_of(spindle, vec3_make(-3, 0, 0), right, t), 2);
    assert_true(t[0] == 0.75 && t[1] == 5.25);
    /* touching the inner rim, and the top circle's plane: double and quadruple roots */
    assert_int_equal(crossings_of(ring, vec3_make(-3, 0, 0.5), right, t), 2);
    assert_int_equal(crossings_of(ring, vec3_make(-3, 0.5, 0), right, t), 0);
    assert_int_equal(crossings_of(ring, vec3_make(-3, 0.5, 1), right, t), 0);
    assert_int_equal(crossings_of(ring, vec3_make(-3, 0, 1.5), right, t), 0);
    prim_destroy(ring);
    prim_destroy(horn);
    prim_destroy(spindle);
}

typedef struct { Prim *(*make)(void); Vec3 from, to; double u, v; } TexturePoint;

static Prim *torus_quarter(void) { return torus_create(0.25); }

/* A ray from `from` through `to` hits where the coordinates are (u, v). */
static void test_texture_points(void **state)
{
    (void)state;
    static const TexturePoint POINTS[] = {
        /* seen from +z, u grows to the right (+x) and v upwards */
        {sphere_create, {0, 0, 5}, {0, 0, 0}, 0.5, 0.5},
        {sphere_create, {5, 0, 0}, {0, 0, 0}, 0.75, 0.5},
        {sphere_create, {-5, 0, 0}, {0, 0, 0}, 0.25, 0.5},
        {sphere_create, {0, 0.5, 5}, {0, 0.5, 0}, 0.5, 2.0 / 3},
        {sphere_create, {0, 5, 0}, {0, 0, 0}, 0.5, 1},
        {sphere_create, {0, -5, 0}, {0, 0, 0}, 0.5, 0},
        {cylinder_create, {0, 0.5, 5}, {0, 0.5, 0}, 0.5, 0.75},
        {cylinder_create, {5, -0.5, 0}, {0, -0.5, 0}, 0.75, 0.25},
        {cylinder_create, {0.5, 5, 0.25}, {0.5, 0, 0.25}, 0.75, 0.625},
        {cylinder_create, {0.5, -5, 0.25}, {0.5, 0, 0.25}, 0.75, 0.625},
        {cone_create, {0, -0.5, 5}, {0, -0.5, 0}, 0.5, 0.5},
        {cone_create, {-5, -0.25, 0}, {0, -0.25, 0}, 0.25, 0.75},
        {cone_create, {0, 5, 0}, {0, 0, 0}, 0.5, 1},
        {cone_create, {0.5, -5, 0.25}, {0.5, 0, 0.25}, 0.75, 0.625},
        {cube_create, {0.25, 0.75, 5}, {0.25, 0.75, 0}, 0.25, 0.75},
        {cube_create, {0.25, 0.75, -5}, {0.25, 0.75, 0}, 0.75, 0.75},
        {cube_create, {5, 0.75, 0.25}, {0, 0.75, 0.25}, 0.75, 0.75},
        {cube_create, {-5, 0.75, 0.25}, {0, 0.75, 0.25}, 0.25, 0.75},
        {cube_create, {0.25, 5, 0.75}, {0.25, 0, 0.75}, 0.25, 0.75},
        {cube_create, {0.25, -5, 0.75}, {0.25, 0, 0.75}, 0.25, 0.75},
        {torus_quarter, {0, 0, 5}, {0, 0, 0}, 0.5, 0.5},
        {torus_quarter, {1, 5, 0}, {1, 0, 0}, 0.75, 0.75},
        {torus_quarter, {-1, -5, 0}, {-1, 0, 0}, 0.25, 0.25},
    };
    for (size_t i = 0; i < sizeof POINTS / sizeof POINTS[0]; i++) {
        const TexturePoint *p = &POINTS[i];
        Prim *prim = p->make();
        assert_non_null(prim);
        Ray ray = {p->from, vec3_sub(p->to, p->from), 0, INFINITY};
        Hit hit = {0};
        Scratch scratch = {0};
        Surface s;
        assert_true(prim->ops->intersect(prim, &ray, &hit, &scratch));
        prim->ops->surface(prim, &ray, &hit, true, &s);
        if (!(fabs(s.u - p->u) < 1e-14 && fabs(s.v - p->v) < 1e-14))
            print_error("%s, point %zu: (%g, %g), not (%g, %g)\n", prim->ops->name, i, s.u, s.v, p->u, p->v);
        assert_true(fabs(s.u - p->u) < 1e-14 && fabs(s.v - p->v) < 1e-14);
        prim_destroy(prim);
    }
}

/* Rays without a direction or with numbers that aren't finite hit nothing, and nothing is invalid on the way. */
static void test_useless_rays(void **state)
{
    (void)state;
    static const Ray RAYS[] = {
        {{0, 0, 0}, {0, 0, 0}, 0, INFINITY},
        {{3, 0, 0}, {-0.0, 0, 0}, 0, INFINITY},
        {{INFINITY, 0, 0}, {-1, 0, 0}, 0, INFINITY},
        {{0.5, 0.5, 0.5}, {NAN, 0, 1}, 0, INFINITY},
        {{NAN, 0, 0}, {1, 0, 0}, 0, INFINITY},
        {{0, 0, 0}, {INFINITY, 0, 0}, 0, INFINITY},
        {{1e300, 1e300, 1e300}, {1, 0, 0}, 0, INFINITY},
    };
    for (int r = 0; r < ROW_COUNT; r++)
        for (size_t i = 0; i < sizeof RAYS / sizeof RAYS[0]; i++) {
            Case c;
            case_open(&c, &ROWS[r]);
            c.seed = i;
            c.ray = RAYS[i];
            Hit hit;
            if (hit_of(&c, &c.ray, &hit)) failed(&c, "a useless ray hits");
            assert_false(hit_of(&c, &c.ray, &hit));
            assert_true(law_segments(&c));
            case_close(&c);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_laws),
        cmocka_unit_test(test_truth_near),
        cmocka_unit_test(test_truth_far),
        cmocka_unit_test(test_limb_from_afar),
        cmocka_unit_test(test_from_the_surface),
        cmocka_unit_test(test_cylinder_along_the_side),
        cmocka_unit_test(test_cube_face_planes),
        cmocka_unit_test(test_cone_apex_and_side),
        cmocka_unit_test(test_torus_axes),
        cmocka_unit_test(test_texture_points),
        cmocka_unit_test(test_useless_rays),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
