#include "common/place.h"

#include <string.h>

size_t place_length(const char *text)
{
    const char *end = strstr(text, ": ");
    if (!end) return 0;
    const char *digit = end;
    while (digit > text && digit[-1] >= '0' && digit[-1] <= '9') digit--;
    if (digit == end || digit < text + 2 || digit[-1] != ':') return 0;
    return (size_t)(end - text) + 2;
}
