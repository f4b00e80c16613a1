#include "render/error_plot.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tools/escape.h"

/* The page and the frame in it, in pixels; the plotted values keep `MARGIN` of the frame's sides free. */
#define WIDTH 720.0
#define HEIGHT 480.0
#define LEFT 78.0
#define RIGHT 696.0
#define TOP 92.0
#define BOTTOM 420.0
#define MARGIN 0.06

#define LABELS 8            /* at most so many decades have a label */
#define FINE_DECADES 2.5    /* axes not longer than this have labels at 2 and 5 too */
#define GRID_DECADES 6      /* and not longer than this, lines at 2 to 9 */
#define TITLE_LETTERS 64
#define TEXT_ABOVE 6.0      /* from a line up to the foot of its label */
#define TEXT_HEIGHT 14.0
#define LETTER_WIDTH 6.3    /* of a wide sans-serif of 12 pixels, on average */
#define DOT 3.8             /* a point's radius */

#define SVG_NAMESPACE "http://www.w3.org/2000/svg"
#define FONTS "Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif"
#define LINE "stroke-width=\"1.4\""
#define MINUS "&#8722;"
#define TIMES "&#215;"

#define AUDITED "#1b6ca8"
#define PREDICTED "#5f6b76"
#define FITTED "#117733"
#define FLOOR "#c2410c"
#define TRUE_ERROR "#8b1e8b"

typedef struct { double low, high; } Range;    /* in decades */

typedef struct {
    FILE *out;
    const ErrorReport *report;
    Range x, y;
} Plot;

static double at_x(const Plot *plot, double s)
{
    return LEFT + (RIGHT - LEFT) * (log10(s) - plot->x.low) / (plot->x.high - plot->x.low);
}

static double at_y(const Plot *plot, double error)
{
    return BOTTOM - (BOTTOM - TOP) * (log10(error) - plot->y.low) / (plot->y.high - plot->y.low);
}

/* Logarithms can show it. */
static bool shows(double x) { return x > 0 && isfinite(x); }

/* ---- the axes' ranges ---- */

static void take(Range *range, double x)
{
    if (!shows(x)) return;
    range->low = fmin(range->low, log10(x));
    range->high = fmax(range->high, log10(x));
}

/* An interval's end far below its value doesn't stretch the axis; its bar then runs out of the frame. */
static void take_estimate(Range *range, const Estimate *e)
{
    take(range, e->value);
    take(range, e->high);
    take(range, fmax(e->low, e->value / 10));
}

/* A decade at least, whole in the middle of what is shown, and some room at both ends. */
static Range finish_range(Range range)
{
    if (range.low > range.high) range = (Range){0, 0};
    double short_by = fmax(0, 1 - (range.high - range.low)) / 2, room = (range.high - range.low) * MARGIN;
    return (Range){range.low - short_by - room, range.high + short_by + room};
}

static void set_ranges(Plot *plot)
{
    const ErrorReport *r = plot->report;
    plot->x = plot->y = (Range){INFINITY, -INFINITY};
    take(&plot->y, error_report_rounding(8));
    take(&plot->y, r->goal_error);
    for (size_t i = 0; i < r->count; i++) {
        const CurvePoint *p = &r->point[i];
        take(&plot->x, p->wall_s);
        take(&plot->y, p->predicted);
        if (p->audited) take_estimate(&plot->y, &p->audit);
    }
    take_estimate(&plot->y, &r->rmse);
    if (r->has_reference) take_estimate(&plot->y, &r->reference);
    plot->x = finish_range(plot->x);
    plot->y = finish_range(plot->y);
}

/* ---- frame and ticks ---- */

typedef struct { bool vertical; Range range; const char *name; } Axis;

/* Where 10^decade lies on the axis. */
static double axis_at(const Axis *axis, double decade)
{
    double share = (decade - axis->range.low) / (axis->range.high - axis->range.low);
    return axis->vertical ? BOTTOM - (BOTTOM - TOP) * share : LEFT + (RIGHT - LEFT) * share;
}

