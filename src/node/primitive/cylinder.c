/* The cylinder x^2 + z^2 <= 1, |y| <= 1. A line's way through it is what the round side's slab and the caps' slab have
 * in common. A line parallel to the axis at radius exactly 1 belongs to the solid (closed), so it meets the caps. */
#include "node/primitive/primitive.h"

#include <stdlib.h>

#include "node/primitive/quadric.h"
#include "node/primitive/wrap.h"

static const Vec3 SIGNS = {1, 0, 1};

/* Both slabs as [in, out], infinite where the line stays inside. False if it stays outside. */
static bool cap_slab(const Ray *ray, double t[2], uint32_t part[2])
{
    double o = ray->o.y, d = ray->d.y;
    bool down = d < 0;
    part[0] = down ? CYLINDER_TOP : CYLINDER_BOTTOM;
    part[1] = down ? CYLINDER_BOTTOM : CYLINDER_TOP;
    if (d == 0) {
        t[0] = -INFINITY;
        t[1] = INFINITY;
        return fabs(o) <= 1;
    }
    double bottom = (-1 - o) / d, top = (1 - o) / d;
    t[0] = down ? top : bottom;
    t[1] = down ? bottom : top;
    return true;
}

static bool guess(const Ray *ray, Guess *g)
{
    double ox = ray->o.x, oz = ray->o.z, dx = ray->d.x, dz = ray->d.z;
    g->sure = false;
    double cap[2];
    uint32_t cap_part[2];
    if (!cap_slab(ray, cap, cap_part)) return false;
    double a = dx * dx + dz * dz, reach = fabs(ox) + fabs(oz);
    if (!(a > 0x1p-400 && a < 0x1p400 && reach < 0x1p400)) return true;
    double inverse = 1 / a, mid = -(ox * dx + oz * dz) * inverse, lx = ox + mid * dx, lz = oz + mid * dz;
    double ll = lx * lx + lz * lz, limit = 1 + GAMMA(16) * reach;
    if (ll > limit * limit * (1 + GAMMA(8))) return false;
    double h = 1 - ll;
    if (!(h > 0x1p-10 && reach + fabs(ray->o.y) < 0x1p20)) return true;
    double half = sqrt(h * inverse), side[2] = {mid - half, mid + half};

    /* How far a side's t may be off, with much to spare: half is at least 1/32 of a unit of length. */
    double slack = 0x1p-38 * (fabs(mid) + (1 + reach) * half);
    double in = side[0] > cap[0] ? side[0] : cap[0], out = side[1] < cap[1] ? side[1] : cap[1];
    slack += 0x1p-45 * (fabs(in) + fabs(out));
    if (in - out > slack) return false;
    if (!(out - in > slack && fabs(side[0] - cap[0]) > slack && fabs(side[1] - cap[1]) > slack)) return true;
    g->t[0] = in;
    g->t[1] = out;
    g->part[0] = side[0] > cap[0] ? CYLINDER_SIDE : cap_part[0];
    g->part[1] = side[1] < cap[1] ? CYLINDER_SIDE : cap_part[1];
    g->slack = slack;
    g->sure = true;
    return true;
}

static Crossing cap_crossing(const Ray *ray, uint32_t part)
{
    return plane_crossing(ray->o.y, ray->d.y, part == CYLINDER_TOP ? 1 : -1, part);
}

static bool refine(const Ray *ray, const Guess *g, int i, Crossing *c)
{
    if (g->part[i] != CYLINDER_SIDE) {
        *c = cap_crossing(ray, g->part[i]);
        return true;
    }
    if (fabs(g->t[i]) < 0x1p-10 * (g->t[1] - g->t[0])) return false;
    *c = quadric_refine(ray, SIGNS, -1, g->t[i], CYLINDER_SIDE);
    /* along the axis the slope is so small that the residual is too coarse */
    return c->err <= GAMMA(4) * fabs(c->t);
}

