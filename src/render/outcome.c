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

void outcome_destroy(RenderOutcome *outcome)
{
    free(outcome->point);
    error_map_destroy(&outcome->map);
    *outcome = (RenderOutcome){.point = NULL};
}
