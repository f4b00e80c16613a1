#include "stability/stability.h"

const StabilityCase mesh_cases[] = {
    {0},
};
