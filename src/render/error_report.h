/* How wrong a picture is, against what it cost: the curve of error over time and the sources of error, as JSON, as CSV and
 * as a plot (--report). Errors are RMSE over pixels and channels, in linear light before clamping; NAN: not known. */
#ifndef RT_RENDER_ERROR_REPORT_H
#define RT_RENDER_ERROR_REPORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "common/err.h"

/* A value and its 95 % interval. */
typedef struct { double value, low, high; } Estimate;

/* The picture at one moment of the render. */
typedef struct {
    double wall_s, cpu_s;       /* of the whole process so far, set-up included */
    uint64_t rays, samples;
    double predicted;           /* error by the difference of the replicates; NAN: there is none */
    bool audited;
    Estimate audit;             /* by fresh samples; without meaning unless audited */
    double greatest_diff;       /* greatest |A - B| of a pixel and channel; NAN: no replicates */
    double unfinished;          /* share of the pixels that would get more samples, [0,1] */
} CurvePoint;

typedef struct {
    const char *script, *picture;
    uint32_t width, height;     /* of what was rendered */
    uint32_t threads, max_depth;
    uint64_t seed;
    uint32_t goal_samples;      /* per pixel (-s); 0: goals decide */
    double goal_error;          /* --error; 0: none */
    double goal_time_s;         /* --time; 0: none */
    bool ended_by_clock;        /* the picture depends on the machine's speed */
    const CurvePoint *point;    /* in order of time; the last is the finished picture */
    size_t count;               /* >= 1 */
    Estimate rmse;              /* the outcome: of the audit, without one of the replicates */
    bool has_pixel_error;
    double median_error, p99_error;   /* of the pixels' standard errors */
    Estimate spatial;           /* what the samples' number leaves, of rmse */
    double truncation;          /* upper bound on the share of the light that --max-depth dropped, [0,1] */
    bool numerical_measured;
    uint64_t numerical_rays, numerical_wrong;   /* traced again in more precision; with another hit */
    double numerical_error;     /* greatest relative error of t among the others */
    uint64_t clipped;           /* pixels with a channel outside [0,1] */
    unsigned bits;              /* of the picture's samples: 8, 16; 0: floats, neither clamped nor rounded */
    bool has_reference;
    Estimate reference;         /* true error against --reference; without an interval all three are equal */
} ErrorReport;

/* The error that rounding to so many bits adds: a step of 1 / (2^bits - 1), evenly distributed, has the standard deviation
 * step / sqrt 12. 0 for 0 bits. */
double error_report_rounding(unsigned bits);

/* error = 10^log10_at_1 * x^slope, by least squares of the logarithms where both are above 0. Audited errors if two points
 * with different x have them, otherwise predicted ones. The slope is NAN unless two x differ. */
typedef struct { double slope, log10_at_1; } ErrorFit;
typedef enum { ERROR_FIT_WALL, ERROR_FIT_CPU, ERROR_FIT_SAMPLES } ErrorFitX;
ErrorFit error_report_fit(const CurvePoint *point, size_t count, ErrorFitX x);

typedef enum { ERROR_REPORT_JSON, ERROR_REPORT_CSV, ERROR_REPORT_SVG } ErrorReportKind;

/* By the name's ending, .json, .csv or .svg in any case. False and *err (ERR_USAGE) for others. */
bool error_report_kind(const char *path, ErrorReportKind *kind, Err *err);

/* *text is malloc'ed, `size` bytes and a NUL. False and *err (ERR_LIMIT) without memory. */
bool error_report_write(const ErrorReport *report, ErrorReportKind kind, char **text, size_t *size, Err *err);

#endif
