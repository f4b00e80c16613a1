/* Two pipelines. Colour: the picture, in an opponent space that is linear in light (YCxCz), is blurred as the eye's
 * contrast sensitivities do it, clamped to the colours of the screen, taken to CIELAB, Hunt-adjusted; the HyAB distance is
 * mapped to [0,1]. Features: edges and points of luminance are found by derivatives of a Gaussian. A difference of features
 * makes the exponent of the difference of colours smaller, and so the result greater. Numbers of sections are the paper's.
 *
 * All filters are separable, or the sum of two that are, so they go along x first and along y then. */
#include "compare/flip.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

#include "common/colour.h"
#include "compare/band.h"

#define PI 3.14159265358979323846

static const double PIXELS_PER_DEGREE = 3840 * PI / 180;  /* 67.02 */

/* Section 4.1: a channel's sensitivity is a1 sqrt(pi/b1) exp(-pi^2 d^2 / b1) + a2 (the same with b2), d in degrees. */
typedef struct { double a1, b1, a2, b2; } Sensitivity;

static const Sensitivity ACHROMATIC = {1, 0.0047, 0, 1}, RED_GREEN = {1, 0.0053, 0, 1};
static const Sensitivity BLUE_YELLOW = {34.1, 0.04, 13.5, 0.025};

/* Section 4.2: width of the feature detectors, in degrees. */
static const double FEATURE_WIDTH = 0.082;

/* Sections 4.1.2 to 4.3. */
static const double QC = 0.7, PC = 0.4, PT = 0.95, QF = 0.5;

enum { RADIUS = 10, TAPS = 2 * RADIUS + 1 };  /* enough for all of the filters */

typedef struct { uint32_t radius; double weight[TAPS]; } Filter;

typedef struct {
    Filter achromatic, red_green, blue_yellow[2];
    double share[2];                  /* of the two parts of blue_yellow */
    Filter smooth, edge, point;       /* a Gaussian and its derivatives */
    double greatest;                  /* distance of two colours, to the power QC: green and blue */
} Tables;

/* Planes of the band, after the filters along x. */
enum { LIGHT, RG, BY1, BY2, SMOOTH, EDGE, POINT, PLANES };

/* One of the two pictures. */
typedef struct {
    const Image *image;
    const Tables *tables;
    bool linear;
    Band band;
    double *opponent[3];     /* a row in YCxCz, with RADIUS numbers on each side */
    double *out[8];          /* a row that is filtered along both */
    double *memory;
} Eye;

/* ---- colour spaces ---- */

/* From linear sRGB to CIE XYZ, divided by the white point's: the paper's matrix, with 1 for white in each row. */
static void to_relative_xyz(const double rgb[3], double xyz[3])
{
    static const double m[3][3] = {
        {10135552 / 24577794.0, 8788810 / 24577794.0, 4435075 / 24577794.0},
        {2613072 / 12288897.0, 8788810 / 12288897.0, 887015 / 12288897.0},
        {1425312 / 73733382.0, 8788810 / 73733382.0, 70074185 / 73733382.0},
    };
    for (int i = 0; i < 3; i++)
        xyz[i] = (m[i][0] * rgb[0] + m[i][1] * rgb[1] + m[i][2] * rgb[2]) / (m[i][0] + m[i][1] + m[i][2]);
}

/* The inverse: rows are those of the inverse matrix times the white point. */
static void to_linear_rgb(const double xyz[3], double rgb[3])
{
    static const double m[3][3] = {
        {3.241003275, -1.537398934, -0.498615861},
        {-0.969224334, 1.875930071, 0.041554224},
        {0.055639423, -0.204011202, 1.057148933},
    };
    static const double white[3] = {0.950428545, 1, 1.088900371};
    for (int i = 0; i < 3; i++)
        rgb[i] = m[i][0] * white[0] * xyz[0] + m[i][1] * white[1] * xyz[1] + m[i][2] * white[2] * xyz[2];
}

static double lab_curve(double t)
{
    const double delta = 6 / 29.0;
    return t > delta * delta * delta ? cbrt(t) : t / (3 * delta * delta) + 4 / 29.0;
}

/* CIELAB with a and b multiplied by L / 100: colours look paler in the dark (Hunt). */
static void to_hunt_lab(const double rgb[3], double lab[3])
{
    double xyz[3];
    to_relative_xyz(rgb, xyz);
    double x = lab_curve(xyz[0]), y = lab_curve(xyz[1]), z = lab_curve(xyz[2]);
    lab[0] = 116 * y - 16;
    lab[1] = 0.01 * lab[0] * 500 * (x - y);
    lab[2] = 0.01 * lab[0] * 200 * (y - z);
}

/* Abasi, Amani Tehran, Fairchild 2020. */
static double hyab(const double a[3], const double b[3])
{
    double da = a[1] - b[1], db = a[2] - b[2];
    return fabs(a[0] - b[0]) + sqrt(da * da + db * db);
}

