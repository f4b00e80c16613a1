#include "stability/stability.h"

const StabilityCase primitive_cases[] = {
    {0},
};
