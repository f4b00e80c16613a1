/* Laws of constructive solid geometry over many rays, random, axis-parallel and aimed at edges and silhouettes, and an
 * oracle that knows the solids only as sets of points, in __float128. Failing rays are printed in full. */
#include "node/csg/csg.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#include "common/rng.h"
#include "support/alloc_fail.h"
#include "support/solids.h"

enum { SEED = 20240611, SHOWN_FAILURES = 3 };

typedef struct { long rays[RAY_KINDS], failed[RAY_KINDS]; } Tally;

static void tally_print(const char *name, const Tally *t)
{
    printf("    %-34s", name);
    for (int k = 0; k < RAY_KINDS; k++) printf("  %s %ld/%ld", SOLID_RAY_NAMES[k], t->failed[k], t->rays[k]);
    printf("\n");
}

static long tally_failures(const Tally *t)
{
    long n = 0;
    for (int k = 0; k < RAY_KINDS; k++) n += t->failed[k];
    return n;
}

/* Whether two expressions are the same solid along random rays; b without tokens: the empty one. */
static void compare(Tally *tally, Rng *rng, const char *name, const Expr *a, const Expr *b, int rays)
{
    Prim *pa = solid_prim(a), *pb = b->count ? solid_prim(b) : NULL;
    Faces faces = solid_faces(a, b);
    for (int kind = 0; kind < RAY_KINDS; kind++)
        for (int i = 0; i < rays; i++) {
            Ray ray = solid_random_ray(rng, kind, a);
            arena_reset(solid_scratch.arena);
            SegList la = solid_segments(pa, &ray), lb = pb ? solid_segments(pb, &ray) : seg_list(&solid_scratch);
            tally->rays[kind]++;
            Difference d = solid_difference(&faces, &la, &lb, &ray);
            if (!d.unclaimed && d.thickness <= SOLID_THICKEST) continue;
            if (tally->failed[kind]++ < SHOWN_FAILURES) {
                solid_print_ray(name, &ray);
                solid_print_list("left", &la);
                solid_print_list("right", &lb);
            }
        }
    prim_destroy(pa);
    prim_destroy(pb);
}

static void check_oracle(Tally *tally, Rng *rng, const char *name, const Expr *e, int rays)
{
    Prim *prim = solid_prim(e);
    QAffine inverse[MAX_TOKENS];
    for (size_t i = 0; i < e->count; i++)
        if (e->token[i].is_leaf) inverse[i] = solid_q_inverse(&e->token[i].to_csg);
    for (int kind = 0; kind < RAY_KINDS; kind++)
        for (int i = 0; i < rays; i++) {
            Ray ray = solid_random_ray(rng, kind, e);
            arena_reset(solid_scratch.arena);
            SegList list = solid_segments(prim, &ray);
            bool good = solid_agrees(e, inverse, &list, &ray);
            /* no films: what is shown is thicker than its bounds. (From afar these hold the rounding of t, which all
             * leaves share.) */
            bool near = vec3_max(vec3_abs(ray.o)) <= 4 * box_reach(prim->ops->bounds(prim));
            for (uint32_t k = 1; near && k < 2 * list.count; k++) {
                const Edge *a = solid_edge(&list, k - 1), *b = solid_edge(&list, k);
                good = good && b->t - a->t > fmax(a->t_err, b->t_err) * (1 - 0x1p-10);
            }
            tally->rays[kind]++;
            if (good) continue;
            if (tally->failed[kind]++ < SHOWN_FAILURES) {
                solid_print_ray(name, &ray);
                solid_print_list("result", &list);
            }
        }
    prim_destroy(prim);
}

/* -- tests -- */

static Expr random_leaf(Rng *rng) { return solid_leaf((int)(rng_u32(rng) % ANALYTIC_SHAPES), solid_random_pose(rng)); }

static void laws_of_sets(void **state)
{
    (void)state;
    enum { POSES = 40, RAYS = 100 };
    Tally tally[SOLID_LAWS] = {0};
    Rng rng = rng_seed(SEED, 1);
    for (int pose = 0; pose < POSES; pose++) {
        Expr a = solid_leaf(pose % SHAPES, pose < SHAPES ? affine_identity() : solid_random_pose(&rng));
        Expr b = random_leaf(&rng), c = random_leaf(&rng), a2 = a;
        a2.token[0].to_csg = solid_roundabout(a.token[0].to_csg, &rng);
        Law law[SOLID_LAWS];
        solid_laws(law, a, a2, b, c);
        for (int i = 0; i < SOLID_LAWS; i++)
            compare(&tally[i], &rng, SOLID_LAW_NAMES[i], &law[i].left, &law[i].right, RAYS);
    }
    long failed = 0;
    for (int i = 0; i < SOLID_LAWS; i++) {
        tally_print(SOLID_LAW_NAMES[i], &tally[i]);
        failed += tally_failures(&tally[i]);
    }
    assert_int_equal(failed, 0);
}

