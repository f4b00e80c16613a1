/* Sets of roots with which Ferrari's and companion-matrix solvers lose digits, from the tables of Strobach 2010 and of
 * Orellana and De Michele 2020. */
#ifndef RT_TESTS_SUPPORT_QUARTIC_ROOTS_H
#define RT_TESTS_SUPPORT_QUARTIC_ROOTS_H

enum { QUARTIC_ROOTS_COUNT = 10 };

static const double QUARTIC_ROOTS[QUARTIC_ROOTS_COUNT][4] = {
    {1, 1e3, 1e6, 1e9}, {2.003, 2.002, 2.001, 2}, {1e53, 1e50, 1e49, 1e47}, {1e14, 2, 1, -1}, {-2e7, 1e7, 1, -1},
    {1e7, -1e6, 1, -1}, {-7, -4, 1e6, 1e5}, {1e8, 11, 1e3, 1}, {1e7, 11, 1e3, 1}, {1e7, 10, 1e3, 1e-7},
};

#endif
