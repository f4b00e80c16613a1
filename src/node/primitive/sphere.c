/* The unit sphere. The discriminant is taken from the point l of the line nearest to the centre, 1 - |l|^2, which is
 * free of the cancellation in b^2 - a c (Haines, Guenther, Akenine-Moeller, Ray Tracing Gems, 2019, chapter 7). */
#include "node/primitive/primitive.h"

#include <stdlib.h>

#include "node/primitive/quadric.h"
#include "node/primitive/wrap.h"

static const Vec3 SIGNS = {1, 1, 1};

static bool guess(const Ray *ray, Guess *g)
{
    Vec3 o = ray->o, d = ray->d;
    g->sure = false;
    double a = vec3_dot(d, d), reach = fabs(o.x) + fabs(o.y) + fabs(o.z);
    if (!(a > 0x1p-400 && a < 0x1p400 && reach < 0x1p400)) return true;
    double inverse = 1 / a, mid = -vec3_dot(o, d) * inverse;
    Vec3 l = vec3_at(o, mid, d);
    double ll = vec3_dot(l, l), e = GAMMA(16) * reach;   /* e bounds the error of l's length */
    double limit = 1 + e;
    if (ll > limit * limit * (1 + GAMMA(8))) return false;
    double h = 1 - ll;
    if (!(h > 0x1p-10 && reach < 0x1p20)) return true;
    double half = sqrt(h * inverse);
    g->t[0] = mid - half;
    g->t[1] = mid + half;
    g->part[0] = g->part[1] = 0;
    g->slack = 0x1p-30 * (half + fabs(mid));
    g->sure = true;
    return true;
}

/* Close to the origin even the double-double residual is too coarse for a t that small. */
static bool refine(const Ray *ray, const Guess *g, int i, Crossing *c)
{
    if (fabs(g->t[i]) < 0x1p-10 * (g->t[1] - g->t[0])) return false;
    *c = quadric_refine(ray, SIGNS, -1, g->t[i], 0);
    return true;
}

static bool exact(const Ray *ray, Crossing c[2])
{
    NearLine line;
    QuadricRoots roots;
    if (!near_line(ray, 1, 0, &line)) return false;
    quadric_roots(&line, SIGNS, -1, &roots);
    c[0] = roots.root[0];
    c[1] = roots.root[1];
    return roots.count == 2;
}

static Vec3 normal(Vec3 p, uint32_t part)
{
    (void)part;
    return p;
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
    return affine_box_about(map, vec3_make(0, 0, 0), affine_ball_extent(map));
}

static bool intersect(const Prim *prim, const Ray *ray, Hit *hit, Scratch *scratch)
{
    return !quadric_departs(ray, SIGNS, -1) && convex_intersect(&SHAPE, prim, ray, hit, scratch);
}

static bool occluded(const Prim *prim, const Ray *ray, Scratch *scratch)
{
    return !quadric_departs(ray, SIGNS, -1) && convex_occluded(&SHAPE, prim, ray, scratch);
}

static bool segments(const Prim *prim, const Ray *ray, SegList *list)
{
    return convex_segments(&SHAPE, prim, ray, list);
}

static void surface(const Prim *prim, const Ray *ray, const Hit *hit, bool uv, Surface *surface)
{
    (void)prim;
    Vec3 p = ray_point(ray, hit->t, hit->u);
    p = vec3_scale(p, 1 / vec3_length(p));
    surface->p = p;
    /* dot, root, reciprocal and product: 1.5 + 1 + 1 + 1 roundings */
    surface->p_err = vec3_scale(vec3_abs(p), GAMMA(5));
    surface->n = surface->ns = p;
    surface->u = uv ? wrap_u(p) : 0;
    surface->v = uv ? 0.5 + asin(clamp(p.y, -1, 1)) * ONE_OVER_PI : 0;
}

static const PrimOps OPS = {
    .name = "sphere", .form = FORM_SPHERE, .closed = true, .bounds = bounds, .bounds_in = bounds_in, .intersect = intersect,
    .occluded = occluded, .segments = segments, .surface = surface,
};

Prim *sphere_create(void)
{
    Prim *prim = malloc(sizeof *prim);
    if (prim) prim->ops = &OPS;
    return prim;
}
