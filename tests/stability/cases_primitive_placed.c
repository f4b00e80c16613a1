/* Cases 11, 12, 15 and 17: primitives under affine maps, and the script's errors about them. The maps are those of
 * common/affine, the oracles work on the matrices' own entries in quad. */
#include "stability/cases_primitive.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "common/numeric.h"
#include "scene_lua.h"
#include "stability/ray_check.h"
#include "support/check.h"
#include "support/test_file.h"

/* What a hit in world space is: t, and the normal as the renderer carries it. */
static bool placed_hit(Subject *s, const Affine *to_object, const Ray *ray, Hit *hit, Surface *at)
{
    Ray inner = {affine_point(to_object, ray->o), affine_vector(to_object, ray->d), ray->tmin, ray->tmax};
    if (!subject_hit(s, &inner, hit)) return false;
    s->prim->ops->surface(s->prim, &inner, hit, true, at);
    return true;
}

static Affine inverse_of(const Affine *map)
{
    Affine inverse;
    CHECK(affine_inverse(map, &inverse));
    return inverse;
}

/* Seen along z an ellipsoid covers the ellipse x^2/a^2 + y^2/b^2 < 1. The maps are (1,1,1e-6), (1,1e6,1) and others. */
void ellipsoid_coverage(Row *row, uint64_t trials)
{
    Subject s = subject_open(SPHERE, 0, false);
    for (uint64_t seed = 0; row->trials < trials; seed++) {
        Rng rng = rng_seed(seed, 111);
        double a = 1, b = 1, c = 1e-6;
        if (seed % 3 == 1) b = 1e6, c = 1;
        if (seed % 3 == 2) a = pow(10, uniform(&rng, -6, 6)), b = pow(10, uniform(&rng, -6, 6)), c = 1e6 / a;
        Affine map = affine_scale(a, b, c), inverse = inverse_of(&map);
        double limb = uniform(&rng, -1, 1) * pow(10, uniform(&rng, -12, 0)), angle = uniform(&rng, 0, 2 * M_PI);
        Ray ray = {{a * (1 + limb) * cos(angle), b * (1 + limb) * sin(angle), 100 * (c + 1)}, {0, 0, -1}, 0, INFINITY};
        Quad x = (Quad)ray.o.x / a, y = (Quad)ray.o.y / b, off = 1 - x * x - y * y;
        Hit hit;
        Surface at;
        bool found = placed_hit(&s, &inverse, &ray, &hit, &at);
        /* the object-space coordinates have two roundings each */
        row_trial(row, q_abs(off) < 2 * GAMMA(4) || found == (off > 0), "semi-axes %g %g %g: 1 - rho^2 = %g, seed %llu", a, b,
                  c, (double)off, (unsigned long long)seed);
    }
    subject_close(&s);
}

typedef struct { Quad m[3][3]; } QMatrix;

static QMatrix q_linear(const Affine *a)
{
    QMatrix q;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) q.m[i][j] = a->m[i][j];
    return q;
}

/* The transposed inverse times the determinant: the matrix of cofactors. */
static QMatrix q_cofactors(const QMatrix *a)
{
    QMatrix c;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            int p = (i + 1) % 3, q = (i + 2) % 3, r = (j + 1) % 3, t = (j + 2) % 3;
            c.m[i][j] = a->m[p][r] * a->m[q][t] - a->m[p][t] * a->m[q][r];
        }
    return c;
}

static Quad q_determinant(const QMatrix *a, const QMatrix *cofactors)
{
    Quad sum = 0;
    for (int j = 0; j < 3; j++) sum += a->m[0][j] * cofactors->m[0][j];
    return sum;
}

static void q_apply(const QMatrix *a, const Quad v[3], Quad out[3])
{
    for (int i = 0; i < 3; i++) out[i] = a->m[i][0] * v[0] + a->m[i][1] * v[1] + a->m[i][2] * v[2];
}

