/* The film: the picture as it leaves the renderer, in the format that the file will have. */
#ifndef RT_RENDER_FILM_H
#define RT_RENDER_FILM_H

#include <stdbool.h>
#include <stddef.h>

typedef enum {
    FILM_8,      /* 3 bytes a pixel */
    FILM_16,     /* 3 samples of 2 bytes, the high one first */
    FILM_FLOAT,  /* 3 floats of the machine: linear light, not clamped */
} FilmFormat;

size_t film_pixel_bytes(FilmFormat format);

/* Stores a colour, finite and linear, as the film's pixel `index`. The integer formats are clamped to [0,1], encoded if
 * `srgb`, and rounded; what a float can't hold becomes its greatest number. */
void film_put(FilmFormat format, bool srgb, void *film, size_t index, const double colour[3]);

/* A channel lies outside [0,1], where the integer formats end. */
bool film_clips(const double colour[3]);

#endif
