/* Precision against time: for each primitive and solver, how far t is from the truth and what a ray costs, for the
 * textbook form in float and in double, for a stable form in both (about the line's point nearest to the origin, roots
 * without cancellation) and for what the program uses, which confirms a double. The same rays go to all of them; the truth is
 * that of the rays in double, from the implicit equations in __float128 (support/oracle.h), so an error in float has the
 * rounding of the ray to float in it, as it has in a program that keeps its rays in float.
 *
 *     precision [RAYS]
 *
 * A table to standard output, the same as build/precision.csv. All forms take turns on a few thousand rays each time, in CPU
 * time; "ratio" is to the textbook form in double in the same turn. Both are medians over all turns, so other work on the
 * machine hardly changes the ratios. Errors are in ulps of double of the true t, over the rays
 * that both the oracle and the form say hit ahead of the origin; a ray that only one of them says hits is a wrong hit.
 *
 * The file includes itself with REAL defined: the textbook forms, once for each type. */
#ifdef REAL

typedef struct { REAL o[3], d[3]; } NAME(Ray);

static inline REAL NAME(dot)(const REAL *a, const REAL *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static inline void NAME(cross)(const REAL *a, const REAL *b, REAL *r)
{
    r[0] = a[1] * b[2] - a[2] * b[1];
    r[1] = a[2] * b[0] - a[0] * b[2];
    r[2] = a[0] * b[1] - a[1] * b[0];
}

/* The smaller of those that are positive; `best` is NaN before the first. */
static inline REAL NAME(nearer)(REAL best, REAL t) { return t > 0 && !(t >= best) ? t : best; }

static inline int NAME(quadratic)(REAL a, REAL b, REAL c, REAL root[2])
{
    REAL disc = b * b - 4 * a * c;
    if (!(disc >= 0)) return 0;
    REAL s = sqrt(disc);
    root[0] = (-b - s) / (2 * a);
    root[1] = (-b + s) / (2 * a);
    return 2;
}

/* A root of x^3 + a x^2 + b x + c, the greatest if there are three: Cardano's. */
static inline REAL NAME(cubic)(REAL a, REAL b, REAL c)
{
    REAL p = (b - a * a / 3) / 3, q = (2 * a * a * a / 27 - a * b / 3 + c) / 2, disc = q * q + p * p * p;
    if (disc < 0) return 2 * sqrt(-p) * cos(acos(-q / sqrt(-p * p * p)) / 3) - a / 3;
    REAL s = sqrt(disc);
    return cbrt(s - q) - cbrt(s + q) - a / 3;
}

/* b is half of the linear coefficient; q = -(b + sign(b) sqrt(D)) doesn't cancel. */
static inline int NAME(stable_roots)(REAL a, REAL b, REAL c, REAL root[2])
{
    REAL disc = b * b - a * c;
    if (!(disc >= 0)) return 0;
    REAL s = sqrt(disc), q = b < 0 ? s - b : -b - s;
    root[0] = c / q;
    root[1] = q / a;
    return 2;
}

/* Ferrari's, as in Schwarze, "Cubic and quartic roots" (Graphics Gems, 1990). */
static inline int NAME(quartic)(const REAL *c, REAL root[4])
{
    REAL a3 = c[3] / c[4], a2 = c[2] / c[4], a1 = c[1] / c[4], a0 = c[0] / c[4], square = a3 * a3;
    REAL p = a2 - 3 * square / 8, q = square * a3 / 8 - a3 * a2 / 2 + a1;
    REAL r = -3 * square * square / 256 + square * a2 / 16 - a3 * a1 / 4 + a0;
    REAL z = NAME(cubic)(-p / 2, -r, r * p / 2 - q * q / 8);
    REAL u = z * z - r, v = 2 * z - p;
    if (!(u >= 0 && v >= 0)) return 0;
    u = sqrt(u);
    v = q < 0 ? -sqrt(v) : sqrt(v);
    int n = NAME(quadratic)(1, v, z - u, root);
    n += NAME(quadratic)(1, -v, z + u, root + n);
    for (int i = 0; i < n; i++) root[i] -= a3 / 4;
    return n;
}

static inline REAL NAME(sphere)(const NAME(Ray) *ray)
{
    REAL t[2], best = NAN;
    int n = NAME(quadratic)(NAME(dot)(ray->d, ray->d), 2 * NAME(dot)(ray->o, ray->d), NAME(dot)(ray->o, ray->o) - 1, t);
    for (int i = 0; i < n; i++) best = NAME(nearer)(best, t[i]);
    return best;
}

/* best, or the disc of radius 1 at the height y. */
static inline REAL NAME(disc)(const NAME(Ray) *ray, REAL y, REAL best)
{
    REAL t = (y - ray->o[1]) / ray->d[1], px = ray->o[0] + t * ray->d[0], pz = ray->o[2] + t * ray->d[2];
    return px * px + pz * pz <= 1 ? NAME(nearer)(best, t) : best;
}

/* x^2 + z^2 + k y^2 + c = 0 between two heights. */
static inline REAL NAME(round)(const NAME(Ray) *ray, REAL k, REAL c0, REAL low, REAL high)
{
    const REAL *o = ray->o, *d = ray->d;
    REAL a = d[0] * d[0] + d[2] * d[2] + k * d[1] * d[1], b = 2 * (o[0] * d[0] + o[2] * d[2] + k * o[1] * d[1]);
    REAL c = o[0] * o[0] + o[2] * o[2] + k * o[1] * o[1] + c0, t[2], best = NAN;
    int n = NAME(quadratic)(a, b, c, t);
    for (int i = 0; i < n; i++) {
        REAL y = o[1] + t[i] * d[1];
        if (y >= low && y <= high) best = NAME(nearer)(best, t[i]);
    }
    return best;
}

/* The same about the line's point nearest to the origin (Haines, Guenther, Akenine-Moeller, Ray Tracing Gems, 2019). */
static inline REAL NAME(stable_round)(const NAME(Ray) *ray, REAL k, REAL c0, REAL low, REAL high)
{
    const REAL *o = ray->o, *d = ray->d;
    REAL near = -NAME(dot)(o, d) / NAME(dot)(d, d), l[3], t[2], best = NAN;
    for (int i = 0; i < 3; i++) l[i] = o[i] + near * d[i];
    REAL a = d[0] * d[0] + d[2] * d[2] + k * d[1] * d[1], b = l[0] * d[0] + l[2] * d[2] + k * l[1] * d[1];
    int n = NAME(stable_roots)(a, b, l[0] * l[0] + l[2] * l[2] + k * l[1] * l[1] + c0, t);
    for (int i = 0; i < n; i++) {
        REAL y = l[1] + t[i] * d[1];
        if (y >= low && y <= high) best = NAME(nearer)(best, near + t[i]);
    }
    return best;
}

static inline REAL NAME(stable_sphere)(const NAME(Ray) *ray) { return NAME(stable_round)(ray, 1, -1, -INFINITY, INFINITY); }

static inline REAL NAME(stable_cylinder)(const NAME(Ray) *ray)
{
    return NAME(disc)(ray, -1, NAME(disc)(ray, 1, NAME(stable_round)(ray, 0, -1, -1, 1)));
}

static inline REAL NAME(stable_cone)(const NAME(Ray) *ray)
{
    return NAME(disc)(ray, -1, NAME(stable_round)(ray, -1, 0, -1, 0));
}

static inline REAL NAME(cylinder)(const NAME(Ray) *ray)
{
    return NAME(disc)(ray, -1, NAME(disc)(ray, 1, NAME(round)(ray, 0, -1, -1, 1)));
}

static inline REAL NAME(cone)(const NAME(Ray) *ray) { return NAME(disc)(ray, -1, NAME(round)(ray, -1, 0, -1, 0)); }

static inline REAL NAME(cube)(const NAME(Ray) *ray)
{
    REAL in = -INFINITY, out = INFINITY;
    for (int i = 0; i < 3; i++) {
        REAL a = (0 - ray->o[i]) / ray->d[i], b = (1 - ray->o[i]) / ray->d[i];
        REAL near = a < b ? a : b, far = a < b ? b : a;
        if (near > in) in = near;
        if (far < out) out = far;
    }
    return in <= out ? NAME(nearer)(NAME(nearer)(NAN, in), out) : (REAL)NAN;
}

static inline REAL NAME(torus)(const NAME(Ray) *ray)
{
    const REAL *o = ray->o, *d = ray->d, m = (REAL)MINOR;
    REAL a = NAME(dot)(d, d), b = NAME(dot)(o, d), k = NAME(dot)(o, o) + 1 - m * m;
    REAL fa = d[0] * d[0] + d[2] * d[2], fb = o[0] * d[0] + o[2] * d[2], fc = o[0] * o[0] + o[2] * o[2];
    REAL c[5] = {k * k - 4 * fc, 4 * b * k - 8 * fb, 4 * b * b + 2 * a * k - 4 * fa, 4 * a * b, a * a}, t[4], best = NAN;
    int n = NAME(quartic)(c, t);
    for (int i = 0; i < n; i++) best = NAME(nearer)(best, t[i]);
    return best;
}

typedef struct { REAL corner[3], e1[3], e2[3]; } NAME(Triangle);

static inline NAME(Triangle) NAME(triangle_corners)(void)
{
    NAME(Triangle) s;
    for (int i = 0; i < 3; i++) {
        s.corner[i] = (REAL)CORNER[0][i];
        s.e1[i] = (REAL)(CORNER[1][i] - CORNER[0][i]);
        s.e2[i] = (REAL)(CORNER[2][i] - CORNER[0][i]);
    }
    return s;
}

/* The point on the plane, then the side of each edge that it is on. */
static inline REAL NAME(triangle)(const NAME(Ray) *ray)
{
    NAME(Triangle) s = NAME(triangle_corners)();
    REAL n[3], to[3], p[3], side[3];
    NAME(cross)(s.e1, s.e2, n);
    for (int i = 0; i < 3; i++) to[i] = s.corner[i] - ray->o[i];
    REAL t = NAME(dot)(n, to) / NAME(dot)(n, ray->d);
    for (int i = 0; i < 3; i++) p[i] = ray->o[i] + t * ray->d[i];
    for (int k = 0; k < 3; k++) {
        REAL edge[3], at[3];
        for (int i = 0; i < 3; i++) {
            edge[i] = (REAL)CORNER[(k + 1) % 3][i] - (REAL)CORNER[k][i];
            at[i] = p[i] - (REAL)CORNER[k][i];
        }
        NAME(cross)(edge, at, side);
        if (!(NAME(dot)(n, side) >= 0)) return NAN;
    }
    return NAME(nearer)(NAN, t);
}

static inline REAL NAME(moeller_trumbore)(const NAME(Ray) *ray)
{
    NAME(Triangle) s = NAME(triangle_corners)();
    REAL p[3], to[3], q[3];
    NAME(cross)(ray->d, s.e2, p);
    REAL inverse = 1 / NAME(dot)(s.e1, p);
    for (int i = 0; i < 3; i++) to[i] = ray->o[i] - s.corner[i];
    REAL u = NAME(dot)(to, p) * inverse;
    if (!(u >= 0 && u <= 1)) return NAN;
    NAME(cross)(to, s.e1, q);
    REAL v = NAME(dot)(ray->d, q) * inverse;
    if (!(v >= 0 && u + v <= 1)) return NAN;
    return NAME(nearer)(NAN, NAME(dot)(s.e2, q) * inverse);
}

static void NAME(rays_make)(const Ray *from, int count, NAME(Ray) *ray)
{
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 3; k++) {
            ray[i].o[k] = (REAL)vec3_get(from[i].o, k);
            ray[i].d[k] = (REAL)vec3_get(from[i].d, k);
        }
}

