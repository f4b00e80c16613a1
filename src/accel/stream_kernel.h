/* A kernel that traces streams, for the instruction set that the including file has wrapped: LANES rays at once (Lanes,
 * Mask), a node's eight boxes at once (Eight), a block's four triangles at once (Four).
 *
 * Everything on the way is in float and keeps its distance from a decision: a box test is generous, and a triangle is
 * passed over, taken, or left in doubt, by margins that cover all roundings (below). What is in doubt is decided in
 * double by hit_triangle, as in the scalar kernel; what is taken needs only its t, u, v computed in double, once for
 * each ray, at its end. So hits are the same bits in every kernel, fused operations or not.
 *
 * Rays that follow each other in a stream are near each other. Groups of GROUP whose directions are near each other go as
 * packets: a node is fetched once for all, and a child that no ray can meet is found out by one test of the intervals
 * that their origins and directions span (Wald, Benthin, Boulos, "Getting rid of packets", 2008; Boulos et al.,
 * "Packet-based Whitted and distribution ray tracing", 2007). Other groups go ray by ray, eight boxes at once. */
#ifndef RT_ACCEL_STREAM_KERNEL_H
#define RT_ACCEL_STREAM_KERNEL_H

#include "accel/kernel.h"
#include "accel/mesh_data.h"
#include "accel/traverse.h"

enum {
    GROUP = 64,
    FEW = 3,   /* rays that are cheaper alone than as a packet */
};

/* What float's rounding does to a relative value. */
#define FLOAT_ROUNDOFF 0x1p-24f

/* Rays whose origin is farther than this go to the scalar kernel: products with 1 / SLAB_PARALLEL must stay finite. */
#define REACH_GREATEST 0x1p40f

/* ---- margins ----
 *
 * Let e be FLOAT_ROUNDOFF, o be off by at most o_err in each component and d by d_err in the sum of its components, S bound
 * the sum of the magnitudes of d's components, R the components of the vertices relative to the origin, E those of a
 * triangle's edges. Summing first-order errors of inputs and roundings (unfused; a fused operation has fewer):
 *   C = v - o             off by o_err + 2 e R
 *   Q = C x d             off by 2 S C_err + 2 R d_err + 4 e R S, at most 2 R S, in the sums of its components
 *   U = Q e2, V = -Q e1   off by E (2 S o_err + 16 e R S + 2 R d_err)
 *   n = e1 x e2           off by 8 e E^2, at most 2 E^2
 *   det = d n             off by E^2 (14 e S + 2 d_err), at most 2 E^2 S
 *   T = C n               off by E^2 (6 o_err + 54 e R)
 * where the hit is at t = T / det with the weights U / det and V / det of the second and third vertex. Rays from one
 * origin share C, and so P = e2 x C, off by E (2 C_err + 6 e R), and U = d P, off by no more than above.
 *
 * t is T times the rounded reciprocal of det, and then bounds are one more rounding away: 3 e t in all, which 6 e S more
 * for det cover. */
typedef struct { float edge, det, t; } Margins;  /* to be multiplied by E, E^2, E^2 */

/* Second-order terms, and the roundings of the margins themselves. */
#define MARGIN_SLACK 1.0625f

static inline Margins margins_of(float o_err, float d_err, float d_sum, float reach)
{
    const float e = FLOAT_ROUNDOFF;
    return (Margins){MARGIN_SLACK * (2 * d_sum * o_err + 16 * e * reach * d_sum + 2 * reach * d_err),
                     MARGIN_SLACK * (20 * e * d_sum + 2 * d_err), MARGIN_SLACK * (6 * o_err + 54 * e * reach)};
}

/* The slabs: with r = 1 / d off by 2.1 e, t = p r - o r has errors of 5.2 e (|p| + |o|) |r| in all. */
#define PLANE_SLACK (6 * FLOAT_ROUNDOFF)

/* ---- rays in a space ---- */

/* The group's rays in the world's or an object's space, directions about 1 long in the world. */
typedef struct {
    _Alignas(64) float o[3][GROUP];
    float d[3][GROUP], r[3][GROUP];            /* r = 1 / d */
    float near_c[3][GROUP], far_c[3][GROUP];   /* a plane p is entered at p r - near_c or later, left by p r - far_c */
    float shift[GROUP];                        /* t of the origins on the rays as given; the t below are beyond that */
    float tmin[GROUP];                         /* rounded down, for boxes */
    float tmax[GROUP];                         /* of the ray or the nearest hit so far, rounded up */
    float tmin_up[GROUP], end_down[GROUP];     /* the ray's own interval, rounded inward */
    float best_low[GROUP];                     /* of the nearest hit so far, rounded down; infinite without one */
    float reach;                               /* greatest coordinate of an origin */
    float slack;                               /* how far a plane's place may be off */
    float d_sum, o_err, d_err;                 /* see margins_of */
    bool packet;                               /* what follows is that of the packet that is being walked */
    bool one_origin;
    uint32_t negative[3];                      /* the octant of the packet that is being walked */
    float first_o[3], last_o[3], r_low[3], r_high[3], slack_t[3];
} Space;

/* A sure hit that may be the nearest of its ray. */
typedef struct { uint32_t lane, object, triangle; } Waiting;

enum { WAITING = 4 * GROUP };

/* Rays as they were given, in double; room for a vector at the end. */
typedef struct {
    _Alignas(64) double o[3][GROUP + DOUBLES], d[3][GROUP + DOUBLES];  /* d about 1 long */
    double per_scale[GROUP + DOUBLES], tmax[GROUP + DOUBLES];          /* tmax in the units of d */
} Columns;

/* A group of rays on their way through the world. t is in units of 1 / scale of its ray. */
typedef struct {
    const World *world;
    Scratch *scratch;
    const Ray *ray;
    const LeftFace *left;                /* NULL: none */
    uint32_t count;
    uint64_t alive;                      /* of occlusion rays: not blocked yet */
    uint64_t exact;                      /* the nearest hit so far is known in double: hit[] */
    _Alignas(64) uint32_t object[GROUP]; /* of the nearest hit so far */
    uint32_t triangle[GROUP];
    Hit *hit;                            /* the caller's, of the nearest hits that are known in double */
    Columns given;
    bool from_end;                       /* the spaces' rays run the other way, from the end of those given; those that
                                            begin at 0 span the same t either way */
    float world_reach;
    uint32_t waiting_count;
    Waiting waiting[WAITING];
    Space space;
} Walk;

static inline Lanes at_lane(const float *p, uint32_t i) { return *(const Lanes *)(p + i); }

enum { LANE_BITS = LANES == 16 ? 0xffff : (1 << LANES) - 1 };

static inline uint64_t group_all(uint32_t n) { return n == 64 ? UINT64_MAX : ((uint64_t)1 << n) - 1; }

/* r, near_c and far_c of all lanes of an axis; directions of less than `parallel` count as that. */
static inline __attribute__((always_inline)) void space_slabs(Space *s, int a, float parallel, uint32_t at)
{
    Lanes d = at_lane(s->d[a], at), size = lanes_max(lanes_abs(d), lanes_set(parallel));
    Lanes r = lanes_flip(lanes_set(1) / size, lanes_sign(d)), slack = lanes_abs(r) * lanes_set(s->slack);
    Lanes c = at_lane(s->o[a], at) * r;
    *(Lanes *)(s->r[a] + at) = r;
    *(Lanes *)(s->near_c[a] + at) = c + slack;
    *(Lanes *)(s->far_c[a] + at) = c - slack;
}

/* The sums of the directions' components, with two roundings. */
static inline Lanes space_sum(const Space *s, uint32_t at)
{
    return lanes_abs(at_lane(s->d[0], at)) + lanes_abs(at_lane(s->d[1], at)) + lanes_abs(at_lane(s->d[2], at));
}

/* The greatest component of a direction must be between these; then its power of two is a normal number. */
#define DIRECTION_LEAST 0x1p-1000
#define DIRECTION_GREATEST 0x1p1000

_Static_assert(sizeof(Ray) == 8 * sizeof(double), "a ray is eight doubles: o, d, tmin, tmax");

/* Rays of a later group are on their way while this one's are traced; a few at a time, which takes no room from what the
 * trace itself waits for: when hits are settled, else when rays are loaded. */
static inline void prefetch_rays(const Ray *ray, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) __builtin_prefetch(&ray[2 * GROUP + i]);
}

/* A direction whose components were floats once is off by a rounding of up to two reaches, so that two such ends may be
 * four roundings of the reach apart; as much is spared for what else was rounded. Margins grow with it. */
#define END_SPREAD 8

/* The rays' numbers as floats in arrays; false if a direction or an origin is out of reach. With `from_end` each ray runs
 * the other way, from its end, whose place is off by fewer roundings in double than floats can tell; that is false if the
 * ends are not one to within END_SPREAD roundings of a float. */
