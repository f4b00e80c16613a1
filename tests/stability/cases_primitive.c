/* Cases 1 to 6 and 16 to 21: single rays through the analytic primitives in their own space. */
#include "stability/stability.h"

#include <math.h>

#include "stability/cases_primitive.h"
#include "stability/ray_check.h"

static Ray whole_line(Vec3 o, Vec3 d) { return (Ray){o, d, -INFINITY, INFINITY}; }

static double either(Rng *rng, double a, double b) { return rng_u32(rng) % 2 ? a : b; }

/* x, or its neighbour on either side. */
static double neighbour(Rng *rng, double x)
{
    uint32_t k = rng_u32(rng) % 3;
    return k == 0 ? x : nextafter(x, k == 1 ? INFINITY : -INFINITY);
}

/* Rays that were once judged wrong; a case begins with its own. */
typedef struct { int number; ShapeKind kind; double minor; Vec3 o, d; } KeptRay;

static const KeptRay KEPT[] = {
    {4, CUBE, 0, {0, 0x1.3647e1c674183p-2, 0x1.d91b65f07a168p-1},
     {-0x1.fcbad94f5130dp-12, 0x1.a60e69163a9a4p-1, 0x1.21d9561c64e12p-1}},
    {5, TORUS, 1.3, {-0x1.76f9490494822p+0, 0x1.e7b50b26f966ap-1, 0x1.6b23671a7f1p-2}, {-0x0.19e58dd132f8fp-1022, 0, 0}},
    {6, SPHERE, 0, {0x1.3a6ecffc76f3bp+5, 0x1.1fa591425267cp+5, 0x1.d0e3c385d720bp+5},
     {-0x1.f564995280bdp-2, -0x1.dc40bb43a741ep-2, -0x1.799cc22d2df9bp-1}},
    {18, CONE, 0, {0x1.f37546a0b8e4ep+0, -0x1.8f88e691d4b68p+0, -0x1.4d6500b186e98p+1},
     {-0x1.14c4ef995548p-1, 0x1.bacbb2be82f39p-2, 0x1.717e71a24a43fp-1}},
    {18, CONE, 0, {-0x1.932e6cea59f1p-57, 0x1.c8d077f8781f4p-59, 0x1.5c8f907d4074ap-58},
     {0x1.ad90af5006d8ep-2, -0x1.b92e63c00928fp-1, -0x1.24616483a06fbp-2}},
    {18, CONE, 0, {-0x1.ab98c6ea9561fp+1, 4, -0x1.199c85b7bfa88p+1}, {0x1.ab98c6ea9561fp-1, -1, 0x1.199c85b7bfa88p-1}},
    {19, TORUS, 1e-6, {-0x1.d6b50421e7ebbp-1, -0x1.38ebecad0c1f2p-10, -0x1.9519b6052b183p-2},
     {0x1.0af2b73643053p-2, 0x1.66dcdaa3755b5p-1, 0x1.53ebc15f747fp-1}},
    {20, TORUS, 0.25, {-0x1.8f84b18f2489p-1, 0, 0.75}, {1, 0, 0}},
    {20, TORUS, 0.25, {0x1.5b842f4e6535ep-51, -0x1.0dc67903ddc34p+1, 0.75}, {0, 1, 0}},
};

static void kept_rays(Row *row, int number)
{
    for (uint64_t i = 0; i < sizeof KEPT / sizeof *KEPT; i++) {
        const KeptRay *k = &KEPT[i];
        if (k->number != number) continue;
        Subject s = subject_open(k->kind, k->minor, true);
        for (int half = 0; half < 2; half++) {
            Ray ray = {k->o, k->d, half ? 0 : -INFINITY, INFINITY};
            check_ray(row, &s, &ray, i);
        }
        subject_close(&s);
    }
}

