/* What a render cost: one summary line for people, JSON for programs (--stats). */
#ifndef RT_RENDER_REPORT_H
#define RT_RENDER_REPORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "common/err.h"
#include "render/stats.h"
#include "scene/compile.h"

typedef struct { double wall_s, cpu_s; } StageTime;

/* Seconds since the clocks were read into *since, which are read anew. */
StageTime stage_lap(StageTime *since);

/* One call of gr.render. */
typedef struct {
    const char *file;               /* the picture's; NULL if none was written (--check) */
    const char *where;              /* "temple.lua:41: ", the script's line */
    uint32_t width, height;         /* of the file */
    uint32_t samples;               /* of each pixel; 0: as goals wanted */
    uint32_t max_depth;
    StageTime script;               /* since the script began or the render before ended */
    StageTime encode;               /* encoding and writing the picture */
    CompileStats compile;
    RenderStats render;
    uint64_t peak_bytes;            /* of the process so far */
} RenderReport;

/* "temple.png: 1024 x 1024, 9 samples, 31.2 M rays in 3.1 s (CPU 6.0 s), 2 threads": the time from gr.render's call to
 * the file. */
void report_summary(const RenderReport *report, char *text, size_t size);

/* Collects the reports of a run as one JSON object. */
typedef struct Report Report;

/* NULL without memory. Owned by the caller; report_destroy takes NULL too. */
Report *report_create(const char *script);
void report_destroy(Report *report);

void report_add(Report *report, const RenderReport *render);

/* Ends the object; *text is freed with the report. False and *err (ERR_LIMIT) if memory ran out at any time. */
bool report_finish(Report *report, const char **text, size_t *size, Err *err);

#endif
