#include "stability/stability.h"

const StabilityCase csg_cases[] = {
    {0},
};