/* The line from (0,0,D) through (x,y,0) passes the centre at D rho / sqrt(D^2 + rho^2): coverage is known exactly. */
static void sphere_from_afar(Row *row, uint64_t trials)
{
    Subject s = subject_open(SPHERE, 0, false);
    for (uint64_t seed = 0; row->trials < trials; seed++) {
        Rng rng = rng_seed(seed, 101);
        double far = pow(10, 2 + (double)(seed % 11)), angle = uniform(&rng, 0, 2 * M_PI);
        double limb = either(&rng, 1, -1) * pow(10, uniform(&rng, -15, -1));
        double rho = seed % 4 == 0 ? uniform(&rng, 0, 2) : 1 + limb;
        Ray ray = {{0, 0, far}, {rho * cos(angle), rho * sin(angle), -far}, 0, INFINITY};
        Quad flat = (Quad)ray.d.x * ray.d.x + (Quad)ray.d.y * ray.d.y, square = (Quad)far * far;
        bool covered = square * flat < square + flat;
        Hit hit;
        bool found = subject_hit(&s, &ray, &hit);
        row_trial(row, found == covered, "far %g: %s, seed %llu", far, covered ? "a limb ray is lost" : "hit beside",
                  (unsigned long long)seed);
    }
    subject_close(&s);
}

static void tangent_rays(Row *row, uint64_t trials)
{
    static const ShapeKind KINDS[] = {SPHERE, CYLINDER, TORUS, CONE};
    for (int k = 0; k < 4; k++) {
        Subject s = subject_open(KINDS[k], 0.5, false);
        uint64_t end = trials * (uint64_t)(k + 1) / 4;
        for (uint64_t seed = 0; row->trials < end; seed++) {
            Rng rng = rng_seed(seed, 103);
            double gap = ldexp(either(&rng, 1, -1), -(int)(10 + seed % 43));
            Vec3 n = random_direction(&rng);
            if (s.kind == TORUS) n = vec3_scale(vec3_normalize(vec3_make(n.x, 0, n.z)), 1.5);
            if (s.kind == CYLINDER) n = vec3_add(vec3_normalize(vec3_make(n.x, 0, n.z)), vec3_make(0, n.y, 0));
            Vec3 p = n, up = n;
            if (s.kind == CYLINDER) up.y = 0;
            if (s.kind == CONE) {
                Vec3 ring = vec3_normalize(vec3_make(n.x, 0, n.z));
                double height = uniform(&rng, 0.01, 1);
                p = vec3_scale(vec3_make(ring.x, -1, ring.z), height);
                up = vec3_make(ring.x, 1, ring.z);
            }
            Vec3 d = vec3_cross(up, random_direction(&rng));
            Ray ray = whole_line(vec3_at(vec3_at(p, gap, up), uniform(&rng, -10, 10), d), d);
            check_ray(row, &s, &ray, seed);
        }
        subject_close(&s);
    }
}