/* Solids with coincident faces, each beside the same solid made with an overlap where that doesn't matter. */
static void flush_faces(void **state)
{
    (void)state;
    enum { CASES = 8, POSES = 8, RAYS = 300 };
    static const char *const NAME[CASES] = {"box - flush box", "tube", "counterbore", "abutting boxes",
                                            "box - inscribed cylinder", "box - touching box", "steps",
                                            "box x flush box"};
    const double e = 0x1p-10;
    Expr slab = solid_box(-1, -1, -1, 1, 1, 1), third = solid_box(-1. / 3, 0, -1. / 3, 1. / 3, 1, 1. / 3);
    Expr case_[CASES][2] = {
        {solid_minus(slab, third), solid_minus(slab, solid_box(-1. / 3, 0, -1. / 3, 1. / 3, 1 + e, 1. / 3))},
        {solid_minus(solid_rod(1, -1, 1), solid_rod(0.7, -1, 1)), solid_minus(solid_rod(1, -1, 1), solid_rod(0.7,
            -1 - e, 1 + e))},
        {solid_minus(solid_minus(slab, solid_rod(0.3, -1, 1)), solid_rod(0.6, 0.4, 1)),
         solid_minus(solid_minus(slab, solid_rod(0.3, -1 - e, 1 + e)), solid_rod(0.6, 0.4, 1 + e))},
        {solid_unite(solid_box(-1, -1, -1, 0.1, 1, 1), solid_box(0.1, -1, -1, 1, 1, 1)), slab},
        {solid_minus(slab, solid_rod(1, -1, 1)), solid_minus(slab, solid_rod(1, -1 - e, 1 + e))},
        {solid_minus(slab, solid_box(1, -1, -1, 2, 1, 1)), slab},
        {solid_unite(solid_unite(solid_box(-1, -1, -1, 1, -0.3, 1), solid_box(-1, -0.3, -1, 0.2, 0.1, 1)),
            solid_box(-1, 0.1, -1, -0.7, 1, 1)),
         solid_unite(solid_unite(solid_box(-1, -1, -1, 1, -0.3, 1), solid_box(-1, -1, -1, 0.2, 0.1, 1)),
             solid_box(-1, -1, -1, -0.7, 1, 1))},
        {solid_meet(solid_box(-1, -1, -1, 0.1, 1, 1), solid_box(0.1, -1, -1, 1, 1, 1)), {.count = 0}},
    };
    Tally tally[CASES] = {0};
    Rng rng = rng_seed(SEED, 2);
    for (int pose = 0; pose < POSES; pose++) {
        static const double DEG[] = {0, 17, 33, 51};
        Affine m = affine_rotate(pose % 3, DEG[pose % 4]);
        if (pose >= 4) m = solid_then(solid_then(m, affine_scale(1. / 3, 1. / 3, 1. / 3)), affine_scale(3, 3, 3));
        if (pose >= 6) m = solid_then(m, affine_scale(1, -1, 1));
        for (int i = 0; i < CASES; i++) {
            Expr a = solid_moved(case_[i][0], m), b = solid_moved(case_[i][1], m);
            compare(&tally[i], &rng, NAME[i], &a, &b, RAYS);
        }
    }
    long failed = 0;
    for (int i = 0; i < CASES; i++) {
        tally_print(NAME[i], &tally[i]);
        failed += tally_failures(&tally[i]);
    }
    assert_int_equal(failed, 0);
}

