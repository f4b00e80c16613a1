/* The rendered part of a picture in tiles, row by row. */
#ifndef RT_RENDER_TILES_H
#define RT_RENDER_TILES_H

#include <stdint.h>

#include "render/settings.h"

/* Pixels of a tile's side: a tile's samples share the upper nodes of the BVH, and a 512 x 512 picture has 1,024 of them
 * to spread over threads. */
enum { TILE = 16, TILE_PIXELS = TILE * TILE };

typedef struct { uint32_t width, height, across, count; } Tiles;

/* Its pixels, counted from the part's corner; x1 and y1 exclusive. */
typedef struct { uint32_t x0, y0, x1, y1; } TileRect;

static inline Tiles tiles_of(uint32_t width, uint32_t height)
{
    uint32_t across = (width + TILE - 1) / TILE;
    return (Tiles){width, height, across, across * ((height + TILE - 1) / TILE)};
}

static inline TileRect tile_rect(const Tiles *tiles, uint32_t tile)
{
    uint32_t x0 = tile % tiles->across * TILE, y0 = tile / tiles->across * TILE;
    return (TileRect){x0, y0, x0 + TILE < tiles->width ? x0 + TILE : tiles->width,
                      y0 + TILE < tiles->height ? y0 + TILE : tiles->height};
}

/* The even bits of a number, moved together: pixels in the order of a Z curve (Morton 1966) stay near each other. */
static inline uint32_t even_bits(uint32_t x)
{
    x &= 0x55;
    x = (x | x >> 1) & 0x33;
    return (x | x >> 2) & 0x0f;
}

/* Column and row within a tile of its k-th pixel on that curve. */
static inline uint32_t tile_column(uint32_t k) { return even_bits(k); }
static inline uint32_t tile_row(uint32_t k) { return even_bits(k >> 1); }

#endif
