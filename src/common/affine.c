#include "common/affine.h"

#include <string.h>

#include "common/numeric.h"

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

Affine affine_ldexp(const Affine *a, int exponent)
{
    Affine r;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++) r.m[i][j] = ldexp(a->m[i][j], exponent);
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
        for (int i = 0; i < 3; i++) m = fmax(m, fabs(ldexp(a->m[i][j], -row[i])));
        if (!(m > 0)) return false;
        col[j] = ilogb(m);
        for (int i = 0; i < 3; i++) b[i][j] = ldexp(a->m[i][j], -row[i] - col[j]);
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

bool affine_inverse(const Affine *a, Affine *inverse)
{
    double b[3][3];
    int row[3], col[3];
    if (!balance(a, b, row, col)) return false;
    double det = determinant(b);
    /* A determinant below its own rounding error is no evidence of a volume: 6 products of entries up to 2 x 2 x 2. */
    if (!(fabs(det) > 48 * GAMMA(5))) return false;
    Affine r;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) r.m[i][j] = ldexp(cofactor(b, j, i) / det, -col[i] - row[j]);
    for (int i = 0; i < 3; i++) {
        r.m[i][3] = -(r.m[i][0] * a->m[0][3] + r.m[i][1] * a->m[1][3] + r.m[i][2] * a->m[2][3]);
        for (int j = 0; j < 4; j++)
            if (!isfinite(r.m[i][j])) return false;
    }
    *inverse = r;
    return true;
}

bool affine_mirrors(const Affine *a)
{
    double b[3][3];
    int row[3], col[3];
    return balance(a, b, row, col) && determinant(b) < 0;
}

Vec3 affine_point_error(const Affine *a, Vec3 p, Vec3 p_err)
{
    Vec3 q = vec3_abs(p);
    double r[3];
    for (int i = 0; i < 3; i++) {
        const double *m = a->m[i];
        double carried = fabs(m[0]) * p_err.x + fabs(m[1]) * p_err.y + fabs(m[2]) * p_err.z;
        double rounded = fabs(m[0]) * q.x + fabs(m[1]) * q.y + fabs(m[2]) * q.z + fabs(m[3]);
        r[i] = carried * (1 + GAMMA(4)) + rounded * GAMMA(4);
    }
    return vec3_make(r[0], r[1], r[2]);
}

Box affine_box(const Affine *a, Box box)
{
    if (box_is_empty(box)) return box;
    Vec3 lo = vec3_scale(box.lo, 0.5), hi = vec3_scale(box.hi, 0.5);  /* halved first: no overflow */
    Vec3 mid = vec3_add(lo, hi), half = vec3_sub(hi, lo);
    Vec3 c = affine_point(a, mid);
    /* the half extents count as an error of the middle; one more rounding each for mid and half */
    Vec3 slack = vec3_scale(vec3_add(vec3_abs(box.lo), vec3_abs(box.hi)), 2 * UNIT_ROUNDOFF);
    Vec3 e = vec3_scale(affine_point_error(a, mid, vec3_add(half, slack)), 1 + 8 * UNIT_ROUNDOFF);
    Box r = {vec3_sub(c, e), vec3_add(c, e)};
    r.lo = vec3_make(nextafter(r.lo.x, -INFINITY), nextafter(r.lo.y, -INFINITY), nextafter(r.lo.z, -INFINITY));
    r.hi = vec3_make(nextafter(r.hi.x, INFINITY), nextafter(r.hi.y, INFINITY), nextafter(r.hi.z, INFINITY));
    return r;
}