#define RUN(form)                                                                                            \
    static void NAME(run_##form)(const void *rays, int count, const Prim *prim, Scratch *scratch, double *t) \
    {                                                                                                        \
        const NAME(Ray) *ray = rays;                                                                         \
        (void)prim, (void)scratch;                                                                           \
        for (int i = 0; i < count; i++) t[i] = NAME(form)(&ray[i]);                                          \
    }
RUN(stable_sphere)
RUN(stable_cylinder)
RUN(stable_cone)
RUN(sphere)
RUN(cylinder)
RUN(cone)
RUN(cube)
RUN(torus)
RUN(triangle)
RUN(moeller_trumbore)
#undef RUN

typedef struct { REAL c[5]; } NAME(Poly);

static void NAME(run_quadratic)(const void *polys, int count, const Prim *prim, Scratch *scratch, double *t)
{
    const NAME(Poly) *p = polys;
    (void)prim, (void)scratch;
    for (int i = 0; i < count; i++) {
        REAL root[2], best = NAN;
        int n = NAME(quadratic)(p[i].c[2], p[i].c[1], p[i].c[0], root);
        for (int k = 0; k < n; k++) best = NAME(nearer)(best, root[k]);
        t[i] = best;
    }
}

static void NAME(run_stable_quadratic)(const void *polys, int count, const Prim *prim, Scratch *scratch, double *t)
{
    const NAME(Poly) *p = polys;
    (void)prim, (void)scratch;
    for (int i = 0; i < count; i++) {
        REAL root[2], best = NAN;
        int n = NAME(stable_roots)(p[i].c[2], p[i].c[1] / 2, p[i].c[0], root);
        for (int k = 0; k < n; k++) best = NAME(nearer)(best, root[k]);
        t[i] = best;
    }
}

static void NAME(run_quartic)(const void *polys, int count, const Prim *prim, Scratch *scratch, double *t)
{
    const NAME(Poly) *p = polys;
    (void)prim, (void)scratch;
    for (int i = 0; i < count; i++) {
        REAL root[4], best = NAN;
        int n = NAME(quartic)(p[i].c, root);
        for (int k = 0; k < n; k++) best = NAME(nearer)(best, root[k]);
        t[i] = best;
    }
}

#else

#include <stdio.h>
#include <stdlib.h>
#include <tgmath.h>
#include <time.h>

#include "accel/mesh_data.h"
#include "accel/mesh_prim.h"
#include "common/rng.h"
#include "node/primitive/primitive.h"
#include "support/check.h"
#include "support/oracle.h"
#include "tools/polyroots.h"

enum { SEED = 20261122, RAYS = 1 << 17, PASSES = 9, FORMS = 6, TURN_RAYS = 4096 };

#define MINOR 0.25

static const double CORNER[3][3] = {{-0.8, -0.5, 0.3}, {0.9, -0.4, -0.2}, {0.1, 0.8, 0.25}};

#define PASTE_TOKENS(a, b) a##_##b
#define PASTE(a, b) PASTE_TOKENS(a, b)
#define NAME(x) PASTE(x, REAL)

#define REAL float
#include "bench/precision.c"
#undef REAL
#define REAL double
#include "bench/precision.c"
#undef REAL

/* Fills t with the nearest hit of each ray, NaN without one. `input` is of the form's own type. */
typedef void Run(const void *input, int count, const Prim *prim, Scratch *scratch, double *t);

static void run_program(const void *rays, int count, const Prim *prim, Scratch *scratch, double *t)
{
    const Ray *ray = rays;
    for (int i = 0; i < count; i++) {
        Hit hit = {.object = HIT_NONE};
        t[i] = prim->ops->intersect(prim, &ray[i], &hit, scratch) ? hit.t : (double)NAN;
    }
}

/* Algorithm 1010 in double about the point nearest to the origin, unpolished; what it can't vouch for is a miss. */
static void run_stable_torus(const void *rays, int count, const Prim *prim, Scratch *scratch, double *t)
{
    const Ray_double *ray = rays;
    (void)prim, (void)scratch;
    for (int i = 0; i < count; i++) {
        const double *o = ray[i].o, *d = ray[i].d;
        double dd = dot_double(d, d), near = -dot_double(o, d) / dd, scale = 1 / sqrt(dd), l[3], root[4];
        for (int k = 0; k < 3; k++) l[k] = o[k] + near * d[k];
        double k = dot_double(l, l) + 1 - MINOR * MINOR, a = (d[0] * d[0] + d[2] * d[2]) / dd;
        double b = (l[0] * d[0] + l[2] * d[2]) * scale, c = l[0] * l[0] + l[2] * l[2];
        int n;
        t[i] = NAN;
        if (!poly_quartic_guess((double[4]){k * k - 4 * c, -8 * b, 2 * k - 4 * a, 0}, root, &n)) continue;
        for (int j = 0; j < n; j++) t[i] = nearer_double(t[i], near + root[j] * scale);
    }
}

/* The program's triangle test without what finds the triangle. */
static void run_cut(const void *rays, int count, const Prim *prim, Scratch *scratch, double *t)
{
    const Ray *ray = rays;
    const Vec3 *c = mesh_prim_data(prim)->position;
    (void)scratch;
    for (int i = 0; i < count; i++) {
        Shear s = shear_of(&ray[i]);
        TriangleCut cut;
        t[i] = NAN;
        if (!triangle_cut(&s, &c[0], &c[1], &c[2], &cut)) continue;
        double err, at = triangle_t(&s, &c[0], &c[1], &c[2], &err);
        if (at > 0) t[i] = at;
    }
}

static double nearest_root(const PolyRoot *root, int n)
{
    for (int i = 0; i < n; i++)
        if (root[i].x > 0) return root[i].x;
    return NAN;
}

static void run_poly_quadratic(const void *polys, int count, const Prim *prim, Scratch *scratch, double *t)
{
    const Poly_double *p = polys;
    (void)prim, (void)scratch;
    for (int i = 0; i < count; i++) {
        PolyRoot root[2];
        Dd c[3] = {{p[i].c[0], 0}, {p[i].c[1], 0}, {p[i].c[2], 0}};
        t[i] = nearest_root(root, poly_quadratic(c, NULL, root));
    }
}

static void run_poly_quartic(const void *polys, int count, const Prim *prim, Scratch *scratch, double *t)
{
    const Poly_double *p = polys;
    (void)prim, (void)scratch;
    for (int i = 0; i < count; i++) {
        Dd c[5];
        for (int k = 0; k < 5; k++) c[k] = (Dd){p[i].c[k], 0};
        PolyRoot root[4];
        t[i] = nearest_root(root, poly_quartic(c, NULL, root, NULL, NULL));
    }
}

/* -- The truth -- */

static void triangle_truth(double minor, const Ray *ray, Truth *truth)
{
    (void)minor;
    Quad d[3] = {ray->d.x, ray->d.y, ray->d.z}, v[3][3], side[3];
    const double o[3] = {ray->o.x, ray->o.y, ray->o.z};
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++) v[k][i] = (Quad)CORNER[k][i] - o[i];
    /* side[k]: volume of the direction with the edge opposite the corner k */
    for (int k = 0; k < 3; k++) {
        const Quad *a = v[(k + 1) % 3], *b = v[(k + 2) % 3];
        side[k] = d[0] * (a[1] * b[2] - a[2] * b[1]) + d[1] * (a[2] * b[0] - a[0] * b[2]) +
                  d[2] * (a[0] * b[1] - a[1] * b[0]);
    }
    truth->n = 0;
    bool in = (side[0] >= 0 && side[1] >= 0 && side[2] >= 0) || (side[0] <= 0 && side[1] <= 0 && side[2] <= 0);
    Quad sum = side[0] + side[1] + side[2], dd = 0, along = 0;
    if (!in || sum == 0) return;
    for (int i = 0; i < 3; i++) {
        dd += d[i] * d[i];
        along += d[i] * (side[0] * v[0][i] + side[1] * v[1][i] + side[2] * v[2][i]) / sum;
    }
    truth->t[0] = along / dd;
    truth->n = 1;
}