static inline __attribute__((always_inline)) bool walk_load(Walk *w, const Ray *ray, uint32_t n, bool any, bool from_end)
{
    Space *s = &w->space;
    Doubles far = doubles_set(0), low[3], high[3];
    for (int a = 0; a < 3; a++) {
        low[a] = doubles_set((double)INFINITY);
        high[a] = doubles_set((double)-INFINITY);
    }
    uint32_t odd = 0;
    uint32_t end = (n + LANES - 1) / LANES * LANES;  /* lanes beyond the last repeat the first ray */
    for (uint32_t i = 0; i < end; i += DOUBLES) {
        Ray padded[DOUBLES];
        const Ray *from = ray + i;
        if (i + DOUBLES > n) {
            for (uint32_t k = 0; k < DOUBLES; k++) padded[k] = ray[i + k < n ? i + k : 0];
            from = padded;
        }
        Doubles f[8], scale;
        if (any) prefetch_rays(ray + i, DOUBLES);
        doubles_fields((const double *)from, f);
        Doubles most = doubles_max(doubles_abs(f[3]), doubles_max(doubles_abs(f[4]), doubles_abs(f[5])));
        odd |= ~(doubles_lt(most, doubles_set(DIRECTION_GREATEST)) & doubles_lt(doubles_set(DIRECTION_LEAST), most));
        Doubles per_scale = doubles_power(most, &scale);
        far = doubles_max(far, doubles_max(doubles_abs(f[0]), doubles_max(doubles_abs(f[1]), doubles_abs(f[2]))));
        Doubles tmin = f[6] * per_scale, tmax = f[7] * per_scale;
        *(Doubles *)(w->given.tmax + i) = tmax;
        for (int a = 0; a < 3; a++) {
            Doubles d = f[3 + a] * scale;
            *(Doubles *)(w->given.o[a] + i) = f[a];
            *(Doubles *)(w->given.d[a] + i) = d;
            if (from_end) {
                f[a] = f[a] + tmax * d;
                d = -d;
                low[a] = doubles_min(low[a], f[a]);
                high[a] = doubles_max(high[a], f[a]);
            }
            doubles_to_floats(s->o[a] + i, f[a]);
            doubles_to_floats(s->d[a] + i, d);
        }
        if (from_end) {
            odd |= ~doubles_lt(f[7], doubles_set((double)INFINITY));
            far = doubles_max(far, doubles_max(doubles_abs(f[0]), doubles_max(doubles_abs(f[1]), doubles_abs(f[2]))));
            tmax = tmax - doubles_max(tmin, doubles_set(0));
            tmin = doubles_set(0);
        }
        *(Doubles *)(w->given.per_scale + i) = per_scale;
        doubles_to_floats(s->tmin + i, tmin);
        doubles_to_floats(s->tmax + i, tmax);
    }
    if (odd & ((1u << DOUBLES) - 1)) return false;
    double most = 0;
    for (int k = 0; k < DOUBLES; k++) most = far[k] > most ? far[k] : most;
    s->reach = slab_up((float)most);
    s->o_err = FLOAT_ROUNDOFF * s->reach;
    if (from_end) {
        double apart = 0;
        for (int a = 0; a < 3; a++) {
            double least = (double)INFINITY, greatest = (double)-INFINITY;
            for (int k = 0; k < DOUBLES; k++) {
                least = low[a][k] < least ? low[a][k] : least;
                greatest = high[a][k] > greatest ? high[a][k] : greatest;
            }
            if (!(greatest - least <= END_SPREAD * (double)s->o_err)) return false;
            apart = greatest - least > apart ? greatest - least : apart;
            for (uint32_t at = 0; at < n; at += LANES) *(Lanes *)(s->o[a] + at) = lanes_set((float)least);
        }
        s->o_err += slab_up((float)apart);
    }
    return s->reach < REACH_GREATEST;
}

/* Fills everything from n rays; false if one of them is out of floats' reach. Occlusion rays to one light are traced from
 * there, as that makes them rays from one origin. */
static bool walk_init(Walk *w, const World *world, const Ray *ray, uint32_t n, bool any)
{
    Space *s = &w->space;
    w->ray = ray;
    w->count = n;
    w->alive = group_all(n);
    w->exact = 0;
    w->waiting_count = 0;
    w->from_end = any && walk_load(w, ray, n, true, true);
    if (!w->from_end && !walk_load(w, ray, n, any, false)) return false;
    float boxes = 0;
    for (int a = 0; a < 3; a++) {
        float lo = fabsf(world->bvh.bounds.lo[a]), hi = fabsf(world->bvh.bounds.hi[a]), most = lo > hi ? lo : hi;
        boxes = most > boxes ? most : boxes;
    }
    w->world_reach = boxes;
    s->slack = PLANE_SLACK * (s->reach + boxes) + s->o_err;
    Lanes sum = lanes_set(0);
    const Lanes zero = lanes_set(0), most = lanes_set(INFINITY), tiny = lanes_set(0x1p-126f), ulp = lanes_set(0x1p-23f);
    for (uint32_t at = 0; at < n; at += LANES) {
        Lanes tmin = lanes_max(zero, at_lane(s->tmin, at)), tmax = at_lane(s->tmax, at);
        Lanes off = lanes_fma(tmin, ulp, tiny), end_off = lanes_fma(lanes_abs(tmax), ulp, tiny);
        Mask ends = lanes_lt(tmax, most);
        *(Lanes *)(s->shift + at) = zero;
        *(Lanes *)(s->tmin + at) = lanes_max(zero, tmin - off);
        *(Lanes *)(s->tmin_up + at) = tmin + off;
        *(Lanes *)(s->tmax + at) = tmax + end_off;
        *(Lanes *)(s->end_down + at) = lanes_pick(ends, tmax - end_off, most);
        *(Lanes *)(s->best_low + at) = most;
        *(LanesInt *)(w->object + at) = lanes_set_int(HIT_NONE);
        for (int a = 0; a < 3; a++) space_slabs(s, a, SLAB_PARALLEL, at);
        sum = lanes_max(sum, space_sum(s, at));
    }
    s->d_sum = slab_up(slab_up(lanes_greatest(sum)));
    s->d_err = FLOAT_ROUNDOFF * s->d_sum;
    return true;
}

/* Vectors of several rays. */
typedef struct { Doubles x, y, z; } Vecs;

static inline __attribute__((always_inline)) Vecs vecs_column(double (*p)[GROUP + DOUBLES], uint32_t k)
{
    return (Vecs){*(Doubles *)(p[0] + k), *(Doubles *)(p[1] + k), *(Doubles *)(p[2] + k)};
}

/* The scale of a map that does nothing but multiply by a power of two that keeps floats in reach; 0 for any other. */
static float power_map(const Object *object)
{
    const double (*m)[4] = object->to_object.m;
    int e;
    if (m[0][0] != m[1][1] || m[0][0] != m[2][2] || frexp(m[0][0], &e) != 0.5 || e < -20 || e > 20) return 0;
    for (int a = 0; a < 3; a++)
        for (int j = 0; j < 4; j++)
            if (a != j && m[a][j] != 0) return 0;
    return (float)m[0][0];
}

/* The rays, and the packet of the world that they are from, in the space of an object with such a map: all is exact, t
 * unchanged. */
static void scaled_space(const Walk *w, float scale, Space *s)
{
    const Space *from = &w->space;
    const Lanes k = lanes_set(scale), per = lanes_set(1 / scale), zero = lanes_set(0);
    for (uint32_t at = 0; at < w->count; at += LANES) {
        for (int a = 0; a < 3; a++) {
            *(Lanes *)(s->o[a] + at) = k * at_lane(from->o[a], at);
            *(Lanes *)(s->d[a] + at) = k * at_lane(from->d[a], at);
            *(Lanes *)(s->r[a] + at) = per * at_lane(from->r[a], at);
            *(Lanes *)(s->near_c[a] + at) = at_lane(from->near_c[a], at);
            *(Lanes *)(s->far_c[a] + at) = at_lane(from->far_c[a], at);
        }
        *(Lanes *)(s->shift + at) = zero;
        *(Lanes *)(s->tmin + at) = at_lane(from->tmin, at);
        *(Lanes *)(s->tmax + at) = at_lane(from->tmax, at);
        *(Lanes *)(s->tmin_up + at) = at_lane(from->tmin_up, at);
        *(Lanes *)(s->end_down + at) = at_lane(from->end_down, at);
        *(Lanes *)(s->best_low + at) = at_lane(from->best_low, at);
    }
    s->packet = true;
    s->one_origin = from->one_origin;
    for (int a = 0; a < 3; a++) {
        s->negative[a] = from->negative[a];
        s->first_o[a] = scale * from->first_o[a];
        s->last_o[a] = scale * from->last_o[a];
        s->r_low[a] = from->r_low[a] / scale;
        s->r_high[a] = from->r_high[a] / scale;
        s->slack_t[a] = from->slack_t[a];
    }
    s->reach = scale * from->reach;
    s->slack = scale * from->slack;
    s->d_sum = scale * from->d_sum;
    s->o_err = scale * from->o_err;
    s->d_err = scale * from->d_err;
}

/* What the double-precision map of a ray may be off, relative to the terms of its sums: the entry of the map, the product,
 * three sums and the shift; three times that, on twice the way, for a ray from its end; and some to spare, 2^-53 each. */
#define MAP_ROUNDOFF 0x1p-48f

/* The same of the map in float, in units of FLOAT_ROUNDOFF: the entry, the coordinate, the product, three sums, one to
 * spare. */
#define FLOAT_MAP_ROUNDOFFS 7

/* The greatest coordinate of the terms that make up the image of an origin. */
static inline float view_far(const ObjectView *v, const Space *from) { return v->size * from->reach + v->offset; }

/* Maps into objects so small beside the world are too much for floats. */
#define VIEW_GREATEST 0x1p60f

static inline bool view_is_in_reach(const ObjectView *v) { return v->size < VIEW_GREATEST && v->offset < VIEW_GREATEST; }

/* Which rays meet an object's own box, which fits a turned object better than the one in the tree, and where. They are
 * mapped in float: at a t up to `way`, beyond which no object is, a place is off by roundings of the origin's image and by
 * t times those of the direction's, whose components are below 2; boxes are widened by that. */
static inline __attribute__((always_inline)) uint64_t object_meets(const Walk *w, const ObjectView *v, uint64_t rays,
                                                                   float *shift)
{
    const Space *from = &w->space;
    float far = view_far(v, from), way = from->reach + w->world_reach;
    float map_err = FLOAT_MAP_ROUNDOFFS * FLOAT_ROUNDOFF * (far + 2 * way * v->size) + v->size * from->o_err;
    Lanes slack = lanes_set((PLANE_SLACK * (far + v->reach) + map_err) * MARGIN_SLACK);
    uint64_t met = 0;
    for (uint32_t at = 0; at < w->count; at += LANES) {
        if (!(rays >> at & LANE_BITS)) continue;
        Lanes enter = at_lane(from->tmin, at), leave = at_lane(from->tmax, at);
        for (int a = 0; a < 3; a++) {
            Lanes o = lanes_set(v->m[a][3]), d = lanes_set(v->m[a][0]) * at_lane(from->d[0], at);
            for (int j = 0; j < 3; j++) o = lanes_fma(lanes_set(v->m[a][j]), at_lane(from->o[j], at), o);
            for (int j = 1; j < 3; j++) d = lanes_fma(lanes_set(v->m[a][j]), at_lane(from->d[j], at), d);
            Lanes r = lanes_flip(lanes_set(1) / lanes_max(lanes_abs(d), lanes_set(v->least_d[a])), lanes_sign(d));
            Lanes c = o * r, off = lanes_abs(r) * slack, x = lanes_set(v->lo[a]) * r, y = lanes_set(v->hi[a]) * r;
            enter = lanes_max(enter, lanes_min(x, y) - (c + off));
            leave = lanes_min(leave, lanes_max(x, y) - (c - off));
        }
        Mask in = lanes_le(enter, leave);
        *(Lanes *)(shift + at) = lanes_pick(in, enter, lanes_set(0));
        met |= (uint64_t)mask_bits(in) << at;
    }
    return met & rays;
}

/* Rays in an object's own space, mapped in double, t unchanged. Their origins are moved to where they meet its box, the
 * shift, so that what follows, in float, is as fine as the object is small, and not as the world is large. */
