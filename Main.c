/* The command line of rt: reads the options, runs the scene, and for each gr.render checks the output, compiles, renders
 * and writes; or compares two pictures. Everything that is printed is printed here. */
#include <errno.h>
#include <float.h>
#include <getopt.h>
#include <inttypes.h>
#include <math.h>
#include <signal.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "accel/accel.h"
#include "common/cpu.h"
#include "common/err.h"
#include "common/place.h"
#include "compare/compare.h"
#include "render.h"
#include "render/error_line.h"
#include "render/error_report.h"
#include "render/film.h"
#include "render/progress.h"
#include "render/report.h"
#include "scene/compile.h"
#include "scene/job.h"
#include "scene_lua.h"
#include "tools/image.h"
#include "tools/nearest.h"
#include "tools/outfile.h"
#include "tools/pfm.h"
#include "tools/png.h"

#define VERSION "1.0.0"

enum {
    MAX_THREADS = 1024,
    MIN_SAMPLES_PER_THREAD = 16384,  /* fewer aren't worth a thread */
    OPTION_KEYS = 256,               /* keys of options without a letter begin here */
};

typedef struct {
    const char *script, *output, *stats;
    const char *report, *variance, *reference;   /* files; NULL: not asked for */
    ErrorReportKind report_kind;
    const char **include;          /* the folders of -I, in order */
    int include_count;
    const char *const *args;       /* what follows -- */
    int arg_count;
    bool has_size, has_crop;
    uint32_t width, height, crop[4];
    uint32_t threads;              /* 0: by the machine and the picture */
    const char *cpu;               /* NULL: the widest instructions that the processor has */
    bool fast_bvh;                 /* --bvh fast */
    bool legacy, srgb, check, quiet, no_audit;
    bool help, version;            /* were asked for */
    RenderOptions options;
    const char *format;            /* "png", "pfm"; NULL: by the file's name */
    unsigned bits;                 /* of a PNG's samples; 0: not given */
    const char *picture[2];        /* rt compare */
    int picture_count;
    const char *diff;
    CompareSettings compare;
    bool has_tolerance, has_max_share;
    double error_goal, time_goal_s;   /* 0: not given */
} CommandLine;

typedef struct {
    char letter;           /* 0: none */
    const char *name;
    const char *argument;  /* NULL: takes none */
    bool (*set)(CommandLine *line, const char *value, Err *err);  /* with an argument */
    size_t flag;           /* without: offset of the bool that it sets */
    const char *help;      /* lines parted by newlines */
} OptionRow;

/* What rt can be told to do. */
typedef struct {
    const char *name;
    const OptionRow *rows;
    size_t row_count;
    bool (*word)(CommandLine *line, const char *word, Err *err);  /* takes a word that is no option */
    bool (*finish)(CommandLine *line, Err *err);                  /* judges the whole */
    const char *usage, *result;   /* before and behind the options in its help */
} Command;

typedef struct {
    const Command *command;
    CommandLine line;
    Report *report;       /* NULL without --stats */
    StageTime clock;      /* at the end of the last stage */
    double start_s;       /* cpu_wall_s when the process began */
    uint32_t renders;
    Progress progress;
    bool shows_progress, bar_is_shown;
    bool out_of_time;     /* before the error asked for was reached */
    bool pictures_differ; /* rt compare: by more than was asked for */
} App;

/* ---- the command line ---- */

static bool bad_value(const char *option, const char *value, const char *expected, Err *err)
{
    return err_set(err, ERR_USAGE, "%s must be %s, not '%s'", option, expected, value);
}

/* A decimal integer in [least, most], without sign or blanks; *end is what follows it. */
static bool parse_integer(const char *text, uint64_t least, uint64_t most, uint64_t *number, const char **end)
{
    if (*text < '0' || *text > '9') return false;
    char *stop;
    errno = 0;
    unsigned long long n = strtoull(text, &stop, 10);
    *number = n;
    *end = stop;
    return errno == 0 && n >= least && n <= most;
}

/* `count` integers in [least, most] with `mark` between them, and nothing else. */
static bool parse_integers(const char *text, char mark, uint64_t least, uint64_t most, size_t count, uint32_t *out)
{
    for (size_t i = 0; i < count; i++) {
        uint64_t n;
        if (i > 0 && *text++ != mark) return false;
        if (!parse_integer(text, least, most, &n, &text)) return false;
        out[i] = (uint32_t)n;
    }
    return *text == '\0';
}

static bool set_output(CommandLine *line, const char *value, Err *err)
{
    line->output = value;
    return *value || bad_value("-o", value, "a file", err);
}

static bool set_size(CommandLine *line, const char *value, Err *err)
{
    uint32_t size[2];
    if (!parse_integers(value, 'x', 1, UINT32_MAX, 2, size)) return bad_value("--size", value, "WxH, at least 1x1", err);
    if (size[0] > MAX_SIDE || size[1] > MAX_SIDE || (uint64_t)size[0] * size[1] > MAX_AREA)
        return err_set(err, ERR_LIMIT, "--size %s: the limits are %u pixels a side and %u in all", value, MAX_SIDE,
                       MAX_AREA);
    line->width = size[0];
    line->height = size[1];
    line->has_size = true;
    return true;
}

static bool set_crop(CommandLine *line, const char *value, Err *err)
{
    const uint32_t *c = line->crop;
    if (!parse_integers(value, ',', 0, MAX_SIDE, 4, line->crop) || c[0] >= c[2] || c[1] >= c[3])
        return bad_value("--crop", value, "X0,Y0,X1,Y1 with X0 < X1 and Y0 < Y1", err);
    line->has_crop = true;
    return true;
}

