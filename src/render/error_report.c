#include "render/error_report.h"

#include <math.h>

double error_report_rounding(unsigned bits)
{
    return bits ? 1 / ((exp2((double)bits) - 1) * sqrt(12)) : 0;
}