static bool is_on(const Axis *axis, double decade) { return decade >= axis->range.low && decade <= axis->range.high; }

static void draw_grid_line(FILE *out, const Axis *axis, double at, const char *colour)
{
    if (axis->vertical)
        fprintf(out, "<path d=\"M%.2f %.2fH%.2f\" stroke=\"%s\"/>\n", LEFT, at, RIGHT, colour);
    else
        fprintf(out, "<path d=\"M%.2f %.2fV%.2f\" stroke=\"%s\"/>\n", at, TOP, BOTTOM, colour);
}

/* digit * 10^exponent: "0.002", "20", or as a power where zeros would have to be counted. */
static void draw_tick_label(FILE *out, const Axis *axis, double at, int digit, int exponent, bool plain)
{
    double x = axis->vertical ? LEFT - 8 : at, y = axis->vertical ? at + 4 : BOTTOM + 18;
    fprintf(out, "<text x=\"%.2f\" y=\"%.2f\" text-anchor=\"%s\">", x, y, axis->vertical ? "end" : "middle");
    if (plain) {
        fprintf(out, "%.*f", exponent < 0 ? -exponent : 0, digit * pow(10, exponent));
    } else {
        if (digit > 1) fprintf(out, "%d&#183;", digit);
        fprintf(out, "10<tspan dy=\"-5\" font-size=\"9\">%s%d</tspan>", exponent < 0 ? MINUS : "", abs(exponent));
    }
    fputs("</text>\n", out);
}

static void draw_axis(FILE *out, const Axis *axis)
{
    double span = axis->range.high - axis->range.low;
    int first = (int)floor(axis->range.low), last = (int)floor(axis->range.high);
    int step = 1 + (int)(span / LABELS);
    bool plain = axis->range.low >= -5 && axis->range.high < 6;
    for (int e = first; e <= last; e++) {
        for (int digit = 1; digit <= 9; digit++) {
            double decade = e + log10(digit), at = axis_at(axis, decade);
            bool labelled = digit == 1 ? e % step == 0 : (digit == 2 || digit == 5) && span <= FINE_DECADES;
            if (!is_on(axis, decade) || !(labelled || span <= GRID_DECADES)) continue;
            draw_grid_line(out, axis, at, labelled ? "#d4d8dc" : "#eef0f2");
            if (labelled) draw_tick_label(out, axis, at, digit, e, plain);
        }
    }
    if (axis->vertical)
        fprintf(out, "<text transform=\"translate(20 %.2f) rotate(-90)\"", (TOP + BOTTOM) / 2);
    else
        fprintf(out, "<text x=\"%.2f\" y=\"%.2f\"", (LEFT + RIGHT) / 2, BOTTOM + 42);
    fprintf(out, " text-anchor=\"middle\" font-size=\"13\">%s</text>\n", axis->name);
}

/* ---- title ---- */

static const char *base_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

static void draw_title(const Plot *plot)
{
    const ErrorReport *r = plot->report;
    const CurvePoint *end = &r->point[r->count - 1];
    FILE *out = plot->out;
    fprintf(out, "<text x=\"%.2f\" y=\"26\" font-size=\"16\" font-weight=\"bold\">", LEFT);
    escape_xml(out, base_name(r->script), TITLE_LETTERS);
    fprintf(out, "</text>\n<text x=\"%.2f\" y=\"47\" font-size=\"13\">", LEFT);
    fprintf(out, "%" PRIu32 " " TIMES " %" PRIu32 ", ", r->width, r->height);
    double samples = (double)end->samples / ((double)r->width * r->height);
    if (r->goal_samples) fprintf(out, "%" PRIu32 " sample%s a pixel", r->goal_samples, r->goal_samples == 1 ? "" : "s");
    else fprintf(out, "%.3g samples a pixel", samples);
    if (isfinite(r->rmse.value)) {
        fprintf(out, ": RMSE %.3g", r->rmse.value);
        if (isfinite(r->rmse.low) && isfinite(r->rmse.high)) fprintf(out, " [%.3g, %.3g]", r->rmse.low, r->rmse.high);
    }
    if (isfinite(end->wall_s)) fprintf(out, " in %.*g s", end->wall_s < 1000 ? 3 : 6, end->wall_s);
    fprintf(out, "%s</text>\n", r->ended_by_clock ? ", ended by the clock" : "");
}

