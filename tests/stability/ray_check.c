#include "stability/ray_check.h"

#include <float.h>
#include <mpfr.h>
#include <stdlib.h>

#include "common/numeric.h"
#include "support/check.h"

/* Where the relative condition number of t is at most 16, it must be within 4 ulps for quadrics, within 16 for the torus;
 * everywhere it must be within its bound, and that no more than 64 times the error that the condition number explains. */
#define QUADRIC_ULPS 4
#define TORUS_ULPS 16
#define MEASURED_CONDITION 16
#define BOUND_SLACK 64

enum { BITS = 200 };
struct Precise { mpfr_t t, p[3], r, f, g; };

Subject subject_open(ShapeKind kind, double minor, bool precise)
{
    Subject s = {.kind = kind, .minor = minor, .precise = precise, .scratch = {.arena = arena_create()}};
    switch (kind) {
    case SPHERE: s.prim = sphere_create(); break;
    case CUBE: s.prim = cube_create(); break;
    case CYLINDER: s.prim = cylinder_create(); break;
    case CONE: s.prim = cone_create(); break;
    case TORUS: s.prim = torus_create(minor); break;
    case SHAPE_COUNT: break;
    }
    CHECK(s.prim && s.scratch.arena);
    struct Precise *m = s.mp = malloc(sizeof *m);
    CHECK(m);
    mpfr_inits2(BITS, m->t, m->p[0], m->p[1], m->p[2], m->r, m->f, m->g, (mpfr_ptr)NULL);
    return s;
}

void subject_close(Subject *s)
{
    struct Precise *m = s->mp;
    mpfr_clears(m->t, m->p[0], m->p[1], m->p[2], m->r, m->f, m->g, (mpfr_ptr)NULL);
    free(m);
    prim_destroy(s->prim);
    arena_destroy(s->scratch.arena);
}

const char *subject_name(const Subject *s) { return s->prim->ops->name; }

bool subject_hit(Subject *s, const Ray *ray, Hit *hit)
{
    *hit = (Hit){.object = HIT_NONE};
    return s->prim->ops->intersect(s->prim, ray, hit, &s->scratch);
}

void subject_truth(const Subject *s, const Ray *ray, Truth *truth)
{
    static OracleTruth *const TRUTH[] = {sphere_truth, cube_truth, cylinder_truth, cone_truth, torus_truth};
    *truth = (Truth){.n = 0};
    TRUTH[s->kind](s->minor, ray, truth);
}

void true_normal(const Subject *s, const Quad p[3], Quad n[3])
{
    Quad rr = p[0] * p[0] + p[2] * p[2], side = q_abs(rr - 1);
    n[0] = p[0], n[1] = p[1], n[2] = p[2];
    switch (s->kind) {
    case CUBE: {
        int face = 0;
        for (int i = 0; i < 6; i++)
            if (q_abs(p[i / 2] - i % 2) < q_abs(p[face / 2] - face % 2)) face = i;
        for (int i = 0; i < 3; i++) n[i] = i == face / 2 ? 2 * (face % 2) - 1 : 0;
        break;
    }
    case CYLINDER:
        if (q_abs(q_abs(p[1]) - 1) < side) n[0] = n[2] = 0;
        else n[1] = 0;
        break;
    case CONE:
        if (q_abs(p[1] + 1) < q_abs(rr - p[1] * p[1])) n[0] = n[2] = 0;
        else n[1] = q_sqrt(rr);
        break;
    case TORUS: {
        Quad rho = q_sqrt(rr), ring = rho > 0 ? (rho - 1) / rho : 0;
        n[0] *= ring;
        n[2] *= ring;
        break;
    }
    case SPHERE:
    case SHAPE_COUNT: break;
    }
}

double angle_ulps(Vec3 v, const Quad n[3])
{
    Quad a[3] = {v.x, v.y, v.z}, cross[3], aa = 0, nn = 0, cc = 0;
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        cross[i] = a[j] * n[k] - a[k] * n[j];
        aa += a[i] * a[i];
        nn += n[i] * n[i];
        cc += cross[i] * cross[i];
    }
    return aa > 0 && nn > 0 ? (double)q_sqrt(cc / (aa * nn)) / UNIT_ROUNDOFF : 0;
}

