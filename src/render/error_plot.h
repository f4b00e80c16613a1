/* The curve of an error report as a plot: error against wall seconds, both logarithmic, as SVG that stands by itself. */
#ifndef RT_RENDER_ERROR_PLOT_H
#define RT_RENDER_ERROR_PLOT_H

#include <stdio.h>

#include "render/error_report.h"

/* The stream's thread must have the C locale. */
void error_plot_write(FILE *out, const ErrorReport *report);

#endif
