/* Analytic primitives and solids of constructive geometry for DOUBLES rays at once: a part of a kernel, included by
 * stream_kernel.h.
 *
 * What decides is what decides for single rays: the primitives' guess in double (its operations in their order, so the same
 * bits), which says how far off its t may be, or that it isn't sure. Where everything that a ray meets is sure and keeps
 * its distance from everything else, the answer follows from the guesses, and the crossing that is the hit is refined as
 * the primitive does it. Every other ray is in doubt and goes to the primitive by itself.
 *
 * A CSG solid's events (csg.c) are taken singly if their intervals don't meet. An interval is at most ALONG times the
 * leaf's part of the line, or else the leaf is looked at again: so here, too, where events have windows of that size about
 * the guesses. Which leaves are inside at an event are bits, for eight events and as many lanes in a word, on which the
 * tree's gates are evaluated with the event's leaf, and what is near, inside and outside: the event shows where these
 * differ. */
#ifndef RT_ACCEL_SOLID_KERNEL_H
#define RT_ACCEL_SOLID_KERNEL_H

#include "node/csg/csg_data.h"
#include "node/primitive/primitive.h"
#include "node/primitive/quadric.h"

enum {
    SOLID_LEAVES = 16,                       /* of those that a vector of rays meets; beyond, all are in doubt */
    SOLID_GATES = 32,
    SOLID_WORDS = 2 * SOLID_LEAVES / 8,      /* of eight events with eight lanes' bits each */
    ALL_DOUBLES = (1 << DOUBLES) - 1,
};

/* A primitive on the rays' lines; sets of lanes are bits. */
typedef struct {
    Vecs o, d;                /* the rays in its space */
    Doubles in, out, slack;   /* t, off by no more */
    uint32_t met, doubt;      /* in, out are the crossings; nothing is known. Neither: certainly no crossing. */
    uint32_t flat[2];         /* the crossing in or out is with a plane: the sign of its t is certain */
    Doubles q, q_err;         /* the quadric's value at the origin, half its slope there, and bounds on their errors */
    Doubles slope, slope_err;
    Doubles steep;            /* not above |n.d| / |n|_1 (out - in) at either crossing */
    uint32_t along;           /* the line may be along a face */
} Span;

static inline uint32_t below(Doubles a, Doubles b) { return doubles_lt(a, b) & ALL_DOUBLES; }
static inline Doubles choose(uint32_t bits, Doubles a, Doubles b) { return doubles_pick(doubles_mask_of(bits), a, b); }

static inline Doubles vecs_dot(const Vecs *a, const Vecs *b) { return a->x * b->x + a->y * b->y + a->z * b->z; }
static inline Vecs vecs_at(const Vecs *a, Doubles t, const Vecs *b)
{
    return (Vecs){a->x + t * b->x, a->y + t * b->y, a->z + t * b->z};
}

static inline Doubles vecs_reach(const Vecs *a) { return doubles_abs(a->x) + doubles_abs(a->y) + doubles_abs(a->z); }
static inline Doubles vecs_most(const Vecs *a)
{
    return doubles_max(doubles_abs(a->x), doubles_max(doubles_abs(a->y), doubles_abs(a->z)));
}

static inline Vecs vecs_less(const Vecs *a, Vec3 b)
{
    return (Vecs){a->x - doubles_set(b.x), a->y - doubles_set(b.y), a->z - doubles_set(b.z)};
}

/* affine_point and affine_vector. */
static inline __attribute__((always_inline)) Vecs map_points(const Affine *a, const Vecs *p)
{
    Doubles r[3];
    for (int i = 0; i < 3; i++)
        r[i] = doubles_set(a->m[i][0]) * p->x + doubles_set(a->m[i][1]) * p->y + doubles_set(a->m[i][2]) * p->z +
               doubles_set(a->m[i][3]);
    return (Vecs){r[0], r[1], r[2]};
}

static inline __attribute__((always_inline)) Vecs map_vectors(const Affine *a, const Vecs *v)
{
    Doubles r[3];
    for (int i = 0; i < 3; i++)
        r[i] = doubles_set(a->m[i][0]) * v->x + doubles_set(a->m[i][1]) * v->y + doubles_set(a->m[i][2]) * v->z;
    return (Vecs){r[0], r[1], r[2]};
}

/* ---- guesses, as in the primitives' files ---- */

#define ROUND_UP_8 (1 + GAMMA(8))

static inline uint32_t is_odd(Doubles squares, Doubles reach)
{
    return ~(below(doubles_set(0x1p-400), squares) & below(squares, doubles_set(0x1p400)) &
             below(reach, doubles_set(0x1p20)));
}

static inline __attribute__((always_inline)) void sphere_span(Span *s)
{
    const Vecs *o = &s->o, *d = &s->d;
    Doubles one = doubles_set(1), a = vecs_dot(d, d), reach = vecs_reach(o), inverse = one / a, od = vecs_dot(o, d);
    Doubles mid = -od * inverse;
    Vecs l = vecs_at(o, mid, d);
    Doubles ll = vecs_dot(&l, &l), limit = one + doubles_set(GAMMA(16)) * reach, h = one - ll;
    uint32_t miss = below(limit * limit * doubles_set(ROUND_UP_8), ll), odd = is_odd(a, reach);
    uint32_t sure = below(doubles_set(0x1p-10), h);
    Doubles half = doubles_sqrt(h * inverse);
    s->in = mid - half;
    s->out = mid + half;
    s->slack = doubles_set(0x1p-30) * (half + doubles_abs(mid));
    s->met = sure & ~odd & ALL_DOUBLES;
    s->doubt = (odd | (~miss & ~sure)) & ALL_DOUBLES;
    s->flat[0] = s->flat[1] = 0;
    Doubles squares = vecs_dot(o, o);
    s->q = squares - one;
    s->q_err = doubles_set(GAMMA(4)) * squares;
    s->slope = od;
    Doubles sizes = doubles_abs(o->x * d->x) + doubles_abs(o->y * d->y) + doubles_abs(o->z * d->z);
    s->slope_err = doubles_set(GAMMA(4)) * sizes;
    s->steep = h;   /* |n.d| is half a, the length 2 half, |n|_1 < 2 */
    s->along = 0;
}