static bool exact(const Ray *ray, Crossing c[2])
{
    double cap[2];
    uint32_t cap_part[2];
    NearLine line;
    QuadricRoots side;
    if (!cap_slab(ray, cap, cap_part) || !near_line(ray, M_SQRT2, 0, &line)) return false;
    quadric_roots(&line, SIGNS, -1, &side);
    if (side.constant ? side.c.hi > 0 : side.count == 0) return false;
    for (int i = 0; i < 2; i++) {
        c[i] = side.root[i];
        if (side.constant) c[i].t = i ? INFINITY : -INFINITY;
        if (ray->d.y == 0) continue;
        Crossing flat = cap_crossing(ray, cap_part[i]);
        if (i ? crossing_before(&flat, &c[i]) : crossing_before(&c[i], &flat)) c[i] = flat;
    }
    return crossing_before(&c[0], &c[1]);
}

static Vec3 normal(Vec3 p, uint32_t part)
{
    return part == CYLINDER_SIDE ? vec3_make(p.x, 0, p.z) : vec3_make(0, part == CYLINDER_TOP ? 1 : -1, 0);
}

static const Convex SHAPE = {guess, refine, exact, normal};

static Box bounds(const Prim *prim)
{
    (void)prim;
    return (Box){{-1, -1, -1}, {1, 1, 1}};
}

static Box bounds_in(const Prim *prim, const Affine *map)
{
    (void)prim;
    Vec3 axis = vec3_make(fabs(map->m[0][1]), fabs(map->m[1][1]), fabs(map->m[2][1]));
    return affine_box_about(map, vec3_make(0, 0, 0), vec3_add(axis, affine_disc_extent(map)));
}

static bool intersect(const Prim *prim, const Ray *ray, Hit *hit, Scratch *scratch)
{
    return !quadric_departs(ray, SIGNS, -1) && convex_intersect(&SHAPE, prim, ray, hit, scratch);
}

static bool occluded(const Prim *prim, const Ray *ray, Scratch *scratch)
{
    return !quadric_departs(ray, SIGNS, -1) && convex_occluded(&SHAPE, prim, ray, scratch);
}

/* Whether the line may lie in a cap or in the side. */
static bool is_along(const Ray *ray)
{
    Vec3 d = vec3_abs(ray->d), middle = {0, 0, 0};
    double steepest = vec3_max(d);
    if (d.y <= ALONG * steepest) return fabs(fabs(line_component(ray, middle, 1)) - 1) <= 2 * ALONG;
    if (fmax(d.x, d.z) > ALONG * steepest) return false;
    return fabs(hypot(line_component(ray, middle, 0), line_component(ray, middle, 2)) - 1) <= 2 * ALONG;
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
    if (hit->part == CYLINDER_SIDE) {
        double s = 1 / sqrt(p.x * p.x + p.z * p.z);
        p = vec3_make(p.x * s, clamp(p.y, -1, 1), p.z * s);
        surface->p_err = vec3_make(GAMMA(5) * fabs(p.x), 0, GAMMA(5) * fabs(p.z));
        surface->u = uv ? wrap_u(p) : 0;
        surface->v = uv ? 0.5 * (p.y + 1) : 0;
    } else {
        p.y = hit->part == CYLINDER_TOP ? 1 : -1;
        wrap_into_disc(&p);
        surface->p_err = vec3_make(GAMMA(5) * fabs(p.x), UNIT_ROUNDOFF, GAMMA(5) * fabs(p.z));
        wrap_cap(p, uv, &surface->u, &surface->v);
    }
    surface->p = p;
    surface->n = surface->ns = normal(p, hit->part);
}

static const PrimOps OPS = {
    .name = "cylinder", .form = FORM_CYLINDER, .closed = true, .bounds = bounds, .bounds_in = bounds_in,
    .intersect = intersect, .occluded = occluded, .segments = segments, .surface = surface,
};

Prim *cylinder_create(void)
{
    Prim *prim = malloc(sizeof *prim);
    if (prim) prim->ops = &OPS;
    return prim;
}