static bool set_samples(CommandLine *line, const char *value, Err *err)
{
    line->options.given |= OPTION_SAMPLES;
    return parse_integers(value, 0, 1, MAX_SAMPLES, 1, &line->options.samples) ||
           bad_value("-s", value, "an integer from 1 to 65536", err);
}

static bool set_max_depth(CommandLine *line, const char *value, Err *err)
{
    line->options.given |= OPTION_MAX_DEPTH;
    return parse_integers(value, 0, 0, MAX_MAX_DEPTH, 1, &line->options.max_depth) ||
           bad_value("--max-depth", value, "an integer from 0 to 1000", err);
}

static bool set_seed(CommandLine *line, const char *value, Err *err)
{
    const char *end;
    line->options.given |= OPTION_SEED;
    return (parse_integer(value, 0, UINT64_MAX, &line->options.seed, &end) && !*end) ||
           bad_value("--seed", value, "an integer from 0 to 2^64 - 1", err);
}

static bool set_background(CommandLine *line, const char *value, Err *err)
{
    double v[3];
    const char *text = value;
    for (int i = 0; i < 3; i++) {
        char *end;
        v[i] = strtod(text, &end);
        if (end == text || *end != (i < 2 ? ',' : '\0') || !(fabs(v[i]) <= (double)FLT_MAX))
            return bad_value("--background", value, "R,G,B", err);
        text = end + 1;
    }
    line->options.given |= OPTION_BACKGROUND;
    line->options.background = rgb((float)v[0], (float)v[1], (float)v[2]);
    return true;
}

static bool set_threads(CommandLine *line, const char *value, Err *err)
{
    return parse_integers(value, 0, 1, MAX_THREADS, 1, &line->threads) ||
           bad_value("-t", value, "an integer from 1 to 1024", err);
}

static bool set_cpu(CommandLine *line, const char *value, Err *err)
{
    line->cpu = value;
    return kernel_best(value) || bad_value("--cpu", value, "scalar, sse2, avx2 or avx512", err);
}

static bool set_bvh(CommandLine *line, const char *value, Err *err)
{
    line->fast_bvh = strcmp(value, "fast") == 0;
    return line->fast_bvh || strcmp(value, "best") == 0 || bad_value("--bvh", value, "fast or best", err);
}

static bool set_include(CommandLine *line, const char *value, Err *err)
{
    line->include[line->include_count++] = value;
    return *value || bad_value("-I", value, "a folder", err);
}

static bool set_stats(CommandLine *line, const char *value, Err *err)
{
    line->stats = value;
    return *value || bad_value("--stats", value, "a file", err);
}

/* A decimal number in [0, most], and nothing else. */
static bool parse_real(const char *text, double most, double *number)
{
    char *end;
    if ((*text < '0' || *text > '9') && *text != '.') return false;
    *number = strtod(text, &end);
    return *end == '\0' && *number >= 0 && *number <= most;
}

/* A decimal number above 0, and nothing else. */
static bool parse_above_0(const char *text, double *number)
{
    return parse_real(text, DBL_MAX, number) && *number > 0;
}

static bool set_error(CommandLine *line, const char *value, Err *err)
{
    return parse_above_0(value, &line->error_goal) || bad_value("--error", value, "a number above 0", err);
}

static bool set_time(CommandLine *line, const char *value, Err *err)
{
    return parse_above_0(value, &line->time_goal_s) || bad_value("--time", value, "seconds above 0", err);
}

static bool set_report(CommandLine *line, const char *value, Err *err)
{
    line->report = value;
    return error_report_kind(value, &line->report_kind, err);
}

static bool set_variance(CommandLine *line, const char *value, Err *err)
{
    line->variance = value;
    return *value || bad_value("--variance", value, "a file", err);
}

static bool set_reference(CommandLine *line, const char *value, Err *err)
{
    line->reference = value;
    return *value || bad_value("--reference", value, "a file", err);
}

static bool set_bits(CommandLine *line, const char *value, Err *err)
{
    return (parse_integers(value, 0, 8, 16, 1, &line->bits) && (line->bits == 8 || line->bits == 16)) ||
           bad_value("--bits", value, "8 or 16", err);
}

static bool set_format(CommandLine *line, const char *value, Err *err)
{
    line->format = value;
    return strcmp(value, "png") == 0 || strcmp(value, "pfm") == 0 || bad_value("--format", value, "png or pfm", err);
}

static bool set_max_rmse(CommandLine *line, const char *value, Err *err)
{
    return parse_real(value, DBL_MAX, &line->compare.max_rmse) || bad_value("--max-rmse", value, "a number from 0", err);
}

static bool set_max_diff(CommandLine *line, const char *value, Err *err)
{
    return parse_real(value, DBL_MAX, &line->compare.max_diff) || bad_value("--max-diff", value, "a number from 0", err);
}

static bool set_tolerance(CommandLine *line, const char *value, Err *err)
{
    line->has_tolerance = true;
    return parse_real(value, 255, &line->compare.tolerance) || bad_value("--tolerance", value, "levels from 0 to 255", err);
}

static bool set_max_share(CommandLine *line, const char *value, Err *err)
{
    line->has_max_share = true;
    return parse_real(value, 100, &line->compare.max_share) ||
           bad_value("--max-share", value, "percent from 0 to 100", err);
}

static bool set_edges(CommandLine *line, const char *value, Err *err)
{
    line->compare.only_edges = true;
    return parse_integers(value, 0, 0, MAX_SIDE, 1, &line->compare.reach) ||
           bad_value("--edges", value, "an integer from 0 to 65535", err);
}

static bool set_diff(CommandLine *line, const char *value, Err *err)
{
    line->diff = value;
    return *value || bad_value("--diff", value, "a file", err);
}