/* ---- what is plotted ---- */

/* Whether a point of the curve lies where a label of that width would begin at x with its foot at y. */
static bool is_taken(const Plot *plot, double x, double y, double width)
{
    const ErrorReport *r = plot->report;
    for (size_t i = 0; i < r->count; i++) {
        const CurvePoint *p = &r->point[i];
        double error = p->audited ? p->audit.value : p->predicted;
        if (!shows(p->wall_s) || !shows(error)) continue;
        double px = at_x(plot, p->wall_s), py = at_y(plot, error);
        if (px > x - DOT && px < x + width + DOT && py > y - TEXT_HEIGHT - DOT && py < y + DOT) return true;
    }
    return false;
}

/* A horizontal line and its label, above or below it, at the end where the curve isn't. */
static void draw_level(const Plot *plot, double error, const char *colour, const char *dashes, const char *name, bool below)
{
    char text[64];
    double y = at_y(plot, error), foot = below ? y + TEXT_HEIGHT : y - TEXT_ABOVE;
    snprintf(text, sizeof text, "%s %.3g", name, error);
    bool right = is_taken(plot, LEFT + 8, foot, LETTER_WIDTH * (double)strlen(text));
    fprintf(plot->out, "<path d=\"M%.2f %.2fH%.2f\" stroke=\"%s\" " LINE " stroke-dasharray=\"%s\"/>\n", LEFT, y, RIGHT,
            colour, dashes);
    fprintf(plot->out, "<text class=\"over\" x=\"%.2f\" y=\"%.2f\" text-anchor=\"%s\" fill=\"%s\">%s</text>\n",
            right ? RIGHT - 8 : LEFT + 8, foot, right ? "end" : "start", colour, text);
}

/* The lower of two near lines has its label below. */
static void draw_levels(const Plot *plot)
{
    double floor_error = error_report_rounding(8), goal = plot->report->goal_error;
    bool has_goal = shows(goal);
    bool near = has_goal && fabs(at_y(plot, goal) - at_y(plot, floor_error)) < TEXT_HEIGHT + TEXT_ABOVE;
    draw_level(plot, floor_error, FLOOR, "7 4", "8-bit rounding", near && floor_error < goal);
    if (has_goal) draw_level(plot, goal, "#333", "2 3", "goal", near && floor_error >= goal);
}

/* A bar from low to high with caps; ends outside the frame are cut there and have none. */
static void draw_bar(const Plot *plot, double x, const Estimate *e, const char *colour)
{
    if (!shows(e->high)) return;
    double top = at_y(plot, e->high), bottom = shows(e->low) ? at_y(plot, e->low) : BOTTOM + 1;
    fprintf(plot->out, "<path d=\"M%.2f %.2fh8m-4 0V%.2f", x - 4, top, fmin(bottom, BOTTOM));
    if (bottom <= BOTTOM) fputs("m-4 0h8", plot->out);
    fprintf(plot->out, "\" fill=\"none\" stroke=\"%s\" stroke-width=\"1.5\"/>\n", colour);
}

static void draw_dot(FILE *out, double x, double y, const char *fill, const char *stroke)
{
    fprintf(out, "<circle cx=\"%.2f\" cy=\"%.2f\" r=\"%g\" fill=\"%s\" stroke=\"%s\" stroke-width=\"1.5\"/>\n", x, y, DOT,
            fill, stroke);
}

static void draw_diamond(FILE *out, double x, double y)
{
    fprintf(out, "<path d=\"M%.2f %.2fl5.5 5.5l-5.5 5.5l-5.5 -5.5z\" fill=\"%s\"/>\n", x, y - 5.5, TRUE_ERROR);
}