static inline __attribute__((always_inline)) void cylinder_span(Span *s)
{
    const Vecs *o = &s->o, *d = &s->d;
    Doubles one = doubles_set(1), zero = doubles_set(0), steepest = doubles_set(ALONG) * vecs_most(d);
    Doubles size_y = doubles_abs(d->y);
    Doubles bottom = (-one - o->y) / d->y, top = (one - o->y) / d->y;
    DoublesMask down = doubles_mask_of(below(d->y, zero));
    Doubles cap_in = doubles_pick(down, top, bottom), cap_out = doubles_pick(down, bottom, top);
    Doubles a = d->x * d->x + d->z * d->z, reach = doubles_abs(o->x) + doubles_abs(o->z), inverse = one / a;
    Doubles od = o->x * d->x + o->z * d->z, mid = -od * inverse, lx = o->x + mid * d->x, lz = o->z + mid * d->z;
    Doubles ll = lx * lx + lz * lz, limit = one + doubles_set(GAMMA(16)) * reach, h = one - ll;
    uint32_t miss = below(limit * limit * doubles_set(ROUND_UP_8), ll);
    uint32_t odd = is_odd(a, reach + doubles_abs(o->y)) | ~below(zero, size_y), sure = below(doubles_set(0x1p-10), h);
    Doubles half = doubles_sqrt(h * inverse), side_in = mid - half, side_out = mid + half;
    Doubles slack = doubles_set(0x1p-38) * (doubles_abs(mid) + (one + reach) * half);
    Doubles in = doubles_max(side_in, cap_in), out = doubles_min(side_out, cap_out);
    slack = slack + doubles_set(0x1p-45) * (doubles_abs(in) + doubles_abs(out));
    miss |= sure & below(slack, in - out);
    sure &= below(slack, out - in) & below(slack, doubles_abs(side_in - cap_in)) &
            below(slack, doubles_abs(side_out - cap_out));
    s->in = in;
    s->out = out;
    s->slack = slack;
    s->met = sure & ~odd & ALL_DOUBLES;
    s->doubt = (odd | (~miss & ~sure)) & ALL_DOUBLES;
    s->flat[0] = ~below(cap_in, side_in);
    s->flat[1] = ~below(side_out, cap_out);
    Doubles squares = o->x * o->x + o->z * o->z;
    s->q = squares - one;
    s->q_err = doubles_set(GAMMA(4)) * squares;
    s->slope = od;
    s->slope_err = doubles_set(GAMMA(4)) * (doubles_abs(o->x * d->x) + doubles_abs(o->z * d->z));
    /* |n.d| is half a at the side, where |n|_1 < 2 */
    s->steep = doubles_min(doubles_set(0.5) * half * a, size_y) * (out - in);
    s->along = ~(below(steepest, size_y) & below(steepest, doubles_max(doubles_abs(d->x), doubles_abs(d->z))));
}

static inline __attribute__((always_inline)) void cone_span(Span *s)
{
    const Vecs *o = &s->o, *d = &s->d;
    Doubles one = doubles_set(1), zero = doubles_set(0), least = doubles_set(0x1p-10);
    Doubles dd = vecs_dot(d, d), reach = vecs_reach(o), near = -vecs_dot(o, d) / dd;
    Vecs l = vecs_at(o, near, d);
    Doubles limit = doubles_set(M_SQRT2) + doubles_set(GAMMA(16)) * reach, size_y = doubles_abs(d->y);
    uint32_t miss = below(limit * limit * doubles_set(ROUND_UP_8), vecs_dot(&l, &l));
    uint32_t odd = is_odd(dd, reach) | ~below(zero, size_y);
    Doubles a = (d->x * d->x - d->y * d->y + d->z * d->z) / dd, scale = one / doubles_sqrt(dd);
    Doubles b = (l.x * d->x - l.y * d->y + l.z * d->z) * scale, c = l.x * l.x - l.y * l.y + l.z * l.z;
    Doubles disc = b * b - a * c;
    uint32_t flatter = below(zero, a);
    miss |= below(disc, -least) & flatter;
    uint32_t sure = below(least, doubles_abs(a)) & below(least, disc);
    Doubles root = doubles_sqrt(disc), q = choose(below(b, zero), root - b, -root - b), r0 = c / q, r1 = q / a;
    Doubles side_in = near + doubles_min(r1, r0) * scale, side_out = near + doubles_max(r0, r1) * scale;
    Doubles slack = doubles_set(0x1p-30) * (one + reach) * (one + doubles_abs(doubles_min(r1, r0)) +
                                                              doubles_abs(doubles_max(r0, r1))) * scale;
    uint32_t down = below(d->y, zero), steep_down = ~flatter & down, steep_up = ~flatter & ~down;
    miss |= sure & flatter & below(zero, l.y - b / a * (d->y * scale));
    Doubles in = choose(steep_down, side_out, choose(steep_up, doubles_set(-INFINITY), side_in));
    Doubles out = choose(steep_down, doubles_set(INFINITY), choose(steep_up, side_in, side_out));
    Doubles base = (-one - o->y) / d->y;
    odd |= ~below(doubles_abs(base), doubles_set(0x1p500) * scale);
    slack = slack + doubles_set(0x1p-45) * doubles_abs(base);
    sure &= below(slack, doubles_abs(base - in)) & below(slack, doubles_abs(base - out));
    s->flat[1] = down & below(base, out);
    s->flat[0] = ~down & below(in, base);
    out = choose(s->flat[1], base, out);
    in = choose(s->flat[0], base, in);
    miss |= sure & below(slack, in - out);
    sure &= below(slack, out - in);
    s->in = in;
    s->out = out;
    s->slack = slack;
    s->met = sure & ~miss & ~odd & ALL_DOUBLES;
    s->doubt = (odd | (~miss & ~sure)) & ALL_DOUBLES;
    Doubles xx = o->x * o->x, yy = o->y * o->y, zz = o->z * o->z;
    s->q = xx - yy + zz;
    s->q_err = doubles_set(GAMMA(4)) * (xx + yy + zz);
    Doubles x = o->x * d->x, y = o->y * d->y, z = o->z * d->z;
    s->slope = x - y + z;
    s->slope_err = doubles_set(GAMMA(4)) * (doubles_abs(x) + doubles_abs(y) + doubles_abs(z));
    /* |n.d| is root |d| at the side, where |n|_1 < 4 */
    s->steep = doubles_min(doubles_set(0.25) * root / scale, size_y) * (out - in);
    s->along = ~below(doubles_set(ALONG) * vecs_most(d), size_y);   /* not along the side, as |a| is above 2^-10 */
}