static void add_square(mpfr_t sum, mpfr_t help, mpfr_t x)
{
    mpfr_sqr(help, x, MPFR_RNDN);
    mpfr_add(sum, sum, help, MPFR_RNDN);
}

/* f = max(f, g) */
static void raise(struct Precise *m)
{
    if (mpfr_cmp(m->g, m->f) > 0) mpfr_swap(m->f, m->g);
}

/* The primitive's implicit function at the ray's point at t + delta, into m->f: negative inside, and near a surface of the
 * order of the distance from it. Its sign. */
static int place(const Subject *s, const Ray *ray, double t, double delta)
{
    struct Precise *m = s->mp;
    double o[3] = {ray->o.x, ray->o.y, ray->o.z}, d[3] = {ray->d.x, ray->d.y, ray->d.z};
    mpfr_set_d(m->t, t, MPFR_RNDN);
    mpfr_add_d(m->t, m->t, delta, MPFR_RNDN);
    for (int i = 0; i < 3; i++) {
        mpfr_mul_d(m->p[i], m->t, d[i], MPFR_RNDN);
        mpfr_add_d(m->p[i], m->p[i], o[i], MPFR_RNDN);
    }
    mpfr_sqr(m->r, m->p[0], MPFR_RNDN);
    add_square(m->r, m->g, m->p[2]);   /* x^2 + z^2 */
    switch (s->kind) {
    case CUBE:
        mpfr_set_inf(m->f, -1);
        for (int i = 0; i < 3; i++) {
            mpfr_neg(m->g, m->p[i], MPFR_RNDN);
            raise(m);
            mpfr_sub_ui(m->g, m->p[i], 1, MPFR_RNDN);
            raise(m);
        }
        break;
    case SPHERE:
        add_square(m->r, m->g, m->p[1]);
        mpfr_sub_ui(m->f, m->r, 1, MPFR_RNDN);
        break;
    case CYLINDER:
        mpfr_sub_ui(m->f, m->r, 1, MPFR_RNDN);
        mpfr_abs(m->g, m->p[1], MPFR_RNDN);
        mpfr_sub_ui(m->g, m->g, 1, MPFR_RNDN);
        raise(m);
        break;
    case CONE:
        mpfr_sqr(m->g, m->p[1], MPFR_RNDN);
        mpfr_sub(m->f, m->r, m->g, MPFR_RNDN);
        mpfr_set(m->g, m->p[1], MPFR_RNDN);
        raise(m);
        mpfr_si_sub(m->g, -1, m->p[1], MPFR_RNDN);
        raise(m);
        break;
    case TORUS:   /* the outer sheet of a spindle: within the minor radius of the circle's nearest point */
        mpfr_sqrt(m->f, m->r, MPFR_RNDN);
        mpfr_sub_ui(m->f, m->f, 1, MPFR_RNDN);
        mpfr_sqr(m->f, m->f, MPFR_RNDN);
        add_square(m->f, m->g, m->p[1]);
        mpfr_set_d(m->g, s->minor, MPFR_RNDN);
        mpfr_sqr(m->g, m->g, MPFR_RNDN);
        mpfr_sub(m->f, m->f, m->g, MPFR_RNDN);
        break;
    case SHAPE_COUNT: break;
    }
    return mpfr_sgn(m->f);
}

/* Double-double rounds at 2^-102, and a program that computes in it adds up to 2^6 terms of the size of a coordinate's
 * square. Surface and line nearer than that to each other touch: they may cross twice or not at all. */
#define TOUCH 0x1p-96

/* place(), or 0 for a touch. */
static int place_or_touch(const Subject *s, const Ray *ray, double t, double delta)
{
    int sign = place(s, ray, t, delta);
    double way = vec3_max(vec3_abs(ray->o)) + fabs(t) * vec3_max(vec3_abs(ray->d)), reach = 1 + s->minor + way;
    mpfr_abs(s->mp->g, s->mp->f, MPFR_RNDN);
    return mpfr_cmp_d(s->mp->g, TOUCH * reach * reach) <= 0 ? 0 : sign;
}

