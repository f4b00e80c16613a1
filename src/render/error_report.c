#include "render/error_report.h"

#include <inttypes.h>
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "render/error_plot.h"
#include "tools/escape.h"

double error_report_rounding(unsigned bits)
{
    return bits ? 1 / ((exp2((double)bits) - 1) * sqrt(12)) : 0;
}

/* ---- the fitted slope ---- */

static double fit_x(const CurvePoint *p, ErrorFitX x)
{
    switch (x) {
    case ERROR_FIT_WALL: return p->wall_s;
    case ERROR_FIT_CPU: return p->cpu_s;
    case ERROR_FIT_SAMPLES: return (double)p->samples;
    }
    return NAN;
}

static bool has_logarithm(double x) { return x > 0 && isfinite(x); }

/* Of the audited errors or of the predicted ones. Means and moments are updated point by point (Welford 1962), so that
 * values far from 1 lose no digits. */
static ErrorFit fit_errors(const CurvePoint *point, size_t count, ErrorFitX x, bool audited)
{
    double n = 0, mean_x = 0, mean_y = 0, xx = 0, xy = 0;
    for (size_t i = 0; i < count; i++) {
        double error = audited ? point[i].audit.value : point[i].predicted;
        if ((audited && !point[i].audited) || !has_logarithm(error) || !has_logarithm(fit_x(&point[i], x))) continue;
        double at = log10(fit_x(&point[i], x)), off = at - mean_x;
        n++;
        mean_x += off / n;
        mean_y += (log10(error) - mean_y) / n;
        xx += off * (at - mean_x);
        xy += off * (log10(error) - mean_y);
    }
    double slope = xx > 0 ? xy / xx : NAN;
    return (ErrorFit){slope, mean_y - slope * mean_x};
}

ErrorFit error_report_fit(const CurvePoint *point, size_t count, ErrorFitX x)
{
    ErrorFit fit = fit_errors(point, count, x, true);
    return isfinite(fit.slope) ? fit : fit_errors(point, count, x, false);
}

/* ---- numbers ---- */

/* Digits that bring a float's measurements back; JSON and CSV have no NaN. */
static void write_number(FILE *out, double x, const char *unknown)
{
    if (isfinite(x)) fprintf(out, "%.9g", x);
    else fputs(unknown, out);
}

/* A goal of 0 is none. */
static double known(double goal) { return goal > 0 ? goal : NAN; }

/* ---- JSON ---- */

static void write_field(FILE *out, const char *name, double x)
{
    fprintf(out, "\"%s\": ", name);
    write_number(out, x, "null");
}

static void write_estimate(FILE *out, const char *name, const Estimate *e)
{
    fprintf(out, "\"%s\": {", name);
    write_field(out, "value", e->value);
    fputs(", ", out);
    write_field(out, "low", e->low);
    fputs(", ", out);
    write_field(out, "high", e->high);
    fputs("}", out);
}

static void write_text(FILE *out, const char *name, const char *text)
{
    fprintf(out, "  \"%s\": ", name);
    if (text) escape_json(out, text, strlen(text));
    else fputs("null", out);
    fputs(",\n", out);
}

/* What wasn't asked for is null. */
static void write_goal(FILE *out, const ErrorReport *r)
{
    fputs("  \"goal\": {", out);
    write_field(out, "samples", known(r->goal_samples));
    fputs(", ", out);
    write_field(out, "error", known(r->goal_error));
    fputs(", ", out);
    write_field(out, "time_s", known(r->goal_time_s));
    fprintf(out, "},\n  \"ended_by_clock\": %s,\n", r->ended_by_clock ? "true" : "false");
}

