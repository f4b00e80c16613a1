#include "common/affine.h"

#include <float.h>
#include <stdint.h>
#include <string.h>

Affine affine_identity(void)
{
    return affine_scale(1, 1, 1);
}

Affine affine_scale(double x, double y, double z)
{
    return (Affine){{{x, 0, 0, 0}, {0, y, 0, 0}, {0, 0, z, 0}}};
}

Affine affine_translate(double x, double y, double z)
{
    return (Affine){{{1, 0, 0, x}, {0, 1, 0, y}, {0, 0, 1, z}}};
}

/* Sine and cosine of an angle in degrees: reduced exactly to [-45, 45] before libm sees it, so that multiples of 90
 * give 0 and +-1, and 1e6 turns lose nothing. */
static void sincos_deg(double deg, double *sine, double *cosine)
{
    int quadrant;
    double rest = remquo(deg, 90.0, &quadrant);
    double radians = rest * 0.017453292519943295769;
    double s = sin(radians), c = cos(radians);
    switch (quadrant & 3) {
    case 0: *sine = s; *cosine = c; break;
    case 1: *sine = c; *cosine = -s; break;
    case 2: *sine = -s; *cosine = -c; break;
    case 3: *sine = -c; *cosine = s; break;
    }
}

Affine affine_rotate(int axis, double deg)
{
    double s, c;
    sincos_deg(deg, &s, &c);
    Affine r = affine_identity();
    int a = (axis + 1) % 3, b = (axis + 2) % 3;
    r.m[a][a] = c;
    r.m[a][b] = -s;
    r.m[b][a] = s;
    r.m[b][b] = c;
    return r;
}

Affine affine_mul(const Affine *a, const Affine *b)
{
    Affine r;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 4; j++) {
            r.m[i][j] = a->m[i][0] * b->m[0][j] + a->m[i][1] * b->m[1][j] + a->m[i][2] * b->m[2][j];
        }
        r.m[i][3] += a->m[i][3];
    }
    return r;
}

bool affine_is_finite(const Affine *a)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++)
            if (!isfinite(a->m[i][j])) return false;
    return true;
}

/* ldexp without the call. One multiplication by a power of two that is a normal number rounds as ldexp does. */
static double scaled(double x, int exponent)
{
    if (exponent < DBL_MIN_EXP - 1 || exponent >= DBL_MAX_EXP) return ldexp(x, exponent);
    uint64_t bits = (uint64_t)(exponent + DBL_MAX_EXP - 1) << (DBL_MANT_DIG - 1);
    double power;
    memcpy(&power, &bits, sizeof power);
    return x * power;
}

Affine affine_ldexp(const Affine *a, int exponent)
{
    Affine r;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++) r.m[i][j] = scaled(a->m[i][j], exponent);
    return r;
}

/* Balances the linear part: a = diag(2^row) b diag(2^col), the greatest entry of each row and column of b near 1.
 * False if a row or column is zero or not finite. */
static bool balance(const Affine *a, double b[3][3], int row[3], int col[3])
{
    for (int i = 0; i < 3; i++) {
        double m = fmax(fabs(a->m[i][0]), fmax(fabs(a->m[i][1]), fabs(a->m[i][2])));
        if (!(m > 0) || !isfinite(m) || isnan(a->m[i][0] + a->m[i][1] + a->m[i][2])) return false;
        row[i] = ilogb(m);
    }
    for (int j = 0; j < 3; j++) {
        double m = 0;
        for (int i = 0; i < 3; i++) m = fmax(m, fabs(scaled(a->m[i][j], -row[i])));
        if (!(m > 0)) return false;
        col[j] = ilogb(m);
        for (int i = 0; i < 3; i++) b[i][j] = scaled(a->m[i][j], -row[i] - col[j]);
    }
    return true;
}

static double cofactor(double b[3][3], int i, int j)
{
    int r0 = (i + 1) % 3, r1 = (i + 2) % 3, c0 = (j + 1) % 3, c1 = (j + 2) % 3;
    return b[r0][c0] * b[r1][c1] - b[r0][c1] * b[r1][c0];
}

