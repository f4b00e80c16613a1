#include "compare/compare.h"

#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>

#include "compare/flip.h"
#include "compare/ssim.h"

static const double LEVELS = 255;

CompareSettings compare_defaults(void)
{
    return (CompareSettings){.max_rmse = (double)INFINITY, .max_diff = (double)INFINITY, .max_share = 100};
}

/* ---- differences ---- */

static const float *pixel(const Image *image, uint32_t x, uint32_t y)
{
    return image->rgb + 3 * ((size_t)y * image->width + x);
}

/* |p / white_p - q / white_q|. A PNG's levels make the products exact, so that k of 255 levels give what k / 255 does. */
static double difference(double p, double white_p, double q, double white_q)
{
    return fabs(p * white_q - q * white_p) / (white_p * white_q);
}

static double greatest_difference(const float *p, double white_p, const float *q, double white_q)
{
    double most = 0;
    for (int k = 0; k < 3; k++) most = fmax(most, difference((double)p[k], white_p, (double)q[k], white_q));
    return most;
}

static double sum_of_squares(const float *p, double white_p, const float *q, double white_q)
{
    double sum = 0;
    for (int k = 0; k < 3; k++) {
        double d = difference((double)p[k], white_p, (double)q[k], white_q);
        sum += d * d;
    }
    return sum;
}

/* Whether two neighbours within `reach` pixels of (x, y) differ by `step` or more. */
static bool near_step(const Image *image, uint32_t x, uint32_t y, uint32_t reach, double step)
{
    uint32_t x0 = x > reach ? x - reach : 0, x1 = reach < image->width - x ? x + reach : image->width - 1;
    uint32_t y0 = y > reach ? y - reach : 0, y1 = reach < image->height - y ? y + reach : image->height - 1;
    double white = image->white;
    for (uint32_t j = y0; j <= y1; j++) {
        for (uint32_t i = x0; i <= x1; i++) {
            const float *p = pixel(image, i, j);
            if (i < x1 && greatest_difference(p, white, pixel(image, i + 1, j), white) >= step) return true;
            if (j < y1 && greatest_difference(p, white, pixel(image, i, j + 1), white) >= step) return true;
        }
    }
    return false;
}

/* A pixel that differs by d > tolerance. An edge that lies a fraction of a pixel elsewhere changes it by no more than the
 * step at the edge, but for the shading: half is asked for, and more than is tolerated. */
static void count_differing(const Image *a, const Image *b, const CompareSettings *s, uint32_t x, uint32_t y, double d,
                            Comparison *result)
{
    result->differing++;
    if (!s->only_edges) return;
    double step = fmax(d / 2, nextafter(s->tolerance / LEVELS, (double)INFINITY));
    if (near_step(a, x, y, s->reach, step) || near_step(b, x, y, s->reach, step)) return;
    if (result->stray++) return;
    result->stray_x = x;
    result->stray_y = y;
}

static void measure_differences(const Image *a, const Image *b, const CompareSettings *s, Comparison *result)
{
    double tolerance = s->tolerance / LEVELS, sum = 0;
    for (uint32_t y = 0; y < a->height; y++) {
        double of_row = 0;
        for (uint32_t x = 0; x < a->width; x++) {
            const float *p = pixel(a, x, y), *q = pixel(b, x, y);
            double d = greatest_difference(p, a->white, q, b->white);
            of_row += sum_of_squares(p, a->white, q, b->white);
            if (d > result->max_diff) {
                result->max_diff = d;
                result->max_x = x;
                result->max_y = y;
            }
            if (d > tolerance) count_differing(a, b, s, x, y, d, result);
        }
        sum += of_row;
    }
    result->pixels = (uint64_t)a->width * a->height;
    result->rmse = sqrt(sum / (3 * (double)result->pixels));
    result->psnr_db = result->rmse > 0 ? -20 * log10(result->rmse) : (double)INFINITY;
}

bool compare_images(const Image *a, const Image *b, const CompareSettings *settings, Comparison *result, Err *err)
{
    *result = (Comparison){0};
    measure_differences(a, b, settings, result);
    return ssim(a, b, &result->ssim, err) && flip(a, b, settings->linear, &result->flip, err);
}