/* The roots of the very polynomial that the solvers get; 0 if none is positive. */
static Quad poly_nearest(const Poly_double *p, int degree)
{
    Quad c[5], bound = 0, root[4];
    for (int i = 0; i <= degree; i++) c[i] = p->c[i];
    /* Fujiwara, 1916: no root is larger */
    for (int i = 0; i < degree; i++)
        bound = q_max(bound, (Quad)(2.001 * pow(fabs(p->c[i] / p->c[degree]), 1.0 / (degree - i))));
    int n = poly_roots(c, degree, -bound, bound, root);
    for (int i = 0; i < n; i++)
        if (root[i] > 0) return root[i];
    return 0;
}

/* -- What is compared -- */

/* A point of the surface with its normal, or of an edge with a direction that leads away from it. */
typedef void Limb(Rng *rng, Vec3 *p, Vec3 *n);

static double uniform(Rng *rng, double lo, double hi) { return lo + (hi - lo) * rng_double(rng); }

static Vec3 random_ball(Rng *rng)
{
    for (;;) {
        double x = uniform(rng, -1, 1), y = uniform(rng, -1, 1);
        Vec3 v = vec3_make(x, y, uniform(rng, -1, 1));
        if (vec3_dot(v, v) <= 1) return v;
    }
}

static Vec3 random_unit(Rng *rng) { return vec3_normalize(random_ball(rng)); }