static void points_agree(void **state)
{
    (void)state;
    enum { TREES = 200, RAYS = 40 };
    Tally tally = {0}, touching = {0};
    Rng rng = rng_seed(SEED, 3);
    for (int i = 0; i < TREES; i++) {
        Expr e = random_leaf(&rng);
        for (int k = (int)(rng_u32(&rng) % 6); k >= 0; k--) {
            CsgOp o = (CsgOp)(rng_u32(&rng) % 3);
            Expr other = random_leaf(&rng);
            if (rng_u32(&rng) % 3 == 0) other = solid_op((CsgOp)(rng_u32(&rng) % 3), other, random_leaf(&rng));
            e = rng_u32(&rng) % 2 ? solid_op(o, e, other) : solid_op(o, other, e);
        }
        check_oracle(&tally, &rng, "random tree", &e, RAYS);
    }
    tally_print("random trees against points", &tally);
    Expr slab = solid_box(-1, -1, -1, 1, 1, 1), ball = solid_leaf(SPHERE, affine_identity());
    Expr tight[] = {solid_minus(slab, ball), solid_minus(slab, solid_rod(1, -1, 1)), solid_minus(solid_rod(1, -1, 1),
        ball), solid_unite(ball, slab),
                    solid_minus(solid_rod(1, -1, 1), solid_leaf(CONE, affine_translate(0, 1, 0))), solid_meet(slab, ball),
                    solid_minus(solid_minus(slab, solid_rod(0.3, -1, 1)), solid_rod(0.6, 0.4, 1)),
                    solid_minus(solid_leaf(TORUS, affine_identity()), solid_rod(1, -1, 1))};
    for (size_t i = 0; i < sizeof tight / sizeof *tight; i++)
        for (int pose = 0; pose < 4; pose++) {
            Expr e = solid_moved(tight[i], affine_rotate(pose % 3, 17.0 * pose));
            check_oracle(&touching, &rng, "touching", &e, 4 * RAYS);
        }
    tally_print("touching solids against points", &touching);
    assert_int_equal(tally_failures(&tally) + tally_failures(&touching), 0);
}

/* A gap, or a film of solid, of a given thickness is seen at all angles or at none, and from a clear limit on. */
static void thickness_decides(void **state)
{
    (void)state;
    static const double ANGLE[] = {0, 10, 30, 45, 60, 75, 85, 89, 89.5, 89.9};
    enum { ANGLES = sizeof ANGLE / sizeof *ANGLE, RAYS = 20 };
    Rng rng = rng_seed(SEED, 4);
    for (int film = 0; film < 2; film++)
        for (int turned = 0; turned < 2; turned++) {
            int seen_to = 0, unseen_from = 99;
            for (int k = 1; k <= 17; k++) {
                double g = pow(10, -k);
                Expr lower = solid_box(-4096, -1, -4096, 4096, 0, 4096);
                Expr e = film ? solid_minus(solid_box(-4096, -1, -4096, 4096, g, 4096), lower)
                              : solid_unite(lower, solid_moved(lower, affine_translate(0, 1 + g, 0)));
                Affine turn = turned ? affine_rotate(2, 33) : affine_identity();
                e = solid_moved(e, turn);
                Prim *prim = solid_prim(&e);
                long seen = 0, all = 0;
                for (int a = 0; a < ANGLES; a++)
                    for (int i = 0; i < RAYS; i++, all++) {
                        double angle = ANGLE[a] * M_PI / 180, about = solid_uniform(&rng, 0, 2 * M_PI);
                        Vec3 d = vec3_make(sin(angle) * cos(about), -cos(angle), sin(angle) * sin(about));
                        Vec3 o = vec3_at(vec3_make(solid_uniform(&rng, -1, 1), 0, solid_uniform(&rng, -1, 1)), -3, d);
                        Ray ray = {affine_point(&turn, o), affine_vector(&turn, d), 0, INFINITY};
                        arena_reset(solid_scratch.arena);
                        seen += solid_segments(prim, &ray).count == (film ? 1 : 2);
                    }
                if (seen == all && seen_to == k - 1) seen_to = k;
                if (seen == 0 && unseen_from == 99) unseen_from = k;
                if (seen && unseen_from != 99) fail_msg("10^-%d is seen and a larger one wasn't", k);
                prim_destroy(prim);
            }
            printf("    %s, %s: seen to 10^-%d, unseen from 10^-%d on\n", film ? "film" : "gap",
                   turned ? "turned" : "straight", seen_to, unseen_from);
            assert_true(seen_to >= (turned ? 10 : 13));
            assert_true(unseen_from <= seen_to + 2);
        }
}

