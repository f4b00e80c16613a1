/* Runs the stiff and extreme cases and prints a row each: `stability [--full|--long] [case number]...`. Ends with the line
 * "N passed, N failed" and status 1 if a row has a failure. */
#include "stability/stability.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "common/cpu.h"

/* A row of which the oracle leaves more than this share open is no evidence, unless the case says why. */
#define UNDECIDED_MOST 0.001

typedef enum { QUICK, FULL, LONG_RUN } Length;

bool row_trial(Row *row, bool ok, const char *format, ...)
{
    row->trials++;
    if (ok) return true;
    if (row->failures++ == 0) {
        va_list args;
        va_start(args, format);
        vsnprintf(row->first, sizeof row->first, format, args);
        va_end(args);
    }
    return false;
}

static void print_ulps(double ulps)
{
    if (ulps > 0)
        printf(" %8.3g", ulps);
    else
        printf(" %8s", "-");
}

static bool run_case(const StabilityCase *c, Length length)
{
    Row row = {0};
    double start = cpu_wall_s();
    c->run(&row, length == QUICK ? c->quick : length == FULL ? c->full : c->extra);
    printf("%2d  %-44.44s %-11s %10llu %8llu %9llu", c->number, c->name, c->oracle, (unsigned long long)row.trials,
           (unsigned long long)row.failures, (unsigned long long)row.undecided);
    print_ulps(row.t_ulps);
    print_ulps(row.n_ulps);
    printf(" %6.1f s  %s\n", cpu_wall_s() - start, c->others);
    if (row.failures) printf("    first: %s\n", row.first);
    if (!row.trials) printf("    no trial was made\n");
    bool evident = (double)row.undecided <= (row.undecided_most > 0 ? row.undecided_most : UNDECIDED_MOST) * (double)row.trials;
    if (!evident) printf("    too many trials could not be decided\n");
    fflush(stdout);
    return row.trials > 0 && row.failures == 0 && evident;
}

static bool is_wanted(int number, int argc, char **argv, int first)
{
    for (int i = first; i < argc; i++)
        if (atoi(argv[i]) == number) return true;
    return first >= argc;
}

int main(int argc, char **argv)
{
    Length length = QUICK;
    int first = 1;
    if (argc > 1 && strcmp(argv[1], "--full") == 0) length = FULL, first++;
    if (argc > 1 && strcmp(argv[1], "--long") == 0) length = LONG_RUN, first++;
    const StabilityCase *const tables[] = {primitive_cases, mesh_cases, csg_cases, picture_cases, shade_cases, far_cases,
                                           camera_cases, texture_cases, bump_cases, limit_cases};
    int passed = 0, failed = 0;
    printf(" #  %-44s %-11s %10s %8s %9s %8s %8s\n", "case", "oracle", "trials", "failures", "undecided", "t ulps",
           "n ulps");
    for (size_t i = 0; i < sizeof tables / sizeof *tables; i++)
        for (const StabilityCase *c = tables[i]; c->name; c++) {
            if (!is_wanted(c->number, argc, argv, first)) continue;
            if (run_case(c, length))
                passed++;
            else
                failed++;
        }
    printf("%d passed, %d failed\n", passed, failed);
    return failed > 0;
}