/* No error was seen: a triangle that points down, at the frame's foot. */
static void draw_zero(FILE *out, double x, double y, const char *colour)
{
    fprintf(out, "<path d=\"M%.2f %.2fh10l-5 9z\" fill=\"%s\"/>\n", x - 5, y - 9, colour);
}

static void draw_value(const Plot *plot, double x, double error, const char *fill, const char *stroke)
{
    if (shows(error)) draw_dot(plot->out, x, at_y(plot, error), fill, stroke);
    else if (error == 0) draw_zero(plot->out, x, BOTTOM, stroke);
}

static void draw_predicted(const Plot *plot)
{
    const ErrorReport *r = plot->report;
    bool begun = false;
    for (size_t i = 0; i < r->count; i++) {
        const CurvePoint *p = &r->point[i];
        if (!shows(p->wall_s) || !shows(p->predicted)) continue;
        fprintf(plot->out, "%s%.2f %.2f", begun ? "L" : "<path d=\"M", at_x(plot, p->wall_s), at_y(plot, p->predicted));
        begun = true;
    }
    if (begun) fprintf(plot->out, "\" fill=\"none\" stroke=\"%s\"/>\n", PREDICTED);
    for (size_t i = 0; i < r->count; i++)
        if (shows(r->point[i].wall_s))
            draw_value(plot, at_x(plot, r->point[i].wall_s), r->point[i].predicted, "#fff", PREDICTED);
}

/* Audited points; the last one shows the outcome, which knows more than its audit alone. */
static void draw_audited(const Plot *plot)
{
    const ErrorReport *r = plot->report;
    for (size_t i = 0; i < r->count; i++) {
        const CurvePoint *p = &r->point[i];
        double x = at_x(plot, p->wall_s);
        if (!shows(p->wall_s)) continue;
        const Estimate *e = i + 1 == r->count ? &r->rmse : &p->audit;
        if (p->audited || e == &r->rmse) draw_bar(plot, x, e, p->audited ? AUDITED : PREDICTED);
        if (p->audited) draw_value(plot, x, e->value, AUDITED, AUDITED);
    }
    const CurvePoint *end = &r->point[r->count - 1];
    if (!r->has_reference || !shows(end->wall_s) || !shows(r->reference.value)) return;
    double x = at_x(plot, end->wall_s);
    if (r->reference.high > r->reference.low) draw_bar(plot, x, &r->reference, TRUE_ERROR);
    draw_diamond(plot->out, x, at_y(plot, r->reference.value));
}

static void draw_fit(const Plot *plot, const ErrorFit *fit)
{
    double y[2];
    for (int i = 0; i < 2; i++) {
        double decade = fit->slope * (i ? plot->x.high : plot->x.low) + fit->log10_at_1;
        y[i] = BOTTOM - (BOTTOM - TOP) * (decade - plot->y.low) / (plot->y.high - plot->y.low);
    }
    fprintf(plot->out, "<path d=\"M%.2f %.2fL%.2f %.2f\" stroke=\"" FITTED "\" " LINE
            " clip-path=\"url(#frame)\"/>\n", LEFT, y[0], RIGHT, y[1]);
}

/* ---- legend, on one line above the frame ---- */

#define LEGEND_Y 78.0

/* As shown: "&#8722;" is one. */
static size_t letters(const char *text)
{
    size_t n = 0;
    for (bool entity = false; *text; text++) {
        entity = entity ? *text != ';' : *text == '&';
        n += !entity;
    }
    return n;
}

/* Its mark, drawn before, takes 22 pixels; returns where the next entry begins. */
static double draw_entry(FILE *out, double x, const char *text)
{
    fprintf(out, "<text x=\"%.2f\" y=\"%.2f\">%s</text>\n", x + 22, LEGEND_Y, text);
    return x + 22 + LETTER_WIDTH * (double)letters(text) + 16;
}

typedef struct { bool predicted, audited, zero; } Shown;