static void object_space(const Walk *w, const Object *object, const ObjectView *v, uint64_t rays, Space *s)
{
    const Space *from = &w->space;
    const double (*m)[4] = object->to_object.m;
    float way = from->reach + w->world_reach;
    float d_most = 2 * slab_up(v->size), map_err = MAP_ROUNDOFF * (view_far(v, from) + 2 * way * d_most);
    Lanes reach = lanes_set(0), sum_d = lanes_set(0);
    s->packet = false;
    for (uint32_t at = 0; at < w->count; at += LANES) {
        uint32_t bits = (uint32_t)(rays >> at) & LANE_BITS;
        if (!bits) continue;
        for (uint32_t k = 0; k < LANES; k += DOUBLES) {
            if (!(bits >> k & ((1u << DOUBLES) - 1))) continue;
            Doubles shift = doubles_of_floats(s->shift + at + k);
            for (int a = 0; a < 3; a++) {
                Doubles o = doubles_set(m[a][3]), d = doubles_set(m[a][0]) * *(const Doubles *)(w->given.d[0] + at + k);
                for (int j = 0; j < 3; j++) o = o + doubles_set(m[a][j]) * *(const Doubles *)(w->given.o[j] + at + k);
                for (int j = 1; j < 3; j++) d = d + doubles_set(m[a][j]) * *(const Doubles *)(w->given.d[j] + at + k);
                if (w->from_end) {
                    o = o + *(const Doubles *)(w->given.tmax + at + k) * d;
                    d = -d;
                }
                doubles_to_floats(s->o[a] + at + k, o + shift * d);
                doubles_to_floats(s->d[a] + at + k, d);
            }
        }
        Mask in = mask_of(bits);
        for (int a = 0; a < 3; a++) reach = lanes_max(reach, lanes_pick(in, lanes_abs(at_lane(s->o[a], at)), reach));
        sum_d = lanes_max(sum_d, lanes_pick(in, space_sum(s, at), sum_d));
        /* t - shift has one rounding */
        Lanes shift = at_lane(s->shift, at), tmin = at_lane(from->tmin, at) - shift;
        Lanes tmin_up = at_lane(from->tmin_up, at) - shift;
        Lanes tmax = at_lane(from->tmax, at) - shift, end = at_lane(from->end_down, at) - shift;
        Lanes low = at_lane(from->best_low, at) - shift, ulp = lanes_set(0x1p-23f), back = lanes_set(-0x1p-23f);
        *(Lanes *)(s->tmin + at) = lanes_fma(lanes_abs(tmin), back, tmin);
        *(Lanes *)(s->tmin_up + at) = lanes_fma(lanes_abs(tmin_up), ulp, tmin_up);
        *(Lanes *)(s->tmax + at) = lanes_fma(lanes_abs(tmax), ulp, tmax);
        Mask ends = lanes_lt(end, lanes_set(INFINITY)), known = lanes_lt(low, lanes_set(INFINITY));
        *(Lanes *)(s->end_down + at) = lanes_pick(ends, lanes_fma(lanes_abs(end), back, end), end);
        *(Lanes *)(s->best_low + at) = lanes_pick(known, lanes_fma(lanes_abs(low), back, low), low);
    }
    s->reach = slab_up(lanes_greatest(reach));
    s->o_err = FLOAT_ROUNDOFF * s->reach + map_err;
    s->d_sum = slab_up(slab_up(lanes_greatest(sum_d)));
    s->d_err = FLOAT_ROUNDOFF * s->d_sum + 3 * MAP_ROUNDOFF * d_most;
    s->slack = PLANE_SLACK * (s->reach + v->reach) + map_err;
    for (uint32_t at = 0; at < w->count; at += LANES)
        for (int a = 0; a < 3; a++)
            if (rays >> at & LANE_BITS) space_slabs(s, a, v->least_d[a], at);
}

/* What was found in an object's space becomes known in the world's; `waited`: what waited before. */
static void leave_space(Walk *w, const Space *s, uint32_t index, uint64_t rays, uint32_t waited)
{
    bool more = w->waiting_count > waited;
    for (; rays; rays &= rays - 1) {
        uint32_t i = (uint32_t)__builtin_ctzll(rays);
        if (w->object[i] != index && !more) continue;
        float tmax = slab_up(s->tmax[i] + s->shift[i]), low = slab_down(s->best_low[i] + s->shift[i]);
        w->space.tmax[i] = tmax < w->space.tmax[i] ? tmax : w->space.tmax[i];
        w->space.best_low[i] = low < w->space.best_low[i] ? low : w->space.best_low[i];
    }
}

/* ---- hits in double ---- */

/* Whether ray i hits a triangle; t, u, v and part of *hit are filled. */
static bool hit_exactly(const Walk *w, uint32_t i, uint32_t object, const MeshPrim *mesh, uint32_t triangle, Hit *hit)
{
    Ray local = ray_to_object(&w->world->objects[object], &w->ray[i]);
    const uint32_t *k = mesh->triangle[triangle];
    const Vec3 *a = &mesh->position[k[0]], *b = &mesh->position[k[1]], *c = &mesh->position[k[2]];
    if (local.tmin >= 0 && plane_behind(&local, a, b, c)) return false;
    Shear shear = shear_of(&local);
    TriangleCut cut;
    if (!triangle_cut(&shear, a, b, c, &cut)) return false;
    TriangleSpan span = triangle_span(&shear, &cut);
    if (!(span.hi > local.tmin) || !(span.lo <= local.tmax)) return false;
    double err, t = triangle_t(&shear, a, b, c, &err);
    *hit = (Hit){t, cut.u, cut.v, triangle, part_of(mesh, triangle), object};
    return t > local.tmin && t <= local.tmax;
}

static const MeshPrim *mesh_of(const Walk *w, uint32_t object) { return mesh_prim_data(w->world->objects[object].prim); }

/* Of equal t that of the least object, then part, counts. */
static inline bool is_nearer(const Hit *a, const Hit *b)
{
    if (a->t != b->t) return a->t < b->t;
    return a->object < b->object || (a->object == b->object && a->part < b->part);
}

static void take_hit(Walk *w, uint32_t i, const Hit *hit)
{
    w->hit[i] = *hit;
    w->object[i] = hit->object;
    w->triangle[i] = hit->part;
    w->exact |= (uint64_t)1 << i;
}

/* Computes the nearest hit so far in double. */
static void settle(Walk *w, uint32_t i)
{
    if (w->exact >> i & 1) return;
    hit_exactly(w, i, w->object[i], mesh_of(w, w->object[i]), w->triangle[i], &w->hit[i]);
    w->exact |= (uint64_t)1 << i;
}

/* A hit in double, found in s, that may be the nearest. */
static void offer(Walk *w, Space *s, uint32_t i, const Hit *hit)
{
    float t = (float)(hit->t * w->given.per_scale[i] - (double)s->shift[i]);
    if (w->object[i] != HIT_NONE && slab_up(t) >= s->best_low[i]) {
        settle(w, i);
        if (!is_nearer(hit, &w->hit[i])) return;
    }
    take_hit(w, i, hit);
    s->tmax[i] = slab_up(t);
    s->best_low[i] = slab_down(t);
}

/* ---- triangles ---- */

/* What a walk over the triangles of one object needs. */
typedef struct {
    Walk *w;
    Space *space;
    const MeshPrim *mesh;
    uint32_t object;
    Margins margins;
    bool any;            /* occlusion */
} Target;

/* Has a triangle wait that ray i surely hits, between two t, if there is room: then it is compared with the nearest hit at
 * the end. Surfaces that lie in each other are all found by every ray, and computing several hits at once costs far less.
 */
static inline bool can_wait(const Target *g, uint32_t i, uint32_t triangle, float t_low, float t_high)
{
    Walk *w = g->w;
    Space *s = g->space;
    if (g->any || w->object[i] == HIT_NONE) return false;
    if (w->object[i] == g->object && w->triangle[i] == triangle) return true;
    if (w->waiting_count == WAITING) return false;
    w->waiting[w->waiting_count++] = (Waiting){i, g->object, triangle};
    s->tmax[i] = t_high < s->tmax[i] ? t_high : s->tmax[i];
    s->best_low[i] = t_low < s->best_low[i] ? t_low : s->best_low[i];
    return true;
}

/* A triangle in doubt for ray i. */
static void decide(const Target *g, uint32_t i, uint32_t triangle)
{
    Walk *w = g->w;
    if (!g->any && w->object[i] == g->object && w->triangle[i] == triangle) return;
    if (w->left && w->left[i].part == triangle && w->left[i].object == g->object) return;
    Hit hit;
    if (!hit_exactly(w, i, g->object, g->mesh, triangle, &hit)) return;
    if (g->any)
        w->alive &= ~((uint64_t)1 << i);
    else
        offer(w, g->space, i, &hit);
}

/* Four triangles of a block, with their margins. */
typedef struct { Four mu, md, mt, rim; } FourMargins;

static inline __attribute__((always_inline)) FourMargins four_margins(const Target *g, const MeshBlock *b)
{
    Four edge = four_load(b->edge), tiny = four_set(FILTER_UNDERFLOW), edge2 = edge * edge;
    Four mu = four_fma(four_set(g->margins.edge), edge, tiny), md = four_fma(four_set(g->margins.det), edge2, tiny);
    return (FourMargins){mu, md, four_fma(four_set(g->margins.t), edge2, tiny), four_fma(four_set(2), mu, md)};
}

typedef struct { Four x, y, z; } FourVecs;

static inline __attribute__((always_inline)) FourVecs fours_load(const float *p)
{
    return (FourVecs){four_load(p), four_load(p + BLOCK), four_load(p + 2 * BLOCK)};
}

static inline __attribute__((always_inline)) FourVecs fours_set(const float *p, uint32_t i)
{
    return (FourVecs){four_set(p[i]), four_set(p[GROUP + i]), four_set(p[2 * GROUP + i])};
}

static inline __attribute__((always_inline)) FourVecs fours_cross(FourVecs a, FourVecs b)
{
    return (FourVecs){four_fms(a.y, b.z, a.z * b.y), four_fms(a.z, b.x, a.x * b.z), four_fms(a.x, b.y, a.y * b.x)};
}

static inline __attribute__((always_inline)) Four fours_dot(FourVecs a, FourVecs b)
{
    return four_fma(a.x, b.x, four_fma(a.y, b.y, a.z * b.z));
}

static inline __attribute__((always_inline)) FourVecs fours_from(FourVecs v, FourVecs o)
{
    return (FourVecs){v.x - o.x, v.y - o.y, v.z - o.z};
}