static void write_point(FILE *out, const CurvePoint *p)
{
    fputs("    {", out);
    write_field(out, "wall_s", p->wall_s);
    fputs(", ", out);
    write_field(out, "cpu_s", p->cpu_s);
    fprintf(out, ", \"rays\": %" PRIu64 ", \"samples\": %" PRIu64 ", ", p->rays, p->samples);
    write_field(out, "predicted", p->predicted);
    fputs(", ", out);
    if (p->audited) write_estimate(out, "audit", &p->audit);
    else fputs("\"audit\": null", out);
    fputs(", ", out);
    write_field(out, "greatest_diff", p->greatest_diff);
    fputs(", ", out);
    write_field(out, "unfinished", p->unfinished);
    fputs("}", out);
}

static void write_sources(FILE *out, const ErrorReport *r)
{
    fputs("  \"sources\": {\n    ", out);
    write_estimate(out, "spatial", &r->spatial);
    fputs(",\n    ", out);
    write_field(out, "truncation", r->truncation);
    fputs(",\n    \"numerical\": ", out);
    if (r->numerical_measured) {
        fprintf(out, "{\"rays\": %" PRIu64 ", \"wrong\": %" PRIu64 ", ", r->numerical_rays, r->numerical_wrong);
        write_field(out, "greatest_error", r->numerical_error);
        fputs("}", out);
    } else {
        fputs("\"not measured\"", out);
    }
    fprintf(out, ",\n    \"clipped_pixels\": %" PRIu64 ",\n    ", r->clipped);
    write_field(out, "rounding", error_report_rounding(r->bits));
    fputs("\n  },\n", out);
}

static void write_json(FILE *out, const ErrorReport *r)
{
    const CurvePoint *end = &r->point[r->count - 1];
    fputs("{\n", out);
    write_text(out, "script", r->script);
    write_text(out, "picture", r->picture);
    fprintf(out, "  \"width\": %" PRIu32 ",\n  \"height\": %" PRIu32 ",\n", r->width, r->height);
    fprintf(out, "  \"threads\": %" PRIu32 ",\n  \"max_depth\": %" PRIu32 ",\n", r->threads, r->max_depth);
    fprintf(out, "  \"seed\": %" PRIu64 ",\n", r->seed);
    write_goal(out, r);
    fputs("  ", out);
    write_estimate(out, "rmse", &r->rmse);
    fputs(",\n  ", out);
    write_field(out, "wall_s", end->wall_s);
    fputs(",\n  ", out);
    write_field(out, "cpu_s", end->cpu_s);
    fprintf(out, ",\n  \"rays\": %" PRIu64 ",\n  \"samples\": %" PRIu64 ",\n  \"curve\": [\n", end->rays, end->samples);
    for (size_t i = 0; i < r->count; i++) {
        write_point(out, &r->point[i]);
        fputs(i + 1 < r->count ? ",\n" : "\n", out);
    }
    fputs("  ],\n  ", out);
    write_field(out, "slope", error_report_fit(r->point, r->count, ERROR_FIT_WALL).slope);
    fputs(",\n  ", out);
    write_field(out, "slope_cpu", error_report_fit(r->point, r->count, ERROR_FIT_CPU).slope);
    fputs(",\n  ", out);
    write_field(out, "slope_samples", error_report_fit(r->point, r->count, ERROR_FIT_SAMPLES).slope);
    fputs(",\n", out);
    if (r->has_reference) {
        fputs("  ", out);
        write_estimate(out, "reference", &r->reference);
        fputs(",\n", out);
    }
    if (r->has_pixel_error) {
        fputs("  \"pixels\": {", out);
        write_field(out, "median", r->median_error);
        fputs(", ", out);
        write_field(out, "p99", r->p99_error);
        fputs("},\n", out);
    }
    write_sources(out, r);
    fprintf(out, "  \"bits\": %u\n}\n", r->bits);
}

/* ---- CSV: a row for each point; what is said of the finished picture alone stands in the last ---- */

