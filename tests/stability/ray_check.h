/* One line through one primitive against the oracles: crossings in quad, and by the implicit inequality in MPFR at 200 bits
 * what quad can't decide and, where asked for, the claimed bound of each crossing. */
#ifndef RT_TESTS_STABILITY_RAY_CHECK_H
#define RT_TESTS_STABILITY_RAY_CHECK_H

#include "common/rng.h"
#include "node/primitive/primitive.h"
#include "stability/stability.h"
#include "support/oracle.h"

typedef enum { SPHERE, CUBE, CYLINDER, CONE, TORUS, SHAPE_COUNT } ShapeKind;

typedef struct {
    ShapeKind kind;
    double minor;        /* of a torus */
    Prim *prim;
    Scratch scratch;
    bool precise;        /* all bounds by MPFR */
    struct Precise *mp;
} Subject;

/* Ends the program without memory. */
Subject subject_open(ShapeKind kind, double minor, bool precise);
void subject_close(Subject *s);
const char *subject_name(const Subject *s);

bool subject_hit(Subject *s, const Ray *ray, Hit *hit);
void subject_truth(const Subject *s, const Ray *ray, Truth *truth);

/* Compares the crossings of the whole line, t > tmin only for the hit, and counts a trial. Whether it passed. */
bool check_ray(Row *row, Subject *s, const Ray *ray, uint64_t seed);

/* Outward normal of the surface nearest to p, of any length. */
void true_normal(const Subject *s, const Quad p[3], Quad n[3]);

/* The angle between two vectors in units of 2^-53. */
double angle_ulps(Vec3 v, const Quad n[3]);

double uniform(Rng *rng, double lo, double hi);
Vec3 random_direction(Rng *rng);
Vec3 random_point(Rng *rng, const Subject *s);   /* in the bounds */

#endif