/* ---- filters ---- */

static uint32_t filter_radius(double sigma)
{
    uint32_t radius = (uint32_t)ceil(3 * sigma);
    assert(radius <= RADIUS);
    return radius;
}

/* exp(-pi^2 d^2 / b) has a standard deviation of sqrt(b / (2 pi^2)) degrees. */
static double sensitivity_sigma(double b) { return sqrt(b / (2 * PI * PI)) * PIXELS_PER_DEGREE; }

/* A Gaussian of the sensitivity; all have the radius of the widest. */
static void sensitivity_filter(double b, Filter *filter)
{
    filter->radius = filter_radius(sensitivity_sigma(BLUE_YELLOW.b1));
    gaussian_weights(filter->weight, filter->radius, sensitivity_sigma(b));
}

/* The sum of a Gaussian's values at whole pixels within the filter, along one axis. */
static double gaussian_sum(double b)
{
    double sigma = sensitivity_sigma(b), sum = 0;
    int radius = (int)filter_radius(sensitivity_sigma(BLUE_YELLOW.b1));
    for (int x = -radius; x <= radius; x++) sum += exp(-x * x / (2 * sigma * sigma));
    return sum;
}

/* The two Gaussians are normalised together, in two dimensions. */
static void blue_yellow_filters(Tables *t)
{
    double b[2] = {BLUE_YELLOW.b1, BLUE_YELLOW.b2}, a[2] = {BLUE_YELLOW.a1, BLUE_YELLOW.a2};
    for (int i = 0; i < 2; i++) {
        double sum = gaussian_sum(b[i]);
        sensitivity_filter(b[i], &t->blue_yellow[i]);
        t->share[i] = a[i] * sqrt(PI / b[i]) * sum * sum;
    }
    double total = t->share[0] + t->share[1];
    for (int i = 0; i < 2; i++) t->share[i] /= total;
}

/* Positive weights sum to 1, negative ones to -1. */
static void normalise_signs(Filter *filter)
{
    double positive = 0, negative = 0;
    for (uint32_t i = 0; i <= 2 * filter->radius; i++) {
        double w = filter->weight[i];
        if (w > 0) positive += w;
        else negative -= w;
    }
    for (uint32_t i = 0; i <= 2 * filter->radius; i++) filter->weight[i] /= filter->weight[i] > 0 ? positive : negative;
}

static void feature_filters(Tables *t)
{
    double sigma = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
    uint32_t radius = filter_radius(sigma);
    t->smooth.radius = t->edge.radius = t->point.radius = radius;
    gaussian_weights(t->smooth.weight, radius, sigma);
    for (uint32_t i = 0; i <= 2 * radius; i++) {
        double x = (double)i - (double)radius, g = t->smooth.weight[i];
        t->edge.weight[i] = -x * g;
        t->point.weight[i] = (x * x / (sigma * sigma) - 1) * g;
    }
    normalise_signs(&t->edge);
    normalise_signs(&t->point);
}

static void make_tables(Tables *t)
{
    double green[3], blue[3];
    sensitivity_filter(ACHROMATIC.b1, &t->achromatic);
    sensitivity_filter(RED_GREEN.b1, &t->red_green);
    blue_yellow_filters(t);
    feature_filters(t);
    to_hunt_lab((const double[]){0, 1, 0}, green);
    to_hunt_lab((const double[]){0, 0, 1}, blue);
    t->greatest = pow(hyab(green, blue), QC);
}

/* ---- one picture ---- */

static void along_x(const Eye *eye, int channel, const Filter *filter, double *out)
{
    filter_along_x(eye->opponent[channel], eye->image->width, filter->weight, filter->radius, out);
}

static void source_row(void *context, uint32_t y, double *const *plane)
{
    const Eye *eye = context;
    const Tables *t = eye->tables;
    uint32_t width = eye->image->width;
    const float *p = eye->image->rgb + (size_t)y * width * 3;
    for (uint32_t x = 0; x < width; x++, p += 3) {
        double rgb[3], xyz[3];
        for (int k = 0; k < 3; k++) {
            double value = fmin(fmax((double)p[k] / eye->image->white, 0), 1);
            rgb[k] = eye->linear ? value : srgb_decode(value);
        }
        to_relative_xyz(rgb, xyz);
        eye->opponent[0][x] = 116 * xyz[1] - 16;
        eye->opponent[1][x] = 500 * (xyz[0] - xyz[1]);
        eye->opponent[2][x] = 200 * (xyz[1] - xyz[2]);
    }
    for (int c = 0; c < 3; c++) extend_row(eye->opponent[c], width, RADIUS);
    along_x(eye, 0, &t->achromatic, plane[LIGHT]);
    along_x(eye, 1, &t->red_green, plane[RG]);
    along_x(eye, 2, &t->blue_yellow[0], plane[BY1]);
    along_x(eye, 2, &t->blue_yellow[1], plane[BY2]);
    along_x(eye, 0, &t->smooth, plane[SMOOTH]);
    along_x(eye, 0, &t->edge, plane[EDGE]);
    along_x(eye, 0, &t->point, plane[POINT]);
}