static int place_of_doubt(const Subject *s, const Ray *ray, Quad t)
{
    double hi = (double)t;
    return place_or_touch(s, ray, hi, (double)(t - hi));
}

/* Within the bound of an edge the line is on both sides of the surface, or touches it. */
static bool edge_meets(const Subject *s, const Ray *ray, const Edge *e, const Truth *truth)
{
    int first = place_or_touch(s, ray, e->t, -e->t_err);
    if (first == 0 || place_or_touch(s, ray, e->t, e->t_err) != first) return true;
    for (int i = 0; i < truth->doubts; i++)
        if (q_abs(truth->doubt[i] - e->t) <= e->t_err && place_of_doubt(s, ray, truth->doubt[i]) != first) return true;
    return false;
}

static const Edge *edge_of(const SegList *list, uint32_t i) { return i % 2 ? &list->seg[i / 2].out : &list->seg[i / 2].in; }

/* The surface is crossed within the bound of every edge, the right way if no other edge is so near. */
static bool bounds_hold(const Subject *s, const Ray *ray, const SegList *list, const Truth *truth)
{
    double before = -INFINITY;
    for (uint32_t i = 0; i < 2 * list->count; i++) {
        const Edge *e = edge_of(list, i), *next = i + 1 < 2 * list->count ? edge_of(list, i + 1) : NULL;
        double reach = e->t + e->t_err, from = e->t - e->t_err;
        bool alone = from > before && (!next || reach < next->t - next->t_err);
        before = fmax(before, reach);
        if (!alone) {
            if (!edge_meets(s, ray, e, truth)) return false;
            continue;
        }
        int below = place(s, ray, e->t, -e->t_err), above = place(s, ray, e->t, e->t_err);
        if (i % 2 ? below > 0 || above < 0 : below < 0 || above > 0) return false;
    }
    return true;
}

/* Whether t is in the list, or so near to one of its edges that this tells nothing. */
static bool may_be_inside(const SegList *list, Quad t, bool *surely)
{
    bool inside = false, near = false;
    for (uint32_t i = 0; i < 2 * list->count; i++) {
        const Edge *e = edge_of(list, i);
        if (t > e->t) inside = !inside;
        near = near || q_abs(t - e->t) <= e->t_err;
    }
    *surely = inside && !near;
    return inside || near;
}

static bool agrees_at(const Subject *s, const Ray *ray, const SegList *list, Quad t)
{
    bool surely, perhaps = may_be_inside(list, t, &surely);
    int where = place_of_doubt(s, ray, t);
    return where == 0 || (where < 0 ? perhaps : !surely);
}

/* The list is inside where the solid is: between its own edges, and where quad leaves open whether there are more or fewer
 * of them. */
static bool inside_agrees(const Subject *s, const Ray *ray, const SegList *list, const Truth *truth)
{
    for (int i = 0; i < truth->doubts; i++)
        if (!agrees_at(s, ray, list, truth->doubt[i])) return false;
    for (uint32_t i = 0; i + 1 < 2 * list->count; i++)
        if (!agrees_at(s, ray, list, ((Quad)edge_of(list, i)->t + edge_of(list, i + 1)->t) / 2)) return false;
    return true;
}

/* How far t moves when each component of the ray moves by its own size, in the worst direction.
 * `first`: per unit, to first order; where the line runs along the surface, as if it met that head on.
 * `most`: by a rounding. A k-fold root moves by the k-th root of what moves its coefficients, which near a tangent is less
 * than the first order would explain. */
typedef struct { double first, most; } Sensitivity;

