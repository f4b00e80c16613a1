#include "render/error_map.h"

#include <stdlib.h>

bool error_map_create(ErrorMap *map, uint32_t width, uint32_t height, Err *err)
{
    Tiles tiles = tiles_of(width, height);
    *map = (ErrorMap){tiles, malloc((size_t)width * height * sizeof *map->code), calloc(tiles.count, sizeof *map->tile)};
    if (map->code && map->tile) return true;
    error_map_destroy(map);
    return err_memory(err, "the pixels' errors");
}

void error_map_destroy(ErrorMap *map)
{
    free(map->code);
    free(map->tile);
    *map = (ErrorMap){.code = NULL};
}

TileError error_map_sum(const ErrorMap *map)
{
    TileError all = {0};
    for (uint32_t i = 0; i < map->tiles.count; i++) {
        all.sum += map->tile[i].sum;
        all.squares += map->tile[i].squares;
        all.true_sum += map->tile[i].true_sum;
        all.greatest = fmax(all.greatest, map->tile[i].greatest);
    }
    return all;
}

/* Codes grow with what they stand for: a pixel more or less in each is all that sorting needs. */
bool error_map_quantiles(const ErrorMap *map, const double *share, double *error, int count, Err *err)
{
    uint32_t *seen = calloc(UINT16_MAX + 1, sizeof *seen);
    if (!seen) return err_memory(err, "the pixels' errors");
    size_t pixels = (size_t)map->tiles.width * map->tiles.height;
    for (size_t i = 0; i < pixels; i++) seen[map->code[i]]++;
    for (int k = 0; k < count; k++) {
        double wanted = share[k] * (double)pixels;
        size_t code = 0;
        for (double below = seen[0]; below < wanted && code < UINT16_MAX;) below += seen[++code];
        error[k] = sqrt(error_of_code((uint16_t)code));
    }
    free(seen);
    return true;
}