/* A block as rays from one origin see it: det = d n, U = d p, -V = d q, T. */
typedef struct {
    _Alignas(16) float n[3][BLOCK], p[3][BLOCK], q[3][BLOCK], t[BLOCK], mu[BLOCK], md[BLOCK], mt[BLOCK];
} BlockView;

static inline __attribute__((always_inline)) void fours_store(float (*to)[BLOCK], FourVecs v)
{
    four_store(to[0], v.x), four_store(to[1], v.y), four_store(to[2], v.z);
}

static inline __attribute__((always_inline)) void block_view(const Target *g, const MeshBlock *b, uint32_t i,
                                                             BlockView *view)
{
    FourVecs e1 = fours_load(b->e1[0]), e2 = fours_load(b->e2[0]), n = fours_cross(e1, e2);
    FourVecs c = fours_from(fours_load(b->v[0]), fours_set(g->space->o[0], i));
    FourMargins m = four_margins(g, b);
    fours_store(view->n, n);
    fours_store(view->p, fours_cross(e2, c));
    fours_store(view->q, fours_cross(e1, c));
    four_store(view->t, fours_dot(c, n));
    four_store(view->mu, m.mu), four_store(view->md, m.md), four_store(view->mt, m.mt);
}

/* What LANES rays have with one triangle. */
typedef struct { Lanes det, u, minus_v, t; } LanesCut;

typedef struct { Lanes x, y, z; } LanesVecs;

static inline __attribute__((always_inline)) LanesVecs rows_at(const float *p, uint32_t at)
{
    return (LanesVecs){at_lane(p, at), at_lane(p + GROUP, at), at_lane(p + 2 * GROUP, at)};
}

static inline __attribute__((always_inline)) Lanes rows_dot(LanesVecs a, const float *p, uint32_t j)
{
    return lanes_fma(a.x, lanes_set(p[j]), lanes_fma(a.y, lanes_set(p[BLOCK + j]), a.z * lanes_set(p[2 * BLOCK + j])));
}

/* Bounds on a margin's quotient hold while the margin is at most an eighth of what it belongs to. */
#define SURE_SHARE 8

/* Takes, leaves or decides the triangle for the rays of the lanes from `at` on that are `active`, without those that are
 * then blocked. */
static inline __attribute__((always_inline)) void take_lanes(const Target *g, const MeshBlock *b, const BlockView *view,
                                                             uint32_t j, uint32_t at, Mask active, const LanesCut *cut)
{
    Walk *w = g->w;
    Space *s = g->space;
    Lanes mu = lanes_set(view->mu[j]), md = lanes_set(view->md[j]), mt = lanes_set(view->mt[j]), zero = lanes_set(0);
    Lanes sign = lanes_sign(cut->det), size = lanes_abs(cut->det);
    Lanes u = lanes_flip(cut->u, sign), minus_v = lanes_flip(cut->minus_v, sign), sum = u - minus_v;
    Lanes rim = mu + mu + md;
    Mask sided = lanes_lt(md, size);
    Mask miss = mask_or(mask_or(lanes_lt(u, zero - mu), lanes_lt(mu, minus_v)), lanes_lt(size + rim, sum));
    Mask left = mask_without(active, mask_and(sided, miss));
    if (!mask_bits(left)) return;
    Lanes t_num = lanes_flip(cut->t, sign), tmax = at_lane(s->tmax, at), tmin = at_lane(s->tmin, at);
    Mask late = mask_or(lanes_lt(lanes_fma(tmax, size, lanes_fma(tmax, md, mt)), t_num),
                        lanes_lt(t_num, lanes_fms(tmin, size, lanes_fma(tmin, md, mt))));
    left = mask_without(left, mask_and(sided, late));
    if (!mask_bits(left)) return;
    /* 1 / (size - md) is at most 8 / 7 of 1 / size here */
    Lanes per = lanes_set(1) / size, t = t_num * per;
    Lanes t_err = lanes_fma(lanes_abs(t), md, mt) * per, worse = lanes_fma(md * per, lanes_set(8.0f / 7), lanes_set(1));
    t_err = t_err * (worse * lanes_set(MARGIN_SLACK));
    Lanes t_low = t - t_err, t_high = t + t_err;
    Mask sure = mask_and(mask_and(lanes_lt(mu, u), lanes_lt(minus_v, zero - mu)), lanes_lt(sum, size - rim));
    sure = mask_and(mask_and(sure, lanes_lt(lanes_set(SURE_SHARE) * md, size)), left);
    sure = mask_and(sure, mask_and(lanes_lt(at_lane(s->tmin_up, at), t_low), lanes_lt(t_high, at_lane(s->end_down, at))));
    uint32_t hits = mask_bits(sure);
    if (g->any) {
        w->alive &= ~((uint64_t)mask_bits(sure) << at);
    } else {
        Lanes best_low = at_lane(s->best_low, at);
        sure = mask_and(sure, lanes_lt(t_high, best_low));
        *(Lanes *)(s->tmax + at) = lanes_pick(sure, t_high, tmax);
        *(Lanes *)(s->best_low + at) = lanes_pick(sure, t_low, best_low);
        LanesInt *object = (LanesInt *)(w->object + at), *triangle = (LanesInt *)(w->triangle + at);
        *object = lanes_pick_int(sure, lanes_set_int(g->object), *object);
        *triangle = lanes_pick_int(sure, lanes_set_int(b->triangle[j]), *triangle);
        w->exact &= ~((uint64_t)mask_bits(sure) << at);
        __builtin_prefetch(g->mesh->triangle[b->triangle[j]]);
    }
    for (uint32_t doubt = mask_bits(mask_without(left, sure)); doubt; doubt &= doubt - 1) {
        uint32_t k = (uint32_t)__builtin_ctz(doubt);
        if (!(hits >> k & 1) || !can_wait(g, at + k, b->triangle[j], t_low[k], t_high[k]))
            decide(g, at + k, b->triangle[j]);
    }
}

/* Many rays against a block, one triangle after the other. */
static inline __attribute__((always_inline)) void block_by_triangles(const Target *g, const MeshBlock *b,
                                                                     const BlockView *view, uint64_t rays, bool one_origin)
{
    const Space *s = g->space;
    for (uint32_t j = 0; j < b->count; j++)
        for (uint32_t at = 0; at < GROUP; at += LANES) {
            uint32_t active = (uint32_t)((g->any ? rays & g->w->alive : rays) >> at) & LANE_BITS;
            if (!active) continue;
            LanesVecs d = rows_at(s->d[0], at);
            LanesCut cut = {.det = rows_dot(d, view->n[0], j)};
            if (one_origin) {
                cut.u = rows_dot(d, view->p[0], j);
                cut.minus_v = rows_dot(d, view->q[0], j);
                cut.t = lanes_set(view->t[j]);
            } else {
                LanesVecs o = rows_at(s->o[0], at);
                LanesVecs c = {lanes_set(b->v[0][j]) - o.x, lanes_set(b->v[1][j]) - o.y, lanes_set(b->v[2][j]) - o.z};
                LanesVecs q = {lanes_fms(c.y, d.z, c.z * d.y), lanes_fms(c.z, d.x, c.x * d.z),
                               lanes_fms(c.x, d.y, c.y * d.x)};
                cut.u = rows_dot(q, b->e2[0], j);
                cut.minus_v = rows_dot(q, b->e1[0], j);
                cut.t = rows_dot(c, view->n[0], j);
            }
            take_lanes(g, b, view, j, at, mask_of(active), &cut);
        }
}

/* What a ray has with the four triangles of a block. */
typedef struct { Four det, u, minus_v, t; } FourCut;

/* False if the ray is blocked. */
static inline __attribute__((always_inline)) bool take_four(const Target *g, const MeshBlock *b, const FourMargins *m,
                                                            uint32_t i, const FourCut *cut)
{
    Walk *w = g->w;
    Space *s = g->space;
    Four sign = four_sign(cut->det), size = four_abs(cut->det), u = four_flip(cut->u, sign);
    Four minus_v = four_flip(cut->minus_v, sign), sum = u - minus_v, t_num = four_flip(cut->t, sign), zero = four_set(0);
    Four tmax = four_set(s->tmax[i]), tmin = four_set(s->tmin[i]);
    uint32_t miss = four_lt(u, zero - m->mu) | four_lt(m->mu, minus_v) | four_lt(size + m->rim, sum);
    miss |= four_lt(four_fma(tmax, size, four_fma(tmax, m->md, m->mt)), t_num);
    miss |= four_lt(t_num, four_fms(tmin, size, four_fma(tmin, m->md, m->mt)));
    uint32_t left = ((1u << b->count) - 1) & ~(miss & four_lt(m->md, size));
    if (!left) return true;
    uint32_t inside = four_lt(m->mu, u) & four_lt(minus_v, zero - m->mu) & four_lt(sum, size - m->rim);
    float t_low[4], t_high[4];
    Four t = t_num / size, t_err = four_fma(four_abs(t), m->md, m->mt) / (size - m->md) * four_set(MARGIN_SLACK);
    *(Four *)t_low = t - t_err;
    *(Four *)t_high = t + t_err;
    for (; left; left &= left - 1) {
        uint32_t j = (uint32_t)__builtin_ctz(left);
        bool sure = (inside >> j & 1) && t_low[j] > s->tmin_up[i] && t_high[j] < s->end_down[i];
        if (sure && g->any) {
            w->alive &= ~((uint64_t)1 << i);
            return false;
        }
        if (sure && t_high[j] < s->best_low[i]) {
            s->tmax[i] = t_high[j];
            s->best_low[i] = t_low[j];
            w->object[i] = g->object;
            w->triangle[i] = b->triangle[j];
            w->exact &= ~((uint64_t)1 << i);
            __builtin_prefetch(g->mesh->triangle[b->triangle[j]]);
        } else if (!(t_low[j] > s->tmax[i]) && !(sure && can_wait(g, i, b->triangle[j], t_low[j], t_high[j]))) {
            decide(g, i, b->triangle[j]);
            if (g->any && !(w->alive >> i & 1)) return false;
        }
    }
    return true;
}

/* One ray against a block, its triangles at once. False if the ray is blocked. */
static inline __attribute__((always_inline)) bool block_by_rays(const Target *g, const MeshBlock *b, uint32_t i)
{
    FourVecs e1 = fours_load(b->e1[0]), e2 = fours_load(b->e2[0]), n = fours_cross(e1, e2);
    FourVecs d = fours_set(g->space->d[0], i);
    FourVecs c = fours_from(fours_load(b->v[0]), fours_set(g->space->o[0], i)), q = fours_cross(c, d);
    FourMargins m = four_margins(g, b);
    FourCut cut = {fours_dot(n, d), fours_dot(q, e2), fours_dot(q, e1), fours_dot(c, n)};
    return take_four(g, b, &m, i, &cut);
}