static Quad q_norm(const Quad v[3]) { return q_sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

/* Frobenius norms of the map and its inverse, multiplied. */
static double condition_of(const QMatrix *a, const QMatrix *cofactors)
{
    Quad aa = 0, cc = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            aa += a->m[i][j] * a->m[i][j];
            cc += cofactors->m[i][j] * cofactors->m[i][j];
        }
    return (double)(q_sqrt(aa * cc) / q_abs(q_determinant(a, cofactors)));
}

static Affine random_turn(Rng *rng)
{
    Affine turn = affine_identity();
    for (int axis = 0; axis < 3; axis++) {
        Affine r = affine_rotate(axis, uniform(rng, -180, 180));
        turn = affine_mul(&r, &turn);
    }
    return turn;
}

/* An ellipsoid's normal at the world point that was hit is A^-T A^-1 (p - centre), up to its length. The bound: rounding
 * the ray in world space by u shifts the object-space point by |A^-1| times that and slides it along the line until it
 * is on the sphere again; |A^-T| turns the shift into one of the normal. Each happens 16 times at most. */
void ellipsoid_normals(Row *row, uint64_t trials)
{
    Subject s = subject_open(SPHERE, 0, false);
    for (uint64_t seed = 0; row->trials < trials; seed++) {
        Rng rng = rng_seed(seed, 112);
        double flat = pow(10, uniform(&rng, -12, -6));
        Affine stretch = seed % 2 ? affine_scale(1, 1, flat) : affine_scale(1, 1 / flat, 1);
        Affine turn = random_turn(&rng), map = affine_mul(&turn, &stretch), inverse = inverse_of(&map);
        Vec3 aim = random_direction(&rng), d = random_direction(&rng);
        Vec3 o = vec3_sub(affine_point(&map, aim), vec3_scale(affine_vector(&map, d), 10));
        Ray ray = {o, affine_vector(&map, d), 0, INFINITY};
        Hit hit;
        Surface at;
        if (!placed_hit(&s, &inverse, &ray, &hit, &at)) continue;

        QMatrix a = q_linear(&map), cofactors = q_cofactors(&a);
        Quad det = q_determinant(&a, &cofactors), world_o[3] = {o.x, o.y, o.z}, po[3] = {0}, pd[3] = {0};
        Quad world_d[3] = {ray.d.x, ray.d.y, ray.d.z};
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) {
                po[i] += cofactors.m[j][i] * world_o[j] / det;
                pd[i] += cofactors.m[j][i] * world_d[j] / det;
            }
        Quad qa = 0, qb = 0, qc = -1;
        for (int i = 0; i < 3; i++) qa += pd[i] * pd[i], qb += po[i] * pd[i], qc += po[i] * po[i];
        Quad disc = qb * qb - qa * qc;
        if (disc <= 0.01 * qa) continue;   /* grazing rays: case 3 */
        Quad t = (-qb - q_sqrt(disc)) / qa, p[3], n[3];
        for (int i = 0; i < 3; i++) p[i] = po[i] + t * pd[i];
        q_apply(&cofactors, p, n);

        double cosine = (double)q_abs(p[0] * pd[0] + p[1] * pd[1] + p[2] * pd[2]);
        double world[3], off[3] = {0}, slip = 0, turned = 0;
        for (int i = 0; i < 3; i++) world[i] = UNIT_ROUNDOFF * (double)(q_abs(world_o[i]) + q_abs(t * world_d[i]));
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < 3; j++) off[i] += fabs(inverse.m[i][j]) * world[j];
            slip += fabs((double)p[i]) * off[i] / cosine;
        }
        for (int i = 0; i < 3; i++) {
            double sum = 0;
            for (int j = 0; j < 3; j++)
                sum += fabs((double)cofactors.m[i][j]) * (off[j] + slip * fabs((double)pd[j]));
            turned += sum * sum;
        }
        double bound = 16 * sqrt(turned) / (double)q_norm(n);
        if (!(bound < 0.5)) continue;   /* nothing can be said */
        double ulps = angle_ulps(affine_normal(&inverse, at.n), n);
        row->n_ulps = fmax(row->n_ulps, ulps);
        row_trial(row, ulps * UNIT_ROUNDOFF <= bound, "flat %g: normal off by %g, bound %g, seed %llu", flat,
                  ulps * UNIT_ROUNDOFF, bound, (unsigned long long)seed);
    }
    subject_close(&s);
}

