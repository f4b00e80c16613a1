/* Sums of products of three doubles without any rounding, for signs that rounding can't settle. The sum is a fixed-point
 * number wide enough for all products of three finite doubles (Kulisch, "Computer arithmetic and validity", 2008,
 * chapter 8), so nothing overflows or underflows. Half a microsecond for the determinant of a triangle's edge: for what a
 * filter leaves over. */
#ifndef RT_COMMON_EXACT_H
#define RT_COMMON_EXACT_H

#include <stdint.h>

/* Bits of the least and the greatest product: a double is a whole number below 2^53 times 2^-1074 to 2^971. */
enum { EXACT_LOWEST = -3 * 1074, EXACT_HIGHEST = 3 * (971 + 53), EXACT_LIMBS = (EXACT_HIGHEST - EXACT_LOWEST) / 32 + 5 };

/* The sum over i of limb[i] 2^(32 i + EXACT_LOWEST); only limbs low to high - 1 aren't zero. Start with `{.low =
 * EXACT_LIMBS}`. Room for 2^24 products. */
typedef struct {
    int64_t limb[EXACT_LIMBS];
    int low, high;
} ExactSum;

/* Adds a b c, all finite. */
void exact_add(ExactSum *sum, double a, double b, double c);

/* -1, 0 or 1. */
int exact_sign(ExactSum *sum);

/* The sum times 2^shift within 2^-52 of itself; infinite or 0 where a double can't hold it. */
double exact_value(ExactSum *sum, int shift);

#endif
