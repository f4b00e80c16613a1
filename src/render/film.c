#include "render/film.h"

#include <float.h>
#include <stdint.h>

#include "common/colour.h"

size_t film_pixel_bytes(FilmFormat format)
{
    switch (format) {
    case FILM_8: return 3;
    case FILM_16: return 3 * sizeof(uint16_t);
    case FILM_FLOAT: return 3 * sizeof(float);
    }
    return 0;
}

/* Of [0, most]. */
static unsigned quantise(double c, bool srgb, unsigned most)
{
    c = c < 0 ? 0 : c > 1 ? 1 : c;
    if (srgb) c = srgb_encode(c);
    return (unsigned)(c * most + 0.5);
}

static float to_float(double c)
{
    return c > (double)FLT_MAX ? FLT_MAX : c < -(double)FLT_MAX ? -FLT_MAX : (float)c;
}

void film_put(FilmFormat format, bool srgb, void *film, size_t index, const double colour[3])
{
    uint8_t *bytes = film;
    float *floats = film;
    for (size_t k = 0, at = 3 * index; k < 3; k++, at++) {
        unsigned deep;
        switch (format) {
        case FILM_8:
            bytes[at] = (uint8_t)quantise(colour[k], srgb, UINT8_MAX);
            break;
        case FILM_16:
            deep = quantise(colour[k], srgb, UINT16_MAX);
            bytes[2 * at] = (uint8_t)(deep >> 8);
            bytes[2 * at + 1] = (uint8_t)deep;
            break;
        case FILM_FLOAT:
            floats[at] = to_float(colour[k]);
            break;
        }
    }
}

bool film_clips(const double colour[3])
{
    bool clips = false;
    for (int k = 0; k < 3; k++) clips |= colour[k] < 0 || colour[k] > 1;
    return clips;
}