/* affine_normal against the quad cofactors. Bound: a few roundings, times the map's condition number. */
void sheared_normals(Row *row, uint64_t trials)
{
    for (uint64_t seed = 0; row->trials < trials; seed++) {
        Rng rng = rng_seed(seed, 115);
        Affine scale = affine_scale(pow(10, uniform(&rng, -3, 3)), pow(10, uniform(&rng, -3, 3)), pow(10, uniform(&rng, -3, 3)));
        Affine shear = affine_identity(), turn = random_turn(&rng), map;
        shear.m[0][1] = uniform(&rng, -10, 10);
        shear.m[2][0] = uniform(&rng, -10, 10);
        map = affine_mul(&shear, &scale);
        map = affine_mul(&turn, &map);
        Affine inverse = inverse_of(&map);
        QMatrix a = q_linear(&map), cofactors = q_cofactors(&a);
        Vec3 v = random_direction(&rng);
        Quad n[3] = {v.x, v.y, v.z}, truth[3];
        q_apply(&cofactors, n, truth);
        double ulps = angle_ulps(affine_normal(&inverse, v), truth), condition = condition_of(&a, &cofactors);
        row->n_ulps = fmax(row->n_ulps, ulps);
        row_trial(row, ulps <= 16 * condition, "normal %g ulps off, condition %g, seed %llu", ulps, condition,
                  (unsigned long long)seed);
    }
}

/* Where the line meets the cylinder of radius and half height `size`, in quad. False: nowhere at t >= 0. */
static bool meets_cylinder(const Quad o[3], const Quad d[3], Quad size, Quad *in, Quad *out)
{
    Quad a = d[0] * d[0] + d[2] * d[2], b = o[0] * d[0] + o[2] * d[2], c = o[0] * o[0] + o[2] * o[2] - size * size;
    Quad disc = b * b - a * c, root = q_sqrt(disc), cap[2] = {(-size - o[1]) / d[1], (size - o[1]) / d[1]};
    *in = q_max(q_min(cap[0], cap[1]), (-b - root) / a);
    *out = q_min(q_max(cap[0], cap[1]), (-b + root) / a);
    return disc > 0 && *in < *out && *out > 0;
}

/* A needle of length 1e8 and radius 1e-4 and a disc of height 1e-8 about y, seen across their outline from the side.
 * In quad, in units of radius and half length, a hit must meet the cylinder that is larger by what the transform's
 * rounding moves a point, and a miss must miss the one that is smaller by that; t must lie between theirs. */
