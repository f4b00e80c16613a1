#include "common/exact.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

/* |x| = *whole 2^(the result), *whole < 2^53; x is finite and not 0. */
static int split(double x, uint64_t *whole)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    int exponent = (int)(bits >> 52 & 2047);
    *whole = bits & (((uint64_t)1 << 52) - 1);
    if (exponent == 0) return -1074;
    *whole |= (uint64_t)1 << 52;
    return exponent - 1075;
}

/* p of n 32-bit digits, least first, becomes p times m, of n + 2. */
static void multiply(uint32_t *p, int n, uint64_t m)
{
    const uint32_t digit[2] = {(uint32_t)m, (uint32_t)(m >> 32)};
    uint32_t product[6] = {0};
    for (int k = 0; k < 2; k++) {
        uint64_t carry = 0;
        for (int i = 0; i < n; i++) {
            carry += product[i + k] + (uint64_t)p[i] * digit[k];
            product[i + k] = (uint32_t)carry;
            carry >>= 32;
        }
        product[n + k] = (uint32_t)carry;
    }
    for (int i = 0; i < n + 2; i++) p[i] = product[i];
}

void exact_add(ExactSum *sum, double a, double b, double c)
{
    if (a == 0 || b == 0 || c == 0) return;
    uint64_t whole[3];
    int bit = split(a, &whole[0]) + split(b, &whole[1]) + split(c, &whole[2]) - EXACT_LOWEST;
    int64_t sign = (a < 0) ^ (b < 0) ^ (c < 0) ? -1 : 1;
    uint32_t p[6] = {(uint32_t)whole[0], (uint32_t)(whole[0] >> 32)};
    multiply(p, 2, whole[1]);
    multiply(p, 4, whole[2]);
    int at = bit / 32;
    for (int i = 0; i < 6; i++) {
        uint64_t shifted = (uint64_t)p[i] << bit % 32;
        sum->limb[at + i] += sign * (int64_t)(uint32_t)shifted;
        sum->limb[at + i + 1] += sign * (int64_t)(shifted >> 32);
    }
    if (at < sum->low) sum->low = at;
    if (at + 7 > sum->high) sum->high = at + 7;
}

/* Carries what is outside of 0 to 2^32 - 1 upward; returns what leaves the highest limb, 0 or -1 as all sums fit. */
static int64_t carry_all(ExactSum *sum)
{
    int64_t carry = 0;
    for (int i = sum->low; i < sum->high; i++) {
        int64_t all = sum->limb[i] + carry, digit = all & UINT32_MAX;
        sum->limb[i] = digit;
        carry = (all - digit) / ((int64_t)1 << 32);
    }
    return carry;
}

static void negate(ExactSum *sum)
{
    for (int i = sum->low; i < sum->high; i++) sum->limb[i] = -sum->limb[i];
}

/* Leaves the magnitude in the limbs. */
static bool make_positive(ExactSum *sum)
{
    int64_t beyond = carry_all(sum);
    if (beyond == 0) return false;
    sum->limb[sum->high - 1] += beyond * ((int64_t)1 << 32);
    negate(sum);
    carry_all(sum);
    return true;
}

int exact_sign(ExactSum *sum)
{
    int64_t beyond = carry_all(sum);
    if (beyond != 0) {
        sum->limb[sum->high - 1] += beyond * ((int64_t)1 << 32);
        return -1;
    }
    for (int i = sum->low; i < sum->high; i++)
        if (sum->limb[i] != 0) return 1;
    return 0;
}

double exact_value(ExactSum *sum, int shift)
{
    bool negative = make_positive(sum);
    int top = sum->high - 1;
    while (top > sum->low && sum->limb[top] == 0) top--;
    double value = 0;
    /* three limbs hold at least the 65 leading bits */
    for (int i = top > sum->low + 2 ? top - 2 : sum->low; i <= top; i++)
        value += ldexp((double)sum->limb[i], 32 * (i - top));
    value = ldexp(value, 32 * top + EXACT_LOWEST + shift);
    if (negative) negate(sum);
    return negative ? -value : value;
}