static Sensitivity sensitivity(const Subject *s, const Ray *ray, Quad t)
{
    Quad o[3] = {ray->o.x, ray->o.y, ray->o.z}, d[3] = {ray->d.x, ray->d.y, ray->d.z}, p[3], n[3];
    for (int i = 0; i < 3; i++) p[i] = o[i] + t * d[i];
    true_normal(s, p, n);
    if (n[0] == 0 && n[1] == 0 && n[2] == 0) {
        /* the apex of the cone: that of the side next to the line */
        for (int i = 0; i < 3; i++) p[i] = -0.5 * d[i] / d[1];
        true_normal(s, p, n);
    }
    Quad slope = 0, sum = 0, dd = 0, size = 0;
    for (int i = 0; i < 3; i++) {
        Quad moved = q_abs(o[i]) + q_abs(t * d[i]);
        slope += n[i] * d[i];
        sum += q_abs(n[i]) * moved;
        dd += d[i] * d[i];
        size += moved * moved;
    }
    double along = (double)q_sqrt(size / dd), first = slope != 0 ? (double)(sum / q_abs(slope)) : along;
    double multiple = s->kind == TORUS ? sqrt(sqrt(UNIT_ROUNDOFF)) : sqrt(UNIT_ROUNDOFF);
    return (Sensitivity){first, fmin(UNIT_ROUNDOFF * first, multiple * along)};
}

typedef struct { double off, ulps, loose; bool decided, measured; } Verdict;

/* Not decided where the oracle errs by more than a small part of what the program may. */
static Verdict judge(const Subject *s, const Ray *ray, const Edge *edge, Quad truth, Quad err)
{
    double size = fabs((double)truth);
    Sensitivity moves = sensitivity(s, ray, truth);
    Verdict v = {.off = fmax(0, (double)(q_abs(truth - edge->t) - err))};
    double explained = moves.most + 0x1p-1074;
    v.decided = (double)err <= 0x1p-4 * explained;
    v.ulps = v.off / (nextafter(size, INFINITY) - size);
    v.loose = edge->t_err / explained;
    v.measured = moves.first <= MEASURED_CONDITION * size;
    return v;
}

static bool finite3(Vec3 v) { return isfinite(v.x) && isfinite(v.y) && isfinite(v.z); }

static bool ordered(const SegList *list)
{
    double last = -INFINITY;
    for (uint32_t i = 0; i < list->count; i++) {
        const Edge *in = &list->seg[i].in, *out = &list->seg[i].out;
        if (!(in->t >= last && out->t >= in->t && isfinite(in->t) && isfinite(out->t))) return false;
        if (!finite3(in->n) || !finite3(out->n) || !(vec3_max(vec3_abs(in->n)) > 0 && vec3_max(vec3_abs(out->n)) > 0))
            return false;
        last = out->t;
    }
    return true;
}

static bool fail(Row *row, const Subject *s, const Ray *r, uint64_t seed, const char *what, double figure)
{
    return row_trial(row, false, "%s %g: %s %.3g, seed %llu, o %a %a %a d %a %a %a", subject_name(s), s->minor, what, figure,
              (unsigned long long)seed, r->o.x, r->o.y, r->o.z, r->d.x, r->d.y, r->d.z);
}

/* intersect gives the first listed edge in (tmin, tmax]. */
static bool first_edge_hit(Subject *s, const Ray *ray, const SegList *list, double tmin, double tmax)
{
    Ray r = {ray->o, ray->d, tmin, tmax};
    const Edge *first = NULL;
    for (uint32_t i = 0; i < 2 * list->count && !first; i++)
        if (edge_of(list, i)->t > tmin) first = edge_of(list, i);
    if (first && !(first->t <= tmax)) first = NULL;
    Hit hit;
    bool found = subject_hit(s, &r, &hit);
    return found == (first != NULL) && (!found || (hit.t == first->t && hit.u == first->u && hit.part == first->part));
}

/* For the ray as given, and with either end of it on an edge or just before it. */
static bool hits_agree(Subject *s, const Ray *ray, const SegList *list, uint64_t seed)
{
    if (!first_edge_hit(s, ray, list, ray->tmin, ray->tmax)) return false;
    if (list->count == 0) return first_edge_hit(s, ray, list, -INFINITY, INFINITY);
    double t = edge_of(list, (uint32_t)(seed % (2 * list->count)))->t, before = nextafter(t, -INFINITY);
    return first_edge_hit(s, ray, list, t, INFINITY) && first_edge_hit(s, ray, list, before, INFINITY) &&
           first_edge_hit(s, ray, list, -INFINITY, before) && first_edge_hit(s, ray, list, before, t);
}