static inline __attribute__((always_inline)) void cube_span(Span *s)
{
    const Doubles o[3] = {s->o.x, s->o.y, s->o.z}, d[3] = {s->d.x, s->d.y, s->d.z};
    Doubles zero = doubles_set(0), one = doubles_set(1), in[3], out[3];
    uint32_t odd = ~below(vecs_reach(&s->o), doubles_set(0x1p400));
    Doubles steepest = doubles_set(ALONG) * vecs_most(&s->d);
    s->along = 0;
    for (int i = 0; i < 3; i++) {
        Doubles low = -o[i] / d[i], high = (one - o[i]) / d[i], size = doubles_abs(d[i]);
        in[i] = doubles_min(low, high);
        out[i] = doubles_max(high, low);
        odd |= ~below(zero, size);
        s->along |= ~below(steepest, size);
    }
    Doubles last = doubles_max(doubles_max(in[0], in[1]), in[2]), first = doubles_min(doubles_min(out[0], out[1]), out[2]);
    Doubles slack = doubles_set(8 * UNIT_ROUNDOFF) * (doubles_abs(last) + doubles_abs(first));
    uint32_t miss = below(slack, last - first), sure = below(slack, first - last);
    s->in = last;
    s->out = first;
    s->slack = slack;
    s->met = sure & ~odd & ALL_DOUBLES;
    s->doubt = (odd | (~miss & ~sure)) & ALL_DOUBLES;
    s->flat[0] = s->flat[1] = ALL_DOUBLES;
    s->q = s->q_err = s->slope = s->slope_err = zero;
    Doubles least = doubles_min(doubles_min(doubles_abs(d[0]), doubles_abs(d[1])), doubles_abs(d[2]));
    s->steep = least * (first - last);
}

static inline void span_of(PrimForm form, Span *s)
{
    switch (form) {
    case FORM_SPHERE: sphere_span(s); break;
    case FORM_CYLINDER: cylinder_span(s); break;
    case FORM_CONE: cone_span(s); break;
    case FORM_CUBE: cube_span(s); break;
    case FORM_TORUS:
    case FORM_OTHER: break;
    }
}

/* ---- on which side of the ray's origin ---- */

typedef struct { uint32_t ahead, vague; } Side;

/* Where a crossing lies that is within `width` of t: ahead of `start`, or it can't be told. At the origin (no lane in
 * `moved`) a plane's crossing has the certain sign of a difference; with a quadric q + 2 slope t + ... = 0 near 0, far
 * from the other root, t has the sign of -q / slope (as for quadric_departs). */
static inline Side side_of(const Span *s, int i, Doubles t, Doubles width, Doubles start, uint32_t moved)
{
    Doubles zero = doubles_set(0), gap = t - start;
    uint32_t ahead = below(zero, gap), vague = ~below(width, doubles_abs(gap)) & ALL_DOUBLES;
    if (!vague) return (Side){ahead, 0};
    uint32_t flat = s->flat[i] & ~moved;
    uint32_t known = below(s->q_err, doubles_abs(s->q)) &
                     below(s->slope_err + doubles_set(0x1p-1000), doubles_abs(s->slope)) & ~moved & ~s->flat[i];
    uint32_t opposite = below(s->q, zero) ^ below(s->slope, zero);
    uint32_t by_slope = vague & known;
    return (Side){(ahead & ~by_slope) | (opposite & by_slope), vague & ~flat & ~known};
}

/* ---- crossings to the last bit ---- */

typedef struct { Doubles hi, lo; } Splits;

static inline Splits splits_of(Doubles o, Doubles d, Doubles t_hi, Doubles t_lo)
{
    Doubles c = doubles_set(0x8000001p0) * d, d_hi = c - (c - d), d_lo = d - d_hi;
    Dds s = dds_sum(o, t_hi * d_hi), p = dds_sum(s.hi, s.lo + (t_hi * d_lo + t_lo * d));
    Doubles big = doubles_set(0x1.8p28), hi = (p.hi + big) - big;
    return (Splits){hi, (p.hi - hi) + p.lo};
}

/* quadric_refine: t and lo, with the bound on the error that the step leaves in *err. */
static inline __attribute__((always_inline)) Dds quadrics_refine(const Vecs *ray_o, const Vecs *ray_d, Vec3 sign, double k,
                                                                 Doubles t, Doubles *err)
{
    const Doubles o[3] = {ray_o->x, ray_o->y, ray_o->z}, d[3] = {ray_d->x, ray_d->y, ray_d->z};
    const double s[3] = {sign.x, sign.y, sign.z};
    Doubles zero = doubles_set(0), two = doubles_set(2);
    Doubles c = doubles_set(0x8000001p0) * t, t_hi = c - (c - t), t_lo = t - t_hi;
    Doubles square = doubles_set(k), cross = zero, slope = zero, a = zero, reach = doubles_set(1);
    for (int i = 0; i < 3; i++) {
        if (s[i] == 0) continue;
        Splits x = splits_of(o[i], d[i], t_hi, t_lo);
        Doubles si = doubles_set(s[i]);
        square = square + si * (x.hi * x.hi);
        cross = cross + si * (x.lo * (two * x.hi + x.lo));
        slope = slope + si * (x.hi * d[i]);
        a = a + d[i] * d[i];
        reach = reach + doubles_abs(o[i]);
    }
    Doubles half_inverse = doubles_set(0.5) / slope, step = -(square + cross) * half_inverse, sum = t + step;
    Doubles size = doubles_abs(step);
    *err = doubles_set(GAMMA(1)) * doubles_abs(sum) +
           ((doubles_set(4) * a * step * step + doubles_set(0x1p-71) * reach) * doubles_abs(half_inverse) +
            doubles_set(0x1p-16) * size);
    return (Dds){sum, step - (sum - t)};
}

