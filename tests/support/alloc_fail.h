/* Makes allocations fail on purpose. A test that includes this as "support/alloc_fail.h" is linked so that
 * malloc, calloc, realloc and aligned_alloc of the program (not those inside other libraries) come through here.
 *
 *     for (long n = 1;; n++) {
 *         alloc_fail_at(n);
 *         bool done = x_create(...);
 *         if (!alloc_fail_stop()) break;    (fewer than n allocations: each has failed once)
 *         assert_false(done);
 *     } */
#ifndef RT_TESTS_SUPPORT_ALLOC_FAIL_H
#define RT_TESTS_SUPPORT_ALLOC_FAIL_H

#include <stdbool.h>

/* The n-th allocation from now on (1: the next) and all after it fail, on whichever thread, until alloc_fail_stop. */
void alloc_fail_at(long n);

/* Only the n-th fails, those after it succeed. */
void alloc_fail_only(long n);

/* Allocations succeed again. True if any has failed. */
bool alloc_fail_stop(void);

/* Allocations since alloc_fail_at or alloc_fail_only, the failed ones too. */
long alloc_fail_count(void);

#endif