/* A crossing that a double can't hold makes the line a miss. */
static bool can_be_held(const Truth *truth)
{
    for (int i = 0; i < truth->n; i++)
        if (q_abs(truth->t[i]) > DBL_MAX) return false;
    return true;
}

/* What quad leaves open, by MPFR. */
static bool check_precisely(Row *row, Subject *s, const Ray *ray, const SegList *list, const Truth *truth, uint64_t seed)
{
    if (!bounds_hold(s, ray, list, truth)) return fail(row, s, ray, seed, "MPFR: no crossing in bound", list->count);
    if (!inside_agrees(s, ray, list, truth)) return fail(row, s, ray, seed, "MPFR: wrong count", list->count);
    for (uint32_t i = 0; i < 2 * list->count; i++) {
        const Edge *edge = edge_of(list, i);
        double loose = judge(s, ray, edge, edge->t, 0).loose;
        row->loose = fmax(row->loose, loose);
        if (loose > BOUND_SLACK) return fail(row, s, ray, seed, "MPFR: bound / explained", loose);
    }
    return row_trial(row, true, "crossings");
}

bool check_ray(Row *row, Subject *s, const Ray *ray, uint64_t seed)
{
    Truth truth;
    subject_truth(s, ray, &truth);
    arena_reset(s->scratch.arena);
    SegList list = seg_list(&s->scratch);
    CHECK(s->prim->ops->segments(s->prim, ray, &list));
    if (!ordered(&list)) return fail(row, s, ray, seed, "crossings unordered or not finite", list.count);
    if (!hits_agree(s, ray, &list, seed)) return fail(row, s, ray, seed, "intersect isn't the first edge", list.count);
    if (!can_be_held(&truth) && list.count > 0) return fail(row, s, ray, seed, "no double holds a crossing", list.count);
    if (!can_be_held(&truth)) return row_trial(row, true, "a miss");
    if (!truth_decided(&truth)) return check_precisely(row, s, ray, &list, &truth, seed);
    if (s->precise && !bounds_hold(s, ray, &list, &truth)) return fail(row, s, ray, seed, "MPFR: no crossing in bound", 0);
    if (2 * (int)list.count != truth.n) return fail(row, s, ray, seed, "wrong count, truth", truth.n);
    for (int i = 0; i < truth.n; i++) {
        const Edge *edge = edge_of(&list, (uint32_t)i);
        Verdict v = judge(s, ray, edge, truth.t[i], truth.err[i]);
        row->loose = fmax(row->loose, v.loose);
        if (v.off > edge->t_err) return fail(row, s, ray, seed, "off / bound", v.off / edge->t_err);
        if (v.loose > BOUND_SLACK) return fail(row, s, ray, seed, "bound / explained", v.loose);
        if (!v.decided) return check_precisely(row, s, ray, &list, &truth, seed);
        if (!v.measured) continue;
        row->t_ulps = fmax(row->t_ulps, v.ulps);
        if (v.ulps > (s->kind == TORUS ? TORUS_ULPS : QUADRIC_ULPS)) return fail(row, s, ray, seed, "ulps", v.ulps);
    }
    return row_trial(row, true, "crossings");
}

double uniform(Rng *rng, double lo, double hi) { return lo + (hi - lo) * rng_double(rng); }

Vec3 random_direction(Rng *rng)
{
    for (;;) {
        Vec3 v = vec3_make(uniform(rng, -1, 1), uniform(rng, -1, 1), uniform(rng, -1, 1));
        double l = vec3_dot(v, v);
        if (l > 0.01 && l < 1) return vec3_scale(v, 1 / sqrt(l));
    }
}

Vec3 random_point(Rng *rng, const Subject *s)
{
    Box b = s->prim->ops->bounds(s->prim);
    return vec3_make(uniform(rng, b.lo.x, b.hi.x), uniform(rng, b.lo.y, b.hi.y), uniform(rng, b.lo.z, b.hi.z));
}
