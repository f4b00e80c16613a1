#include "render/error_line.h"

#include <stdio.h>

/* Error falls with samples^-slope. 1/2 is what independent samples do and stratified ones always reach; more than 1 would
 * be luck. */
#define LEAST_SLOPE 0.5
#define MOST_SLOPE 1.0

/* By the last two points of the curve that differ in samples. */
static double slope(const RenderOutcome *o)
{
    if (o->count == 0) return LEAST_SLOPE;
    const CurvePoint *end = &o->point[o->count - 1];
    for (size_t i = o->count - 1; i-- > 0;) {
        const CurvePoint *p = &o->point[i];
        if (!(p->samples < end->samples) || !(p->predicted > 0 && end->predicted > 0)) continue;
        double b = log(p->predicted / end->predicted) / log((double)end->samples / (double)p->samples);
        return b > MOST_SLOPE ? MOST_SLOPE : b > LEAST_SLOPE ? b : LEAST_SLOPE;
    }
    return LEAST_SLOPE;
}

static int places(double seconds) { return seconds < 1 ? 2 : seconds < 100 ? 1 : 0; }

void error_line(const RenderOutcome *o, double wall_s, double cpu_s, double render_s, char *text, size_t size)
{
    const Estimate *e = &o->rmse;
    if (isnan(e->value)) {
        snprintf(text, size, "RMSE unknown in %.*f s (CPU %.*f s)", places(wall_s), wall_s, places(cpu_s), cpu_s);
        return;
    }
    int length = snprintf(text, size, "RMSE %.3g [%.3g, %.3g] in %.*f s (CPU %.*f s)", e->value, e->low, e->high,
                          places(wall_s), wall_s, places(cpu_s), cpu_s);
    if (!(e->value > 0) || length < 0 || (size_t)length >= size) return;
    double longer_s = wall_s + render_s * (pow(2, 1 / slope(o)) - 1);
    snprintf(text + length, size - (size_t)length, "; %.2g would take about %.*f s", e->value / 2, places(longer_s),
             longer_s);
}
