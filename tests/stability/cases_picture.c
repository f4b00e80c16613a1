#include "stability/stability.h"

const StabilityCase picture_cases[] = {
    {0},
};