/* Faces apart by about their bounds, three and more at a place, leave no film thinner than the bounds of its own ends. */
static void no_films(void **state)
{
    (void)state;
    Rng rng = rng_seed(SEED, 8);
    long films = 0, seen = 0;
    for (int tree = 0; tree < 2000; tree++) {
        Expr e = solid_box(-1, -1, -1, 1, 0, 1);
        for (int k = (int)(rng_u32(&rng) % 5); k >= 0; k--) {
            double a = solid_uniform(&rng, -2e-14, 2e-14), b = solid_uniform(&rng, -2e-14, 2e-14);
            static const double LEVEL[] = {-1, 0, 1};
            uint32_t lo = rng_u32(&rng) % 2, hi = lo + 1 + rng_u32(&rng) % (2 - lo);
            e = solid_op((CsgOp)(rng_u32(&rng) % 2), e, solid_box(-1, LEVEL[lo] + a, -1, 1, LEVEL[hi] + b, 1));
        }
        if (tree % 2) e = solid_moved(e, affine_rotate(tree % 3, solid_uniform(&rng, 0, 90)));
        Prim *prim = solid_prim(&e);
        for (int i = 0; i < 20; i++) {
            Ray ray = solid_random_ray(&rng, RAY_RANDOM, &e);
            if (vec3_max(vec3_abs(ray.o)) > 4) ray.o = vec3_scale(ray.o, 0.5);
            arena_reset(solid_scratch.arena);
            SegList list = solid_segments(prim, &ray);
            for (uint32_t k = 1; k < 2 * list.count; k++, seen++) {
                const Edge *a = solid_edge(&list, k - 1), *b = solid_edge(&list, k);
                films += b->t - a->t <= fmax(a->t_err, b->t_err) * (1 - 0x1p-10);
            }
        }
        prim_destroy(prim);
    }
    printf("    %ld films among %ld parts\n", films, seen);
    assert_int_equal(films, 0);
}

/* A ray that meets a face at a slope so small that the crossing is uncertain by lengths still sees what stands there:
 * the walls on either side, and the wall before the leaf that the face belongs to. */
static void grazing_keeps_walls(void **state)
{
    (void)state;
    Expr floor_part = solid_meet(solid_box(0, -1, -1, 20, 0, 1), solid_box(15, -1, -1, 16, 1, 1));
    Expr walls = solid_unite(solid_box(6, -2, -1, 6.5, 2, 1), solid_box(8, -2, -1, 8.5, 2, 1));
    Expr among = solid_unite(floor_part, walls), carved = solid_minus(solid_box(4.5, -1, -1, 8, 1, 1), solid_box(4.9,
        -1, -1, 9, 0, 1));
    Prim *a = solid_prim(&among), *b = solid_prim(&carved);
    for (int k = 0; k < 400; k++) {
        double slope = pow(10, -10 - k * 0.015);
        Ray to_floor = {vec3_make(-4, 11 * slope, 0.1), vec3_make(1, -slope, 0), 0, INFINITY};
        Ray to_pit = {vec3_make(-4, 9 * slope, 0.1), vec3_make(1, -slope, 0), 0, INFINITY};
        arena_reset(solid_scratch.arena);
        SegList list = solid_segments(a, &to_floor);
        assert_true(list.count >= 2);
        assert_true(fabs(list.seg[0].in.t - 10) < 1e-9 && fabs(list.seg[0].out.t - 10.5) < 1e-9);
        assert_true(fabs(list.seg[1].in.t - 12) < 1e-9 && fabs(list.seg[1].out.t - 12.5) < 1e-9);
        list = solid_segments(b, &to_pit);
        assert_true(list.count >= 1 && fabs(list.seg[0].in.t - 8.5) < 1e-9);
    }
    prim_destroy(a);
    prim_destroy(b);
}

/* From far away a gap is seen that the rounding of the distance would swallow. */
static void gap_from_afar(void **state)
{
    (void)state;
    Rng rng = rng_seed(SEED, 9);
    Expr e = solid_unite(solid_box(-1, -1, -1, 1, 0, 1), solid_box(-1, 0x1p-36, -1, 1, 1, 1));
    Prim *prim = solid_prim(&e);
    for (int i = 0; i < 1000; i++) {
        Vec3 target = vec3_make(solid_uniform(&rng, -0.5, 0.5), 0, solid_uniform(&rng, -0.5, 0.5));
        Vec3 d = vec3_make(solid_uniform(&rng, -0.3, 0.3), -1, solid_uniform(&rng, -0.3, 0.3));
        Ray ray = {vec3_at(target, -exp2(solid_uniform(&rng, 3, 24)), d), d, 0, INFINITY};
        arena_reset(solid_scratch.arena);
        assert_int_equal(solid_segments(prim, &ray).count, 2);
    }
    prim_destroy(prim);
}