/* Of those from one origin. */
static inline __attribute__((always_inline)) void block_by_viewers(const Target *g, const MeshBlock *b,
                                                                   const BlockView *view, uint64_t rays)
{
    FourVecs n = fours_load(view->n[0]), p = fours_load(view->p[0]), q = fours_load(view->q[0]);
    Four t = four_load(view->t), two = four_set(2);
    FourMargins m = {four_load(view->mu), four_load(view->md), four_load(view->mt), four_set(0)};
    m.rim = four_fma(two, m.mu, m.md);
    for (; rays; rays &= rays - 1) {
        uint32_t i = (uint32_t)__builtin_ctzll(rays);
        FourVecs d = fours_set(g->space->d[0], i);
        FourCut cut = {fours_dot(n, d), fours_dot(p, d), fours_dot(q, d), t};
        take_four(g, b, &m, i, &cut);
    }
}

/* ---- single rays through a tree ---- */

/* A ray's way through a tree. What waits is in two arrays, nearer ones above: room for a whole node's children is left at
 * the end. */
typedef struct {
    uint32_t ray, top, now;         /* now: a child, being visited */
    uint32_t near_at[3];            /* of a node's planes, in floats */
    uint32_t octant, reverse;       /* of the node's four orders, and whether it is read backwards */
    float tmax;                     /* when the stack was culled last */
    float entry[SLAB_STACK + 8];
    uint32_t child[SLAB_STACK + 8];
} Turn;

static inline __attribute__((always_inline)) void turn_start(Turn *turn, const Space *s, uint32_t i, uint32_t start)
{
    uint32_t octant = 0;
    for (int a = 0; a < 3; a++) {
        uint32_t negative = s->r[a][i] < 0;
        octant |= negative << a;
        turn->near_at[a] = 24 * negative + 8 * (uint32_t)a;
    }
    turn->ray = i;
    turn->top = 0;
    turn->now = start;
    turn->reverse = octant >> 2;
    turn->octant = turn->reverse ? octant ^ 7 : octant;
    turn->tmax = s->tmax[i];
}

/* The next that waits becomes the present one; false if there is none. */
static inline bool turn_pop(Turn *turn)
{
    if (turn->top == 0) return false;
    turn->now = turn->child[--turn->top];
    return true;
}

/* Takes out what begins beyond the nearest hit, then goes on with the next. */
static inline bool turn_next(Turn *turn, const Space *s)
{
    float tmax = s->tmax[turn->ray];
    if (tmax < turn->tmax) {
        uint32_t kept = 0;
        for (uint32_t at = 0; at < turn->top; at += 8)
            kept += eight_keep(turn->entry + kept, turn->child + kept, turn->entry + at, turn->child + at,
                               turn->top - at < 8 ? turn->top - at : 8, tmax);
        turn->top = kept;
        turn->tmax = tmax;
    }
    return turn_pop(turn);
}

/* Goes on from an inner node; false at the end of the way. */
static inline __attribute__((always_inline)) bool turn_node(Turn *turn, const Bvh *bvh, const Space *s)
{
    const BvhNode *node = &bvh->node[turn->now];
    const float *plane = node->lo[0];
    const uint32_t *at = turn->near_at;
    uint32_t i = turn->ray;
    Eight rx = eight_set(s->r[0][i]), ry = eight_set(s->r[1][i]), rz = eight_set(s->r[2][i]);
    Eight x = eight_fms(eight_load(plane + at[0]), rx, eight_set(s->near_c[0][i]));
    Eight y = eight_fms(eight_load(plane + at[1]), ry, eight_set(s->near_c[1][i]));
    Eight z = eight_fms(eight_load(plane + at[2]), rz, eight_set(s->near_c[2][i]));
    Eight enter = eight_max(eight_max(x, y), eight_max(z, eight_set(s->tmin[i])));
    x = eight_fms(eight_load(plane + 24 - at[0]), rx, eight_set(s->far_c[0][i]));
    y = eight_fms(eight_load(plane + 40 - at[1]), ry, eight_set(s->far_c[1][i]));
    z = eight_fms(eight_load(plane + 56 - at[2]), rz, eight_set(s->far_c[2][i]));
    Eight leave = eight_min(eight_min(x, y), eight_min(z, eight_set(turn->tmax)));
    turn->top += eight_push(turn->entry + turn->top, turn->child + turn->top, enter, leave, node->child,
                            node->order[turn->octant], turn->reverse);
    return turn_pop(turn);
}

/* Visits the leaves below `start` that ray i meets, roughly nearer ones first, until one returns false. */
static inline __attribute__((always_inline)) bool walk_alone(const Bvh *bvh, const Space *s, uint32_t i,
                                                             uint32_t start, bool (*leaf)(void *, uint32_t, uint32_t),
                                                             void *context)
{
    Turn turn;
    turn_start(&turn, s, i, start);
    for (;;) {
        if (turn.now & BVH_LEAF) {
            if (!leaf(context, turn.now & ~BVH_LEAF, i)) return false;
            if (!turn_next(&turn, s)) return true;
        } else if (!turn_node(&turn, bvh, s)) {
            return true;
        }
    }
}

static inline bool block_leaf_alone(void *context, uint32_t block, uint32_t i)
{
    const Target *g = context;
    return block_by_rays(g, &g->mesh->block[block], i);
}

/* Several rays through a mesh, a step of each by turns: while one waits for memory or for a comparison, others go on. */
enum { TURNS_SMALL = 2, TURNS_LARGE = 4, TURNS_MOST = 4, SMALL_NODES = 8000 };

/* A node or a block; false at the end of the ray's way. */
static inline __attribute__((always_inline)) bool turn_step(Turn *turn, const Target *g)
{
    const MeshPrim *mesh = g->mesh;
    if (turn->now & BVH_LEAF) {
        if (!block_by_rays(g, &mesh->block[turn->now & ~BVH_LEAF], turn->ray) || !turn_next(turn, g->space)) return false;
    } else if (!turn_node(turn, &mesh->bvh, g->space)) {
        return false;
    }
    const char *next = turn->now & BVH_LEAF ? (const char *)&mesh->block[turn->now & ~BVH_LEAF]
                                            : (const char *)&mesh->bvh.node[turn->now];
    for (int line = 0; line < 4; line++) __builtin_prefetch(next + 64 * line);
    return true;
}

static inline __attribute__((always_inline)) void walk_by_turns(const Target *g, uint64_t rays, uint32_t turns)
{
    Turn turn[TURNS_MOST];
    uint32_t n = 0;
    for (; n < turns && rays; rays &= rays - 1)
        turn_start(&turn[n++], g->space, (uint32_t)__builtin_ctzll(rays), g->mesh->bvh.root);
    while (n > 0)
        for (uint32_t k = 0; k < n; k++) {
            if (turn_step(&turn[k], g)) continue;
            if (rays) {
                turn_start(&turn[k], g->space, (uint32_t)__builtin_ctzll(rays), g->mesh->bvh.root);
                rays &= rays - 1;
            } else {
                if (k < --n) turn[k--] = turn[n];
            }
        }
}

static __attribute__((noinline)) void walk_large(const Target *g, uint64_t rays) { walk_by_turns(g, rays, TURNS_LARGE); }
static __attribute__((noinline)) void walk_small(const Target *g, uint64_t rays) { walk_by_turns(g, rays, TURNS_SMALL); }

/* ---- packets through a tree ---- */

/* Readies a space for the rays of one octant; *rays loses them, the result has them. */
static uint64_t space_octant(Space *s, uint64_t *rays)
{
    uint32_t first = (uint32_t)__builtin_ctzll(*rays);
    uint64_t same = *rays;
    for (int a = 0; a < 3; a++) {
        bool negative = s->r[a][first] < 0;
        s->negative[a] = negative;
        for (uint32_t at = 0; at < GROUP; at += LANES) {
            if (!(same >> at & LANE_BITS)) continue;
            uint64_t below = (uint64_t)mask_bits(lanes_lt(at_lane(s->r[a], at), lanes_set(0))) << at;
            same &= (negative ? below : ~below) | ~((uint64_t)LANE_BITS << at);
        }
    }
    s->one_origin = true;
    for (int a = 0; a < 3; a++) {
        Lanes least_o = lanes_set(INFINITY), most_o = lanes_set(-INFINITY), low = least_o, high = most_o;
        for (uint32_t at = 0; at < GROUP; at += LANES) {
            uint32_t bits = (uint32_t)(same >> at) & LANE_BITS;
            if (!bits) continue;
            Mask m = mask_of(bits);
            Lanes o = at_lane(s->o[a], at), r = at_lane(s->r[a], at);
            least_o = lanes_min(least_o, lanes_pick(m, o, least_o));
            most_o = lanes_max(most_o, lanes_pick(m, o, most_o));
            low = lanes_min(low, lanes_pick(m, r, low));
            high = lanes_max(high, lanes_pick(m, r, high));
        }
        /* earliest entry: the origin farthest along the axis' sense; latest exit: the one farthest back */
        float least = lanes_least(least_o), most = lanes_greatest(most_o);
        s->one_origin &= least == most;
        s->first_o[a] = s->negative[a] ? least : most;
        s->last_o[a] = s->negative[a] ? most : least;
        s->r_low[a] = lanes_least(low);
        s->r_high[a] = lanes_greatest(high);
        s->slack_t[a] = s->slack * fmaxf(fabsf(s->r_low[a]), fabsf(s->r_high[a])) * MARGIN_SLACK;
    }
    s->packet = true;
    *rays &= ~same;
    return same;
}

/* When the rays of a packet begin and end: the first and the last of them. */
typedef struct { float tmin, tmin_last, tmax_first, tmax; } PacketSpan;

/* The children that some ray of the packet might meet, and bounds on their entry distances; and those that all meet but for
 * roundings, for which it does no harm to go on with all. */
