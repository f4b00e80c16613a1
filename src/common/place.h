/* The place that a message carries in front: "temple.lua:41: ". */
#ifndef RT_COMMON_PLACE_H
#define RT_COMMON_PLACE_H

#include <stddef.h>

/* Length of the place in front of a message, its last blank included; 0 if there is none ("can't open a.lua: ..."). */
size_t place_length(const char *text);

#endif
