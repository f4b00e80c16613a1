#include "tools/nearest.h"

#include <ctype.h>
#include <string.h>

enum { MAX_LENGTH = 40 };

static size_t min_size(size_t a, size_t b) { return a < b ? a : b; }

static int lower(char c) { return tolower((unsigned char)c); }

/* Optimal string alignment (Damerau 1964; Wagner, Fischer 1974): row i holds the distances of the first i letters of a
 * to the first j of b. Neither is longer than MAX_LENGTH. */
static size_t edit_distance(const char *a, size_t a_length, const char *b, size_t b_length)
{
    size_t row[MAX_LENGTH + 1][MAX_LENGTH + 1];
    for (size_t j = 0; j <= b_length; j++) row[0][j] = j;
    for (size_t i = 1; i <= a_length; i++) {
        row[i][0] = i;
        for (size_t j = 1; j <= b_length; j++) {
            size_t change = row[i - 1][j - 1] + (lower(a[i - 1]) != lower(b[j - 1]));
            row[i][j] = min_size(change, min_size(row[i - 1][j], row[i][j - 1]) + 1);
            if (i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) && lower(a[i - 2]) == lower(b[j - 1]))
                row[i][j] = min_size(row[i][j], row[i - 2][j - 2] + 1);
        }
    }
    return row[a_length][b_length];
}

const char *nearest_name(const char *wrong, const char *const *names, size_t count)
{
    size_t length = strlen(wrong);
    if (length > MAX_LENGTH) return NULL;
    const char *best = NULL;
    size_t least = 2 + length / 3;
    for (size_t i = 0; i < count; i++) {
        size_t name_length = strlen(names[i]);
        if (name_length > MAX_LENGTH) continue;
        size_t distance = edit_distance(wrong, length, names[i], name_length);
        if (distance >= least) continue;
        least = distance;
        best = names[i];
    }
    return best;
}
