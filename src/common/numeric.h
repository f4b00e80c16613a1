/* The unit roundoff and what is derived from it: the only epsilons of the program. */
#ifndef RT_COMMON_NUMERIC_H
#define RT_COMMON_NUMERIC_H

/* u = 2^-53: fl(a op b) = (a op b)(1 + d), |d| <= u. */
#define UNIT_ROUNDOFF 0x1p-53

/* gamma_n = n u / (1 - n u): bound on the relative error that n roundings accumulate (Higham 2002, lemma 3.1). */
#define GAMMA(n) (((n) * UNIT_ROUNDOFF) / (1.0 - (n) * UNIT_ROUNDOFF))

#endif