static const OptionRow render_rows[] = {
    {'o', "output", "FILE", set_output, 0,
     "write the picture to FILE, not where the script\n"
     "says; further ones go to FILE-2, FILE-3, ..."},
    {0, "size", "WxH", set_size, 0, "size in pixels, instead of the script's"},
    {0, "crop", "X0,Y0,X1,Y1", set_crop, 0,
     "render this part only; the origin is at the top\n"
     "left, X1 and Y1 are exclusive"},
    {'s', "samples", "N", set_samples, 0, "samples per pixel (9); 1 is the pixel's centre"},
    {0, "error", "E", set_error, 0,
     "as many samples as it takes for an RMSE of at most E\n"
     "in linear light (white is 1), with 95 % certainty"},
    {0, "time", "SECONDS", set_time, 0, "the best that the whole run can do in this time"},
    {0, "max-depth", "N", set_max_depth, 0, "greatest number of mirror bounces (4)"},
    {0, "seed", "N", set_seed, 0, "seed of the samples, never of the geometry"},
    {0, "background", "R,G,B", set_background, 0, "colour where nothing is hit"},
    {0, "srgb", NULL, NULL, offsetof(CommandLine, srgb),
     "decode textures from sRGB, encode the picture;\n"
     "a PFM stays linear"},
    {0, "bits", "8|16", set_bits, 0, "bits of each sample of a PNG (8)"},
    {0, "format", "png|pfm", set_format, 0,
     "what to write, whatever the name; otherwise a\n"
     "name that ends in .pfm gets a PFM: floats, linear,\n"
     "not clamped"},
    {'t', "threads", "N", set_threads, 0, "threads (as many as processors are allowed)"},
    {0, "cpu", "SET", set_cpu, 0,
     "use no wider instructions than scalar, sse2, avx2\n"
     "or avx512; the picture is the same with each"},
    {0, "bvh", "fast|best", set_bvh, 0,
     "how to build for meshes: best (the default) cuts\n"
     "triangles that are long beside their neighbours"},
    {'I', "include", "DIR", set_include, 0,
     "look for inputs there too, after the script's\n"
     "folder and the working directory; repeatable"},
    {0, "legacy", NULL, NULL, offsetof(CommandLine, legacy),
     "run a script of 2015 or before: post-multiplied\n"
     "transforms, names of Lua 5.1"},
    {0, "check", NULL, NULL, offsetof(CommandLine, check), "all but rendering: find what is wrong with a scene"},
    {0, "stats", "FILE", set_stats, 0, "write times, rays and memory to FILE, as JSON"},
    {0, "no-audit", NULL, NULL, offsetof(CommandLine, no_audit),
     "don't measure the picture's error by fresh samples:\n"
     "tell it by its own"},
    {0, "report", "FILE", set_report, 0,
     "write error against time and the error's sources\n"
     "to FILE, by its ending: .json, .csv or .svg"},
    {0, "variance", "FILE", set_variance, 0,
     "write the standard error of each pixel as a PNG of\n"
     "16 bits: 65535 is an error of 1, white against black"},
    {0, "reference", "FILE", set_reference, 0,
     "a PNG or PFM of the true picture: the report gets\n"
     "the error against it"},
    {'q', "quiet", NULL, NULL, offsetof(CommandLine, quiet), "no progress bar, no summary; warnings stay"},
    {'h', "help", NULL, NULL, offsetof(CommandLine, help), "print this help"},
    {0, "version", NULL, NULL, offsetof(CommandLine, version), "print the version"},
};

static const OptionRow compare_rows[] = {
    {0, "crop", "X0,Y0,X1,Y1", set_crop, 0, "compare this part of both only"},
    {0, "linear", NULL, NULL, offsetof(CommandLine, compare.linear),
     "the values are linear light: FLIP encodes them\n"
     "as sRGB first"},
    {0, "max-rmse", "E", set_max_rmse, 0, "fail if RMSE is more; white is 1"},
    {0, "max-diff", "D", set_max_diff, 0, "fail if a channel differs by more; white is 1"},
    {0, "tolerance", "LEVELS", set_tolerance, 0,
     "fail if a channel differs by more; white is 255.\n"
     "Without it pixels that differ at all are counted"},
    {0, "max-share", "PERCENT", set_max_share, 0, "let this many pixels go beyond the tolerance (0)"},
    {0, "edges", "N", set_edges, 0,
     "fail if one of them is further than N pixels from\n"
     "every edge of half its difference or more"},
    {0, "diff", "FILE", set_diff, 0,
     "write a PNG of the differences: black where there\n"
     "is none, over red and yellow to white for the\n"
     "greatest, by the square root"},
    {'q', "quiet", NULL, NULL, offsetof(CommandLine, quiet), "print nothing; the exit status tells"},
    {'h', "help", NULL, NULL, offsetof(CommandLine, help), "print this help"},
};

enum {
    RENDER_COUNT = sizeof render_rows / sizeof render_rows[0],
    COMPARE_COUNT = sizeof compare_rows / sizeof compare_rows[0],
    MAX_ROWS = (int)RENDER_COUNT > (int)COMPARE_COUNT ? RENDER_COUNT : COMPARE_COUNT,
};

static int option_key(const Command *command, size_t row)
{
    return command->rows[row].letter ? command->rows[row].letter : OPTION_KEYS + (int)row;
}

/* getopt's two forms of the table. The string begins with "-:": words that are no options come as option 1, so that
 * they can be told from those after "--", and a missing value as ':'. */
static void make_getopt_tables(const Command *command, struct option *longs, char *letters)
{
    *letters++ = '-';
    *letters++ = ':';
    for (size_t i = 0; i < command->row_count; i++) {
        const OptionRow *row = &command->rows[i];
        int takes = row->argument ? required_argument : no_argument;
        longs[i] = (struct option){row->name, takes, NULL, option_key(command, i)};
        if (!row->letter) continue;
        *letters++ = row->letter;
        if (takes == required_argument) *letters++ = ':';
    }
    longs[command->row_count] = (struct option){NULL, 0, NULL, 0};
    *letters = '\0';
}

