/* How wrong a rendered picture is, and how it got there. Errors are those of error_report.h. */
#ifndef RT_RENDER_OUTCOME_H
#define RT_RENDER_OUTCOME_H

#include "common/err.h"
#include "render/error_map.h"
#include "render/error_report.h"
#include "render/settings.h"
#include "render/stats.h"

/* Intervals hold with all but this probability. */
#define ERROR_ALPHA 0.05

typedef struct {
    CurvePoint *point;           /* in order of time; the last is the finished picture */
    size_t count, room;
    Estimate rmse;               /* by the audit, without one by the replicates; NAN if there are none either */
    bool has_pixel_error;        /* the map holds the squared error of each pixel */
    double median_error, p99_error;
    ErrorMap map;
    double true_rmse;            /* against the reference; NAN without one */
    uint64_t clipped;            /* pixels with a channel outside [0,1] */
    bool ended_by_clock;         /* the deadline came before the goal, or there was none */
} RenderOutcome;

/* A point on the curve. False and *err without memory. */
bool outcome_add_point(RenderOutcome *outcome, const CurvePoint *point, Err *err);

/* Sets true_rmse from the map. */
void outcome_set_true_error(RenderOutcome *outcome, const RenderSettings *settings);

/* Median and 99th percentile, from the map. False and *err without memory. */
bool outcome_set_pixel_error(RenderOutcome *outcome, Err *err);

void outcome_destroy(RenderOutcome *outcome);

#endif