/* The three ways to ask, and the ray's length, agree. */
static void queries_agree(void **state)
{
    (void)state;
    Rng rng = rng_seed(SEED, 5);
    for (int tree = 0; tree < 60; tree++) {
        Expr e = solid_op((CsgOp)(tree % 3), random_leaf(&rng), random_leaf(&rng));
        if (tree % 2) e = solid_op((CsgOp)(rng_u32(&rng) % 3), e, random_leaf(&rng));
        Prim *prim = solid_prim(&e);
        for (int i = 0; i < 400; i++) {
            Ray ray = solid_random_ray(&rng, i % RAY_KINDS, &e);
            if (i % 3 == 0) ray.o = solid_random_point(&rng, 1);  /* often inside */
            arena_reset(solid_scratch.arena);
            SegList list = solid_segments(prim, &ray);
            if (list.count && i % 5 == 0) ray.tmin = solid_edge(&list, rng_u32(&rng) % (2 * list.count))->t;
            if (list.count && i % 7 == 0) ray.tmax = solid_edge(&list, rng_u32(&rng) % (2 * list.count))->t;
            const Edge *first = NULL;
            for (uint32_t k = 0; k < 2 * list.count && !first; k++)
                if (solid_edge(&list, k)->t > ray.tmin) first = solid_edge(&list, k);
            if (first && !(first->t <= ray.tmax)) first = NULL;
            Hit hit = {.t = -7};
            bool found = prim->ops->intersect(prim, &ray, &hit, &solid_scratch);
            assert_int_equal(found, first != NULL);
            assert_int_equal(prim->ops->occluded(prim, &ray, &solid_scratch), found);
            if (!found) {
                assert_true(hit.t == -7);
                continue;
            }
            assert_true(hit.t == first->t && hit.u == first->u && hit.v == first->v);
            assert_true(hit.part == first->part && hit.leaf == first->leaf);
            Box b = prim->ops->bounds(prim);
            Surface s;
            prim->ops->surface(prim, &ray, &hit, true, &s);
            for (int axis = 0; axis < 3; axis++) {
                double p = vec3_get(s.p, axis), err = vec3_get(s.p_err, axis);
                double at = vec3_get(ray.o, axis) + hit.t * vec3_get(ray.d, axis);
                assert_true(p >= vec3_get(b.lo, axis) - err && p <= vec3_get(b.hi, axis) + err);
                assert_true(fabs(p - at) <= 1e-7 * (1 + fabs(vec3_get(ray.o, axis))));
            }
            /* the normal looks outward: against the ray where it enters */
            bool enters = first == solid_edge(&list, 0) || (first - &list.seg[0].in) % 2 == 0;
            double cosine = vec3_dot(vec3_normalize(s.n), vec3_normalize(ray.d));
            assert_true(enters ? cosine < 1e-6 : cosine > -1e-6);
            assert_true(vec3_dot(vec3_normalize(s.n), vec3_normalize(first->n)) > 1 - 1e-6);

            Ray twice = {ray.o, vec3_scale(ray.d, 2), ray.tmin / 2, ray.tmax / 2};
            Hit half;
            assert_true(prim->ops->intersect(prim, &twice, &half, &solid_scratch));
            assert_true(half.t == hit.t / 2 && half.leaf == hit.leaf && half.part == hit.part);
        }
        prim_destroy(prim);
    }
}

/* A ray that leaves the surface of a convex whole, starting outside the error of its point, meets nothing, however the
 * whole was put together; in a pose where coincident faces aren't exactly so. */