/* plane_crossing; *odd gets the lanes that need more than it. */
static inline __attribute__((always_inline)) Dds planes_cross(Doubles o, Doubles d, Doubles value, uint32_t *odd)
{
    Dds gap = dds_sum(value, -o);
    Doubles t = gap.hi / d, size = doubles_abs(t), slope = doubles_abs(d), tiny = doubles_set(0x1p-800);
    Doubles huge = doubles_set(0x1p800);
    *odd = ~(below(tiny, size) & below(size, huge) & below(tiny, slope) & below(slope, huge));
    Dds td = dds_prod(t, d);
    Doubles lo = ((gap.hi - td.hi) - td.lo + gap.lo) / d, sum = t + lo;
    return (Dds){sum, lo - (sum - t)};
}

typedef struct {
    Dds t;
    Doubles part;      /* small whole numbers */
    uint32_t odd;      /* lanes that need the primitive itself */
} Crossings;

/* The crossing in or out (lanes in `outward`) of the lanes of a span. */
static inline __attribute__((always_inline)) Crossings refine_span(PrimForm form, const Span *s, uint32_t outward)
{
    const Vecs *o = &s->o, *d = &s->d;
    Doubles t = choose(outward, s->out, s->in), zero = doubles_set(0), err;
    uint32_t flat = (s->flat[1] & outward) | (s->flat[0] & ~outward), bad = 0, flat_odd = 0;
    uint32_t near = below(doubles_abs(t), doubles_set(0x1p-10) * (s->out - s->in)), down = below(d->y, zero);
    Crossings c = {.part = zero};
    switch (form) {
    case FORM_SPHERE:
        c.t = quadrics_refine(o, d, vec3_make(1, 1, 1), -1, t, &err);
        c.odd = near;
        break;
    case FORM_CYLINDER:
        c.t = quadrics_refine(o, d, vec3_make(1, 0, 1), -1, t, &err);
        bad = near | ~(below(err, doubles_set(GAMMA(4)) * doubles_abs(c.t.hi)));
        if (flat & ALL_DOUBLES) {
            uint32_t is_top = down ^ outward;
            Dds cap = planes_cross(o->y, d->y, choose(is_top, doubles_set(1), doubles_set(-1)), &flat_odd);
            c.t.hi = choose(flat, cap.hi, c.t.hi);
            c.t.lo = choose(flat, cap.lo, c.t.lo);
            c.part = choose(flat, choose(is_top, doubles_set(CYLINDER_TOP), doubles_set(CYLINDER_BOTTOM)), zero);
        }
        c.odd = (flat & flat_odd) | (~flat & bad);
        break;
    case FORM_CONE:
        c.t = quadrics_refine(o, d, vec3_make(1, -1, 1), 0, t, &err);
        if (flat & ALL_DOUBLES) {
            Dds base = planes_cross(o->y, d->y, doubles_set(-1), &flat_odd);
            c.t.hi = choose(flat, base.hi, c.t.hi);
            c.t.lo = choose(flat, base.lo, c.t.lo);
            c.part = choose(flat, doubles_set(CONE_BASE), zero);
        }
        c.odd = (flat & flat_odd) | (~flat & near);
        break;
    case FORM_CUBE: {
        const Doubles ray_o[3] = {o->x, o->y, o->z}, ray_d[3] = {d->x, d->y, d->z};
        Doubles at_o = o->z, at_d = d->z, axis = doubles_set(2);
        for (int i = 1; i >= 0; i--) {
            Doubles low = -ray_o[i] / ray_d[i], high = (doubles_set(1) - ray_o[i]) / ray_d[i];
            Doubles own = choose(outward, doubles_max(high, low), doubles_min(low, high));
            DoublesMask same = doubles_mask_and(doubles_le(own, t), doubles_le(t, own));
            at_o = doubles_pick(same, ray_o[i], at_o);
            at_d = doubles_pick(same, ray_d[i], at_d);
            axis = doubles_pick(same, doubles_set(i), axis);
        }
        Doubles side = choose(below(at_d, zero) ^ outward, doubles_set(1), zero);
        c.t = planes_cross(at_o, at_d, side, &flat_odd);
        c.part = axis + axis + side;
        c.odd = flat_odd;
        break;
    }
    case FORM_TORUS:
    case FORM_OTHER: break;
    }
    return c;
}

/* ---- a vector of rays ---- */

typedef struct {
    Walk *w;
    uint32_t index, at;   /* of the object, of the first lane */
    bool any;
    Vecs o, d;            /* in the object's space */
    Doubles tmax;         /* of the ray or the nearest hit so far, rounded up */
    uint32_t rays;        /* lanes */
} Bundle;

static inline Doubles doubles_at(const double *p) { return *(const Doubles *)p; }

static void bundle_load(Bundle *b, const Object *object)
{
    const Walk *w = b->w;
    Vecs o = {doubles_at(w->given.o[0] + b->at), doubles_at(w->given.o[1] + b->at), doubles_at(w->given.o[2] + b->at)};
    Vecs d = {doubles_at(w->given.d[0] + b->at), doubles_at(w->given.d[1] + b->at), doubles_at(w->given.d[2] + b->at)};
    b->o = object->in_world ? o : map_points(&object->to_object, &o);
    b->d = object->in_world ? d : map_vectors(&object->to_object, &d);
    b->tmax = doubles_of_floats(w->space.tmax + b->at);
}

