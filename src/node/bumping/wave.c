#include "node/bumping/bump.h"

#include <math.h>
#include <stdlib.h>

#include "common/numeric.h"

/* Texture coordinates are interpolated: three weights, one of them a difference, their products and sums. A point that
 * is no farther from the centre may be at it, where nothing is bent: one texture coordinate for a whole face, the centre's,
 * would give a normal to one pixel and another to the next. */
enum { CENTRE_ROUNDINGS = 7 };

#define TWO_PI 6.283185307179586477

typedef struct {
    Bump base;
    double u0, v0, periods, period;
} Wave;

static Vec3 bend(const Bump *bump, double u, double v, Vec3 n)
{
    const Wave *w = (const Wave *)bump;
    double d = hypot(u - w->u0, v - w->v0), turns = d / w->period;
    double centre = GAMMA(CENTRE_ROUNDINGS) * (fabs(w->u0) + fabs(w->v0));
    if (!(d > centre && turns <= w->periods && isfinite(turns))) return n;
    double angle = cos(TWO_PI * (turns - floor(turns)));
    double s = sin(angle), c = cos(angle);
    return vec3_make(n.x, c * n.y - s * n.z, s * n.y + c * n.z);
}

static const BumpOps ops = {.name = "wave", .bend = bend};

Bump *wave_create(double u0, double v0, double periods, double period)
{
    Wave *w = malloc(sizeof *w);
    if (!w) return NULL;
    *w = (Wave){{&ops}, u0, v0, periods, period};
    return &w->base;
}
