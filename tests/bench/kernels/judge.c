#include "bench/kernels/judge.h"

#include <math.h>
#include <stdbool.h>

typedef __float128 Quad;

/* The rounding of an edge's volume, a determinant of the direction and two vertices seen from the origin, in double:
 * below 16 roundings of 2^-53 of its greatest terms' sum, which is at most 6 |d| |v|^2. Rounded up. */
#define VOLUME_MARGIN 0x1p-46

/* False only for a triangle that the ray's line passes by. */
static bool line_may_hit(const Vec3 v[3], Vec3 d)
{
    double size = fmax(vec3_max(vec3_abs(v[0])), fmax(vec3_max(vec3_abs(v[1])), vec3_max(vec3_abs(v[2]))));
    double margin = VOLUME_MARGIN * vec3_max(vec3_abs(d)) * size * size;
    bool negative = false, positive = false;
    for (int k = 0; k < 3; k++) {
        double volume = vec3_dot(d, vec3_cross(v[(k + 1) % 3], v[(k + 2) % 3]));
        negative |= volume < -margin;
        positive |= volume > margin;
    }
    return !(negative && positive);
}

/* The differences of floats are exact here unless their exponents are some 80 apart. `v` is seen from the origin. */
static void exact(Truth *truth, const Ray *ray, const Quad v[3][3])
{
    Quad d[3] = {ray->d.x, ray->d.y, ray->d.z}, side[3], sum = 0, along = 0, dd = 0;
    bool inside = true, negative = false, positive = false;
    for (int k = 0; k < 3; k++) {
        const Quad *a = v[(k + 1) % 3], *b = v[(k + 2) % 3];
        side[k] = d[0] * (a[1] * b[2] - a[2] * b[1]) + d[1] * (a[2] * b[0] - a[0] * b[2]) +
                  d[2] * (a[0] * b[1] - a[1] * b[0]);
        inside &= side[k] != 0;
        negative |= side[k] < 0;
        positive |= side[k] > 0;
        sum += side[k];
    }
    if ((negative && positive) || sum == 0) return;
    for (int i = 0; i < 3; i++) {
        dd += d[i] * d[i];
        along += d[i] * (side[0] * v[0][i] + side[1] * v[1][i] + side[2] * v[2][i]) / sum;
    }
    Quad t = along / dd;
    if (!(t > (Quad)ray->tmin && t <= (Quad)ray->tmax)) return;
    truth->with_edges = fmin(truth->with_edges, (double)t);
    if (inside) truth->without_edges = fmin(truth->without_edges, (double)t);
}

Truth judge_ray(const Mesh *mesh, int exponent, const Ray *ray)
{
    Truth truth = {(double)INFINITY, (double)INFINITY};
    double scale = ldexp(1, -exponent);
    for (uint32_t i = 0; i < mesh->triangle_count; i++) {
        Vec3 p[3], v[3];
        for (int k = 0; k < 3; k++) {
            p[k] = vec3_scale(mesh->position[mesh->triangle[i][k]], scale);
            v[k] = vec3_sub(p[k], ray->o);
        }
        if (!line_may_hit(v, ray->d)) continue;
        Quad q[3][3];
        for (int k = 0; k < 3; k++)
            for (int a = 0; a < 3; a++) q[k][a] = (Quad)vec3_get(p[k], a) - (Quad)vec3_get(ray->o, a);
        exact(&truth, ray, (const Quad (*)[3])q);
    }
    return truth;
}