/* getopt has refused `word`; `key` is optopt: the letter, or the key of a long option that got a value it doesn't take,
 * or 0. */
static bool unknown_option(const Command *command, const char *word, int key, Err *err)
{
    if (strncmp(word, "--", 2) != 0) return err_set(err, ERR_USAGE, "unknown option -%c", key);
    size_t length = strcspn(word, "=");
    if (key != 0) return err_set(err, ERR_USAGE, "%.*s takes no value", (int)length, word);
    const char *names[MAX_ROWS];
    char name[64];
    for (size_t i = 0; i < command->row_count; i++) names[i] = command->rows[i].name;
    snprintf(name, sizeof name, "%.*s", (int)(length - 2), word + 2);
    const char *near = nearest_name(name, names, command->row_count);
    if (near) return err_set(err, ERR_USAGE, "unknown option %.*s (did you mean --%s?)", (int)length, word, near);
    return err_set(err, ERR_USAGE, "unknown option %.*s", (int)length, word);
}

/* `key` is that of a row: getopt gives no other. */
static bool set_option(const Command *command, CommandLine *line, int key, const char *value, Err *err)
{
    size_t row = 0;
    while (option_key(command, row) != key) row++;
    if (command->rows[row].set) return command->rows[row].set(line, value, err);
    *(bool *)((char *)line + command->rows[row].flag) = true;
    return true;
}

static bool set_script(CommandLine *line, const char *word, Err *err)
{
    if (line->script)
        return err_set(err, ERR_USAGE, "one scene at a time, not '%s' too (words for the script stand after --)", word);
    line->script = word;
    return true;
}

static bool is_pfm_name(const char *name)
{
    size_t length = strlen(name);
    return length >= 4 && strcasecmp(name + length - 4, ".pfm") == 0;
}

static bool writes_pfm(const CommandLine *line, const char *file)
{
    return line->format ? strcmp(line->format, "pfm") == 0 : is_pfm_name(file);
}

static bool has_goal(const CommandLine *line) { return line->error_goal > 0 || line->time_goal_s > 0; }

static bool finish_render(CommandLine *line, Err *err)
{
    if (!line->script) return err_set(err, ERR_USAGE, "no scene is given");
    if ((line->options.given & OPTION_SAMPLES) && has_goal(line))
        return err_set(err, ERR_USAGE, "-s fixes the samples: it can't stand with --error or --time");
    if (line->bits && writes_pfm(line, line->output ? line->output : ""))
        return err_set(err, ERR_USAGE, "--bits is for PNG; a PFM has 32");
    return true;
}

static bool set_picture(CommandLine *line, const char *word, Err *err)
{
    if (line->picture_count == 2) return err_set(err, ERR_USAGE, "two pictures are compared, not '%s' too", word);
    line->picture[line->picture_count++] = word;
    return true;
}

/* Words after -- are pictures too. With a tolerance no pixel may be beyond it, unless a share is given. */
static bool finish_compare(CommandLine *line, Err *err)
{
    for (int i = 0; i < line->arg_count; i++)
        if (!set_picture(line, line->args[i], err)) return false;
    if (line->picture_count < 2) return err_set(err, ERR_USAGE, "two pictures are compared");
    if (line->has_tolerance && !line->has_max_share) line->compare.max_share = 0;
    return true;
}

static const Command render_command = {
    "rt", render_rows, RENDER_COUNT, set_script, finish_render,
    "Usage: rt [options] scene.lua [options] [-- words for the script]\n"
    "       rt compare [options] A B      (see rt compare --help)\n"
    "Renders the pictures that a Lua scene asks for with gr.render.\n",
    "Exit status: 0 done, 1 the script or the scene is wrong, 2 the command line,\n"
    "3 the scene or a file that it names can't be read, 4 the output can't be\n"
    "written, 5 a limit, 6 out of time.\n",
};

static const Command compare_command = {
    "rt compare", compare_rows, COMPARE_COUNT, set_picture, finish_compare,
    "Usage: rt compare [options] A B\n"
    "Prints how far two pictures of the same size, PNG or PFM, are apart: RMSE and\n"
    "PSNR of the values as they are, SSIM, FLIP at 67 pixels per degree, the greatest\n"
    "difference, and how many pixels differ.\n",
    "Exit status: 0 as near as asked for, 1 not, 2 the command line or pictures of\n"
    "different sizes, 3 a picture can't be read, 4 the output can't be written,\n"
    "5 a limit.\n",
};

/* Fills *line, whose `include` has room for argc folders. */
static bool parse_command_line(const Command *command, int argc, char **argv, CommandLine *line, Err *err)
{
    struct option longs[MAX_ROWS + 1];
    char letters[2 * MAX_ROWS + 3];
    make_getopt_tables(command, longs, letters);
    opterr = 0;
    for (int key; (key = getopt_long(argc, argv, letters, longs, NULL)) != -1;) {
        const char *word = argv[optind - 1];
        if (key == ':') return err_set(err, ERR_USAGE, "%s needs a value", word);
        if (key == '?') return unknown_option(command, word, optopt, err);
        if (!(key == 1 ? command->word(line, optarg, err) : set_option(command, line, key, optarg, err))) return false;
        if (line->help || line->version) return true;
    }
    line->args = (const char *const *)argv + optind;
    line->arg_count = argc - optind;
    return command->finish(line, err);
}

/* ---- what is printed ---- */

