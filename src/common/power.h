/* Powers of numbers from 0 to 1 in operations that round alike on every machine, without branches, so that loops over it
 * become vectors. */
#ifndef RT_COMMON_POWER_H
#define RT_COMMON_POWER_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#define POWER_EXPONENT_BITS 52
#define POWER_SQRT_HALF 0x3fe6a09e667f3bcdu   /* the bits of sqrt(1/2) */
#define POWER_LEAST (-1000.0)                 /* 2^this is far below all floats */

static inline uint64_t power_bits(double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static inline double power_double(uint64_t bits)
{
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* log2 x for x >= 2^-1022. x = 2^k m with sqrt(1/2) <= m < sqrt 2, and ln m = 2 artanh s with s = (m - 1) / (m + 1),
 * |s| < 0.1716; its series in z = s^2 < 0.0295 ends with z^8 / 17: what is left out is below 2^-44 of the sum. */
static inline double power_log2(double x)
{
    const uint64_t bias = 2048;
    const double whole = 0x1p52;   /* its lowest bits are whole numbers */
    uint64_t k = (power_bits(x) - POWER_SQRT_HALF + (bias << POWER_EXPONENT_BITS)) >> POWER_EXPONENT_BITS;
    double m = power_double(power_bits(x) - ((k - bias) << POWER_EXPONENT_BITS)), s = (m - 1) / (m + 1), z = s * s;
    double sum = 1.0 / 13 + z * (1.0 / 15);
    sum = 1.0 / 9 + z * (1.0 / 11 + z * sum);
    sum = 1.0 / 5 + z * (1.0 / 7 + z * sum);
    sum = 1 + z * (1.0 / 3 + z * sum);
    return power_double(k | power_bits(whole)) - (whole + (double)bias) + 2 * M_LOG2E * s * sum;
}

/* 2^y for POWER_LEAST <= y <= 0: 2^n exp(g), n whole and |g| <= ln 2 / 2, by the series of exp to the ninth power; what is
 * left out is below 2^-36. */
static inline double power_exp2(double y)
{
    const double whole = 0x1.8p52;
    double n = y + whole, g = (y - (n - whole)) * M_LN2;
    double sum = 1.0 / 40320 + g * (1.0 / 362880);
    sum = 1.0 / 720 + g * (1.0 / 5040 + g * sum);
    sum = 1.0 / 24 + g * (1.0 / 120 + g * sum);
    sum = 1.0 / 2 + g * (1.0 / 6 + g * sum);
    sum = 1 + g * (1 + g * sum);
    return power_double(power_bits(sum) + (power_bits(n) << POWER_EXPONENT_BITS));
}

/* x^exponent for 2^-1022 <= x <= 1 and exponent >= 0, finite. Where it is not below the least float, the logarithm times
 * the exponent is at most 150 and its error brings in 150 ln 2 2^-44 < 2^-37: it is off by less than 2^-35 of itself. */
static inline double power_of(double x, double exponent)
{
    double y = exponent * power_log2(x);
    return power_exp2(y > POWER_LEAST ? y : POWER_LEAST);
}

#endif