static inline __attribute__((always_inline)) uint32_t packet_children(const BvhNode *node, const Space *s,
                                                                      const PacketSpan *span, float entry[8],
                                                                      uint32_t *by_all)
{
    Eight enter = eight_set(span->tmin), leave = eight_set(span->tmax);
    Eight all_enter = eight_set(span->tmin_last), all_leave = eight_set(span->tmax_first);
    for (int a = 0; a < 3; a++) {
        Eight lo = eight_load(node->lo[a]), hi = eight_load(node->hi[a]), slack = eight_set(s->slack_t[a]);
        Eight near = eight_sub(s->negative[a] ? hi : lo, eight_set(s->first_o[a]));
        Eight far = eight_sub(s->negative[a] ? lo : hi, eight_set(s->last_o[a]));
        Eight low = eight_set(s->r_low[a]), high = eight_set(s->r_high[a]);
        Eight in_a = eight_mul(near, low), in_b = eight_mul(near, high);
        Eight out_a = eight_mul(far, low), out_b = eight_mul(far, high);
        enter = eight_max(enter, eight_sub(eight_min(in_a, in_b), slack));
        leave = eight_min(leave, eight_add(eight_max(out_a, out_b), slack));
        if (!s->one_origin) {
            near = eight_sub(s->negative[a] ? hi : lo, eight_set(s->last_o[a]));
            far = eight_sub(s->negative[a] ? lo : hi, eight_set(s->first_o[a]));
            in_a = eight_mul(near, low), in_b = eight_mul(near, high);
            out_a = eight_mul(far, low), out_b = eight_mul(far, high);
        }
        all_enter = eight_max(all_enter, eight_max(in_a, in_b));
        all_leave = eight_min(all_leave, eight_min(out_a, out_b));
    }
    eight_store(entry, enter);
    *by_all = eight_le(all_enter, all_leave);
    return eight_le(enter, leave);
}

/* Those of `rays` that meet child k. */
static inline __attribute__((always_inline)) uint64_t packet_lanes(const Walk *w, const Space *s, const BvhNode *node,
                                                                   int k, uint64_t rays)
{
    Lanes near[3], far[3];
    for (int a = 0; a < 3; a++) {
        float lo = node->lo[a][k], hi = node->hi[a][k];
        near[a] = lanes_set(s->negative[a] ? hi : lo);
        far[a] = lanes_set(s->negative[a] ? lo : hi);
    }
    uint64_t met = 0;
    for (uint32_t at = 0; at < w->count; at += LANES) {
        if (!(rays >> at & LANE_BITS)) continue;
        Lanes x = lanes_fms(near[0], at_lane(s->r[0], at), at_lane(s->near_c[0], at));
        Lanes y = lanes_fms(near[1], at_lane(s->r[1], at), at_lane(s->near_c[1], at));
        Lanes z = lanes_fms(near[2], at_lane(s->r[2], at), at_lane(s->near_c[2], at));
        Lanes enter = lanes_max(lanes_max(x, y), lanes_max(z, at_lane(s->tmin, at)));
        x = lanes_fms(far[0], at_lane(s->r[0], at), at_lane(s->far_c[0], at));
        y = lanes_fms(far[1], at_lane(s->r[1], at), at_lane(s->far_c[1], at));
        z = lanes_fms(far[2], at_lane(s->r[2], at), at_lane(s->far_c[2], at));
        Lanes leave = lanes_min(lanes_min(x, y), lanes_min(z, at_lane(s->tmax, at)));
        met |= (uint64_t)mask_bits(lanes_le(enter, leave)) << at;
    }
    return met & rays;
}

/* A node or block is on its way before it's asked for. */
static inline void prefetch_child(const Bvh *bvh, const MeshBlock *block, uint32_t child)
{
    const char *at;
    if (!(child & BVH_LEAF))
        at = (const char *)&bvh->node[child];
    else if (block)
        at = (const char *)&block[child & ~BVH_LEAF];
    else
        return;
    for (int line = 0; line < 4; line++) __builtin_prefetch(at + 64 * line);
}

/* A subtree or leaf that waits for its turn, with the rays that meet it. */
typedef struct { uint64_t rays; float entry; uint32_t child; } PacketTask;

/* The least and the greatest of the rays' numbers. */
static inline __attribute__((always_inline)) void packet_range(const float *column, uint64_t rays, float *least,
                                                               float *most)
{
    Lanes low = lanes_set(INFINITY), high = lanes_set(-INFINITY);
    for (uint32_t at = 0; at < GROUP; at += LANES) {
        uint32_t bits = (uint32_t)(rays >> at) & LANE_BITS;
        if (!bits) continue;
        Mask m = mask_of(bits);
        Lanes x = at_lane(column, at);
        low = lanes_min(low, lanes_pick(m, x, low));
        high = lanes_max(high, lanes_pick(m, x, high));
    }
    *least = lanes_least(low);
    *most = lanes_greatest(high);
}

static inline __attribute__((always_inline)) void packet_ends(const Space *s, uint64_t rays, PacketSpan *span)
{
    packet_range(s->tmax, rays, &span->tmax_first, &span->tmax);
}

static inline __attribute__((always_inline)) void packet_starts(const Space *s, uint64_t rays, PacketSpan *span)
{
    packet_range(s->tmin, rays, &span->tmin, &span->tmin_last);
}

/* Visits the leaves that rays of a packet (of one octant) meet, roughly nearer ones first; few rays go on alone. */
static inline __attribute__((always_inline)) void walk_packet(const Bvh *bvh, Walk *w, const Space *s, uint64_t rays,
                                                              void (*leaf)(void *, uint32_t, uint64_t),
                                                              bool (*leaf_alone)(void *, uint32_t, uint32_t),
                                                              const MeshBlock *block, void *context)
{
    PacketTask stack[SLAB_STACK];
    uint32_t top = 0;
    PacketSpan span;
    packet_starts(s, rays, &span);
    packet_ends(s, rays, &span);
    stack[top++] = (PacketTask){rays, 0, bvh->root};
    while (top > 0) {
        PacketTask now = stack[--top];
        now.rays &= w->alive;
        if (!now.rays || now.entry > span.tmax) continue;
        if (now.child & BVH_LEAF) {
            leaf(context, now.child & ~BVH_LEAF, now.rays);
            packet_ends(s, rays, &span);
            continue;
        }
        if (__builtin_popcountll(now.rays) <= FEW) {
            for (; now.rays; now.rays &= now.rays - 1)
                walk_alone(bvh, s, (uint32_t)__builtin_ctzll(now.rays), now.child, leaf_alone, context);
            packet_ends(s, rays, &span);
            continue;
        }
        const BvhNode *node = &bvh->node[now.child];
        _Alignas(32) float entry[8];
        uint32_t bottom = top, by_all;
        for (uint32_t mask = packet_children(node, s, &span, entry, &by_all); mask; mask &= mask - 1) {
            int k = __builtin_ctz(mask);
            PacketTask task = {now.rays, entry[k], node->child[k]};
            if (!(by_all >> k & 1)) task.rays = packet_lanes(w, s, node, k, now.rays);
            if (!task.rays) continue;
            prefetch_child(bvh, block, task.child);
            uint32_t i = top++;
            while (i > bottom && stack[i - 1].entry < task.entry) {
                stack[i] = stack[i - 1];
                i--;
            }
            stack[i] = task;
        }
    }
}

/* One ray after the other where that costs less than one triangle after the other for all. */
static void block_leaf(void *context, uint32_t block, uint64_t rays)
{
    const Target *g = context;
    const MeshBlock *b = &g->mesh->block[block];
    uint32_t groups = 0;
    for (uint32_t at = 0; at < GROUP; at += LANES) groups += (rays >> at & LANE_BITS) != 0;
    uint32_t cost = g->space->one_origin ? 2 : 1;  /* of a ray against a group and a triangle, as measured */
    bool by_rays = cost * (uint32_t)__builtin_popcountll(rays) <= b->count * groups;
    if (by_rays && !g->space->one_origin) {
        for (; rays; rays &= rays - 1) block_by_rays(g, b, (uint32_t)__builtin_ctzll(rays));
        return;
    }
    BlockView view;
    block_view(g, b, (uint32_t)__builtin_ctzll(rays), &view);
    if (by_rays)
        block_by_viewers(g, b, &view, rays);
    else if (g->space->one_origin)
        block_by_triangles(g, b, &view, rays, true);
    else
        block_by_triangles(g, b, &view, rays, false);
}

/* ---- objects ---- */

static void at_mesh(Walk *w, uint32_t index, const MeshPrim *mesh, Space *s, uint64_t rays, bool coherent, bool any)
{
    Target g = {w, s, mesh, index, margins_of(s->o_err, s->d_err, s->d_sum, s->reach + mesh->reach), any};
    if (!coherent && __builtin_popcountll(rays) > 1) {
        if (mesh->bvh.node_count < SMALL_NODES) walk_small(&g, rays);
        else walk_large(&g, rays);
        return;
    }
    if (!coherent || __builtin_popcountll(rays) <= FEW) {
        for (; rays; rays &= rays - 1)
            walk_alone(&mesh->bvh, s, (uint32_t)__builtin_ctzll(rays), mesh->bvh.root, block_leaf_alone, &g);
        return;
    }
    if (s->packet) {
        walk_packet(&mesh->bvh, w, s, rays, block_leaf, block_leaf_alone, mesh->block, &g);
        return;
    }
    while (rays) {
        uint64_t same = space_octant(s, &rays);
        walk_packet(&mesh->bvh, w, s, same, block_leaf, block_leaf_alone, mesh->block, &g);
    }
}

static void at_prim(Walk *w, uint32_t index, uint64_t rays, bool any)
{
    const Object *object = &w->world->objects[index];
    const PrimOps *ops = object->prim->ops;
    for (; rays; rays &= rays - 1) {
        uint32_t i = (uint32_t)__builtin_ctzll(rays);
        Ray local = ray_to_object(object, &w->ray[i]);
        Hit hit;
        arena_reset(w->scratch->arena);
        if (any) {
            bool hits = ops->occluded ? ops->occluded(object->prim, &local, w->scratch)
                                      : ops->intersect(object->prim, &local, &hit, w->scratch);
            if (hits) w->alive &= ~((uint64_t)1 << i);
        } else {
            if (w->exact >> i & 1) local.tmax = w->hit[i].t;
            if (!ops->intersect(object->prim, &local, &hit, w->scratch)) continue;
            hit.object = index;
            offer(w, &w->space, i, &hit);
        }
    }
}

static void at_solid(Walk *w, uint32_t index, uint64_t rays, bool any);

static inline __attribute__((always_inline)) void at_object(Walk *w, uint32_t index, uint64_t rays, bool coherent, bool any)
{
    const Object *object = &w->world->objects[index];
    const MeshPrim *mesh = mesh_prim_data(object->prim);
    const ObjectView *view = &w->world->views[index];
    Space s;
    float power = mesh && !object->in_world ? power_map(object) : 0;
    if (power > 0) {
        scaled_space(w, power, &s);
    } else if (!object->in_world && view_is_in_reach(view)) {
        rays = object_meets(w, view, rays, s.shift);
        if (!rays) return;
    }
    if (!mesh) {
        at_solid(w, index, rays, any);
    } else if (object->in_world) {
        at_mesh(w, index, mesh, &w->space, rays, coherent, any);
    } else if (power > 0 || view_is_in_reach(view)) {
        if (!(power > 0)) object_space(w, object, view, rays, &s);
        uint32_t waited = w->waiting_count;
        at_mesh(w, index, mesh, &s, rays, coherent, any);
        if (!any) leave_space(w, &s, index, rays, waited);
    } else {
        at_prim(w, index, rays, any);
    }
}

