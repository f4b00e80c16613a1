/* The cube [0,1]^3 by slabs (Kay and Kajiya 1986). Each plane's t is one exact difference and a quotient, kept to
 * double-double where two planes are too close to tell apart. A line in a face belongs to the solid (closed). */
#include "node/primitive/primitive.h"

#include <stdlib.h>

#include "node/primitive/quadric.h"
#include "node/primitive/wrap.h"

/* Faces: 0 and 1 are x = 0 and x = 1, 2 and 3 y, 4 and 5 z. */
static bool axis_slab(double o, double d, double *in, double *out)
{
    if (d == 0) {
        *in = -INFINITY;
        *out = INFINITY;
        return o >= 0 && o <= 1;
    }
    double low = -o / d, high = (1 - o) / d;
    *in = low < high ? low : high;
    *out = low < high ? high : low;
    return *in <= *out;   /* false if any of them is not a number */
}

static bool guess(const Ray *ray, Guess *g)
{
    Vec3 in, out, o = ray->o, d = ray->d;
    if (!axis_slab(o.x, d.x, &in.x, &out.x) || !axis_slab(o.y, d.y, &in.y, &out.y) ||
        !axis_slab(o.z, d.z, &in.z, &out.z))
        return false;
    double last = in.x > in.y ? in.x : in.y, first = out.x < out.y ? out.x : out.y;
    last = last > in.z ? last : in.z;
    first = first < out.z ? first : out.z;
    /* each t has two roundings; subnormal quotients lose more */
    double slack = 8 * UNIT_ROUNDOFF * (fabs(last) + fabs(first));
    if (last - first > slack) return false;
    g->t[0] = last;
    g->t[1] = first;
    g->part[0] = (uint32_t)(last == in.x ? (d.x < 0) : last == in.y ? 2 + (d.y < 0) : 4 + (d.z < 0));
    g->part[1] = (uint32_t)(first == out.x ? !(d.x < 0) : first == out.y ? 2 + !(d.y < 0) : 4 + !(d.z < 0));
    g->slack = slack;
    g->sure = first - last > slack;
    return true;
}

static bool refine(const Ray *ray, const Guess *g, int i, Crossing *c)
{
    double o[3] = {ray->o.x, ray->o.y, ray->o.z}, d[3] = {ray->d.x, ray->d.y, ray->d.z};
    uint32_t part = g->part[i], axis = part / 2;
    *c = plane_crossing(o[axis], d[axis], part % 2, part);
    return true;
}

static bool exact(const Ray *ray, Crossing c[2])
{
    c[0] = (Crossing){.t = -INFINITY};
    c[1] = (Crossing){.t = INFINITY};
    for (int i = 0; i < 3; i++) {
        double o = vec3_get(ray->o, i), d = vec3_get(ray->d, i);
        if (d == 0) {
            if (!(o >= 0 && o <= 1)) return false;
            continue;
        }
        uint32_t face = 2 * (uint32_t)i, back = d < 0;
        Crossing a = plane_crossing(o, d, back, face + back), b = plane_crossing(o, d, !back, face + !back);
        if (crossing_before(&c[0], &a)) c[0] = a;
        if (crossing_before(&b, &c[1])) c[1] = b;
    }
    return crossing_before(&c[0], &c[1]);
}

static Vec3 normal(Vec3 p, uint32_t part)
{
    (void)p;
    double s = part % 2 ? 1 : -1;
    return vec3_make(part / 2 == 0 ? s : 0, part / 2 == 1 ? s : 0, part / 2 == 2 ? s : 0);
}

static const Convex SHAPE = {guess, refine, exact, normal};

static Box bounds(const Prim *prim)
{
    (void)prim;
    return (Box){{0, 0, 0}, {1, 1, 1}};
}

static bool intersect(const Prim *prim, const Ray *ray, Hit *hit, Scratch *scratch)
{
    return convex_intersect(&SHAPE, prim, ray, hit, scratch);
}

/* Whether the line may lie in a face. */
static bool is_along(const Ray *ray)
{
    double steepest = vec3_max(vec3_abs(ray->d));
    for (int i = 0; i < 3; i++) {
        if (fabs(vec3_get(ray->d, i)) > ALONG * steepest) continue;
        Vec3 middle = vec3_make(0.5, 0.5, 0.5);
        if (fabs(fabs(line_component(ray, middle, i) - 0.5) - 0.5) <= 2 * ALONG) return true;
    }
    return false;
}

static bool occluded(const Prim *prim, const Ray *ray, Scratch *scratch)
{
    return convex_occluded(&SHAPE, prim, ray, scratch);
}

static bool segments(const Prim *prim, const Ray *ray, SegList *list)
{
    list->along |= is_along(ray);
    return convex_segments(&SHAPE, prim, ray, list);
}

static void surface(const Prim *prim, const Ray *ray, const Hit *hit, bool uv, Surface *surface)
{
    (void)prim;
    Vec3 p = ray_point(ray, hit->t, hit->u);
    p = vec3_make(clamp(p.x, 0, 1), clamp(p.y, 0, 1), clamp(p.z, 0, 1));
    double side = hit->part % 2;
    switch (hit->part / 2) {
    case 0:
        p.x = side;
        surface->u = side > 0 ? 1 - p.z : p.z;
        surface->v = p.y;
        break;
    case 1:
        p.y = side;
        surface->u = p.x;
        surface->v = p.z;
        break;
    default:
        p.z = side;
        surface->u = side > 0 ? p.x : 1 - p.x;
        surface->v = p.y;
        break;
    }
    if (!uv) surface->u = surface->v = 0;
    surface->p = p;
    /* the face's coordinate is exact: this only says how finely the space around it resolves */
    surface->p_err = vec3_make(UNIT_ROUNDOFF, UNIT_ROUNDOFF, UNIT_ROUNDOFF);
    surface->n = surface->ns = normal(p, hit->part);
}

static const PrimOps OPS = {
    .name = "cube", .form = FORM_CUBE, .closed = true, .bounds = bounds, .intersect = intersect,
    .occluded = occluded, .segments = segments, .surface = surface,
};

Prim *cube_create(void)
{
    Prim *prim = malloc(sizeof *prim);
    if (prim) prim->ops = &OPS;
    return prim;
}