static Vec3 random_around(Rng *rng, double y)
{
    double turn = uniform(rng, 0, 2 * M_PI);
    return vec3_make(cos(turn), y, sin(turn));
}

static void sphere_limb(Rng *rng, Vec3 *p, Vec3 *n) { *p = *n = random_unit(rng); }

static void cylinder_limb(Rng *rng, Vec3 *p, Vec3 *n)
{
    *p = random_around(rng, uniform(rng, -1, 1));
    *n = vec3_make(p->x, 0, p->z);
}

static void cone_limb(Rng *rng, Vec3 *p, Vec3 *n)
{
    Vec3 side = random_around(rng, -1);
    *p = vec3_scale(side, uniform(rng, 0.05, 1));
    *n = vec3_normalize(vec3_make(side.x, 1, side.z));
}

static void cube_limb(Rng *rng, Vec3 *p, Vec3 *n)
{
    double x = rng_double(rng) < 0.5 ? 0 : 1, y = rng_double(rng) < 0.5 ? 0 : 1, z = rng_double(rng);
    Vec3 out = vec3_normalize(vec3_make(2 * x - 1, 2 * y - 1, 0));
    int turn = (int)(3 * rng_double(rng));
    *p = turn == 0 ? vec3_make(x, y, z) : turn == 1 ? vec3_make(z, x, y) : vec3_make(y, z, x);
    *n = turn == 0 ? out : turn == 1 ? vec3_make(0, out.x, out.y) : vec3_make(out.y, 0, out.x);
}