static void nearest_object(void *context, uint32_t index, uint64_t rays) { at_object(context, index, rays, true, false); }
static void any_object(void *context, uint32_t index, uint64_t rays) { at_object(context, index, rays, true, true); }

static bool nearest_object_alone(void *context, uint32_t index, uint32_t i)
{
    at_object(context, index, (uint64_t)1 << i, false, false);
    return true;
}

static bool any_object_alone(void *context, uint32_t index, uint32_t i)
{
    Walk *w = context;
    at_object(w, index, (uint64_t)1 << i, false, true);
    return w->alive >> i & 1;
}

/* ---- streams ---- */

/* Whether a packet of these rays is worth while: directions, about 1 long, that differ by no more than this. */
#define COHERENT_SPREAD 0.5f

static bool is_coherent(const Space *s, uint64_t rays)
{
    float spread = 0;
    for (int a = 0; a < 3; a++) {
        Lanes low = lanes_set(INFINITY), high = lanes_set(-INFINITY);
        for (uint32_t at = 0; at < GROUP; at += LANES) {
            uint32_t bits = (uint32_t)(rays >> at) & LANE_BITS;
            if (!bits) continue;
            Lanes d = at_lane(s->d[a], at);
            low = lanes_min(low, lanes_pick(mask_of(bits), d, low));
            high = lanes_max(high, lanes_pick(mask_of(bits), d, high));
        }
        spread = fmaxf(spread, lanes_greatest(high) - lanes_least(low));
    }
    return spread <= COHERENT_SPREAD;
}

static inline __attribute__((always_inline)) void trace(Walk *w, bool any)
{
    const Bvh *bvh = &w->world->bvh;
    uint64_t rays = w->alive;
    if (is_coherent(&w->space, rays)) {
        while (rays) {
            uint64_t same = space_octant(&w->space, &rays);
            if (any)
                walk_packet(bvh, w, &w->space, same, any_object, any_object_alone, NULL, w);
            else
                walk_packet(bvh, w, &w->space, same, nearest_object, nearest_object_alone, NULL, w);
        }
        return;
    }
    if (bvh->root & BVH_LEAF) {
        at_object(w, bvh->root & ~BVH_LEAF, rays, false, any);
        return;
    }
    for (uint32_t i = 0; i < w->count; i++) {
        if (any)
            walk_alone(bvh, &w->space, i, bvh->root, any_object_alone, w);
        else
            walk_alone(bvh, &w->space, i, bvh->root, nearest_object_alone, w);
    }
}

/* ---- several hits in double at once ---- */

/* Vectors of several rays in twice the precision: dd.h and triangle.h, operation by operation. */
typedef struct { Doubles hi, lo; } Dds;
typedef struct { Dds x, y, z; } DdVecs;

static inline __attribute__((always_inline)) Dds dds_sum(Doubles a, Doubles b)
{
    Doubles s = a + b, bb = s - a;
    return (Dds){s, (a - (s - bb)) + (b - bb)};
}

static inline __attribute__((always_inline)) Dds dds_prod(Doubles a, Doubles b)
{
    Doubles p = a * b;
    return (Dds){p, doubles_rest(a, b, p)};
}

static inline __attribute__((always_inline)) DdVecs ddvecs_between(const Vecs *a, const Vecs *b)
{
    return (DdVecs){dds_sum(b->x, -a->x), dds_sum(b->y, -a->y), dds_sum(b->z, -a->z)};
}

/* a b - c d. */
static inline __attribute__((always_inline)) Dds dds_minor(Dds a, Dds b, Dds c, Dds d)
{
    Dds p = dds_prod(a.hi, b.hi), q = dds_prod(c.hi, d.hi), high = dds_sum(p.hi, -q.hi);
    return (Dds){high.hi, high.lo + ((p.lo - q.lo) + ((a.hi * b.lo + a.lo * b.hi) - (c.hi * d.lo + c.lo * d.hi)))};
}

static inline __attribute__((always_inline)) Dds ddrows_dot(const DdVecs *n, const DdVecs *v)
{
    Dds x = dds_prod(n->x.hi, v->x.hi), y = dds_prod(n->y.hi, v->y.hi), z = dds_prod(n->z.hi, v->z.hi);
    Doubles low_x = x.lo + (n->x.hi * v->x.lo + n->x.lo * v->x.hi), low_y = y.lo + (n->y.hi * v->y.lo + n->y.lo * v->y.hi);
    Doubles low_z = z.lo + (n->z.hi * v->z.lo + n->z.lo * v->z.hi);
    Dds xy = dds_sum(x.hi, y.hi), xyz = dds_sum(xy.hi, z.hi);
    return dds_sum(xyz.hi, (xy.lo + xyz.lo) + ((low_x + low_y) + low_z));
}

/* The component along the greatest of d's, or one of those after it. */
typedef struct { DoublesMask x, y; } Axes;

static inline __attribute__((always_inline)) Doubles along(Axes k, Doubles x, Doubles y, Doubles z)
{
    return doubles_pick(k.x, x, doubles_pick(k.y, y, z));
}

/* Triangles as seen from an origin: their corners from there, and n and n . (a - o) of triangle_t. */
typedef struct {
    Vecs to[3];
    DdVecs n;
    Dds top;
} Faces;

static inline __attribute__((always_inline)) Faces faces_of(const Vecs *o, const Vecs corner[3])
{
    Faces s;
    DdVecs to = ddvecs_between(o, &corner[0]), e = ddvecs_between(&corner[0], &corner[1]);
    DdVecs f = ddvecs_between(&corner[0], &corner[2]);
    for (int i = 0; i < 3; i++) s.to[i] = (Vecs){corner[i].x - o->x, corner[i].y - o->y, corner[i].z - o->z};
    s.n = (DdVecs){dds_minor(e.y, f.z, e.z, f.y), dds_minor(e.z, f.x, e.x, f.z), dds_minor(e.x, f.y, e.y, f.x)};
    s.top = ddrows_dot(&s.n, &to);
    return s;
}

typedef struct { Doubles t, u, v; } Confirmed;

/* t, u and v of triangle_t and triangle_cut; d is about 1 long, `scale` times the ray's. Only for hits that the margins in
 * float vouch for: these are far above all that triangle_cut or triangle_t could doubt in double. */
static inline __attribute__((always_inline)) Confirmed confirm(const Faces *face, const Vecs *d, Doubles scale)
{
    Doubles ax = doubles_abs(d->x), ay = doubles_abs(d->y), az = doubles_abs(d->z);
    DoublesMask x_y = doubles_le(ay, ax);
    Axes k = {doubles_mask_and(x_y, doubles_le(az, ax)), doubles_mask_without(doubles_le(az, ay), x_y)};
    Doubles dx = along(k, d->y, d->z, d->x), dy = along(k, d->z, d->x, d->y), dz = along(k, d->x, d->y, d->z);
    Doubles sx = dx / dz, sy = dy / dz;
    Vecs sheared[3];
    for (int i = 0; i < 3; i++) {
        Doubles x = face->to[i].x, y = face->to[i].y, z = face->to[i].z, far = along(k, x, y, z);
        sheared[i] = (Vecs){along(k, y, z, x) - sx * far, along(k, z, x, y) - sy * far, far};
    }
    Vecs a = sheared[0], b = sheared[1], c = sheared[2];
    Doubles ea = c.x * b.y - c.y * b.x, eb = a.x * c.y - a.y * c.x, ec = b.x * a.y - b.y * a.x;
    Doubles r = doubles_set(1) / (ea + eb + ec), zero = doubles_set(0);
    DdVecs way = {{d->x, zero}, {d->y, zero}, {d->z, zero}};
    Dds slope = ddrows_dot(&face->n, &way);
    Doubles per_slope = doubles_set(1) / slope.hi, t0 = face->top.hi * per_slope;
    Dds back = dds_prod(t0, slope.hi);
    Doubles t = t0 + (((face->top.hi - back.hi) - back.lo) + (face->top.lo - t0 * slope.lo)) * per_slope;
    return (Confirmed){t * scale, eb * r, ec * r};
}

#include "accel/solid_kernel.h"

/* Triangles that rays from one origin share most of the work for. */
enum { FACES = 16 };

enum { FACE_NUMBERS = sizeof(Faces) / sizeof(Doubles) };

/* Hits of one object: their rays, of the world, in columns, and what they hit. */
typedef struct {
    Columns *ray, own;                           /* ray: own, or all of the walk's */
    _Alignas(64) uint32_t triangle[GROUP + DOUBLES];
    _Alignas(64) uint32_t slot[GROUP];           /* of the triangle in a table of faces */
    Hit *hit[GROUP + DOUBLES], spare;            /* spare: where lanes beyond the last go */
    uint32_t count;
    const World *world;
    uint32_t index;
    const MeshPrim *mesh;
} Found;

_Static_assert(offsetof(Hit, u) == 8 && offsetof(Hit, part) == offsetof(Hit, v) + 8 &&
               offsetof(Hit, leaf) == offsetof(Hit, part) + 4, "found_settle writes pairs");

static inline void found_start(Found *f, const Walk *w, uint32_t index)
{
    f->world = w->world;
    f->index = index;
    f->mesh = mesh_of(w, index);
}

/* After n hits, at least one, have been put in. */
static inline void found_end(Found *f, uint32_t n)
{
    f->count = n;
    for (uint32_t j = 0; j < DOUBLES; j++) {
        f->triangle[n + j] = f->triangle[0];
        f->hit[n + j] = &f->spare;
    }
}

