/* The stiff and extreme cases (NUMERICS): each is a generator with a fixed seed and an oracle that owes nothing to the
 * code under test. A case fills a Row; stability.c prints the table. */
#ifndef RT_STABILITY_STABILITY_H
#define RT_STABILITY_STABILITY_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    uint64_t trials, failures;
    uint64_t undecided;      /* trials that the oracle's own precision could not judge: no evidence */
    double t_ulps, n_ulps;   /* greatest error of t and of the normal seen, in units of the last place; 0: not measured */
    double loose;            /* greatest bound on t that the program claimed, over the error that t's condition explains */
    char first[160];         /* the first failure: enough to repeat it */
} Row;

/* Counts a trial; a failure is noted with printf's words. Returns ok. */
bool row_trial(Row *row, bool ok, const char *format, ...) __attribute__((format(printf, 3, 4)));

typedef struct {
    int number;              /* in the list of NUMERICS; a case may have several rows */
    const char *name;
    const char *oracle;      /* "analytic", "quad", "MPFR", "interval", "metamorphic", "coverage" */
    const char *others;      /* what POV-Ray or Embree do, where it was measured; "" otherwise */
    uint64_t quick, full, extra;  /* trials in make test, in make stability, with LONG=1 */
    void (*run)(Row *row, uint64_t trials);
} StabilityCase;

/* The tables of cases_*.c, each ended by a row without a name. */
extern const StabilityCase primitive_cases[], mesh_cases[], csg_cases[], picture_cases[], shade_cases[],
    far_cases[], camera_cases[], texture_cases[],
    bump_cases[], limit_cases[];

#endif