static void torus_limb(Rng *rng, Vec3 *p, Vec3 *n)
{
    Vec3 ring = random_around(rng, 0);
    double turn = uniform(rng, 0, 2 * M_PI);
    *n = vec3_add(vec3_scale(ring, cos(turn)), vec3_make(0, sin(turn), 0));
    *p = vec3_add(ring, vec3_scale(*n, MINOR));
}

static Vec3 corner(int k) { return vec3_make(CORNER[k][0], CORNER[k][1], CORNER[k][2]); }

static void triangle_limb(Rng *rng, Vec3 *p, Vec3 *n)
{
    int k = (int)(3 * rng_double(rng));
    Vec3 a = corner(k), along = vec3_sub(corner((k + 1) % 3), a), other = vec3_sub(corner((k + 2) % 3), a);
    *p = vec3_at(a, rng_double(rng), along);
    *n = vec3_normalize(vec3_cross(along, vec3_cross(along, other)));
}

typedef enum { FLOAT_RAYS, DOUBLE_RAYS, PROGRAM_RAYS } Input;

typedef struct { const char *name; Input input; Run *run; } Form;

typedef struct {
    const char *name;
    OracleTruth *truth;   /* NULL: a solver */
    int degree;           /* of a solver's polynomials: those that the rays make with a sphere or a torus */
    Limb *limb;
    Vec3 centre;
    double radius;
    Form form[FORMS];
} Subject;