static void no_hit_of_own_surface(void **state)
{
    (void)state;
    Rng rng = rng_seed(SEED, 6);
    long rays = 0;
    for (int pose = 0; pose < 40; pose++) {
        Affine m = solid_random_pose(&rng);
        Expr left = solid_moved(solid_box(-1, -1, -1, 0.1, 1, 1), m), right = solid_moved(solid_box(0.1, -1, -1, 1,
            1, 1), m);
        Expr whole = solid_moved(solid_box(-1, -1, -1, 1, 1, 1), m);
        right.token[0].to_csg = solid_roundabout(right.token[0].to_csg, &rng);
        Vec3 by = solid_random_point(&rng, 3e-15);  /* counts as coincident,
            but the first shows where the second stands out */
        Expr made[] = {solid_unite(left, right), solid_minus(whole, solid_moved(solid_box(1, -1, -1, 2, 1, 1), m)),
                       solid_meet(whole, solid_moved(solid_box(-1, -1, -1, 1, 1, 1), solid_roundabout(m, &rng))),
                       solid_unite(whole, solid_moved(whole, affine_translate(by.x, by.y, by.z)))};
        for (int k = 0; k < 4; k++) {
            Prim *prim = solid_prim(&made[k]);
            for (int i = 0; i < 300; i++) {
                Ray ray = solid_random_ray(&rng, i % 10 ? RAY_RANDOM : RAY_FAR, &made[k]);
                Hit hit;
                Surface s;
                arena_reset(solid_scratch.arena);
                if (!prim->ops->intersect(prim, &ray, &hit, &solid_scratch)) continue;
                if (vec3_dot(ray.d, vec3_sub(ray.o, vec3_make(0, 0, 0))) > 0 && i % 10 == 0) continue;
                prim->ops->surface(prim, &ray, &hit, true, &s);
                Vec3 n = vec3_normalize(s.n);
                if (vec3_dot(n, ray.d) > 0) continue;  /* it started inside */
                Vec3 o = vec3_at(s.p, vec3_dot(vec3_abs(n), s.p_err), n), d = vec3_normalize(solid_random_point(&rng, 1));
                if (i % 3 == 0) d = vec3_at(d, -vec3_dot(d, n) * (1 - 0x1p-20), n);
                if (vec3_dot(d, n) < 0) d = vec3_neg(d);
                Ray away = {o, d, 0, INFINITY};
                rays++;
                if (!prim->ops->intersect(prim, &away, &hit, &solid_scratch)) continue;
                solid_print_ray("leaving ray", &away);
                fail_msg("made %d meets itself at %g, n.d %g", k, hit.t, vec3_dot(n, d));
            }
            prim_destroy(prim);
        }
    }
    printf("    %ld leaving rays\n", rays);
    assert_true(rays > 3000);
}

/* On coincident faces the first operand shows; a face that the result hasn't there does not. */
static void identity_of_faces(void **state)
{
    (void)state;
    Expr a = solid_box(0, 0, 0, 1, 1, 1), same = solid_box(0, 0, 0, 1, 1, 1), far = solid_box(5, 5, 5, 6, 6, 6);
    Expr edge_on = solid_box(0.75, 0, 0, 1, 1, 1), half = solid_box(0, 0, 0, 0.5, 1, 1);
    struct { Expr e; double x; uint32_t leaf, shown, leaf_count; double nx; } table[] = {
        {solid_unite(a, same), 0.25, 0, 0, 2, -1},
        {solid_meet(a, same), 0.25, 0, 0, 2, -1},
        {solid_unite(solid_meet(a, far), same), 0.25, 2, 2, 3, -1},            /* the first operand isn't there */
        {solid_unite(solid_meet(a, edge_on), same), 0.25, 2, 2, 3, -1},
        {solid_minus(a, half), 0.25, 1, 0, 2, -1},                       /* carved: the carver's face, the carved's look */
        {solid_minus(solid_unite(a, far), half), 0.25, 2, 0, 3, -1},
        {solid_minus(solid_unite(far, a), half), 0.25, 2, 0, 3, -1},
        {solid_unite(far, solid_minus(a, half)), 0.25, 2, 1, 3, -1},
        {solid_minus(a, solid_minus(same, half)), 0.25, 0, 0, 3, -1},
        {solid_minus(a, solid_minus(half, edge_on)), 0.25, 1, 0, 3, -1},
        {solid_minus(solid_minus(a, half), solid_box(0.5, 0, 0, 0.6, 1, 1)), 0.25, 2, 0, 3, -1},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        Prim *prim = solid_prim(&table[i].e);
        Ray ray = {vec3_make(-1, 0.5, 0.3), vec3_make(1, 0, 0), 0, INFINITY};
        Hit hit;
        Surface s;
        arena_reset(solid_scratch.arena);
        assert_true(prim->ops->intersect(prim, &ray, &hit, &solid_scratch));
        if (hit.leaf != table[i].leaf) fail_msg("row %zu: leaf %u", i, hit.leaf);
        assert_int_equal(csg_leaf_count(prim), table[i].leaf_count);
        if (csg_shown_leaf(prim, hit.leaf) != table[i].shown)
            fail_msg("row %zu: shows %u", i, csg_shown_leaf(prim, hit.leaf));
        prim->ops->surface(prim, &ray, &hit, true, &s);
        assert_true(vec3_normalize(s.n).x == table[i].nx && vec3_normalize(s.ns).x == table[i].nx);
        prim_destroy(prim);
    }
    /* the outermost difference decides, its first leaf shows */
    Expr e = solid_unite(far, solid_minus(solid_unite(a, same), solid_unite(solid_minus(half, edge_on), far)));
    Prim *prim = solid_prim(&e);
    static const uint32_t SHOWN[] = {0, 1, 2, 1, 1, 1};
    assert_int_equal(csg_leaf_count(prim), 6);
    for (uint32_t i = 0; i < 6; i++) assert_int_equal(csg_shown_leaf(prim, i), SHOWN[i]);
    prim_destroy(prim);
}

