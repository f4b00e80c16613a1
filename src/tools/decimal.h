/* Decimal numbers as text to doubles, rounded correctly (to nearest, ties to even), whatever the program's locale is. */
#ifndef RT_TOOLS_DECIMAL_H
#define RT_TOOLS_DECIMAL_H

#include <locale.h>
#include <stdbool.h>
#include <stdint.h>

/* Reads [+-]DIGITS[.DIGITS][e[+-]DIGITS] at *at, with a digit before or behind the point at least, and moves *at behind
 * it. The text must end with another character, at the latest a zero byte. *x is what strtod gives: infinite where the
 * number is too large, 0 or subnormal where it is too small. `c_locale` is the C locale. False if there is no number
 * or an exponent without digits; *at and *x are unchanged then. */
bool decimal_read(const char **at, double *x, locale_t c_locale);

/* What it works with, for its test: 5^q for the powers of 19 digits of any float and more, q from LEAST_POWER up to below
 * END_POWER, each times the power of two that makes it 128 bits long, rounded down; the high half, the low half. */
enum { DECIMAL_LEAST_POWER = -64, DECIMAL_END_POWER = 64 };
extern const uint64_t decimal_power_of_five[DECIMAL_END_POWER - DECIMAL_LEAST_POWER][2];

#endif
