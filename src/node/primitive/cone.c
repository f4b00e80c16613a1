/* The cone x^2 + z^2 <= y^2, -1 <= y <= 0. A line's way through the lower nappe of the double cone is one interval,
 * bounded or not by its slope:
 *   a > 0 (flatter than the side)  between the roots, if these lie below the apex;
 *   a < 0 (steeper)                from the root on the lower nappe on, downwards without end;
 *   a = 0 (parallel to a side)     from the only root on, likewise;
 * and the base plane cuts off the rest. A line that lies in the side belongs to the solid. */
#include "node/primitive/primitive.h"

#include <stdlib.h>

#include "node/primitive/quadric.h"
#include "node/primitive/wrap.h"

static const Vec3 SIGNS = {1, -1, 1};

static bool guess(const Ray *ray, Guess *g)
{
    Vec3 o = ray->o, d = ray->d;
    g->sure = false;
    double dd = vec3_dot(d, d), reach = fabs(o.x) + fabs(o.y) + fabs(o.z);
    if (!(dd > 0x1p-400 && dd < 0x1p400 && reach < 0x1p400)) return true;
    double near = -vec3_dot(o, d) / dd;
    Vec3 l = vec3_at(o, near, d);
    double limit = M_SQRT2 + GAMMA(16) * reach;
    if (vec3_dot(l, l) > limit * limit * (1 + GAMMA(8))) return false;
    if (!(reach < 0x1p20)) return true;

    /* about l all terms are of moderate size; their error, some u (reach + 1), is far below the thresholds */
    double a = (d.x * d.x - d.y * d.y + d.z * d.z) / dd;
    double scale = 1 / sqrt(dd);
    double b = (l.x * d.x - l.y * d.y + l.z * d.z) * scale, c = l.x * l.x - l.y * l.y + l.z * l.z;
    double disc = b * b - a * c;
    if (disc < -0x1p-10 && a > 0) return false;
    if (!(fabs(a) > 0x1p-10 && disc > 0x1p-10)) return true;
    double root = sqrt(disc), q = b < 0 ? root - b : -root - b, r[2] = {c / q, q / a};
    if (r[0] > r[1]) {
        double swap = r[0];
        r[0] = r[1];
        r[1] = swap;
    }
    /* a root's error is below u (reach + 1) 2^10 / |a|, in units of length */
    double side[2] = {near + r[0] * scale, near + r[1] * scale};
    double slack = 0x1p-30 * (1 + reach) * (1 + fabs(r[0]) + fabs(r[1])) * scale;
    bool down = d.y < 0;
    double in = side[0], out = side[1];
    if (a > 0) {
        double y = l.y - b / a * (d.y * scale);   /* half way between the roots: well off 0, as disc / a^2 is */
        if (y > 0) return false;
    } else if (down) {
        in = side[1];
        out = INFINITY;
    } else {
        in = -INFINITY;
        out = side[0];
    }
    g->part[0] = g->part[1] = CONE_SIDE;
    if (d.y == 0) {
        if (o.y < -1) return false;
    } else {
        double base = (-1 - o.y) / d.y;
        if (!(fabs(base) < 0x1p500 * scale)) return true;
        slack += 0x1p-45 * fabs(base);
        if (fabs(base - in) <= slack || fabs(base - out) <= slack) return true;
        if (down && base < out) {
            out = base;
            g->part[1] = CONE_BASE;
        } else if (!down && base > in) {
            in = base;
            g->part[0] = CONE_BASE;
        }
    }
    if (in - out > slack) return false;
    if (!(out - in > slack)) return true;
    g->t[0] = in;
    g->t[1] = out;
    g->slack = slack;
    g->sure = true;
    return true;
}

static Crossing base_crossing(const Ray *ray) { return plane_crossing(ray->o.y, ray->d.y, -1, CONE_BASE); }

static bool refine(const Ray *ray, const Guess *g, int i, Crossing *c)
{
    if (g->part[i] == CONE_BASE) {
        *c = base_crossing(ray);
        return true;
    }
    if (fabs(g->t[i]) < 0x1p-10 * (g->t[1] - g->t[0])) return false;
    *c = quadric_refine(ray, SIGNS, 0, g->t[i], CONE_SIDE);
    return true;
}

/* y of the point half way between the roots of a flat line, l.y - (b / a) d.y: its sign tells the nappe. */
static double middle_y(const NearLine *line, const QuadricRoots *side)
{
    Dd y = dd_mul_d(dd_div(side->b, side->a), line->d.y);
    return dd_sub(dd_sum(line->hi.y, line->lo.y), y).hi;
}