/* A CSG primitive as an operand is its tree put in its place. */
static void nested(void **state)
{
    (void)state;
    Rng rng = rng_seed(SEED, 7);
    for (int i = 0; i < 50; i++) {
        Expr a = random_leaf(&rng), inner = solid_op((CsgOp)(i % 3), random_leaf(&rng), random_leaf(&rng));
        Affine m = solid_random_pose(&rng);
        Prim *part = solid_prim(&inner);
        CsgToken inside = {.is_leaf = true, .prim = part, .to_csg = m};
        Expr by_prim = {.token = {a.token[0], inside, {.op = CSG_DIFF}}, .count = 3};
        Expr by_tree = solid_minus(a, solid_moved(inner, m));
        Prim *one = solid_prim(&by_prim), *two = solid_prim(&by_tree);
        assert_int_equal(csg_leaf_count(one), 3);
        for (uint32_t k = 0; k < 3; k++) assert_int_equal(csg_shown_leaf(one, k), csg_shown_leaf(two, k));
        for (int k = 0; k < 200; k++) {
            Ray ray = solid_random_ray(&rng, RAY_RANDOM, &by_tree);
            arena_reset(solid_scratch.arena);
            Hit x = {0}, y = {0};
            bool found = one->ops->intersect(one, &ray, &x, &solid_scratch);
            assert_int_equal(found, two->ops->intersect(two, &ray, &y, &solid_scratch));
            if (!found) continue;
            assert_true(x.t == y.t && x.leaf == y.leaf && x.part == y.part && x.u == y.u && x.v == y.v);
            Surface s;
            one->ops->surface(one, &ray, &x, true, &s);
            assert_true(vec3_length(vec3_sub(s.p, vec3_at(ray.o, x.t, ray.d))) < 1e-7);
        }
        prim_destroy(one);
        prim_destroy(two);
        prim_destroy(part);
    }
}

/* -- size -- */

enum { CHAIN_LEFT, CHAIN_RIGHT, CHAIN_MIXED, CHAIN_HOLES };

/* A row of n small boxes along x, or a plate with n holes. */
static Prim *chain(int kind, uint32_t n)
{
    CsgToken *token = malloc((2 * (size_t)n + 1) * sizeof *token);
    assert_non_null(token);
    size_t k = 0, bad;
    Expr plate = solid_box(-1, 0, 0, 2.0 * n, 1, 1);
    if (kind == CHAIN_HOLES) token[k++] = plate.token[0];
    for (uint32_t i = 0; i < n; i++) {
        double x = 2.0 * i, side = kind == CHAIN_HOLES ? 0.25 : 0;
        Expr b = solid_box(x, 0, side, x + 1, 1, 1 - side);
        token[k++] = b.token[0];
        CsgOp o = kind == CHAIN_HOLES || (kind == CHAIN_MIXED && i % 2) ? CSG_DIFF : CSG_UNION;
        if (kind != CHAIN_RIGHT && k > 1) token[k++] = (CsgToken){.op = o};
    }
    while (kind == CHAIN_RIGHT && k < 2 * (size_t)n - 1) token[k++] = (CsgToken){.op = CSG_UNION};
    Err err;
    Prim *prim = csg_create(token, k, &bad, &err);
    assert_non_null(prim);
    free(token);
    return prim;
}

static double seconds(void)
{
    struct timespec ts;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &ts);
    return (double)ts.tv_sec + 1e-9 * (double)ts.tv_nsec;
}

