#include "render/report.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "common/cpu.h"
#include "tools/escape.h"

StageTime stage_lap(StageTime *since)
{
    StageTime now = {cpu_wall_s(), cpu_time_s()};
    StageTime lap = {now.wall_s - since->wall_s, now.cpu_s - since->cpu_s};
    *since = now;
    return lap;
}

/* ---- the summary line ---- */

static uint64_t all_rays(const RenderStats *stats)
{
    return stats->camera_rays + stats->shadow_rays + stats->mirror_rays;
}

/* Three significant digits or more: "512", "31.2 k", "1.04 G". */
static void format_count(uint64_t count, char *text, size_t size)
{
    static const char *const unit[] = {"", " k", " M", " G", " T"};
    double x = (double)count;
    size_t i = 0;
    for (; x >= 999.5 && i + 1 < sizeof unit / sizeof unit[0]; i++) x /= 1000;
    snprintf(text, size, "%.*f%s", i == 0 || x >= 99.95 ? 0 : x >= 9.995 ? 1 : 2, x, unit[i]);
}

void report_summary(const RenderReport *r, char *text, size_t size)
{
    const CompileStats *c = &r->compile;
    double wall_s = c->load_wall_s + c->compile_wall_s + c->bvh_wall_s + r->render.wall_s + r->encode.wall_s;
    double cpu_s = c->load_cpu_s + c->compile_cpu_s + c->bvh_cpu_s + r->render.cpu_s + r->encode.cpu_s;
    uint64_t count = all_rays(&r->render);
    char rays[32];
    format_count(count, rays, sizeof rays);
    char samples[32];
    double pixels = (double)r->width * r->height;
    if (r->samples) snprintf(samples, sizeof samples, "%" PRIu32, r->samples);
    else snprintf(samples, sizeof samples, "%.1f", (double)r->render.samples / pixels);
    snprintf(text, size, "%s: %" PRIu32 " x %" PRIu32 ", %s sample%s, %s ray%s in %.*f s (CPU %.*f s), %" PRIu32
             " thread%s", r->file, r->width, r->height, samples, r->samples == 1 ? "" : "s", rays,
             count == 1 ? "" : "s", wall_s < 1 ? 2 : 1, wall_s, cpu_s < 1 ? 2 : 1, cpu_s, r->render.threads,
             r->render.threads == 1 ? "" : "s");
}

/* ---- JSON ---- */

struct Report {
    FILE *out;      /* writes to text and size; NULL once closed */
    char *text;
    size_t size;
    uint32_t renders;
};

static void write_stage(FILE *out, const char *name, double wall_s, double cpu_s, const char *end)
{
    fprintf(out, "        \"%s\": {\"wall_s\": %.6f, \"cpu_s\": %.6f}%s\n", name, wall_s, cpu_s, end);
}

Report *report_create(const char *script)
{
    Report *report = calloc(1, sizeof *report);
    if (!report) return NULL;
    report->out = open_memstream(&report->text, &report->size);
    if (!report->out) {
        free(report);
        return NULL;
    }
    fputs("{\n  \"script\": ", report->out);
    escape_json(report->out, script, strlen(script));
    fputs(",\n  \"renders\": [", report->out);
    return report;
}

void report_destroy(Report *report)
{
    if (!report) return;
    if (report->out) fclose(report->out);
    free(report->text);
    free(report);
}

void report_add(Report *report, const RenderReport *r)
{
    FILE *out = report->out;
    const CompileStats *c = &r->compile;
    fprintf(out, "%s\n    {\n      \"file\": ", report->renders++ ? "," : "");
    if (r->file) escape_json(out, r->file, strlen(r->file));
    else fputs("null", out);
    fputs(",\n      \"place\": ", out);
    size_t place = strlen(r->where);
    escape_json(out, r->where, place >= 2 ? place - 2 : 0);  /* without ": " */
    fprintf(out, ",\n      \"width\": %" PRIu32 ",\n      \"height\": %" PRIu32 ",\n", r->width, r->height);
    fprintf(out, "      \"samples\": %" PRIu32 ",\n      \"max_depth\": %" PRIu32 ",\n", r->samples, r->max_depth);
    fprintf(out, "      \"threads\": %" PRIu32 ",\n      \"stages\": {\n", r->render.threads);
    write_stage(out, "script", r->script.wall_s, r->script.cpu_s, ",");
    write_stage(out, "load", c->load_wall_s, c->load_cpu_s, ",");
    write_stage(out, "compile", c->compile_wall_s, c->compile_cpu_s, ",");
    write_stage(out, "bvh", c->bvh_wall_s, c->bvh_cpu_s, ",");
    write_stage(out, "render", r->render.wall_s, r->render.cpu_s, ",");
    write_stage(out, "encode", r->encode.wall_s, r->encode.cpu_s, "");
    fprintf(out, "      },\n      \"rays\": {\"camera\": %" PRIu64 ", \"shadow\": %" PRIu64 ", \"mirror\": %" PRIu64 "},\n",
            r->render.camera_rays, r->render.shadow_rays, r->render.mirror_rays);
    fprintf(out, "      \"samples_taken\": %" PRIu64 ",\n      \"samples_not_finite\": %" PRIu64 ",\n", r->render.samples,
            r->render.not_finite);
    fprintf(out, "      \"meshes\": {\"named\": %" PRIu32 ", \"loaded\": %" PRIu32 "},\n", c->meshes_named,
            c->meshes_loaded);
    fprintf(out, "      \"textures\": {\"named\": %" PRIu32 ", \"loaded\": %" PRIu32 "},\n", c->textures_named,
            c->textures_loaded);
    fprintf(out, "      \"nodes\": %" PRIu32 ",\n      \"objects\": %" PRIu64 ",\n", c->nodes, c->objects);
    fprintf(out, "      \"triangles\": %" PRIu64 ",\n      \"dropped_triangles\": %" PRIu64 ",\n", c->triangles,
            c->dropped_triangles);
    fprintf(out, "      \"peak_memory_bytes\": %" PRIu64 "\n    }", r->peak_bytes);
}

bool report_finish(Report *report, const char **text, size_t *size, Err *err)
{
    fputs(report->renders ? "\n  ]\n}\n" : "]\n}\n", report->out);
    bool failed = ferror(report->out) != 0;
    failed |= fclose(report->out) != 0;
    report->out = NULL;
    if (failed) return err_memory(err, "the statistics");
    *text = report->text;
    *size = report->size;
    return true;
}