/* Takes the crossings of the lanes as hits; those in doubt are returned. `shift` is to be added to t. */
static uint32_t take_crossings(const Bundle *b, uint32_t lanes, const Crossings *c, Doubles shift, uint32_t leaf)
{
    Walk *w = b->w;
    _Alignas(64) double t[DOUBLES], lo[DOUBLES], part[DOUBLES];
    *(Doubles *)t = c->t.hi + shift;
    *(Doubles *)lo = c->t.lo;
    *(Doubles *)part = c->part;
    for (uint32_t left = lanes & ~c->odd; left; left &= left - 1) {
        uint32_t k = (uint32_t)__builtin_ctz(left), i = b->at + k;
        double scale = 1 / w->given.per_scale[i];
        Hit hit = {.t = t[k] * scale, .u = lo[k] * scale, .part = (uint32_t)part[k], .leaf = leaf, .object = b->index};
        if (hit.t <= w->ray[i].tmax) offer(w, &w->space, i, &hit);
    }
    return lanes & c->odd;
}

/* Whether a hit within `width` of t blocks (first) or may (second) lanes of occlusion rays. */
static inline Side end_of(const Bundle *b, Doubles t, Doubles width)
{
    uint32_t within = below(t + width, doubles_of_floats(b->w->space.end_down + b->at));
    return (Side){within, ~within & ~below(b->tmax, t - width) & ALL_DOUBLES};
}

/* A primitive by itself. Returns the lanes in doubt. */
static inline __attribute__((always_inline)) uint32_t form_alone(const Bundle *b, PrimForm form)
{
    Span s;
    s.o = b->o;
    s.d = b->d;
    span_of(form, &s);
    if (!(b->rays & (s.met | s.doubt))) return 0;
    Doubles zero = doubles_set(0);
    Side in = side_of(&s, 0, s.in, s.slack, zero, 0), out = side_of(&s, 1, s.out, s.slack, zero, 0);
    uint32_t met = b->rays & s.met, doubt = b->rays & s.doubt;
    uint32_t vague = met & (in.vague | (~in.ahead & out.vague)), first = met & in.ahead & ~vague;
    uint32_t hits = first | (met & out.ahead & ~vague);
    doubt |= vague;
    if (!hits) return doubt;
    Doubles t = choose(first, s.in, s.out);
    if (b->any) {
        Side end = end_of(b, t, s.slack);
        uint64_t blocked = hits & end.ahead;
        b->w->alive &= ~(blocked << b->at);
        return doubt | (hits & end.vague);
    }
    hits &= ~below(b->tmax, t - s.slack);
    if (!hits) return doubt;
    Crossings c = refine_span(form, &s, ~first);
    return doubt | take_crossings(b, hits, &c, zero, 0);
}

/* ---- constructive solid geometry ---- */

typedef struct {
    const Csg *csg;
    Vecs o, d;               /* moved to the solid */
    Doubles shift, start;    /* t of the origin; of the ray's own origin beyond that */
    uint32_t moved;
    uint32_t doubt;
    uint32_t count;
    uint32_t leaf[SOLID_LEAVES];
    Span span[SOLID_LEAVES];
    Doubles width[SOLID_LEAVES];
} Solid;

/* move_origin. */
static void solid_move(Solid *s)
{
    const Csg *csg = s->csg;
    s->shift = s->start = doubles_set(0);
    s->moved = below(doubles_set(CSG_FAR_ORIGIN * csg->reach), vecs_most(&s->o));
    if (!s->moved) return;
    Vecs c = {doubles_set(csg->centre.x), doubles_set(csg->centre.y), doubles_set(csg->centre.z)};
    Vecs to = {c.x - s->o.x, c.y - s->o.y, c.z - s->o.z};
    Doubles shift = vecs_dot(&to, &s->d) / vecs_dot(&s->d, &s->d);
    uint32_t finite = below(doubles_abs(shift), doubles_set(INFINITY));
    s->doubt |= s->moved & ~finite;
    s->shift = choose(s->moved, shift, s->shift);
    s->start = -s->shift;
    Vecs o = vecs_at(&s->o, shift, &s->d);
    s->o = (Vecs){choose(s->moved, o.x, s->o.x), choose(s->moved, o.y, s->o.y), choose(s->moved, o.z, s->o.z)};
}

typedef struct { Vecs o, inverse; DoublesMask negative[3]; } Lines;

/* line_meets. */
static inline __attribute__((always_inline)) uint32_t lines_meet(const Lines *l, const Box *box)
{
    const double lo[3] = {box->lo.x, box->lo.y, box->lo.z}, hi[3] = {box->hi.x, box->hi.y, box->hi.z};
    const Doubles o[3] = {l->o.x, l->o.y, l->o.z}, inverse[3] = {l->inverse.x, l->inverse.y, l->inverse.z};
    Doubles near = doubles_set(-INFINITY), far = doubles_set(INFINITY);
    for (int i = 0; i < 3; i++) {
        Doubles low = doubles_set(lo[i]), high = doubles_set(hi[i]);
        near = doubles_max((doubles_pick(l->negative[i], high, low) - o[i]) * inverse[i], near);
        far = doubles_min((doubles_pick(l->negative[i], low, high) - o[i]) * inverse[i], far);
    }
    return doubles_mask_bits(doubles_le(near, far)) & ALL_DOUBLES;
}