static void print_help(const Command *command)
{
    printf("%s\nOptions:\n", command->usage);
    for (size_t i = 0; i < command->row_count; i++) {
        const OptionRow *row = &command->rows[i];
        char names[64], letter[8] = "    ";
        if (row->letter) snprintf(letter, sizeof letter, "-%c, ", row->letter);
        snprintf(names, sizeof names, "%s--%s %s", letter, row->name, row->argument ? row->argument : "");
        const char *text = row->help;
        for (const char *left = names; text; left = "") {
            size_t length = strcspn(text, "\n");
            printf("  %-25s %.*s\n", left, (int)length, text);
            text = text[length] ? text + length + 1 : NULL;
        }
    }
    printf("\n%s", command->result);
}

static void print_error(const Command *command, const Err *err)
{
    fprintf(stderr, "%s%s", place_length(err->text) ? "" : "rt: ", err->text);
    if (err->kind == ERR_USAGE) fprintf(stderr, "; see %s --help", command->name);
    fputc('\n', stderr);
}

static void erase_bar(App *app)
{
    if (app->bar_is_shown) fputs("\r\033[K", stderr);
    app->bar_is_shown = false;
}

static void print_warning(void *context, const char *text)
{
    erase_bar(context);
    size_t place = place_length(text);
    fprintf(stderr, "%.*swarning: %s\n", place ? (int)place : 4, place ? text : "rt: ", text + place);
}

static void show_progress(void *context, double share)
{
    App *app = context;
    struct winsize window;
    char text[128];
    size_t columns = ioctl(STDERR_FILENO, TIOCGWINSZ, &window) == 0 && window.ws_col > 0 ? window.ws_col : 80;
    if (!progress_line(&app->progress, cpu_wall_s(), share, columns, text, sizeof text)) return;
    fprintf(stderr, "\r%s\033[K", text);
    app->bar_is_shown = true;
}

/* ---- one call of gr.render ---- */

/* The picture's size and what is rendered of it, samples and the rest: the command line goes before the script. */
static bool make_settings(App *app, const RenderJob *job, RenderSettings *settings, Err *err)
{
    const CommandLine *line = &app->line;
    const RenderOptions *mine = &line->options, *its = &job->options;
    unsigned given = mine->given | its->given;
#define CHOOSE(bit, field) ((mine->given & (bit) ? mine : its)->field)
    *settings = (RenderSettings){
        .width = job->width,
        .height = job->height,
        .samples = has_goal(line) ? 0 : given & OPTION_SAMPLES ? CHOOSE(OPTION_SAMPLES, samples) : DEFAULT_SAMPLES,
        .max_depth = given & OPTION_MAX_DEPTH ? CHOOSE(OPTION_MAX_DEPTH, max_depth) : DEFAULT_MAX_DEPTH,
        .seed = given & OPTION_SEED ? CHOOSE(OPTION_SEED, seed) : 0,
        .has_background = given & OPTION_BACKGROUND,
        .background = CHOOSE(OPTION_BACKGROUND, background),
        .format = line->bits == 16 ? FILM_16 : FILM_8,
        .srgb = line->srgb,
        .error_goal = line->error_goal,
        .deadline_s = line->time_goal_s > 0 ? app->start_s + line->time_goal_s : 0,
        .audits = !line->no_audit,
        .start_s = app->start_s,
        .progress = app->shows_progress ? show_progress : NULL,
        .progress_context = app,
    };
#undef CHOOSE
    settings->x1 = settings->width;
    settings->y1 = settings->height;
    if (line->has_crop) {
        settings->x0 = line->crop[0];
        settings->y0 = line->crop[1];
        settings->x1 = line->crop[2];
        settings->y1 = line->crop[3];
    }
    if (settings->x1 > settings->width || settings->y1 > settings->height)
        return err_set(err, ERR_USAGE, "--crop reaches beyond the picture of %" PRIu32 " x %" PRIu32, settings->width,
                       settings->height);
    if (line->variance && settings->samples == 1)
        return err_set(err, ERR_USAGE, "--variance needs two samples at least");
    uint64_t pixels = (uint64_t)(settings->x1 - settings->x0) * (settings->y1 - settings->y0);
    uint32_t each = settings->samples ? settings->samples : DEFAULT_SAMPLES;
    uint64_t useful = pixels * each / MIN_SAMPLES_PER_THREAD + 1, allowed = cpu_allowed();
    settings->threads = line->threads ? line->threads : (uint32_t)(useful < allowed ? useful : allowed);
    return true;
}

/* The file's name of this render, malloc'ed: "out.png", "out-2.png", ... */
static char *numbered_path(const App *app, const char *path)
{
    if (app->renders == 1) return strdup(path);
    const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path;
    const char *dot = strrchr(name, '.');
    size_t stem = dot && dot > name ? (size_t)(dot - path) : strlen(path), room = strlen(path) + 16;
    char *numbered = malloc(room);
    if (numbered) snprintf(numbered, room, "%.*s-%" PRIu32 "%s", (int)stem, path, app->renders, path + stem);
    return numbered;
}

/* Where the picture goes, malloc'ed: by -o, or the script's file. */
static char *output_path(const App *app, const RenderJob *job)
{
    return app->line.output ? numbered_path(app, app->line.output) : strdup(job->file);
}

/* While a temporary file exists, signals that end the program wait: the file is removed or renamed first. */
static sigset_t hold_signals(void)
{
    sigset_t ending, before;
    sigemptyset(&ending);
    sigaddset(&ending, SIGINT);
    sigaddset(&ending, SIGTERM);
    sigaddset(&ending, SIGHUP);
    sigprocmask(SIG_BLOCK, &ending, &before);
    return before;
}

static Outfile *open_output(const char *path, Err *err)
{
    sigset_t before = hold_signals();
    Outfile *file = outfile_open(path, err);
    sigprocmask(SIG_SETMASK, &before, NULL);
    return file;
}

static bool commit_output(Outfile *file, const void *data, size_t size, Err *err)
{
    sigset_t before = hold_signals();
    bool ok = outfile_commit(file, data, size, err);
    sigprocmask(SIG_SETMASK, &before, NULL);
    return ok;
}