/* The hits of an object that are known in float. Whether most are on the triangle of the one before. */
static inline bool found_gather(Found *f, Walk *w, uint64_t rays)
{
    uint32_t n = 0, last = UINT32_MAX, same = 0;
    for (uint64_t left = rays; left; left &= left - 1, n++) {
        uint32_t i = (uint32_t)__builtin_ctzll(left);
        f->triangle[n] = w->triangle[i];
        f->hit[n] = &w->hit[i];
        same += w->triangle[i] == last;
        last = w->triangle[i];
    }
    found_end(f, n);
    f->ray = n == w->count ? &w->given : &f->own;
    if (n == w->count) return 2 * same > n;
    uint32_t to = 0;
    for (uint32_t at = 0; at < w->count; at += DOUBLES) {
        uint32_t bits = (uint32_t)(rays >> at) & ((1u << DOUBLES) - 1);
        for (int a = 0; a < 3; a++) {
            doubles_keep(f->own.o[a] + to, w->given.o[a] + at, bits);
            doubles_keep(f->own.d[a] + to, w->given.d[a] + at, bits);
        }
        doubles_keep(f->own.per_scale + to, w->given.per_scale + at, bits);
        to += (uint32_t)__builtin_popcount(bits);
    }
    return 2 * same > n;
}

/* The corners of DOUBLES triangles, the first one's for those from `count` on. */
static inline __attribute__((always_inline)) void corners_of(const MeshPrim *mesh, const uint32_t *triangle, uint32_t count,
                                                             Vecs corner[3])
{
    const double *at[3][DOUBLES];
    for (uint32_t j = 0; j < DOUBLES; j++) {
        const uint32_t *k = mesh->triangle[triangle[j < count ? j : 0]];
        for (int c = 0; c < 3; c++) at[c][j] = &mesh->position[k[c]].x;
    }
    for (int c = 0; c < 3; c++) doubles_gather(at[c], &corner[c].x, &corner[c].y, &corner[c].z);
}

static inline __attribute__((always_inline)) Vecs found_origin(Found *f, uint32_t k)
{
    const Object *object = &f->world->objects[f->index];
    Vecs o = vecs_column(f->ray->o, k);
    return object->in_world ? o : map_points(&object->to_object, &o);
}

/* Computes the hits from k on, whose faces are known. */
static inline __attribute__((always_inline)) void found_settle(Found *f, uint32_t k, const Faces *face)
{
    const Object *object = &f->world->objects[f->index];
    Vecs d = vecs_column(f->ray->d, k);
    Doubles per = *(Doubles *)(f->ray->per_scale + k), scale = doubles_set(1) / per;
    if (!object->in_world) {
        Vecs given = {d.x * per, d.y * per, d.z * per};
        d = map_vectors(&object->to_object, &given);
        doubles_power(doubles_max(doubles_abs(d.x), doubles_max(doubles_abs(d.y), doubles_abs(d.z))), &scale);
        d = (Vecs){d.x * scale, d.y * scale, d.z * scale};
    }
    Confirmed r = confirm(face, &d, scale);
    /* t and u, then v, part and a leaf of 0 */
    doubles_store_pairs(f->hit + k, offsetof(Hit, t), r.t, r.u);
    doubles_store_pairs(f->hit + k, offsetof(Hit, v), r.v, doubles_of_ints(f->triangle + k));
    for (uint32_t j = 0; j < DOUBLES; j++) f->hit[k + j]->object = f->index;
    if (f->mesh->source_count == 1) return;
    for (uint32_t j = 0; j < DOUBLES; j++) f->hit[k + j]->leaf = part_of(f->mesh, f->triangle[k + j]);
}

static inline bool one_origin(Found *f)
{
    uint32_t other = 0;
    for (int a = 0; a < 3; a++) {
        Doubles first = doubles_set(f->ray->o[a][0]);
        for (uint32_t k = 0; k < f->count; k += DOUBLES) {
            uint32_t lanes = f->count - k < DOUBLES ? f->count - k : DOUBLES;
            Doubles o = *(Doubles *)(f->ray->o[a] + k);
            other |= (doubles_lt(o, first) | doubles_lt(first, o)) & ((1u << lanes) - 1);
        }
    }
    return !other;
}

/* Fills in which slot of a table of different triangles each hit's has, and the table's triangles; their number, 0 if there
 * are more than FACES. */
static inline uint32_t found_slots(Found *f, uint32_t triangle[FACES])
{
    uint32_t n = 0;
    memset(f->slot, 0, sizeof f->slot);
    for (uint64_t left = group_all(f->count); left; n++) {
        if (n == FACES) return 0;
        triangle[n] = f->triangle[__builtin_ctzll(left)];
        uint64_t same = 0;
        for (uint32_t at = 0; at < f->count; at += LANES) {
            LanesInt *slot = (LanesInt *)(f->slot + at);
            uint32_t bits = lanes_equal_int(*(LanesInt *)(f->triangle + at), lanes_set_int(triangle[n]));
            *slot = lanes_pick_int(mask_of(bits), lanes_set_int(n), *slot);
            same |= (uint64_t)bits << at;
        }
        left &= ~same;
    }
    return n;
}

/* Computes hits one by one. */
static inline __attribute__((always_inline)) void found_settle_all(Found *f, const Ray *later)
{
    for (uint32_t k = 0; k < f->count; k++)
        for (int j = 0; j < 3; j++) __builtin_prefetch(&f->mesh->position[f->mesh->triangle[f->triangle[k]][j]]);
    for (uint32_t k = 0; k < f->count; k += DOUBLES) {
        prefetch_rays(later + k, DOUBLES);
        Vecs o = found_origin(f, k), corner[3];
        corners_of(f->mesh, f->triangle + k, f->count - k, corner);
        Faces face = faces_of(&o, corner);
        found_settle(f, k, &face);
    }
}

/* Computes hits of an object in double. */
static __attribute__((noinline)) void settle_object(Walk *w, uint32_t index, uint64_t rays)
{
    Found f;
    found_start(&f, w, index);
    uint32_t different[FACES], n = 0;
    if (found_gather(&f, w, rays) && one_origin(&f)) n = found_slots(&f, different);
    if (n > 0) {
        _Alignas(64) double table[FACE_NUMBERS][FACES];
        for (uint32_t k = 0; k < n; k += DOUBLES) {
            Vecs o = found_origin(&f, 0), first = {doubles_first(o.x), doubles_first(o.y), doubles_first(o.z)}, corner[3];
            corners_of(f.mesh, different + k, n - k, corner);
            Faces face = faces_of(&first, corner);
            for (int i = 0; i < FACE_NUMBERS; i++) doubles_store(table[i] + k, ((const Doubles *)&face)[i]);
        }
        for (uint32_t k = 0; k < f.count; k += DOUBLES) {
            Faces face;
            prefetch_rays(w->ray + k, DOUBLES);
            for (int i = 0; i < FACE_NUMBERS; i++) ((Doubles *)&face)[i] = doubles_chosen(table[i], f.slot + k);
            found_settle(&f, k, &face);
        }
        return;
    }
    found_settle_all(&f, w->ray);
}

/* Computes the hits that wait, those of an object that follow each other together, and finds the nearest. All others are
 * known. */
static __attribute__((noinline)) void settle_waiting(Walk *w)
{
    for (uint32_t k = 0, n; k < w->waiting_count; k += n) {
        Found f;
        Hit hit[GROUP];
        const Waiting *at = &w->waiting[k];
        found_start(&f, w, at->object);
        for (n = 0; n < GROUP && k + n < w->waiting_count && at[n].object == at->object; n++) {
            for (int a = 0; a < 3; a++) {
                f.own.o[a][n] = w->given.o[a][at[n].lane];
                f.own.d[a][n] = w->given.d[a][at[n].lane];
            }
            f.own.per_scale[n] = w->given.per_scale[at[n].lane];
            f.triangle[n] = at[n].triangle;
            f.hit[n] = &hit[n];
        }
        f.ray = &f.own;
        found_end(&f, n);
        found_settle_all(&f, w->ray);
        for (uint32_t j = 0; j < n; j++) {
            uint32_t i = at[j].lane;
            if (is_nearer(&hit[j], &w->hit[i])) w->hit[i] = hit[j];
        }
    }
}

static uint64_t rays_of(const Walk *w, uint32_t object)
{
    uint64_t rays = 0;
    for (uint32_t at = 0; at < w->count; at += LANES)
        rays |= (uint64_t)lanes_equal_int(*(const LanesInt *)(w->object + at), lanes_set_int(object)) << at;
    return rays & group_all(w->count);
}

static void take_hits(Walk *w)
{
    uint64_t none = rays_of(w, HIT_NONE);
    for (uint64_t left = group_all(w->count) & ~none & ~w->exact; left;) {
        uint32_t object = w->object[__builtin_ctzll(left)];
        uint64_t same = left & rays_of(w, object);
        settle_object(w, object, same);
        left &= ~same;
    }
    if (w->waiting_count > 0) settle_waiting(w);
    for (; none; none &= none - 1) {
        uint32_t i = (uint32_t)__builtin_ctzll(none);
        w->hit[i] = (Hit){.t = w->ray[i].tmax, .object = HIT_NONE};
        prefetch_rays(&w->ray[i], 1);
    }
}

static void intersect(const World *world, const Ray *rays, const LeftFace *left, Hit *hits, size_t n, Scratch *scratch)
{
    Walk w;
    w.world = world;
    w.scratch = scratch;
    for (size_t at = 0; at < n; at += GROUP) {
        uint32_t count = n - at < GROUP ? (uint32_t)(n - at) : GROUP;
        if (!world->bvh.item_count || !walk_init(&w, world, rays + at, count, false)) {
            kernel_scalar.intersect(world, rays + at, NULL, hits + at, count, scratch);
            continue;
        }
        w.hit = hits + at;
        w.left = left ? left + at : NULL;
        trace(&w, false);
        take_hits(&w);
    }
}

/* Bits as flags, eight at a time: copied to all bytes, of which the k-th keeps bit k, as 1. */
static inline void put_flags(bool *flag, uint64_t bits, uint32_t n)
{
    const uint64_t ones = 0x0101010101010101;
    for (uint32_t i = 0; i < n; i += 8) {
        uint64_t bytes = (bits >> i & 0xff) * ones & 0x8040201008040201;
        bytes = (bytes + 0x7f * ones) >> 7 & ones;
        memcpy(flag + i, &bytes, n - i < 8 ? n - i : 8);
    }
}

static void occluded(const World *world, const Ray *rays, const LeftFace *left, bool *blocked, size_t n, Scratch *scratch)
{
    Walk w;
    w.world = world;
    w.scratch = scratch;
    for (size_t at = 0; at < n; at += GROUP) {
        uint32_t count = n - at < GROUP ? (uint32_t)(n - at) : GROUP;
        if (!world->bvh.item_count || !walk_init(&w, world, rays + at, count, true)) {
            kernel_scalar.occluded(world, rays + at, NULL, blocked + at, count, scratch);
            continue;
        }
        w.left = left ? left + at : NULL;
        trace(&w, true);
        put_flags(blocked + at, ~w.alive, count);
    }
}

#endif