void needle_and_disc(Row *row, uint64_t trials)
{
    static const uint64_t BEHIND = 275926;   /* the needle lies just behind the origin: kept, and tested first */
    static const double RADIUS[] = {1e-4, 1}, HALF[] = {5e7, 5e-9};
    Subject s = subject_open(CYLINDER, 0, false);
    for (uint64_t i = 0; row->trials < trials; i++) {
        uint64_t seed = i == 0 ? BEHIND : i - 1;
        Rng rng = rng_seed(seed, 117);
        double r = RADIUS[seed % 2], h = HALF[seed % 2];
        Affine map = affine_scale(r, h, r), inverse = inverse_of(&map);
        Vec3 aim = {uniform(&rng, -1.5, 1.5), uniform(&rng, -1.5, 1.5), uniform(&rng, -1.5, 1.5)}, d = random_direction(&rng);
        aim = vec3_make(aim.x * r, aim.y * h, aim.z * r);
        d = vec3_make(d.x * r, d.y * h, d.z * r);
        double away = uniform(&rng, 2, 100);
        Ray ray = {vec3_at(aim, -away, d), d, 0, INFINITY};
        Quad o[3] = {(Quad)ray.o.x / r, (Quad)ray.o.y / h, (Quad)ray.o.z / r};
        Quad e[3] = {(Quad)d.x / r, (Quad)d.y / h, (Quad)d.z / r};
        /* the inverse's entry and the product have a rounding each, the sum with 0 none: a point at t <= away + 4 is
         * moved by no more than 2 u (|o| + t |d|) in a component, |o| <= away + 1.5, |d| <= 1; in radius by twice that */
        double moved = 2 * GAMMA(2) * (2 * away + 6);
        Quad in[2] = {0, 0}, out[2] = {0, 0};
        bool surely = meets_cylinder(o, e, 1 - moved, &in[0], &out[0]);
        bool perhaps = meets_cylinder(o, e, 1 + moved, &in[1], &out[1]);
        Hit hit;
        Surface at;
        bool found = placed_hit(&s, &inverse, &ray, &hit, &at), ok = found ? perhaps : !surely;
        /* the way in, or out for an origin inside, of one of the cylinders between the two */
        if (found && surely && in[1] > 0) ok = ok && hit.t >= in[1] && hit.t <= in[0];
        if (found && surely && in[0] <= 0) ok = ok && hit.t >= out[0] && hit.t <= out[1];
        row->undecided += surely != perhaps;
        row_trial(row, ok, "radius %g: found %d, surely %d, perhaps %d, t %g, seed %llu", r, found, surely, perhaps, hit.t,
                  (unsigned long long)seed);
    }
    subject_close(&s);
}

static bool ignore_job(void *context, const RenderJob *job, Err *err)
{
    (void)context, (void)job, (void)err;
    return true;
}

static void ignore_warning(void *context, const char *text) { (void)context, (void)text; }

/* Every argument of every primitive and transform that is nan, infinite, or zero or negative where that means nothing:
 * an error with the script's line (exit 1 is what Main makes of ERR_SCENE). */
void bad_arguments(Row *row, uint64_t trials)
{
    (void)trials;
    static const char *const CALLS[] = {
        "gr.cube('c'):scale(#, 1, 1)", "gr.cube('c'):scale(1, #, 1)", "gr.cube('c'):scale(1, 1, #)",
        "gr.nh_sphere('s', {0, 0, 0}, #)", "gr.nh_box('b', {0, 0, 0}, #)", "gr.torus('t', #)",
        "gr.nh_sphere('s', {#, 0, 0}, 1)", "gr.nh_box('b', {0, #, 0}, 1)", "gr.cone('c'):translate(#, 0, 0)",
        "gr.cone('c'):translate(0, #, 0)", "gr.cylinder('c'):rotate('x', #)", "gr.sphere('s'):translate(0, 0, #)",
    };
    static const char *const VALUES[] = {"0/0", "1/0", "-1/0", "0", "-2"};
    enum { SIZES = 6, ZERO = 3, NEGATIVE = 4 };   /* calls that take sizes; a negative scale is a mirror */
    for (size_t c = 0; c < sizeof CALLS / sizeof *CALLS; c++)
        for (int v = 0; v < 5; v++) {
            if ((v == ZERO && c >= SIZES) || (v == NEGATIVE && (c < 3 || c >= SIZES))) continue;
            char text[128];
            const char *hash = strchr(CALLS[c], '#');
            snprintf(text, sizeof text, "\n%.*s(%s)%s\n", (int)(hash - CALLS[c]), CALLS[c], VALUES[v], hash + 1);
            SceneScript script = {.script = test_file("stability_bad.lua", text)};
            const RenderSink sink = {.render = ignore_job, .warn = ignore_warning};
            Err err = {ERR_NONE, ""};
            bool ran = scene_lua_run(&script, &sink, &err);
            row_trial(row, !ran && err.kind == ERR_SCENE && strstr(err.text, "stability_bad.lua:2: "), "%s with %s: %s",
                      CALLS[c], VALUES[v], ran ? "no error" : err.text);
        }
}
