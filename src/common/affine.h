/* Affine maps p -> A p + b in double precision: three rows of four, the last column is b.
 * A point is a column vector; affine_mul(a, b) applies b first. */
#ifndef RT_COMMON_AFFINE_H
#define RT_COMMON_AFFINE_H

#include <stdbool.h>

#include "common/box.h"
#include "common/numeric.h"
#include "common/vec.h"

typedef struct { double m[3][4]; } Affine;

Affine affine_identity(void);
Affine affine_scale(double x, double y, double z);
Affine affine_translate(double x, double y, double z);

/* Rotation about axis 0, 1 or 2 (x, y, z) by an angle in degrees, counter-clockwise seen against the axis;
 * multiples of 90 degrees are exact. */
Affine affine_rotate(int axis, double deg);

Affine affine_mul(const Affine *a, const Affine *b);

/* Whether all its numbers are finite: the product of two finite maps may overflow. */
bool affine_is_finite(const Affine *a);

/* The same map with its result multiplied by 2^exponent. */
Affine affine_ldexp(const Affine *a, int exponent);

/* False if the linear part is singular or the inverse can't be represented; *inverse is untouched then.
 * Rows and columns are balanced by powers of two first, so scales of 1e-150 or 1e150 lose nothing. */
bool affine_inverse(const Affine *a, Affine *inverse);

/* The smallest box around the image of a box, rounded outward. */
Box affine_box(const Affine *a, Box box);

/* Half the extent along each axis of the image of the unit ball, or of the unit disc about y in the plane y = 0. */
Vec3 affine_ball_extent(const Affine *a);
Vec3 affine_disc_extent(const Affine *a);

/* The box of half extents `half` about the image of a point, rounded outward: for bounds of images that are known by
 * their extents. `half` may be off by the roundings of a sum of squares and its root. */
Box affine_box_about(const Affine *a, Vec3 centre, Vec3 half);

static inline Vec3 affine_point(const Affine *a, Vec3 p)
{
    return vec3_make(a->m[0][0] * p.x + a->m[0][1] * p.y + a->m[0][2] * p.z + a->m[0][3],
                a->m[1][0] * p.x + a->m[1][1] * p.y + a->m[1][2] * p.z + a->m[1][3],
                a->m[2][0] * p.x + a->m[2][1] * p.y + a->m[2][2] * p.z + a->m[2][3]);
}

static inline Vec3 affine_vector(const Affine *a, Vec3 v)
{
    return vec3_make(a->m[0][0] * v.x + a->m[0][1] * v.y + a->m[0][2] * v.z,
                a->m[1][0] * v.x + a->m[1][1] * v.y + a->m[1][2] * v.z,
                a->m[2][0] * v.x + a->m[2][1] * v.y + a->m[2][2] * v.z);
}

/* A normal is carried by the transposed inverse: pass the inverse of the map that moves the points. */
static inline Vec3 affine_normal(const Affine *inverse, Vec3 n)
{
    return vec3_make(inverse->m[0][0] * n.x + inverse->m[1][0] * n.y + inverse->m[2][0] * n.z,
                inverse->m[0][1] * n.x + inverse->m[1][1] * n.y + inverse->m[2][1] * n.z,
                inverse->m[0][2] * n.x + inverse->m[1][2] * n.y + inverse->m[2][2] * n.z);
}

/* The linear part with every entry by its size, times v; and the size of the shift. */
static inline Vec3 affine_abs_vector(const Affine *a, Vec3 v)
{
    return vec3_make(fabs(a->m[0][0]) * v.x + fabs(a->m[0][1]) * v.y + fabs(a->m[0][2]) * v.z,
                fabs(a->m[1][0]) * v.x + fabs(a->m[1][1]) * v.y + fabs(a->m[1][2]) * v.z,
                fabs(a->m[2][0]) * v.x + fabs(a->m[2][1]) * v.y + fabs(a->m[2][2]) * v.z);
}

static inline Vec3 affine_abs_shift(const Affine *a)
{
    return vec3_make(fabs(a->m[0][3]), fabs(a->m[1][3]), fabs(a->m[2][3]));
}

/* Bound, per component, on the rounding error of affine_point(a, p), gamma_4 (|A| |p| + |b|), Higham 2002, section 3.5. */
static inline Vec3 affine_point_rounding(const Affine *a, Vec3 p)
{
    return vec3_scale(vec3_add(affine_abs_vector(a, vec3_abs(p)), affine_abs_shift(a)), GAMMA(4));
}

/* The same when p itself is off by at most p_err: |A| p_err more. */
static inline Vec3 affine_point_error(const Affine *a, Vec3 p, Vec3 p_err)
{
    return vec3_add(vec3_scale(affine_abs_vector(a, p_err), 1 + GAMMA(4)), affine_point_rounding(a, p));
}

#endif
