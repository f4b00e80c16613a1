/* Runs the stiff and extreme cases and prints a row each:
 *
 *     stability [--full|--long] [--jobs N] [CASE | CASE.ROW]...
 *
 * Without a length as in `make test`; --full as in `make stability`, --long as with LONG=1. CASE is a number of NUMERICS and
 * means all of its rows, 24.2 the second of them. Rows run in processes of their own, N at a time: as many as there are
 * processors unless said. Ends with the line "N passed, N failed" and status 1 if a row falls short. */
#include "stability/stability.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "common/cpu.h"
#include "support/check.h"

/* A row of which the oracle leaves more than this share open is no evidence. */
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

/* A row of the table: who works on it, where the answer comes from, and the answer. */
typedef struct {
    const StabilityCase *c;
    pid_t worker;
    int answer;
    Row row;
    double seconds;
    int status;     /* of the process, as waitpid tells it */
    bool done;
} Job;

enum { MOST_JOBS = 200 };

static void start(Job *job, Length length)
{
    int ends[2];
    CHECK(pipe(ends) == 0);
    fflush(stdout);
    job->worker = fork();
    CHECK(job->worker >= 0);
    if (job->worker == 0) {
        const StabilityCase *c = job->c;
        Row row = {0};
        close(ends[0]);
        c->run(&row, length == QUICK ? c->quick : length == FULL ? c->full : c->extra);
        CHECK(write(ends[1], &row, sizeof row) == sizeof row);
        exit(0);
    }
    close(ends[1]);
    job->answer = ends[0];
    job->seconds = cpu_wall_s();
}

/* Waits until one of them is done. */
static void collect(Job *jobs, int count)
{
    int status;
    pid_t worker = wait(&status);
    CHECK(worker > 0);
    for (int i = 0; i < count; i++) {
        Job *job = &jobs[i];
        if (job->worker != worker) continue;
        job->seconds = cpu_wall_s() - job->seconds;
        job->status = status;
        job->done = true;
        if (read(job->answer, &job->row, sizeof job->row) != sizeof job->row) job->row = (Row){0};
        close(job->answer);
    }
}

static bool report(const Job *job)
{
    const StabilityCase *c = job->c;
    const Row *row = &job->row;
    printf("%2d  %-44.44s %-11s %10llu %8llu %9llu", c->number, c->name, c->oracle, (unsigned long long)row->trials,
           (unsigned long long)row->failures, (unsigned long long)row->undecided);
    print_ulps(row->t_ulps);
    print_ulps(row->n_ulps);
    print_ulps(row->loose);
    printf(" %6.1f s  %s\n", job->seconds, c->others);
    if (row->failures) printf("    first: %s\n", row->first);
    if (job->status != 0) printf("    the program ended: status %d\n", job->status);
    else if (!row->trials) printf("    no trial was made\n");
    bool evident = (double)row->undecided <= UNDECIDED_MOST * (double)row->trials;
    if (!evident) printf("    too many trials could not be decided\n");
    fflush(stdout);
    return job->status == 0 && row->trials > 0 && row->failures == 0 && evident;
}

/* "24" or "24.2". */
static bool is_wanted(int number, int nth, int count, char *const *wanted)
{
    for (int i = 0; i < count; i++) {
        const char *dot = strchr(wanted[i], '.');
        if (atoi(wanted[i]) == number && (!dot || atoi(dot + 1) == nth)) return true;
    }
    return count == 0;
}

/* All rows of the wanted cases. */
static int list_jobs(Job *jobs, int count, char *const *wanted)
{
    const StabilityCase *const tables[] = {primitive_cases, mesh_cases, csg_cases, picture_cases, shade_cases, far_cases,
                                           camera_cases, texture_cases, bump_cases, limit_cases};
    int n = 0, rows[MOST_JOBS] = {0};
    for (size_t i = 0; i < sizeof tables / sizeof *tables; i++)
        for (const StabilityCase *c = tables[i]; c->name; c++) {
            CHECK(c->number < MOST_JOBS && n < MOST_JOBS);
            if (is_wanted(c->number, ++rows[c->number], count, wanted)) jobs[n++] = (Job){.c = c};
        }
    return n;
}

int main(int argc, char **argv)
{
    static Job jobs[MOST_JOBS];
    Length length = QUICK;
    int at = 1, most = (int)cpu_allowed(), passed = 0, failed = 0;
    for (; at < argc && argv[at][0] == '-'; at++) {
        if (strcmp(argv[at], "--full") == 0) length = FULL;
        else if (strcmp(argv[at], "--long") == 0) length = LONG_RUN;
        else if (strcmp(argv[at], "--jobs") == 0 && at + 1 < argc && atoi(argv[at + 1]) > 0) most = atoi(argv[++at]);
        else {
            fprintf(stderr, "usage: stability [--full|--long] [--jobs N] [CASE | CASE.ROW]...\n");
            return 2;
        }
    }
    int count = list_jobs(jobs, argc - at, argv + at), started = 0, running = 0, told = 0;
    printf(" #  %-44s %-11s %10s %8s %9s %8s %8s %8s\n", "case", "oracle", "trials", "failures", "undecided", "t ulps",
           "n ulps", "bound");
    while (told < count) {
        while (started < count && running < most) start(&jobs[started++], length), running++;
        collect(jobs, count);
        running--;
        for (; told < count && jobs[told].done; told++) *(report(&jobs[told]) ? &passed : &failed) += 1;
    }
    printf("t: within 4 ulps of the oracle (torus 16) where its condition number is at most 16; within the program's bound\n"
           "everywhere; \"bound\": that bound over the error that the condition number explains, at most 64\n");
    printf("%d passed, %d failed\n", passed, failed);
    return failed > 0 || passed == 0;
}