/* An error that doesn't say where it comes from gets the place of the call of gr.render. */
static bool blame_call(const RenderJob *job, Err *err)
{
    if (place_length(err->text) == 0) err_prefix(err, job->where);
    return false;
}

static World *compile(App *app, const RenderJob *job, CompileStats *stats, Err *err)
{
    CompileSettings settings = {.srgb = app->line.srgb, .cpu = app->line.cpu, .warn = print_warning, .warn_context = app,
                                .threads = app->line.threads ? app->line.threads : cpu_allowed(),
                                .split = !app->line.fast_bvh};
    World *world = world_compile(job, &settings, stats, err);
    if (!world) blame_call(job, err);
    return world;
}

/* A sample that gave no number is a defect of the program, or the script has colours that a float hardly holds: its place
 * is told, and how to draw it alone. */
static void tell_not_finite(App *app, const RenderJob *job, const RenderSettings *settings, const RenderStats *stats)
{
    if (stats->not_finite == 0) return;
    uint32_t x = stats->first_x, y = stats->first_y;
    char text[1024], seed[40] = "", depth[40] = "";
    if (settings->seed != 0) snprintf(seed, sizeof seed, " --seed %" PRIu64, settings->seed);
    if (settings->max_depth != DEFAULT_MAX_DEPTH)
        snprintf(depth, sizeof depth, " --max-depth %" PRIu32, settings->max_depth);
    snprintf(text, sizeof text,
             "%s%" PRIu64 " sample%s gave no finite colour, the first sample %" PRIu32 " of pixel %" PRIu32 ",%" PRIu32
             "; --size %" PRIu32 "x%" PRIu32 " -s %" PRIu32 "%s%s --crop %" PRIu32 ",%" PRIu32 ",%" PRIu32 ",%" PRIu32
             " draws it alone",
             job->where, stats->not_finite, stats->not_finite == 1 ? "" : "s", stats->first_sample, x, y, settings->width,
             settings->height, stats->first_total, seed, depth, x, y, x + 1, y + 1);
    print_warning(app, text);
}

static void *draw(App *app, const RenderJob *job, const RenderSettings *settings, RenderReport *report,
                  RenderOutcome *outcome, Err *err)
{
    World *world = compile(app, job, &report->compile, err);
    if (!world) return NULL;
    void *film = malloc((size_t)report->width * report->height * film_pixel_bytes(settings->format));
    app->progress = progress_start(cpu_wall_s());
    bool ok = film ? render(world, settings, film, &report->render, outcome, err) : err_memory(err, "the picture");
    erase_bar(app);
    world_destroy(world);
    if (ok) tell_not_finite(app, job, settings, &report->render);
    if (ok) return film;
    free(film);
    blame_call(job, err);
    return NULL;
}

static bool encode_film(const void *film, FilmFormat format, uint32_t width, uint32_t height, uint8_t **data, size_t *size,
                        Err *err)
{
    switch (format) {
    case FILM_8: return png_encode(film, 8, width, height, data, size, err);
    case FILM_16: return png_encode(film, 16, width, height, data, size, err);
    case FILM_FLOAT: return pfm_encode(film, width, height, data, size, err);
    }
    return false;
}

/* Whatever happens, the file is closed. */
static bool write_film(const void *film, FilmFormat format, uint32_t width, uint32_t height, Outfile *file, Err *err)
{
    uint8_t *data = NULL;
    size_t size = 0;
    if (!encode_film(film, format, width, height, &data, &size, err)) {
        outfile_abandon(file);
        return false;
    }
    bool ok = commit_output(file, data, size, err);
    free(data);
    return ok;
}

static void tell_outcome(App *app, const RenderReport *report, const RenderOutcome *outcome)
{
    char text[512];
    if (app->line.error_goal > 0 && !(outcome->rmse.high <= app->line.error_goal)) {
        app->out_of_time = true;
        snprintf(text, sizeof text, "the time ended before the RMSE of %s was known to be at most %g", report->file,
                 app->line.error_goal);
        print_warning(app, text);
    }
    if (app->line.quiet) return;
    report_summary(report, text, sizeof text);
    fprintf(stderr, "%s\n", text);
    error_line(outcome, cpu_wall_s() - app->start_s, cpu_time_s(), report->render.wall_s, text, sizeof text);
    fprintf(stderr, "%s\n", text);
}

/* The files of one render, opened before it begins, so that what can't be written ends it at once. */
typedef struct { Outfile *picture, *report, *variance; } Outputs;

static void abandon_outputs(Outputs *files)
{
    outfile_abandon(files->picture);
    outfile_abandon(files->report);
    outfile_abandon(files->variance);
}

/* `name` NULL: no such file is wanted. */
static bool open_numbered(const App *app, const char *name, Outfile **file, Err *err)
{
    if (!name) return true;
    char *path = numbered_path(app, name);
    if (!path) return err_memory(err, "a file's path");
    *file = open_output(path, err);
    free(path);
    return *file != NULL;
}

static bool open_outputs(const App *app, const RenderJob *job, const char *picture, Outputs *files, Err *err)
{
    *files = (Outputs){.picture = open_output(picture, err)};
    if (!files->picture) return app->line.output ? false : blame_call(job, err);
    if (open_numbered(app, app->line.report, &files->report, err) &&
        open_numbered(app, app->line.variance, &files->variance, err))
        return true;
    abandon_outputs(files);
    return false;
}

/* Takes the file over from the outputs. */
static Outfile *take_file(Outfile **file)
{
    Outfile *taken = *file;
    *file = NULL;
    return taken;
}