/* Adds a leaf that lanes may meet. */
static void solid_leaf(Solid *s, uint32_t index, uint32_t lanes)
{
    const CsgLeaf *leaf = &s->csg->leaf[index];
    PrimForm form = leaf->prim->ops->form;
    if (form == FORM_OTHER || form == FORM_TORUS || leaf->coarse || s->count == SOLID_LEAVES) {
        s->doubt |= lanes;
        return;
    }
    Span *p = &s->span[s->count];
    Vecs from = vecs_less(&s->o, leaf->middle);
    p->o = s->o;
    p->d = s->d;
    if (!leaf->identity) {  /* leaf_ray */
        Vecs o = map_vectors(&leaf->to_leaf, &from);
        p->o = (Vecs){doubles_set(leaf->leaf_middle.x) + o.x, doubles_set(leaf->leaf_middle.y) + o.y,
                      doubles_set(leaf->leaf_middle.z) + o.z};
        p->d = map_vectors(&leaf->to_leaf, &s->d);
    }
    span_of(form, p);
    s->doubt |= lanes & (p->doubt | p->along);
    p->met &= lanes;
    if (!p->met) return;
    /* place_error, more coarsely; twice, for the roundings of this */
    Doubles length = p->out - p->in, farthest = doubles_max(doubles_abs(p->in), doubles_abs(p->out));
    Doubles reach = vecs_most(&from) + farthest * vecs_most(&s->d);
    Doubles err = doubles_set(2 * leaf->spread_most) + doubles_set(2 * leaf->growth) * reach;
    uint32_t clear = below(doubles_set(4) * err, doubles_set(ALONG) * p->steep) &
                     below(doubles_set(4) * p->slack, doubles_set(ALONG) * length);
    s->doubt |= p->met & ~clear;
    s->width[s->count] = doubles_set(ALONG) * length;
    s->leaf[s->count++] = index;
}

static void solid_collect(Solid *s, uint32_t rays)
{
    const Csg *csg = s->csg;
    Doubles one = doubles_set(1), zero = doubles_set(0);
    Lines l;
    l.o = s->o;
    l.inverse = (Vecs){one / s->d.x, one / s->d.y, one / s->d.z};
    l.negative[0] = doubles_mask_of(below(l.inverse.x, zero));
    l.negative[1] = doubles_mask_of(below(l.inverse.y, zero));
    l.negative[2] = doubles_mask_of(below(l.inverse.z, zero));
    for (uint32_t i = 0; i < csg->node_count;) {
        const CsgNode *node = &csg->node[i];
        if (csg->node_count > 1 && !(lines_meet(&l, &node->box) & rays & ~s->doubt)) {
            i = node->skip;
            continue;
        }
        for (uint32_t k = 0; k < node->count; k++) {
            const CsgItem *item = &csg->item[node->first + k];
            uint32_t lanes = lines_meet(&l, &item->box) & rays & ~s->doubt;
            if (lanes) solid_leaf(s, item->leaf, lanes);
        }
        i++;
    }
}

/* The gates above the leaves that are met, as operations on words. */
typedef struct {
    uint32_t gate_count;
    uint32_t gate[SOLID_GATES];      /* ascending: a gate's parent comes before it */
    bool is_and[SOLID_GATES];
    uint64_t start[SOLID_GATES];     /* what the operands that stay as they are far away make of it */
    uint32_t parent[SOLID_GATES];    /* places in `gate` */
    uint32_t of_leaf[SOLID_LEAVES];
} Gates;

static uint32_t place_of(const Gates *g, uint32_t gate)
{
    uint32_t i = 0;
    while (g->gate[i] != gate) i++;
    return i;
}

/* False if they are too many. */
static bool gates_find(Gates *g, const Solid *s)
{
    const Csg *csg = s->csg;
    uint32_t n = 0;
    for (uint32_t k = 0; k < s->count; k++)
        for (uint32_t gate = csg->leaf[s->leaf[k]].gate; gate != UINT32_MAX; gate = csg->gate[gate].parent) {
            uint32_t i = n;
            while (i > 0 && g->gate[i - 1] > gate) i--;
            if (i > 0 && g->gate[i - 1] == gate) break;
            if (n == SOLID_GATES) return false;
            for (uint32_t j = n++; j > i; j--) g->gate[j] = g->gate[j - 1];
            g->gate[i] = gate;
        }
    g->gate_count = n;
    uint32_t still_on[SOLID_GATES], still_off[SOLID_GATES];
    for (uint32_t i = 0; i < n; i++) {
        uint32_t gate = g->gate[i], on = csg->idle[gate].count;
        g->is_and[i] = csg->gate[gate].threshold > 1;
        still_on[i] = on;
        still_off[i] = csg->gate[gate].threshold - on;
        if (i == 0) continue;
        g->parent[i] = place_of(g, csg->gate[gate].parent);
        still_on[g->parent[i]] -= csg->idle[gate].settled;
        still_off[g->parent[i]] -= !csg->idle[gate].settled;
    }
    for (uint32_t k = 0; k < s->count; k++) {
        const CsgLeaf *leaf = &csg->leaf[s->leaf[k]];
        uint32_t i = g->of_leaf[k] = place_of(g, leaf->gate);
        still_on[i] -= leaf->flip;
        still_off[i] -= !leaf->flip;
    }
    for (uint32_t i = 0; i < n; i++) g->start[i] = (g->is_and[i] ? !still_off[i] : still_on[i] > 0) ? UINT64_MAX : 0;
    return true;
}

static inline void gate_add(const Gates *g, uint64_t *value, uint32_t gate, uint64_t operand)
{
    value[gate] = g->is_and[gate] ? value[gate] & operand : value[gate] | operand;
}

/* What is certain, and what is possible, of the leaves or of a gate at events: of a leaf, whether the line is in it. */
typedef struct { uint64_t least, most; } Bounds;

/* The root's bounds. Gates are monotone in their operands, complements being at the leaves. */
static Bounds gates_value(const Gates *g, const Solid *s, Bounds (*inside)[SOLID_WORDS], uint32_t word)
{
    uint64_t least[SOLID_GATES], most[SOLID_GATES];
    for (uint32_t i = 0; i < g->gate_count; i++) least[i] = most[i] = g->start[i];
    for (uint32_t k = 0; k < s->count; k++) {
        Bounds own = inside[k][word];
        bool flip = s->csg->leaf[s->leaf[k]].flip;
        gate_add(g, least, g->of_leaf[k], flip ? ~own.most : own.least);
        gate_add(g, most, g->of_leaf[k], flip ? ~own.least : own.most);
    }
    for (uint32_t i = g->gate_count - 1; i > 0; i--) {
        gate_add(g, least, g->parent[i], least[i]);
        gate_add(g, most, g->parent[i], most[i]);
    }
    return (Bounds){least[0], most[0]};
}