static double determinant(double b[3][3])
{
    return b[0][0] * cofactor(b, 0, 0) + b[0][1] * cofactor(b, 0, 1) + b[0][2] * cofactor(b, 0, 2);
}

/* The sum of the determinant's six products, each by its size: a bound on its rounding error once multiplied by GAMMA(5).
 * Scaling a row or a column scales it as the determinant, so the two may be compared however well b is balanced. */
static double permanent(double b[3][3])
{
    double sum = 0;
    for (int j = 0; j < 3; j++) {
        int c0 = (j + 1) % 3, c1 = (j + 2) % 3;
        sum += fabs(b[0][j]) * (fabs(b[1][c0] * b[2][c1]) + fabs(b[1][c1] * b[2][c0]));
    }
    return sum;
}

bool affine_inverse(const Affine *a, Affine *inverse)
{
    double b[3][3];
    int row[3], col[3];
    if (!balance(a, b, row, col)) return false;
    double det = determinant(b);
    /* A determinant below its own rounding error is no evidence of a volume. */
    if (!(fabs(det) > GAMMA(5) * permanent(b))) return false;
    Affine r;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) r.m[i][j] = scaled(cofactor(b, j, i) / det, -col[i] - row[j]);
    for (int i = 0; i < 3; i++) {
        r.m[i][3] = -(r.m[i][0] * a->m[0][3] + r.m[i][1] * a->m[1][3] + r.m[i][2] * a->m[2][3]);
        for (int j = 0; j < 4; j++)
            if (!isfinite(r.m[i][j])) return false;
    }
    *inverse = r;
    return true;
}

/* Its length without overflow or underflow. */
static double length_of(Vec3 v)
{
    double s = vec3_pow2_scale(v);
    return vec3_length(vec3_scale(v, s)) / s;
}

/* The image of the unit ball reaches along an axis as far as that axis' row is long. */
Vec3 affine_ball_extent(const Affine *a)
{
    double e[3];
    for (int i = 0; i < 3; i++) e[i] = length_of(vec3_make(a->m[i][0], a->m[i][1], a->m[i][2]));
    return vec3_make(e[0], e[1], e[2]);
}

Vec3 affine_disc_extent(const Affine *a)
{
    double e[3];
    for (int i = 0; i < 3; i++) e[i] = length_of(vec3_make(a->m[i][0], 0, a->m[i][2]));
    return vec3_make(e[0], e[1], e[2]);
}

Box affine_box_about(const Affine *a, Vec3 centre, Vec3 half)
{
    Vec3 c = affine_point(a, centre);
    Vec3 e = vec3_scale(vec3_add(half, affine_point_rounding(a, centre)), 1 + 8 * UNIT_ROUNDOFF);
    Box r = {vec3_sub(c, e), vec3_add(c, e)};
    r.lo = vec3_make(nextafter(r.lo.x, -INFINITY), nextafter(r.lo.y, -INFINITY), nextafter(r.lo.z, -INFINITY));
    r.hi = vec3_make(nextafter(r.hi.x, INFINITY), nextafter(r.hi.y, INFINITY), nextafter(r.hi.z, INFINITY));
    return r;
}

Box affine_box(const Affine *a, Box box)
{
    if (box_is_empty(box)) return box;
    Vec3 lo = vec3_scale(box.lo, 0.5), hi = vec3_scale(box.hi, 0.5);  /* halved first: no overflow */
    Vec3 mid = vec3_add(lo, hi), half = vec3_sub(hi, lo), zero = {0, 0, 0};
    /* the middle's and the half extents' own roundings */
    half = vec3_add(half, vec3_scale(vec3_add(vec3_abs(lo), vec3_abs(hi)), 4 * UNIT_ROUNDOFF));
    Affine linear = *a;
    for (int i = 0; i < 3; i++) linear.m[i][3] = 0;
    return affine_box_about(a, mid, affine_point_error(&linear, zero, half));
}
