/* Limits of pictures, read or written: each side at most MAX_SIDE pixels, the area at most MAX_AREA. */
#ifndef RT_COMMON_PICTURE_H
#define RT_COMMON_PICTURE_H

#define MAX_SIDE 65535u
#define MAX_AREA (1u << 28)

#endif
