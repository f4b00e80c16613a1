/* The name that a misspelt one was probably meant to be. */
#ifndef RT_TOOLS_NEAREST_H
#define RT_TOOLS_NEAREST_H

#include <stddef.h>

/* The name of the least edit distance (insertions, deletions, replacements, swaps of neighbours; upper and lower case
 * are the same); the first of several. NULL if none is near: more than 1 + a third of the letters would have to change. */
const char *nearest_name(const char *wrong, const char *const *names, size_t count);

#endif