/* ---- words ---- */

/* Appends to the text of `size` bytes, which is cut where it doesn't fit. */
static void append(char **text, size_t *size, const char *format, ...) __attribute__((format(printf, 3, 4)));
static void append(char **text, size_t *size, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    int n = vsnprintf(*text, *size, format, args);
    va_end(args);
    size_t written = n < 0 || *size == 0 ? 0 : (size_t)n < *size ? (size_t)n : *size - 1;
    *text += written;
    *size -= written;
}

static double share_percent(const Comparison *result)
{
    return 100 * (double)result->differing / (double)result->pixels;
}

/* Rounding may say neither that none of the pixels differ when some do, nor that all do when some don't. */
static double shown_percent(const Comparison *result)
{
    double percent = share_percent(result), step = 0.001;
    if (result->differing > 0 && percent < step) return step;
    if (result->differing < result->pixels && percent > 100 - step) return 100 - step;
    return percent;
}

/* No less than 1 is shown as 1. */
static double shown_ssim(double value) { return value < 1 ? fmin(value, 0.999999) : value; }

static const char *plural(double count) { return count == 1 ? "" : "s"; }

void compare_text(const Comparison *r, const CompareSettings *s, char *text, size_t size)
{
    append(&text, &size, "RMSE      %.6g\n", r->rmse);
    if (isinf(r->psnr_db)) append(&text, &size, "PSNR      inf dB\n");
    else append(&text, &size, "PSNR      %.3f dB\n", r->psnr_db);
    if (isnan(r->ssim)) append(&text, &size, "SSIM      none below 11 x 11 pixels\n");
    else append(&text, &size, "SSIM      %.6f\n", shown_ssim(r->ssim));
    append(&text, &size, "FLIP      %.6g\n", r->flip);
    append(&text, &size, "greatest  %.6g, %.6g level%s", r->max_diff, r->max_diff * LEVELS, plural(r->max_diff * LEVELS));
    if (r->max_diff > 0) append(&text, &size, ", at %" PRIu32 ",%" PRIu32, r->max_x, r->max_y);
    append(&text, &size, "\ndiffering %" PRIu64 " of %" PRIu64 " pixels, %.3f %%, by more than %.6g level%s\n",
           r->differing, r->pixels, shown_percent(r), s->tolerance, plural(s->tolerance));
}

bool compare_passes(const Comparison *r, const CompareSettings *s, char *text, size_t size)
{
    bool rmse = r->rmse <= s->max_rmse, greatest = r->max_diff <= s->max_diff;
    bool share = share_percent(r) <= s->max_share, edges = r->stray == 0;
    if (size > 0) *text = '\0';
    if (!rmse) append(&text, &size, "fails: RMSE %.6g is more than %.6g\n", r->rmse, s->max_rmse);
    if (!greatest)
        append(&text, &size, "fails: the greatest difference %.6g is more than %.6g\n", r->max_diff, s->max_diff);
    if (!share)
        append(&text, &size, "fails: %" PRIu64 " pixel%s, %.3f %%, differ%s by more than %.6g level%s; %.6g %% may\n",
               r->differing, plural((double)r->differing), shown_percent(r), r->differing == 1 ? "s" : "", s->tolerance,
               plural(s->tolerance), s->max_share);
    if (!edges)
        append(&text, &size, "fails: %" PRIu64 " differing pixel%s not near an edge, the first at %" PRIu32 ",%" PRIu32
               "\n", r->stray, plural((double)r->stray), r->stray_x, r->stray_y);
    return rmse && greatest && share && edges;
}

/* ---- the map ---- */

static uint8_t byte(double share) { return (uint8_t)(fmin(fmax(share, 0), 1) * 255 + 0.5); }

void compare_heat_map(const Image *a, const Image *b, double greatest, uint8_t *rgb)
{
    for (uint32_t y = 0; y < a->height; y++) {
        for (uint32_t x = 0; x < a->width; x++) {
            double d = greatest_difference(pixel(a, x, y), a->white, pixel(b, x, y), b->white);
            double heat = d > 0 ? 3 * sqrt(d / greatest) : 0;
            for (int k = 0; k < 3; k++) *rgb++ = byte(heat - k);
        }
    }
}