static const char csv_head[] =
    "script,picture,width,height,seed,goal_samples,goal_error,goal_time_s,wall_s,cpu_s,rays,samples,predicted,"
    "audit,audit_low,audit_high,greatest_diff,unfinished,"
    "rmse,rmse_low,rmse_high,median_error,p99_error,truncation,clipped_pixels,rounding,"
    "reference,reference_low,reference_high\n";

static void write_cells(FILE *out, const double *x, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        fputc(',', out);
        write_number(out, x[i], "");
    }
}

static void write_row(FILE *out, const ErrorReport *r, const CurvePoint *p, bool last)
{
    const Estimate none = {NAN, NAN, NAN};
    Estimate audit = p->audited ? p->audit : none, rmse = last ? r->rmse : none;
    Estimate reference = last && r->has_reference ? r->reference : none;
    bool pixels = last && r->has_pixel_error;
    escape_csv(out, r->script);
    fputc(',', out);
    escape_csv(out, r->picture ? r->picture : "");
    fprintf(out, ",%" PRIu32 ",%" PRIu32 ",%" PRIu64, r->width, r->height, r->seed);
    write_cells(out, (double[]){known(r->goal_samples), known(r->goal_error), known(r->goal_time_s), p->wall_s,
                                p->cpu_s}, 5);
    fprintf(out, ",%" PRIu64 ",%" PRIu64, p->rays, p->samples);
    write_cells(out, (double[]){p->predicted, audit.value, audit.low, audit.high, p->greatest_diff, p->unfinished,
                                rmse.value, rmse.low, rmse.high, pixels ? r->median_error : NAN,
                                pixels ? r->p99_error : NAN, last ? r->truncation : NAN}, 12);
    if (last) fprintf(out, ",%" PRIu64, r->clipped);
    else fputc(',', out);
    double rounding = last ? error_report_rounding(r->bits) : NAN;
    write_cells(out, (double[]){rounding, reference.value, reference.low, reference.high}, 4);
    fputc('\n', out);
}

static void write_csv(FILE *out, const ErrorReport *r)
{
    fputs(csv_head, out);
    for (size_t i = 0; i < r->count; i++) write_row(out, r, &r->point[i], i + 1 == r->count);
}

/* ---- files ---- */

bool error_report_kind(const char *path, ErrorReportKind *kind, Err *err)
{
    static const char *const ending[] = {
        [ERROR_REPORT_JSON] = ".json", [ERROR_REPORT_CSV] = ".csv", [ERROR_REPORT_SVG] = ".svg",
    };
    size_t length = strlen(path);
    for (size_t i = 0; i < sizeof ending / sizeof ending[0]; i++) {
        size_t n = strlen(ending[i]);
        if (length <= n || strcasecmp(path + length - n, ending[i]) != 0) continue;
        *kind = (ErrorReportKind)i;
        return true;
    }
    return err_set(err, ERR_USAGE, "--report must end in .json, .csv or .svg, not '%s'", path);
}

static void write_kind(FILE *out, const ErrorReport *report, ErrorReportKind kind)
{
    switch (kind) {
    case ERROR_REPORT_JSON: write_json(out, report); break;
    case ERROR_REPORT_CSV: write_csv(out, report); break;
    case ERROR_REPORT_SVG: error_plot_write(out, report); break;
    }
}

/* Numbers have a point whatever the program's locale is. */
bool error_report_write(const ErrorReport *report, ErrorReportKind kind, char **text, size_t *size, Err *err)
{
    *text = NULL;
    *size = 0;
    FILE *out = open_memstream(text, size);
    locale_t c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    bool ok = out && c_locale;
    if (ok) {
        locale_t before = uselocale(c_locale);
        write_kind(out, report, kind);
        uselocale(before);
        ok = !ferror(out);
    }
    if (out) ok = fclose(out) == 0 && ok;
    if (c_locale) freelocale(c_locale);
    if (ok) return true;
    free(*text);
    *text = NULL;
    return err_memory(err, "the report of the error");
}