static bool write_error_report(const App *app, const RenderSettings *s, const RenderReport *report,
                               const RenderOutcome *o, Outputs *files, Err *err)
{
    double samples = (double)report->render.samples;
    ErrorReport error = {
        .script = app->line.script, .picture = report->file, .width = report->width, .height = report->height,
        .threads = report->render.threads, .max_depth = s->max_depth, .seed = s->seed, .goal_samples = s->samples,
        .goal_error = s->error_goal, .goal_time_s = app->line.time_goal_s, .ended_by_clock = o->ended_by_clock,
        .point = o->point, .count = o->count, .rmse = o->rmse, .has_pixel_error = o->has_pixel_error,
        .median_error = o->median_error, .p99_error = o->p99_error, .spatial = o->rmse,
        .truncation = fmin((double)report->render.dropped * WEIGHT_UNIT / samples, 1), .clipped = o->clipped,
        .bits = s->format == FILM_8 ? 8 : s->format == FILM_16 ? 16 : 0, .has_reference = s->reference != NULL,
        .reference = {o->true_rmse, o->true_rmse, o->true_rmse},
    };
    char *text;
    size_t size;
    if (!error_report_write(&error, app->line.report_kind, &text, &size, err)) return false;
    bool ok = commit_output(take_file(&files->report), text, size, err);
    free(text);
    return ok;
}

static bool write_variance(const ErrorMap *map, Outputs *files, Err *err)
{
    size_t pixels = (size_t)map->tiles.width * map->tiles.height;
    uint8_t *film = malloc(pixels * film_pixel_bytes(FILM_16));
    if (!film) return err_memory(err, "the picture of errors");
    for (size_t i = 0; i < pixels; i++) {
        double error = sqrt(error_of_code(map->code[i]));
        film_put(FILM_16, false, film, i, (const double[3]){error, error, error});
    }
    bool ok = write_film(film, FILM_16, map->tiles.width, map->tiles.height, take_file(&files->variance), err);
    free(film);
    return ok;
}

static bool write_outputs(App *app, const RenderJob *job, const RenderSettings *s, const void *film, RenderReport *report,
                          const RenderOutcome *outcome, Outputs *files, Err *err)
{
    stage_lap(&app->clock);
    bool ok = write_film(film, s->format, report->width, report->height, take_file(&files->picture), err);
    report->encode = stage_lap(&app->clock);
    if (!ok) return app->line.output ? false : blame_call(job, err);
    return (!files->report || write_error_report(app, s, report, outcome, files, err)) &&
           (!files->variance || write_variance(&outcome->map, files, err));
}

static bool draw_and_write(App *app, const RenderJob *job, const RenderSettings *settings, RenderReport *report, Err *err)
{
    Outputs files;
    if (!open_outputs(app, job, report->file, &files, err)) return false;
    RenderOutcome outcome;
    void *film = draw(app, job, settings, report, &outcome, err);
    bool ok = film && write_outputs(app, job, settings, film, report, &outcome, &files, err);
    abandon_outputs(&files);
    if (ok) tell_outcome(app, report, &outcome);
    if (film) outcome_destroy(&outcome);
    free(film);
    return ok;
}

/* The reference is a picture of the part that is rendered, or of the whole. It becomes linear: with --srgb a PNG is
 * decoded. */
static bool load_reference(const CommandLine *line, const RenderSettings *s, Image *image, Err *err)
{
    if (!image_load(line->reference, image, err)) return false;
    uint32_t width = s->x1 - s->x0, height = s->y1 - s->y0, part[4] = {s->x0, s->y0, s->x1, s->y1};
    if (image->width == s->width && image->height == s->height) image_crop(image, part);
    if (image->width != width || image->height != height) {
        err_set(err, ERR_USAGE, "%s is %" PRIu32 " x %" PRIu32 " and the picture is %" PRIu32 " x %" PRIu32,
                line->reference, image->width, image->height, width, height);
        image_free(image);
        return false;
    }
    bool decodes = line->srgb && image->white > 1;
    for (size_t i = 0; i < (size_t)3 * width * height; i++) {
        double c = (double)image->rgb[i] / image->white;
        image->rgb[i] = (float)(decodes ? srgb_decode(c) : c);
    }
    return true;
}

static bool draw_with_reference(App *app, const RenderJob *job, RenderSettings *settings, RenderReport *report, Err *err)
{
    if (!app->line.reference) return draw_and_write(app, job, settings, report, err);
    Image image;
    if (!load_reference(&app->line, settings, &image, err)) return false;
    settings->reference = image.rgb;
    bool ok = draw_and_write(app, job, settings, report, err);
    image_free(&image);
    return ok;
}

static bool check_job(App *app, const RenderJob *job, RenderReport *report, Err *err)
{
    World *world = compile(app, job, &report->compile, err);
    world_destroy(world);
    return world != NULL;
}

/* The sink of scene_lua_run. --size replaces the script's size before anything depends on it. */
static bool render_job(void *context, const RenderJob *asked, Err *err)
{
    App *app = context;
    RenderJob sized = *asked;
    const RenderJob *job = &sized;
    if (app->line.has_size) {
        sized.width = app->line.width;
        sized.height = app->line.height;
    }
    RenderSettings settings;
    app->renders++;
    RenderReport report = {.where = job->where, .script = stage_lap(&app->clock)};
    if (!make_settings(app, job, &settings, err)) return false;
    report.width = settings.x1 - settings.x0;
    report.height = settings.y1 - settings.y0;
    report.samples = settings.samples;
    report.max_depth = settings.max_depth;
    char *path = output_path(app, job);
    if (!path) return err_memory(err, "the picture's path");
    if (writes_pfm(&app->line, path)) settings.format = FILM_FLOAT;
    report.file = app->line.check ? NULL : path;
    bool ok = app->line.check ? check_job(app, job, &report, err)
                              : draw_with_reference(app, job, &settings, &report, err);
    report.peak_bytes = cpu_peak_bytes();
    if (ok && app->report) report_add(app->report, &report);
    free(path);
    stage_lap(&app->clock);
    return ok;
}

