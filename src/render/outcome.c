#include "render/outcome.h"

#include <stdlib.h>

bool outcome_add_point(RenderOutcome *outcome, const CurvePoint *point, Err *err)
{
    if (outcome->count == outcome->room) {
        size_t room = outcome->room ? 2 * outcome->room : 16;
        CurvePoint *grown = realloc(outcome->point, room * sizeof *grown);
        if (!grown) return err_memory(err, "the curve of error");
        outcome->point = grown;
        outcome->room = room;
    }
    outcome->point[outcome->count++] = *point;
    return true;
}

void outcome_set_true_error(RenderOutcome *outcome, const RenderSettings *settings)
{
    const Tiles *tiles = &outcome->map.tiles;
    double pixels = (double)tiles->width * tiles->height;
    outcome->true_rmse = settings->reference ? sqrt(error_map_sum(&outcome->map).true_sum / pixels) : NAN;
}

bool outcome_set_pixel_error(RenderOutcome *outcome, Err *err)
{
    const double share[2] = {0.5, 0.99};
    double error[2];
    if (!error_map_quantiles(&outcome->map, share, error, 2, err)) return false;
    outcome->has_pixel_error = true;
    outcome->median_error = error[0];
    outcome->p99_error = error[1];
    return true;
}

void outcome_destroy(RenderOutcome *outcome)
{
    free(outcome->point);
    error_map_destroy(&outcome->map);
    *outcome = (RenderOutcome){.point = NULL};
}