static void long_and_deep(void **state)
{
    (void)state;
    static const char *const NAME[] = {"left", "right", "mixed", "holes"};
    for (int kind = 0; kind < 4; kind++) {
        double cost[2];
        for (int large = 0; large < 2; large++) {
            uint32_t n = large ? 10000 : 1000;
            double start = seconds();
            Prim *prim = chain(kind, n);
            Ray along = {vec3_make(-9, 0.5, 0.5), vec3_make(1, 0, 0), 0, INFINITY};
            Ray across = {vec3_make(n / 2 * 2 + 0.5, 0.5, -9), vec3_make(0, 0, 1), 0, INFINITY};
            for (int i = 0; i < 5; i++) {
                arena_reset(solid_scratch.arena);
                uint32_t count = solid_segments(prim, &along).count;
                uint32_t expected = kind == CHAIN_MIXED ? (n + 1) / 2 : kind == CHAIN_HOLES ? n + 1 : n;
                assert_int_equal(count, expected);
            }
            cost[large] = seconds() - start;
            arena_reset(solid_scratch.arena);
            Hit hit;
            assert_true(prim->ops->intersect(prim, &across, &hit, &solid_scratch));
            assert_true(hit.t == 9);
            prim_destroy(prim);
        }
        printf("    %s: 1,000 in %.2f ms, 10,000 in %.2f ms\n", NAME[kind], 1e3 * cost[0], 1e3 * cost[1]);
        /* 10 times the work, but for caches. Only alternating operators cost a crossing up to their depth. */
        if (kind != CHAIN_MIXED) assert_true(cost[1] < 40 * cost[0] + 0.005);
    }
}

/* -- failure -- */

static void bad_matrix(void **state)
{
    (void)state;
    Expr e = solid_unite(solid_box(0, 0, 0, 1, 1, 1), solid_minus(solid_leaf(SPHERE, affine_identity()),
        solid_leaf(CUBE, affine_scale(1, 0, 1))));
    size_t bad = 99;
    Err err = {0};
    assert_null(csg_create(e.token, e.count, &bad, &err));
    assert_int_equal(bad, 2);
    assert_int_equal(err.kind, ERR_SCENE);
    assert_true(strlen(err.text) > 0);
}

static void out_of_memory(void **state)
{
    (void)state;
    Expr e = solid_minus(solid_box(0, 0, 0, 1, 1, 1), solid_leaf(SPHERE, affine_identity()));
    long failures = 0;
    for (long n = 1;; n++) {
        size_t bad;
        Err err = {0};
        alloc_fail_at(n);
        Prim *prim = csg_create(e.token, e.count, &bad, &err);
        bool failed = alloc_fail_stop();
        assert_int_equal(prim == NULL, failed);
        prim_destroy(prim);
        if (!failed) break;
        assert_int_equal(err.kind, ERR_LIMIT);
        failures++;
    }
    assert_true(failures > 5);

    /* in the ray loop: no hit, and the solid_scratch says why */
    Prim *prim = chain(CHAIN_LEFT, 2000);
    Ray along = {vec3_make(-9, 0.5, 0.5), vec3_make(1, 0, 0), 0, INFINITY};
    for (long n = 1;; n++) {
        Scratch own = {.arena = arena_create()};
        assert_non_null(own.arena);
        Hit hit;
        alloc_fail_at(n);
        bool found = prim->ops->intersect(prim, &along, &hit, &own);
        bool failed = alloc_fail_stop();
        assert_int_equal(found, !failed);
        assert_int_equal(own.out_of_memory, failed);
        arena_destroy(own.arena);
        if (!failed) {
            assert_true(n > 3);
            break;
        }
    }
    prim_destroy(prim);
}

static int set_up(void **state)
{
    (void)state;
    solids_create();
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    solids_destroy();
    return 0;
}

int main(void)
{
    printf("seed %d\n", SEED);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(laws_of_sets),      cmocka_unit_test(flush_faces),
        cmocka_unit_test(points_agree),      cmocka_unit_test(thickness_decides),
        cmocka_unit_test(no_films),          cmocka_unit_test(grazing_keeps_walls),
        cmocka_unit_test(gap_from_afar),
        cmocka_unit_test(queries_agree),     cmocka_unit_test(no_hit_of_own_surface),
        cmocka_unit_test(identity_of_faces), cmocka_unit_test(nested),
        cmocka_unit_test(long_and_deep),     cmocka_unit_test(bad_matrix),
        cmocka_unit_test(out_of_memory),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