/* ---- the run ---- */

static bool run_scene(App *app, Err *err)
{
    const CommandLine *line = &app->line;
    SceneScript script = {
        .script = line->script,
        .args = line->args,
        .arg_count = line->arg_count,
        .include = line->include,
        .include_count = line->include_count,
        .legacy = line->legacy,
    };
    RenderSink sink = {.render = render_job, .warn = print_warning, .context = app};
    app->shows_progress = !line->quiet && isatty(STDERR_FILENO);
    stage_lap(&app->clock);
    return scene_lua_run(&script, &sink, err);
}

static bool write_report(Report *report, Outfile *file, Err *err)
{
    const char *text;
    size_t size;
    if (report_finish(report, &text, &size, err)) return commit_output(file, text, size, err);
    outfile_abandon(file);
    return false;
}

static bool run_with_stats(App *app, Err *err)
{
    Outfile *file = open_output(app->line.stats, err);
    if (!file) return false;
    app->report = report_create(app->line.script);
    bool ok = app->report ? run_scene(app, err) : err_memory(err, "the statistics");
    if (ok)
        ok = write_report(app->report, file, err);
    else
        outfile_abandon(file);
    report_destroy(app->report);
    return ok;
}

/* ---- rt compare ---- */

static bool load_pictures(const CommandLine *line, Image image[2], Err *err)
{
    for (int i = 0; i < 2; i++)
        if (!image_load(line->picture[i], &image[i], err)) return false;
    const Image *a = &image[0], *b = &image[1];
    if (a->width != b->width || a->height != b->height)
        return err_set(err, ERR_USAGE, "%s is %" PRIu32 " x %" PRIu32 " and %s is %" PRIu32 " x %" PRIu32, line->picture[0],
                       a->width, a->height, line->picture[1], b->width, b->height);
    if (!line->has_crop) return true;
    if (line->crop[2] > a->width || line->crop[3] > a->height)
        return err_set(err, ERR_USAGE, "--crop reaches beyond the pictures of %" PRIu32 " x %" PRIu32, a->width, a->height);
    for (int i = 0; i < 2; i++) image_crop(&image[i], line->crop);
    return true;
}

static bool write_diff(const Image image[2], double greatest, Outfile *file, Err *err)
{
    uint8_t *map = malloc((size_t)image[0].width * image[0].height * 3);
    if (!map) {
        outfile_abandon(file);
        return err_memory(err, "the map of differences");
    }
    compare_heat_map(&image[0], &image[1], greatest, map);
    bool ok = write_film(map, FILM_8, image[0].width, image[0].height, file, err);
    free(map);
    return ok;
}

static bool compare_pictures(App *app, Err *err)
{
    const CommandLine *line = &app->line;
    Image image[2] = {{.rgb = NULL}, {.rgb = NULL}};
    Comparison result;
    Outfile *file = line->diff ? open_output(line->diff, err) : NULL;
    bool ok = (file || !line->diff) && load_pictures(line, image, err) &&
              compare_images(&image[0], &image[1], &line->compare, &result, err);
    if (ok) {
        char figures[1024], reasons[1024];
        compare_text(&result, &line->compare, figures, sizeof figures);
        app->pictures_differ = !compare_passes(&result, &line->compare, reasons, sizeof reasons);
        if (!line->quiet) printf("%s%s", figures, reasons);
        if (file) ok = write_diff(image, result.max_diff, file, err);
    } else {
        outfile_abandon(file);
    }
    for (int i = 0; i < 2; i++) image_free(&image[i]);
    return ok;
}

static bool run_render(App *app, Err *err)
{
    return app->line.stats ? run_with_stats(app, err) : run_scene(app, err);
}

/* `rt compare ...` compares; anything else renders. */
static bool run(App *app, int argc, char **argv, Err *err)
{
    bool compares = argc > 1 && strcmp(argv[1], "compare") == 0;
    app->command = compares ? &compare_command : &render_command;
    if (!parse_command_line(app->command, argc - compares, argv + compares, &app->line, err)) return false;
    bool ok = true;
    if (app->line.help)
        print_help(app->command);
    else if (app->line.version)
        printf("rt " VERSION "\n");
    else
        ok = compares ? compare_pictures(app, err) : run_render(app, err);
    bool flushed = fflush(stdout) == 0 && !ferror(stdout);
    if (ok && !flushed) return err_set(err, ERR_OUTPUT, "can't write to standard output: %s", strerror(errno));
    return ok;
}

static void end_by_signal(int number) { _exit(128 + number); }

/* Signals that end the program do so with a status; a file that grows too large is an error of write. */
static void catch_signals(void)
{
    static const int ending[] = {SIGINT, SIGTERM, SIGHUP};
    for (size_t i = 0; i < sizeof ending / sizeof ending[0]; i++) {
        struct sigaction action = {.sa_handler = end_by_signal}, before;
        if (sigaction(ending[i], NULL, &before) == 0 && before.sa_handler != SIG_IGN) sigaction(ending[i], &action, NULL);
    }
    signal(SIGXFSZ, SIG_IGN);
}

int main(int argc, char **argv)
{
    Err err = {ERR_NONE, ""};
    App app = {.command = &render_command, .start_s = cpu_wall_s(), .line.compare = compare_defaults()};
    catch_signals();
    app.line.include = calloc((size_t)argc + 1, sizeof *app.line.include);
    bool ok = app.line.include ? run(&app, argc, argv, &err) : err_memory(&err, "the command line");
    free(app.line.include);
    if (ok && app.out_of_time) return ERR_TIME;
    if (ok) return app.pictures_differ;
    print_error(app.command, &err);
    return (int)err.kind;
}