static Shown what_is_shown(const ErrorReport *r)
{
    Shown shown = {false, false, false};
    for (size_t i = 0; i < r->count; i++) {
        const CurvePoint *p = &r->point[i];
        shown.predicted |= shows(p->predicted);
        shown.audited |= p->audited;
        shown.zero |= p->predicted == 0 || (p->audited && p->audit.value == 0);
    }
    return shown;
}

static void draw_legend(const Plot *plot, const ErrorFit *fit, Shown shown)
{
    const ErrorReport *r = plot->report;
    FILE *out = plot->out;
    double x = LEFT, y = LEGEND_Y - 4;
    if (shown.audited) {
        fprintf(out, "<path d=\"M%.2f %.2fv14m-3 0h6m-6 -14h6\" stroke=\"" AUDITED "\" " LINE "/>\n", x + 8, y - 7);
        draw_dot(out, x + 8, y, AUDITED, AUDITED);
        x = draw_entry(out, x, "audit, 95 % interval");
    }
    if (shown.predicted) {
        fprintf(out, "<path d=\"M%.2f %.2fh18\" stroke=\"%s\"/>\n", x - 1, y, PREDICTED);
        draw_dot(out, x + 8, y, "#fff", PREDICTED);
        x = draw_entry(out, x, "by replicates");
    }
    if (shown.zero) {
        draw_zero(out, x + 8, y + 4, PREDICTED);
        x = draw_entry(out, x, "none seen");
    }
    if (isfinite(fit->slope)) {
        char text[48];
        snprintf(text, sizeof text, "fit, slope %s%.2f", fit->slope < 0 ? MINUS : "", fabs(fit->slope));
        fprintf(out, "<path d=\"M%.2f %.2fh18\" stroke=\"" FITTED "\" " LINE "/>\n", x - 1, y);
        x = draw_entry(out, x, text);
    }
    if (r->has_reference) {
        draw_diamond(out, x + 8, y);
        draw_entry(out, x, "true error");
    }
}

/* ---- the whole ---- */

void error_plot_write(FILE *out, const ErrorReport *report)
{
    Plot plot = {.out = out, .report = report};
    Shown shown = what_is_shown(report);
    set_ranges(&plot);
    ErrorFit fit = error_report_fit(report->point, report->count, ERROR_FIT_WALL);
    fprintf(out, "<svg xmlns=\"" SVG_NAMESPACE "\" width=\"%g\" height=\"%g\" viewBox=\"0 0 %g %g\" "
            "font-family=\"" FONTS "\" font-size=\"12\" fill=\"#222\">\n<title>RMSE against run time: ", WIDTH, HEIGHT,
            WIDTH, HEIGHT);
    escape_xml(out, base_name(report->script), TITLE_LETTERS);
    fprintf(out, "</title>\n<style>.over { paint-order: stroke; stroke: #fff; stroke-width: 4px }</style>\n"
            "<clipPath id=\"frame\"><path d=\"M%g %gH%gV%gH%gz\"/></clipPath>\n"
            "<rect width=\"100%%\" height=\"100%%\" fill=\"#fff\"/>\n", LEFT, TOP, RIGHT, BOTTOM, LEFT);
    draw_title(&plot);
    draw_axis(out, &(Axis){false, plot.x, "seconds by the clock, start of the program included"});
    draw_axis(out, &(Axis){true, plot.y, "RMSE, linear light"});
    draw_legend(&plot, &fit, shown);
    if (isfinite(fit.slope)) draw_fit(&plot, &fit);
    draw_levels(&plot);
    draw_predicted(&plot);
    draw_audited(&plot);
    fprintf(out, "<path d=\"M%g %gH%gV%gH%gz\" fill=\"none\" stroke=\"#222\"/>\n", LEFT, TOP, RIGHT, BOTTOM, LEFT);
    if (!shown.predicted && !shown.audited && !shown.zero)
        fprintf(out, "<text x=\"%.2f\" y=\"%.2f\" text-anchor=\"middle\" font-size=\"14\">no error is known: "
                "one sample a pixel and no audit</text>\n", (LEFT + RIGHT) / 2, TOP + 40);
    fputs("</svg>\n", out);
}
