/* Where a line crosses the analytic primitives, in __float128 and from the implicit equations alone: it owes nothing to
 * the program but the types Ray and Surface. `minor` is that of a torus, ignored by the others. */
#ifndef RT_TESTS_SUPPORT_ORACLE_H
#define RT_TESTS_SUPPORT_ORACLE_H

#include <stdbool.h>
#include <stdint.h>

#include "common/ray.h"

__extension__ typedef __float128 Quad;

static inline Quad q_abs(Quad x) { return x < 0 ? -x : x; }
static inline Quad q_min(Quad a, Quad b) { return a < b ? a : b; }
static inline Quad q_max(Quad a, Quad b) { return a > b ? a : b; }
Quad q_sqrt(Quad x);

/* The value of a polynomial, coefficients from the constant up. */
Quad poly(const Quad *c, int degree, Quad x);

/* All real roots in (lo, hi) where the polynomial changes its sign, ascending: between the roots of its derivative. */
int poly_roots(const Quad *c, int degree, Quad lo, Quad hi, Quad *root);

enum { DOUBTS_MOST = 8 };

/* Crossings of the whole line, in pairs, ascending, each with a bound on what quad precision itself got wrong. */
typedef struct {
    Quad t[4], err[4];
    int n;
    Quad sure;   /* how many times its own error separates the line from another number of crossings */
    Quad doubt[DOUBTS_MOST];   /* the places where two crossings may come or go */
    int doubts;
} Truth;

static inline bool truth_decided(const Truth *truth) { return truth->sure >= 4; }

typedef void OracleTruth(double minor, const Ray *ray, Truth *truth);
OracleTruth sphere_truth, cube_truth, cylinder_truth, cone_truth, torus_truth;

/* How far the point is from the surface, or from the part of it that was hit. */
typedef Quad OracleDistance(double minor, const Surface *s, uint32_t part);
OracleDistance sphere_distance, cube_distance, cylinder_distance, cone_distance, torus_distance;

#endif