#define TEXTBOOK(form) \
    {"textbook float", FLOAT_RAYS, run_##form##_float}, {"textbook double", DOUBLE_RAYS, run_##form##_double}
#define STABLE(form) \
    {"stable float", FLOAT_RAYS, run_stable_##form##_float}, {"stable double", DOUBLE_RAYS, run_stable_##form##_double}
#define PROGRAM {"program", PROGRAM_RAYS, run_program}

static const Subject SUBJECT[] = {
    {"sphere", sphere_truth, 0, sphere_limb, {0, 0, 0}, 1, {TEXTBOOK(sphere), STABLE(sphere), PROGRAM}},
    {"cylinder", cylinder_truth, 0, cylinder_limb, {0, 0, 0}, M_SQRT2, {TEXTBOOK(cylinder), STABLE(cylinder), PROGRAM}},
    {"cone", cone_truth, 0, cone_limb, {0, -0.5, 0}, 1.12, {TEXTBOOK(cone), STABLE(cone), PROGRAM}},
    {"cube", cube_truth, 0, cube_limb, {0.5, 0.5, 0.5}, 0.87, {TEXTBOOK(cube), PROGRAM}},
    {"torus", torus_truth, 0, torus_limb, {0, 0, 0}, 1 + MINOR,
     {TEXTBOOK(torus), {"stable double", DOUBLE_RAYS, run_stable_torus}, PROGRAM}},
    {"triangle", triangle_truth, 0, triangle_limb, {0, 0, 0}, 1,
     {TEXTBOOK(triangle), {"Moeller-Trumbore float", FLOAT_RAYS, run_moeller_trumbore_float},
      {"Moeller-Trumbore double", DOUBLE_RAYS, run_moeller_trumbore_double}, {"one triangle", PROGRAM_RAYS, run_cut},
      PROGRAM}},
    {"quadratic", NULL, 2, sphere_limb, {0, 0, 0}, 1,
     {TEXTBOOK(quadratic), STABLE(quadratic), {"program", DOUBLE_RAYS, run_poly_quadratic}}},
    {"quartic", NULL, 4, torus_limb, {0, 0, 0}, 1 + MINOR,
     {TEXTBOOK(quartic), {"program", DOUBLE_RAYS, run_poly_quartic}}},
};
enum { SUBJECTS = sizeof SUBJECT / sizeof *SUBJECT };

/* What the program makes of a subject; NULL for a solver. */
static Prim *prim_of(const Subject *s, const Mesh *mesh)
{
    if (s->truth == sphere_truth) return sphere_create();
    if (s->truth == cylinder_truth) return cylinder_create();
    if (s->truth == cone_truth) return cone_create();
    if (s->truth == cube_truth) return cube_create();
    if (s->truth == torus_truth) return torus_create(MINOR);
    return s->truth ? mesh_prim_create(mesh, false, NULL, NULL) : NULL;
}

/* -- Rays -- */

typedef enum { ORDINARY, FAR, GRAZING, SETS } Set;

static const char *const SET_NAME[SETS] = {"ordinary", "far", "grazing"};

/* From within 4 radii; from 1e2 to 1e8 radii away; past the limb at 2^-10 to 2^-40 radii on either side of it. */
static Ray random_ray(Rng *rng, const Subject *s, Set set)
{
    Vec3 o, target;
    if (set == GRAZING) {
        Vec3 p, n, across;
        s->limb(rng, &p, &n);
        do across = vec3_cross(n, random_unit(rng));
        while (!(vec3_dot(across, across) > 0x1p-8));
        double off = s->radius * exp2(-uniform(rng, 10, 40)) * (rng_double(rng) < 0.5 ? -1 : 1);
        target = vec3_at(p, off, n);
        o = vec3_at(target, s->radius * uniform(rng, 0.5, 4), vec3_normalize(across));
    } else {
        Vec3 away = set == FAR ? random_unit(rng) : random_ball(rng);
        away = vec3_scale(away, set == FAR ? pow(10, uniform(rng, 2, 8)) : 4);
        o = vec3_at(s->centre, s->radius, away);
        target = vec3_at(s->centre, 1.2 * s->radius, random_ball(rng));
    }
    return (Ray){o, vec3_normalize(vec3_sub(target, o)), 0, INFINITY};
}

/* What a ray's line and the sphere or torus make, rounded to double. */
static Poly_double poly_of(const Ray *ray, int degree)
{
    double a = vec3_dot(ray->d, ray->d), b = vec3_dot(ray->o, ray->d), c = vec3_dot(ray->o, ray->o);
    if (degree == 2) return (Poly_double){{c - 1, 2 * b, a}};
    double fa = ray->d.x * ray->d.x + ray->d.z * ray->d.z, fb = ray->o.x * ray->d.x + ray->o.z * ray->d.z;
    double fc = ray->o.x * ray->o.x + ray->o.z * ray->o.z, k = c + 1 - MINOR * MINOR;
    return (Poly_double){{k * k - 4 * fc, 4 * b * k - 8 * fb, 4 * b * b + 2 * a * k - 4 * fa, 4 * a * b, a * a}};
}

/* -- Measuring -- */

typedef struct {
    int count;
    Ray *ray;
    void *input[3];   /* by Input; rays or polynomials */
    Quad *truth;      /* 0: a miss */
    double *t, *error;
} Rays;

static Rays rays_create(int count)
{
    size_t n = (size_t)count;
    Rays r = {.count = count, .ray = malloc(n * sizeof *r.ray), .truth = malloc(n * sizeof *r.truth),
              .t = malloc(n * sizeof *r.t), .error = malloc(n * sizeof *r.error)};
    r.input[FLOAT_RAYS] = malloc(n * sizeof(Ray_float));
    r.input[DOUBLE_RAYS] = malloc(n * sizeof(Ray_double));
    r.input[PROGRAM_RAYS] = r.ray;
    CHECK(r.ray && r.truth && r.t && r.error && r.input[FLOAT_RAYS] && r.input[DOUBLE_RAYS]);
    return r;
}

static void rays_free(Rays *r)
{
    free(r->ray);
    free(r->truth);
    free(r->t);
    free(r->error);
    free(r->input[FLOAT_RAYS]);
    free(r->input[DOUBLE_RAYS]);
}

/* A polynomial has 5 numbers, a ray 6. */
_Static_assert(sizeof(Poly_float) <= sizeof(Ray_float) && sizeof(Poly_double) <= sizeof(Ray_double), "room");

static void rays_fill(Rays *r, const Subject *s, Set set)
{
    Rng rng = rng_seed(SEED, (uint64_t)(s - SUBJECT) * SETS + set);
    for (int i = 0; i < r->count; i++) r->ray[i] = random_ray(&rng, s, set);
    if (s->truth) {
        rays_make_float(r->ray, r->count, r->input[FLOAT_RAYS]);
        rays_make_double(r->ray, r->count, r->input[DOUBLE_RAYS]);
    }
    for (int i = 0; i < r->count; i++) {
        r->truth[i] = 0;
        if (s->truth) {
            Truth truth = {.n = 0};
            s->truth(MINOR, &r->ray[i], &truth);
            for (int k = truth.n - 1; k >= 0; k--)
                if (truth.t[k] > 0) r->truth[i] = truth.t[k];
        } else {
            Poly_double p = poly_of(&r->ray[i], s->degree);
            ((Poly_double *)r->input[DOUBLE_RAYS])[i] = p;
            for (int k = 0; k < 5; k++) ((Poly_float *)r->input[FLOAT_RAYS])[i].c[k] = (float)p.c[k];
            r->truth[i] = poly_nearest(&p, s->degree);
        }
    }
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *x, int n)
{
    qsort(x, (size_t)n, sizeof *x, compare_doubles);
    return n ? x[n / 2] : (double)NAN;
}

static double now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static void report(FILE *csv, const Subject *s, Set set, const Form *f, const Rays *r, double ns, double ratio)
{
    int wrong = 0, hits = 0;
    for (int i = 0; i < r->count; i++) {
        bool hit = !isnan(r->t[i]), truly = r->truth[i] > 0;
        wrong += hit != truly;
        if (hit && truly)
            r->error[hits++] = (double)(q_abs(r->t[i] - r->truth[i]) / (Quad)ldexp(1, ilogb((double)r->truth[i]) - 52));
    }
    double middle = median(r->error, hits), worst = hits ? r->error[hits - 1] : (double)NAN;
    double wrong_rate = 1e9 * wrong / r->count;
    printf("%-10s %-9s %-24s %8d %11.3g %11.3g %12.0f %8.1f %7.2f\n", s->name, SET_NAME[set], f->name, hits, middle,
           worst, wrong_rate, ns, ratio);
    fprintf(csv, "%s,%s,%s,%d,%d,%.4g,%.4g,%.0f,%.1f,%.3f\n", s->name, SET_NAME[set], f->name, r->count, hits, middle, worst,
            wrong_rate, ns, ratio);
}

enum { TEXTBOOK_DOUBLE = 1 };   /* among a subject's forms */

/* Rays from the `first` on, or a solver's polynomials. */
static const char *input_at(const Rays *r, const Subject *s, Input input, int first)
{
    static const size_t RAY[] = {sizeof(Ray_float), sizeof(Ray_double), sizeof(Ray)};
    static const size_t POLY[] = {sizeof(Poly_float), sizeof(Poly_double)};
    return (const char *)r->input[input] + (size_t)first * (s->truth ? RAY : POLY)[input];
}

/* All forms on one set of rays, in turns so short that other work seldom falls into one, and then into none of the rest. */
static void measure(FILE *csv, const Subject *s, Set set, const Prim *prim, Scratch *scratch, Rays *r)
{
    rays_fill(r, s, set);
    int parts = (r->count + TURN_RAYS - 1) / TURN_RAYS, turns = 0;
    double *ns[FORMS], *ratio[FORMS];
    for (int f = 0; f < FORMS; f++) {
        ns[f] = malloc(2 * (size_t)(parts * PASSES) * sizeof *ns[f]);
        CHECK(ns[f]);
        ratio[f] = ns[f] + parts * PASSES;
    }
    for (int pass = 0; pass < PASSES; pass++)
        for (int part = 0; part < parts; part++, turns++) {
            int first = part * TURN_RAYS, count = r->count - first < TURN_RAYS ? r->count - first : TURN_RAYS;
            for (int f = 0; f < FORMS && s->form[f].run; f++) {
                double begin = now_ns();
                s->form[f].run(input_at(r, s, s->form[f].input, first), count, prim, scratch, r->t);
                ns[f][turns] = (now_ns() - begin) / count;
            }
            for (int f = 0; f < FORMS && s->form[f].run; f++) ratio[f][turns] = ns[f][turns] / ns[TEXTBOOK_DOUBLE][turns];
        }
    for (int f = 0; f < FORMS && s->form[f].run; f++) {
        s->form[f].run(r->input[s->form[f].input], r->count, prim, scratch, r->t);
        report(csv, s, set, &s->form[f], r, median(ns[f], turns), median(ratio[f], turns));
    }
    for (int f = 0; f < FORMS; f++) free(ns[f]);
    fflush(stdout);
}

int main(int argc, char **argv)
{
    int count = argc > 1 ? atoi(argv[1]) : RAYS;
    FILE *csv = fopen("build/precision.csv", "w");
    if (count < 1 || !csv) {
        fprintf(stderr, count < 1 ? "usage: precision [RAYS]\n" : "can't write build/precision.csv\n");
        return 1;
    }
    Vec3 position[3] = {corner(0), corner(1), corner(2)};
    uint32_t index[1][3] = {{0, 1, 2}};
    Mesh mesh = {.position = position, .position_count = 3, .triangle = index, .triangle_count = 1};
    Scratch scratch = {.arena = arena_create()};
    Rays rays = rays_create(count);
    CHECK(scratch.arena);

    printf("%d rays a set, seed %d; errors in ulps of double; wrong hits per 10^9 rays\n", count, SEED);
    printf("%-10s %-9s %-24s %8s %11s %11s %12s %8s %7s\n", "", "rays", "form", "hits", "median", "worst", "wrong", "ns/ray",
           "ratio");
    fprintf(csv, "subject,rays,form,count,hits,median_ulps,worst_ulps,wrong_per_1e9,ns_per_ray,ratio\n");
    for (int i = 0; i < SUBJECTS; i++) {
        Prim *prim = prim_of(&SUBJECT[i], &mesh);
        CHECK(prim || !SUBJECT[i].truth);
        for (Set set = 0; set < SETS; set++) measure(csv, &SUBJECT[i], set, prim, &scratch, &rays);
        prim_destroy(prim);
    }
    rays_free(&rays);
    arena_destroy(scratch.arena);
    return fclose(csv) != 0;
}

#endif