static inline uint64_t event_bits(uint32_t event, uint32_t lanes) { return (uint64_t)lanes << (8 * (event % 8)); }

static inline Doubles event_t(const Solid *s, uint32_t event)
{
    return event & 1 ? s->span[event / 2].out : s->span[event / 2].in;
}

/* The lanes of each event (2 k: in, 2 k + 1: out of leaf k) where the result begins or ends: for certain, or perhaps, as
 * other windows meet the event's. */
typedef struct { uint32_t shown[2 * SOLID_LEAVES], murky[2 * SOLID_LEAVES]; } Shown;

/* An event is passed with its own leaf, and all those with a window that meets its window, taken to be in any state. If
 * that makes no difference then none of them shows here, in whatever order or group they are passed. */
static void solid_shown(const Solid *s, const Gates *g, Shown *shown)
{
    Bounds inside[SOLID_LEAVES][SOLID_WORDS];
    uint32_t events = 2 * s->count, words = (events + 7) / 8, crowded[2 * SOLID_LEAVES] = {0};
    for (uint32_t k = 0; k < s->count; k++) {
        const Span *p = &s->span[k];
        for (uint32_t word = 0; word < words; word++) inside[k][word] = (Bounds){0, 0};
        for (uint32_t e = 0; e < events; e++) {
            uint32_t least = 0, most = ALL_DOUBLES;
            if (e / 2 != k) {
                Doubles t = event_t(s, e), reach = s->width[k] + s->width[e / 2], after = t - p->in, before = p->out - t;
                Doubles nearest = doubles_min(after, before);
                least = below(reach, nearest) & p->met;
                most = ~below(nearest, -reach) & p->met;
                crowded[e] |= least ^ most;
            }
            inside[k][e / 8].least |= event_bits(e, least);
            inside[k][e / 8].most |= event_bits(e, most);
        }
    }
    for (uint32_t word = 0; word < words; word++) {
        Bounds value = gates_value(g, s, inside, word);
        uint64_t differs = value.least ^ value.most;
        for (uint32_t e = 8 * word; e < events && e < 8 * word + 8; e++) {
            uint32_t lanes = (uint32_t)(differs >> (8 * (e % 8))) & s->span[e / 2].met;
            shown->shown[e] = lanes & ~crowded[e];
            shown->murky[e] = lanes & crowded[e];
        }
    }
}

static uint32_t csg_bundle(const Bundle *b, const Csg *csg)
{
    Solid s;
    s.csg = csg;
    s.o = b->o;
    s.d = b->d;
    s.doubt = 0;
    s.count = 0;
    solid_move(&s);
    solid_collect(&s, b->rays);
    uint32_t rays = b->rays & ~s.doubt;
    if (s.count == 0 || !rays) return b->rays & s.doubt;
    Gates g;
    if (!gates_find(&g, &s)) return b->rays;
    Shown shown;
    solid_shown(&s, &g, &shown);
    Doubles best = doubles_set(INFINITY), width = doubles_set(0), which = width, murky = best;
    uint32_t hits = 0;
    for (uint32_t e = 0; e < 2 * s.count; e++) {
        uint32_t lanes = (shown.shown[e] | shown.murky[e]) & rays;
        if (!lanes) continue;
        Doubles t = event_t(&s, e);
        Side side = side_of(&s.span[e / 2], e & 1, t, s.width[e / 2], s.start, s.moved);
        s.doubt |= lanes & side.vague;
        uint32_t ahead = lanes & side.ahead & ~side.vague, nearer = shown.shown[e] & ahead & below(t, best);
        hits |= nearer;
        best = choose(nearer, t, best);
        width = choose(nearer, s.width[e / 2], width);
        which = choose(nearer, doubles_set(e), which);
        murky = choose(shown.murky[e] & ahead, doubles_min(t - s.width[e / 2], murky), murky);
    }
    Doubles tmax = b->tmax + s.start;
    s.doubt |= below(murky, doubles_min(best, tmax)) & rays;
    hits &= ~s.doubt;
    if (hits && b->any) {
        Side end = end_of(b, best - s.start, width);
        uint64_t blocked = hits & end.ahead;
        b->w->alive &= ~(blocked << b->at);
        s.doubt |= hits & end.vague;
    } else if (hits) {
        hits &= ~below(tmax + width, best);
        for (uint32_t k = 0; k < s.count && hits; k++) {
            uint32_t outward = below(doubles_set(2 * k + 0.5), which);
            uint32_t lanes = hits & below(which, doubles_set(2 * k + 1.5)) & ~below(which, doubles_set(2 * k));
            if (!lanes) continue;
            Crossings c = refine_span(csg->leaf[s.leaf[k]].prim->ops->form, &s.span[k], outward);
            s.doubt |= take_crossings(b, lanes, &c, s.shift, s.leaf[k]);
            hits &= ~lanes;
        }
    }
    return b->rays & s.doubt;
}

/* Directions whose power of two is beyond these, or rays that don't start at 0, go to the primitive one by one. */
#define SOLID_SCALE_LEAST 0x1p-64
#define SOLID_SCALE_GREATEST 0x1p64

static bool is_plain(const Walk *w, uint32_t i)
{
    return w->ray[i].tmin == 0 && w->given.per_scale[i] > SOLID_SCALE_LEAST && w->given.per_scale[i] < SOLID_SCALE_GREATEST;
}

/* Roundings of a plane's place less the origin's, and of the quotient and its product. */
enum { BOX_ROUNDINGS = 8 };

/* A stretch of the rays, t from near to far. */
typedef struct { Doubles near, far; } Stretch;

