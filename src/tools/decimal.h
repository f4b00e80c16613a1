/* Decimal numbers as text to doubles, rounded correctly (to nearest, ties to even), whatever the program's locale is. */
#ifndef RT_TOOLS_DECIMAL_H
#define RT_TOOLS_DECIMAL_H

#include <locale.h>
#include <stdbool.h>

/* Reads [+-]DIGITS[.DIGITS][e[+-]DIGITS] at *at, with a digit before or behind the point at least, and moves *at behind
 * it. The text must end with another character, at the latest a zero byte. *x is what strtod gives: infinite where the
 * number is too large, 0 or subnormal where it is too small. `c_locale` is the C locale. False if there is no number
 * or an exponent without digits; *at and *x are unchanged then. */
bool decimal_read(const char **at, double *x, locale_t c_locale);

#endif