static bool exact(const Ray *ray, Crossing c[2])
{
    NearLine line;
    QuadricRoots side;
    if (!near_line(ray, M_SQRT2, 1.0 / 16, &line)) return false;
    quadric_roots(&line, SIGNS, 0, &side);
    bool down = ray->d.y < 0;
    c[0] = side.root[0];
    c[1] = side.root[1];
    if (side.constant) {
        /* parallel to a side and touching no more than a tangent plane: in the side itself, or outside */
        if (side.c.hi != 0) return false;
        c[0] = c[1] = plane_crossing(ray->o.y, ray->d.y, 0, CONE_SIDE);
        c[down].t = down ? INFINITY : -INFINITY;
    } else if (side.a.hi > 0) {
        if (side.count == 0 || middle_y(&line, &side) >= 0) return false;
    } else {
        /* parallel to a side and above it: the half of the line that is inside is in the upper nappe */
        if (side.a.hi == 0 && (side.b.hi < 0) != down) return false;
        c[!down] = side.root[down];
        c[down].t = down ? INFINITY : -INFINITY;
    }
    if (ray->d.y == 0) {
        if (ray->o.y < -1) return false;
    } else {
        Crossing base = base_crossing(ray);
        if (down ? crossing_before(&base, &c[1]) : crossing_before(&c[0], &base)) c[down] = base;
    }
    return crossing_before(&c[0], &c[1]);
}

static Vec3 normal(Vec3 p, uint32_t part)
{
    if (part == CONE_BASE) return vec3_make(0, -1, 0);
    if (p.x == 0 && p.z == 0) return vec3_make(0, 1, 0);
    return vec3_make(p.x, sqrt(p.x * p.x + p.z * p.z), p.z);
}

static const Convex SHAPE = {guess, refine, exact, normal};

static Box bounds(const Prim *prim)
{
    (void)prim;
    return (Box){{-1, -1, -1}, {1, 0, 1}};
}

static Box bounds_in(const Prim *prim, const Affine *map)
{
    (void)prim;
    Vec3 apex = {0, 0, 0}, base = {0, -1, 0};
    return box_union(affine_box_about(map, apex, apex), affine_box_about(map, base, affine_disc_extent(map)));
}

static bool intersect(const Prim *prim, const Ray *ray, Hit *hit, Scratch *scratch)
{
    return convex_intersect(&SHAPE, prim, ray, hit, scratch);
}

/* Whether the line may lie in the base or in the side. All lines of the side pass the apex; one parallel to them at a
 * distance w from the nearest leaves the side by about w^2, so it is not along it if w is far above sqrt(u). */
static bool is_along(const Ray *ray)
{
    Vec3 d = ray->d, apex = {0, 0, 0}, base = {0, -1, 0};
    double steepest = vec3_max(vec3_abs(d));
    if (fabs(d.y) <= ALONG * steepest) return fabs(line_component(ray, base, 1) + 1) <= 2 * ALONG;
    d = vec3_scale(d, 1 / steepest);
    if (fabs(d.x * d.x + d.z * d.z - d.y * d.y) > 4 * ALONG) return false;
    for (int i = 0; i < 3; i++)
        if (fabs(line_component(ray, apex, i)) > 4 * ALONG) return false;
    return true;
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
    wrap_into_disc(&p);
    if (hit->part == CONE_SIDE) {
        /* y from x and z: exact but for the dot product's 2 roundings under the root, and the root's own */
        p.y = -clamp(sqrt(p.x * p.x + p.z * p.z), 0, 1);
        surface->p_err = vec3_make(GAMMA(1) * fabs(p.x), GAMMA(5) * fabs(p.y), GAMMA(1) * fabs(p.z));
        surface->u = uv ? wrap_u(p) : 0;
        surface->v = uv ? p.y + 1 : 0;
    } else {
        p.y = -1;
        surface->p_err = vec3_make(GAMMA(5) * fabs(p.x), UNIT_ROUNDOFF, GAMMA(5) * fabs(p.z));
        wrap_cap(p, uv, &surface->u, &surface->v);
    }
    surface->p = p;
    surface->n = surface->ns = normal(p, hit->part);
}

static const PrimOps OPS = {
    .name = "cone", .form = FORM_CONE, .closed = true, .bounds = bounds, .bounds_in = bounds_in, .intersect = intersect,
    .occluded = occluded, .segments = segments, .surface = surface,
};

Prim *cone_create(void)
{
    Prim *prim = malloc(sizeof *prim);
    if (prim) prim->ops = &OPS;
    return prim;
}