/* The lanes that meet the primitive's box, and their way through it. */
static uint32_t box_alone(const Bundle *b, const Box *bounds, Stretch *in_box)
{
    Doubles zero = doubles_set(0), one = doubles_set(1);
    Doubles reach = doubles_max(vecs_most(&b->o), doubles_set(box_reach(*bounds)));
    const double lo[3] = {bounds->lo.x, bounds->lo.y, bounds->lo.z}, hi[3] = {bounds->hi.x, bounds->hi.y, bounds->hi.z};
    const Doubles o[3] = {b->o.x, b->o.y, b->o.z}, d[3] = {b->d.x, b->d.y, b->d.z};
    Doubles pad = doubles_set(GAMMA(BOX_ROUNDINGS)) * reach, near = zero, far = b->tmax;
    for (int i = 0; i < 3; i++) {
        Doubles inverse = one / d[i], low = doubles_set(lo[i]) - pad, high = doubles_set(hi[i]) + pad;
        DoublesMask negative = doubles_mask_of(below(inverse, zero));
        near = doubles_max((doubles_pick(negative, high, low) - o[i]) * inverse, near);
        far = doubles_min((doubles_pick(negative, low, high) - o[i]) * inverse, far);
    }
    *in_box = (Stretch){near, far};
    return doubles_mask_bits(doubles_le(near, far)) & b->rays;
}

/* Tori of these minor radii and rays from within this many radii have f = (|p|^2 + 1 - m^2)^2 - 4 (x^2 + z^2) of moderate
 * size in the box, where |p| is at most 4.7: |grad f| is below 600, the ends of a stretch are off by 8 u (reach + 8) in
 * each coordinate, the sums by 32 u of terms below 600. */
#define TORUS_MINOR_GREATEST 2.0
#define TORUS_REACH 0x1p10
#define TORUS_DOUBT 0x1p-36

/* A torus: f is a quartic along the ray. In the form of Bernstein it lies between the least and the greatest of its five
 * coefficients, made of those of two quadratics (Farin, "Curves and surfaces for CAGD", 2002, chapter 6).
 * Where these are positive, f has no zero. Only the first may be in doubt, for a ray that leaves the torus: then f at the
 * origin is found with twice the precision. Shadow rays are blocked if f is negative half way. */
static uint32_t torus_alone(const Bundle *b, const Prim *prim)
{
    Stretch in_box;
    double minor = torus_minor(prim);
    Box bounds = prim->ops->bounds(prim);
    uint32_t rays = box_alone(b, &bounds, &in_box), blocked = 0;
    if (!rays || minor > TORUS_MINOR_GREATEST) return rays;
    Vecs p = vecs_at(&b->o, in_box.near, &b->d), q = vecs_at(&b->o, in_box.far, &b->d);
    Doubles two = doubles_set(2), four = doubles_set(4), c = doubles_set(1 - minor * minor), reach = vecs_most(&b->o);
    Doubles w0 = p.x * p.x + p.z * p.z, w1 = p.x * q.x + p.z * q.z, w2 = q.x * q.x + q.z * q.z;
    Doubles g0 = w0 + p.y * p.y + c, g1 = w1 + p.y * q.y + c, g2 = w2 + q.y * q.y + c;
    Doubles third = doubles_set(1.0 / 3), doubt = doubles_set(TORUS_DOUBT) * (reach + doubles_set(8));
    Doubles first = g0 * g0 - four * w0, second = g0 * g1 - two * (w0 + w1);
    Doubles middle = (g0 * g2 + two * g1 * g1 - two * (w0 + four * w1 + w2)) * third;
    Doubles fourth = g1 * g2 - two * (w1 + w2), last = g2 * g2 - four * w2;
    uint32_t plain = below(reach, doubles_set(TORUS_REACH));
    Doubles least = doubles_min(doubles_min(second, middle), doubles_min(fourth, last));
    uint32_t outside = below(doubt, first) & plain, clear = below(doubt, least) & plain;
    uint32_t leaves = rays & clear & ~outside & doubles_mask_bits(doubles_le(in_box.near, doubles_set(0)));
    for (; leaves; leaves &= leaves - 1) {
        uint32_t k = (uint32_t)__builtin_ctz(leaves);
        const double *x = (const double *)&b->o.x, *y = (const double *)&b->o.y, *z = (const double *)&b->o.z;
        if (torus_is_outside(prim, vec3_make(x[k], y[k], z[k]))) outside |= 1u << k;
    }
    if (b->any && minor <= 1) {
        Doubles g = (g0 + two * g1 + g2) * doubles_set(0.25), half_way = g * g - (w0 + two * w1 + w2);
        Doubles end = doubles_of_floats(b->w->space.end_down + b->at);
        Doubles t = (in_box.near + in_box.far) * doubles_set(0.5);
        blocked = rays & outside & below(half_way, -doubt) & below(t, end);
        b->w->alive &= ~((uint64_t)blocked << b->at);
    }
    return rays & ~(outside & clear) & ~blocked;
}

static uint32_t at_bundle(const Bundle *b, const Prim *prim)
{
    PrimForm form = prim->ops->form;
    const Csg *csg = csg_data(prim);
    if (csg) return csg_bundle(b, csg);
    if (form == FORM_TORUS) return torus_alone(b, prim);
    if (form != FORM_OTHER) return form_alone(b, form);
    Stretch in_box;
    Box bounds = prim->ops->bounds(prim);
    return box_alone(b, &bounds, &in_box);
}

static void at_solid(Walk *w, uint32_t index, uint64_t rays, bool any)
{
    const Object *object = &w->world->objects[index];
    uint64_t doubt = 0;
    Bundle b;
    b.w = w;
    b.index = index;
    b.any = any;
    while (rays) {
        b.at = (uint32_t)__builtin_ctzll(rays) & ~((uint32_t)DOUBLES - 1);
        b.rays = (uint32_t)(rays >> b.at) & ALL_DOUBLES;
        rays &= ~((uint64_t)ALL_DOUBLES << b.at);
        for (uint32_t left = b.rays; left; left &= left - 1) {
            uint32_t k = (uint32_t)__builtin_ctz(left);
            if (is_plain(w, b.at + k)) continue;
            b.rays &= ~(1u << k);
            doubt |= (uint64_t)1 << (b.at + k);
        }
        if (!b.rays) continue;
        bundle_load(&b, object);
        doubt |= (uint64_t)at_bundle(&b, object->prim) << b.at;
    }
    if (doubt) at_prim(w, index, doubt, any);
}

#endif