static void along_y(Eye *eye, uint32_t plane, uint32_t y, const Filter *filter, double *out)
{
    filter_along_y(&eye->band, plane, y, filter->weight, filter->radius, out);
}

static void look_at_row(Eye *eye, uint32_t y)
{
    const Tables *t = eye->tables;
    along_y(eye, LIGHT, y, &t->achromatic, eye->out[0]);
    along_y(eye, RG, y, &t->red_green, eye->out[1]);
    along_y(eye, BY1, y, &t->blue_yellow[0], eye->out[2]);
    along_y(eye, BY2, y, &t->blue_yellow[1], eye->out[3]);
    along_y(eye, EDGE, y, &t->smooth, eye->out[4]);
    along_y(eye, SMOOTH, y, &t->edge, eye->out[5]);
    along_y(eye, POINT, y, &t->smooth, eye->out[6]);
    along_y(eye, SMOOTH, y, &t->point, eye->out[7]);
}

/* What is seen at column x of the row looked at. Luminance is normalised to [0,1] here: (Y + 16) / 116, whose constant part
 * the feature detectors don't see. */
static void seen(const Eye *eye, uint32_t x, double lab[3], double *edge, double *point)
{
    const double *const share = eye->tables->share;
    double y = (eye->out[0][x] + 16) / 116, blue = share[0] * eye->out[2][x] + share[1] * eye->out[3][x];
    double xyz[3] = {y + eye->out[1][x] / 500, y, y - blue / 200}, rgb[3];
    to_linear_rgb(xyz, rgb);
    for (int k = 0; k < 3; k++) rgb[k] = fmin(fmax(rgb[k], 0), 1);
    to_hunt_lab(rgb, lab);
    *edge = sqrt(eye->out[4][x] * eye->out[4][x] + eye->out[5][x] * eye->out[5][x]) / 116;
    *point = sqrt(eye->out[6][x] * eye->out[6][x] + eye->out[7][x] * eye->out[7][x]) / 116;
}

static bool eye_open(Eye *eye, const Image *image, const Tables *tables, bool linear)
{
    size_t width = image->width, extended = width + 2 * RADIUS;
    *eye = (Eye){.image = image, .tables = tables, .linear = linear};
    eye->band = (Band){image->width, image->height, PLANES, RADIUS, source_row, eye, NULL, NULL, 0};
    eye->memory = malloc((3 * extended + 8 * width) * sizeof *eye->memory);
    if (!band_create(&eye->band) || !eye->memory) return false;
    for (size_t i = 0; i < 3; i++) eye->opponent[i] = eye->memory + i * extended + RADIUS;
    for (size_t i = 0; i < 8; i++) eye->out[i] = eye->memory + 3 * extended + i * width;
    return true;
}

static void eye_close(Eye *eye)
{
    band_destroy(&eye->band);
    free(eye->memory);
}

/* ---- both ---- */

/* Section 4.1.3: distances up to a share PC of the greatest take up a share PT of [0,1]. */
static double redistribute(double distance, double greatest)
{
    double knee = PC * greatest;
    return distance < knee ? PT / knee * distance : PT + (distance - knee) / (greatest - knee) * (1 - PT);
}

static double pixel_difference(const Eye *a, const Eye *b, uint32_t x)
{
    double lab_a[3], lab_b[3], edge_a, edge_b, point_a, point_b;
    seen(a, x, lab_a, &edge_a, &point_a);
    seen(b, x, lab_b, &edge_b, &point_b);
    double colour = redistribute(pow(hyab(lab_a, lab_b), QC), a->tables->greatest);
    double feature = pow(sqrt(0.5) * fmax(fabs(edge_a - edge_b), fabs(point_a - point_b)), QF);
    return pow(colour, 1 - feature);
}

bool flip(const Image *a, const Image *b, bool linear, double *value, Err *err)
{
    Tables tables;
    Eye eye[2] = {{.memory = NULL}, {.memory = NULL}};
    make_tables(&tables);
    bool ok = eye_open(&eye[0], a, &tables, linear) && eye_open(&eye[1], b, &tables, linear);
    double sum = 0;
    for (uint32_t y = 0; ok && y < a->height; y++) {
        double of_row = 0;
        for (int i = 0; i < 2; i++) look_at_row(&eye[i], y);
        for (uint32_t x = 0; x < a->width; x++) of_row += pixel_difference(&eye[0], &eye[1], x);
        sum += of_row;
    }
    *value = sum / ((double)a->width * (double)a->height);
    for (int i = 0; i < 2; i++) eye_close(&eye[i]);
    return ok || err_memory(err, "the comparison");
}