static void tangent_exact(Row *row, uint64_t trials)
{
    (void)trials;
    Subject s = subject_open(SPHERE, 0, true);
    for (int k = 10; k <= 52; k++)
        for (int side = -1; side <= 1; side++)
            for (int axis = 0; axis < 3; axis++) {
                double b = 1 + side * ldexp(1, -k);
                Vec3 o[3] = {{-5, b, 0}, {0, -5, b}, {b, 0, -5}}, d[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
                Ray ray = {o[axis], d[axis], 0, INFINITY};
                Hit hit;
                bool found = subject_hit(&s, &ray, &hit);
                if (side == 0) {
                    row_trial(row, !found || hit.t == 5, "the double root is at %a", hit.t);
                } else if (found != (side < 0)) {
                    row_trial(row, false, "k %d side %d: found %d", k, side, found);
                } else {
                    check_ray(row, &s, &ray, (uint64_t)k);
                }
            }
    subject_close(&s);
}

/* From a surface point or its neighbour, and from where the renderer starts: just outside the point's error bound. */
static void from_the_surface(Row *row, uint64_t trials)
{
    kept_rays(row, 4);
    static const double MINORS[] = {0.5, 0.05, 1.3};
    enum { SUBJECTS = 4 + sizeof MINORS / sizeof MINORS[0] };
    for (int k = 0; k < SUBJECTS; k++) {
        Subject s = subject_open(k < 4 ? (ShapeKind)k : TORUS, k < 4 ? 0 : MINORS[k - 4], false);
        uint64_t end = trials * (uint64_t)(k + 1) / SUBJECTS;
        for (uint64_t seed = 0; row->trials < end; seed++) {
            Rng rng = rng_seed(seed, 104);
            Vec3 d = random_direction(&rng);
            Ray ray = {vec3_at(random_point(&rng, &s), -10, d), d, 0, INFINITY};
            Hit hit, other;
            if (!subject_hit(&s, &ray, &hit)) continue;
            Surface at;
            s.prim->ops->surface(s.prim, &ray, &hit, true, &at);
            Quad p[3] = {at.p.x, at.p.y, at.p.z}, n[3];
            true_normal(&s, p, n);
            double slope = vec3_dot(d, at.n) / vec3_length(at.n);
            if (k < 4) row->n_ulps = fmax(row->n_ulps, angle_ulps(at.n, n));
            Vec3 o = {neighbour(&rng, at.p.x), neighbour(&rng, at.p.y), neighbour(&rng, at.p.z)};
            ray = (Ray){o, random_direction(&rng), 0, INFINITY};
            check_ray(row, &s, &ray, seed);
            if (k >= 4) continue;
            double away = (vec3_dot(vec3_abs(at.n), at.p_err) + 0x1p-50) / vec3_dot(at.n, at.n);
            ray = (Ray){vec3_at(at.p, away, at.n), random_direction(&rng), 0, INFINITY};
            if (vec3_dot(ray.d, at.n) < 0) ray.d = vec3_neg(ray.d);
            row_trial(row, !subject_hit(&s, &ray, &other), "%s: a leaving ray hits, seed %llu", subject_name(&s),
                      (unsigned long long)seed);
            ray = (Ray){vec3_at(at.p, -away, at.n), d, 0, INFINITY};
            /* near an edge of the solid the start may lie outside of another face */
            if (fabs(slope) > 0.1) check_ray(row, &s, &ray, seed);
        }
        subject_close(&s);
    }
}

static double extreme_component(Rng *rng, double x)
{
    switch (rng_u32(rng) % 6) {
    case 0: return -0.0;
    case 1: return ldexp(x, -1074 + (int)(rng_u32(rng) % 52));
    case 2: return x * 1e-300;
    case 3: return x * pow(10, uniform(rng, -300, 0));
    default: return x;
    }
}

static void extreme_components(Row *row, uint64_t trials)
{
    kept_rays(row, 5);
    for (int k = 0; k < SHAPE_COUNT; k++) {
        Subject s = subject_open((ShapeKind)k, 0.5, true);
        uint64_t end = trials * (uint64_t)(k + 1) / SHAPE_COUNT;
        for (uint64_t seed = 0; row->trials < end; seed++) {
            Rng rng = rng_seed(seed, 105);
            Vec3 d = random_direction(&rng), p = random_point(&rng, &s);
            d = vec3_make(extreme_component(&rng, d.x), extreme_component(&rng, d.y), extreme_component(&rng, d.z));
            if (vec3_max(vec3_abs(d)) == 0) d.z = 1e-300;
            double m = vec3_max(vec3_abs(d));
            double back = uniform(&rng, 0, 10) / m;
            Ray ray = {vec3_at(p, isfinite(back) ? -back : 0, d), d, 0, INFINITY};
            check_ray(row, &s, &ray, seed);
        }
        subject_close(&s);
    }
}

static bool same_point(const Surface *a, const Surface *b)
{
    return a->p.x == b->p.x && a->p.y == b->p.y && a->p.z == b->p.z;
}

static void lengthened(Row *row, Subject *s, const Ray *ray, int e, uint64_t seed)
{
    Vec3 d = ray->d;
    Ray other = {ray->o, vec3_make(ldexp(d.x, e), ldexp(d.y, e), ldexp(d.z, e)), ray->tmin, ray->tmax};
    Hit a, b;
    Surface p, q;
    bool found = subject_hit(s, ray, &a), same = subject_hit(s, &other, &b) == found;
    if (found && same) {
        s->prim->ops->surface(s->prim, ray, &a, true, &p);
        s->prim->ops->surface(s->prim, &other, &b, true, &q);
        same = same_point(&p, &q) && ldexp(a.t, -e) == b.t && ldexp(a.u, -e) == b.u;
    }
    row_trial(row, same, "%s: 2^%d, seed %llu", subject_name(s), e, (unsigned long long)seed);
}

/* A direction times 2^k moves the hit not at all; times 10^k, by no more than its own rounding. */
static void direction_lengths(Row *row, uint64_t trials)
{
    kept_rays(row, 6);
    for (int k = 0; k < SHAPE_COUNT; k++) {
        Subject s = subject_open((ShapeKind)k, 0.5, false);
        uint64_t end = trials * (uint64_t)(k + 1) / SHAPE_COUNT;
        for (size_t i = 0; i < sizeof KEPT / sizeof *KEPT; i++) {
            Ray ray = {KEPT[i].o, KEPT[i].d, 0, INFINITY};
            for (int e = -650; KEPT[i].kind == s.kind && e <= 650; e++)
                if (vec3_max(vec3_abs(ray.d)) > 0x1p-100) lengthened(row, &s, &ray, e, i);
        }
        for (uint64_t seed = 0; row->trials < end; seed++) {
            Rng rng = rng_seed(seed, 106);
            Vec3 d = random_direction(&rng);
            Ray ray = {vec3_at(random_point(&rng, &s), -pow(10, uniform(&rng, -2, 3)), d), d, 0, INFINITY}, other = ray;
            lengthened(row, &s, &ray, (int)(rng_u32(&rng) % 1330) - 665, seed);
            other.d = vec3_scale(d, pow(10, uniform(&rng, -200, 200)));
            check_ray(row, &s, &other, seed);
        }
        subject_close(&s);
    }
}

/* Case 16, and lines at the radius that aren't quite parallel. */
static void cylinder_along_axis(Row *row, uint64_t trials)
{
    Subject s = subject_open(CYLINDER, 0, true);
    for (uint64_t seed = 0; row->trials < trials; seed++) {
        Rng rng = rng_seed(seed, 116);
        double angle = uniform(&rng, 0, 2 * M_PI), r = seed % 4 == 0 ? uniform(&rng, 0, 2) : neighbour(&rng, 1);
        Ray ray = {{r * cos(angle), uniform(&rng, -3, 3), r * sin(angle)}, {0, either(&rng, 1, -1), 0}, -INFINITY, INFINITY};
        if (seed % 8 == 1) ray.o.x = either(&rng, r, -r), ray.o.z = 0;
        bool parallel = seed % 2;
        if (!parallel) ray.d.x = uniform(&rng, -1, 1) * pow(10, uniform(&rng, -20, 0));
        if (!parallel) {
            check_ray(row, &s, &ray, seed);
            continue;
        }
        Quad rr = (Quad)ray.o.x * ray.o.x + (Quad)ray.o.z * ray.o.z;
        Hit hit;
        double first = ray.d.y > 0 ? -1 - ray.o.y : ray.o.y - 1;
        bool found = subject_hit(&s, &ray, &hit);
        row_trial(row, found == (rr <= 1) && (!found || fabs(hit.t - first) <= 0x1p-52 * fabs(first)),
                  "r^2 - 1 = %g: found %d, seed %llu", (double)(rr - 1), found, (unsigned long long)seed);
    }
    subject_close(&s);
}

static void cone_special(Row *row, uint64_t trials)
{
    kept_rays(row, 18);
    Subject s = subject_open(CONE, 0, false);
    for (uint64_t seed = 0; row->trials < trials; seed++) {
        Rng rng = rng_seed(seed, 118);
        Vec3 d = random_direction(&rng), o = {0, 0, 0};
        double tiny = either(&rng, 1, -1) * pow(10, uniform(&rng, -17, -1)), far = uniform(&rng, -10, 10);
        switch (seed % 4) {
        case 0:   /* through the apex, or past it by a little */
            o = vec3_at(o, far, d);
            if (seed % 8 == 0) o.x += tiny;
            break;
        case 1: { /* along a line of the side, or beside it by a little; (3,4,5) makes some of them exact */
            Vec3 side = seed % 8 == 1 ? vec3_make(3, -5, 4) : vec3_normalize(vec3_make(d.x, 0, d.z));
            if (seed % 8 != 1) side.y = -1;
            d = side;
            o = vec3_scale(side, round(far));
            if (seed % 16 > 8) o.y += tiny;
            break;
        }
        case 2:   /* from the apex */
            break;
        default:  /* from a neighbour of the apex */
            o = vec3_make(tiny, tiny * uniform(&rng, -1, 1), tiny * uniform(&rng, -1, 1));
            break;
        }
        Ray ray = {o, d, either(&rng, 0, -INFINITY), INFINITY};
        check_ray(row, &s, &ray, seed);
    }
    subject_close(&s);
}

static void torus_random(Row *row, uint64_t trials, const double *minor, int minors, bool precise)
{
    for (int k = 0; k < minors; k++) {
        Subject s = subject_open(TORUS, minor[k], precise);
        uint64_t end = trials * (uint64_t)(k + 1) / (uint64_t)minors;
        for (uint64_t seed = 0; row->trials < end; seed++) {
            Rng rng = rng_seed(seed, 119);
            Vec3 d = random_direction(&rng), p = random_point(&rng, &s);
            /* a thread is hardly ever hit by chance: aim at its tube */
            if (seed % 2) {
                Vec3 ring = vec3_normalize(vec3_make(p.x, 0, p.z));
                p = vec3_at(ring, s.minor * uniform(&rng, 0, 1.2), random_direction(&rng));
            }
            if (seed % 16 == 0) d.y = 0;
            if (seed % 16 == 2) d = vec3_make(0, either(&rng, 1, -1), 0);
            Ray ray = {vec3_at(p, -pow(10, uniform(&rng, -3, 3)), d), d, 0, INFINITY};
            check_ray(row, &s, &ray, seed);
        }
        subject_close(&s);
    }
}

static void torus_rings(Row *row, uint64_t trials)
{
    kept_rays(row, 19);
    static const double MINOR[] = {1e-6, 0.5, 1 - 1e-12, 1};
    torus_random(row, trials, MINOR, 4, true);
}

static void torus_spindles(Row *row, uint64_t trials)
{
    static const double MINOR[] = {1 + 1e-12, 1.3, 20};
    torus_random(row, trials, MINOR, 3, true);
}

/* Along the axis of a horn torus two roots are a pair of a nearly quadruple one. A third of the lines are tangents up to
 * the rounding of their own coordinates. */
static void torus_degenerate(Row *row, uint64_t trials)
{
    kept_rays(row, 20);
    static const double MINOR[] = {0.5, 0.25, 1};
    for (int k = 0; k < 3; k++) {
        Subject s = subject_open(TORUS, MINOR[k], true);
        uint64_t end = trials * (uint64_t)(k + 1) / 3;
        double m = s.minor;
        for (uint64_t seed = 0; row->trials < end; seed++) {
            Rng rng = rng_seed(seed, 120);
            double gap = seed % 3 ? either(&rng, 1, -1) * pow(10, uniform(&rng, -17, -1)) : 0;
            double angle = either(&rng, round(uniform(&rng, 0, 4)) * M_PI / 2, uniform(&rng, 0, 2 * M_PI));
            Vec3 d = {cos(angle), 0, sin(angle)}, side = {-d.z, 0, d.x}, o;
            switch (seed / 3 % 5) {
            case 0: o = vec3_scale(side, 1 - m + gap); break;                  /* in its plane, at the inner rim */
            case 1: o = vec3_scale(side, uniform(&rng, 0, 2)); o.y = gap; break;
            case 2: o = vec3_scale(side, 1 + m + gap); break;                  /* at the outer rim */
            case 3: o = vec3_scale(side, 1 + gap); o.y = m; break;             /* on top: a quadruple root */
            default:                                                           /* along the axis */
                d = vec3_make(0, 1, 0);
                o = vec3_make(gap, 0, seed % 2 ? 0 : 1 - m);
                break;
            }
            Ray ray = whole_line(vec3_at(o, uniform(&rng, -10, 10), d), d);
            check_ray(row, &s, &ray, seed);
        }
        subject_close(&s);
    }
}

static void torus_grazing(Row *row, uint64_t trials)
{
    Subject s = subject_open(TORUS, 0.5, true);
    for (uint64_t seed = 0; row->trials < trials; seed++) {
        Rng rng = rng_seed(seed, 121);
        double tilt = either(&rng, 1, -1) * 1e-3 * M_PI / 180, angle = uniform(&rng, 0, 2 * M_PI);
        Vec3 p = {uniform(&rng, -1.5, 1.5), either(&rng, 0.5, uniform(&rng, -0.5, 0.5)), uniform(&rng, -1.5, 1.5)};
        if (seed % 2) p.y += pow(10, uniform(&rng, -12, -2)) * either(&rng, 1, -1);
        Vec3 d = {cos(tilt) * cos(angle), sin(tilt), cos(tilt) * sin(angle)};
        Ray ray = {vec3_at(p, -1e6, d), d, 0, INFINITY};
        check_ray(row, &s, &ray, seed);
    }
    subject_close(&s);
}

const StabilityCase primitive_cases[] = {
    {1, "sphere from 1e2 to 1e12 radii", "analytic", "", 20000, 1000000, 100000000, sphere_from_afar},
    {3, "tangent rays, b = 1 -+ 2^-k, along the axes", "MPFR", "", 387, 387, 387, tangent_exact},
    {3, "tangent rays, all round solids", "quad", "", 20000, 1000000, 20000000, tangent_rays},
    {4, "rays from on, 1 ulp in, 1 ulp out", "quad", "", 20000, 1000000, 20000000, from_the_surface},
    {5, "direction components -0, subnormal, 1e-300", "MPFR", "", 20000, 1000000, 20000000, extreme_components},
    {6, "directions of length 1e-200 to 1e200", "metamorphic", "", 20000, 1000000, 20000000, direction_lengths},
    {11, "ellipsoids seen: projected area", "analytic", "", 20000, 1000000, 20000000, ellipsoid_coverage},
    {11, "ellipsoids of condition 1e6 to 1e12: normals", "quad", "", 20000, 1000000, 20000000, ellipsoid_normals},
    {12, "singular, not finite, negative arguments", "analytic", "", 1, 1, 1, bad_arguments},
    {15, "normals under scale and shear", "quad", "", 20000, 1000000, 20000000, sheared_normals},
    {16, "cylinder: rays along the axis at the radius", "MPFR", "", 20000, 1000000, 20000000, cylinder_along_axis},
    {17, "needle 1e8 by 1e-4, disc of height 1e-8", "quad", "", 20000, 1000000, 20000000, needle_and_disc},
    {18, "cone: apex, lines of the side", "quad, MPFR", "", 20000, 1000000, 20000000, cone_special},
    {19, "torus of minor radius 1e-6 to 1", "MPFR", "POV-Ray 3.7: no silhouette wrong in 24 poses", 5000, 1000000,
     10000000, torus_rings},
    {19, "torus of minor radius above 1", "MPFR", "", 5000, 1000000, 10000000, torus_spindles},
    {20, "torus: its plane, its axis, its rims", "quad, MPFR", "", 5000, 1250000, 12500000, torus_degenerate},
    {21, "torus from 1e6 away, grazing at 1e-3 degrees", "MPFR", "", 5000, 1000000, 10000000, torus_grazing},
    {22, "quartics: published, spread and close roots", "MPFR", "", 5000, 1000000, 10000000, quartics},
    {23, "quadratics: b^2 near 4ac, over- and underflow", "MPFR", "", 20000, 1000000, 20000000, quadratics},
    {0},
};
