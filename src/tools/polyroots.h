/* Real roots of quadratics and quartics, right to the last place or nearly so, each with a bound on its error.
 *
 * Quartics: factored into two quadratics by way of the resolvent cubic after Orellana and De Michele, "Algorithm 1010:
 * Boosting efficiency in solving quartic equations with no compromise in accuracy", ACM TOMS 46 (2020), then polished
 * by Newton's method on the polynomial evaluated in double-double. Where roots are too close for that, they are
 * isolated between the roots of the derivatives instead, by sign alone. */
#ifndef RT_TOOLS_POLYROOTS_H
#define RT_TOOLS_POLYROOTS_H

#include <stdbool.h>

#include "common/dd.h"

typedef struct {
    double x, lo;   /* the root is x + lo; x alone is it rounded */
    double err;     /* bound on |x + lo - root| */
} PolyRoot;

/* The real roots of c[2] x^2 + c[1] x + c[0], ascending: 0 or 2, a double one being listed twice; 1 or 0 if c[2] is 0.
 * noise[i] bounds the error of c[i] (NULL: they are exact), and a discriminant that is negative by no more than that
 * explains counts as 0. For any finite exact coefficients whose low parts are 0 the number is right and each x within
 * 1 ulp; a root that a double can't hold is 0 or infinite. */
int poly_quadratic(const Dd c[3], const double noise[3], PolyRoot root[2]);

/* The real zeros at which c[4] x^4 + ... + c[0] changes its sign, ascending: an even number, so a double root is either
 * left out or a pair close together. c[4] isn't 0. The count is right unless the polynomial comes nearer to 0 between
 * two roots than its evaluation resolves (2^-98 of its terms) or than the coefficients' own uncertainty, `noise` (NULL:
 * they are exact), makes doubtful; noise widens the bounds.
 * `critical` (NULL: not wanted) gets the roots of the derivative in ascending order, up to 3, *criticals of them. */
int poly_quartic(const Dd c[5], const double noise[5], PolyRoot root[4], double critical[3], int *criticals);

/* The same for the monic quartic x^4 + c[3] x^3 + ... + c[0] with roots of the order of 1, in double precision only and
 * unpolished. False if it can't vouch for their number. */
bool poly_quartic_guess(const double c[4], double root[4], int *count);

#endif
