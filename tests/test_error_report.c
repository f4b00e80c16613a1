/* Tests of the error report: its JSON, CSV and SVG are well-formed whatever the numbers and names are, and say what is
 * known; slopes are those of known curves. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "render/error_report.h"
#include "tools/escape.h"

/* ---- judges of the three formats ---- */

static const char *skip_blanks(const char *s) { return s + strspn(s, " \n"); }

/* A JSON string (RFC 8259); NULL if there is none. */
static const char *json_string(const char *s)
{
    if (*s++ != '"') return NULL;
    for (; *s != '"'; s++) {
        if ((unsigned char)*s < 0x20) return NULL;
        if (*s == '\\' && !strchr("\"\\/bfnrtu", *++s)) return NULL;
        if (s[-1] == '\\' && *s == 'u' && strspn(s + 1, "0123456789abcdef") < 4) return NULL;
    }
    return s + 1;
}

static const char *json_number(const char *s)
{
    if (*s == '-') s++;
    size_t n = strspn(s, "0123456789");
    if (n == 0 || (n > 1 && *s == '0')) return NULL;
    s += n;
    if (*s == '.') {
        n = strspn(++s, "0123456789");
        if (n == 0) return NULL;
        s += n;
    }
    if (*s != 'e' && *s != 'E') return s;
    s += strspn(s + 1, "+-") + 1;
    n = strspn(s, "0123456789");
    return n ? s + n : NULL;
}

/* What follows the JSON value that s begins with; NULL if there is none. */
static const char *json_value(const char *s)
{
    static const char *const word[] = {"null", "true", "false"};
    for (size_t i = 0; i < 3; i++)
        if (strncmp(s, word[i], strlen(word[i])) == 0) return s + strlen(word[i]);
    if (*s == '"') return json_string(s);
    if (*s != '{' && *s != '[') return json_number(s);
    char close = *s == '{' ? '}' : ']';
    s = skip_blanks(s + 1);
    if (*s == close) return s + 1;
    for (;; s++) {
        s = skip_blanks(s);
        if (close == '}') {
            s = json_string(s);
            if (!s || *s != ':') return NULL;
            s = skip_blanks(s + 1);
        }
        s = json_value(s);
        if (!s) return NULL;
        s = skip_blanks(s);
        if (*s == close) return s + 1;
        if (*s != ',') return NULL;
    }
}

static void check_json(const char *text)
{
    const char *end = json_value(text);
    if (!end || *skip_blanks(end)) fail_msg("no JSON: %s", text);
}

/* Whether &name; or &#xhex; begins at s. */
static bool is_entity(const char *s)
{
    size_t n = strspn(s + 1, "#abcdefghijklmnopqrstuvwxyz0123456789");
    return n > 0 && s[n + 1] == ';';
}

/* Elements nest, attributes are quoted, & begins an entity, no control but newlines. */
static void check_xml(const char *text)
{
    enum { DEEPEST = 8, NAME = 16 };
    char open[DEEPEST][NAME + 1];
    size_t depth = 0;
    bool in_quotes = false, in_tag = false;
    for (const char *s = text; *s; s++) {
        if (((unsigned char)*s < 0x20 && *s != '\n') || (*s == '&' && !is_entity(s))) fail_msg("byte %d in %s", *s, text);
        if (!in_tag && *s == '<') {
            bool closes = s[1] == '/';
            s += closes;
            size_t n = strspn(s + 1, "abcdefghijklmnopqrstuvwxyzCEGILMNOPRSTUVWXYZ");
            if (n == 0 || n > NAME) fail_msg("no name of an element: %s", s);
            if (closes) {
                if (depth == 0 || strncmp(open[depth - 1], s + 1, n) != 0 || open[depth - 1][n]) fail_msg("not open: %s", s);
                depth--;
            } else {
                assert_true(depth < DEEPEST);
                snprintf(open[depth++], NAME + 1, "%.*s", (int)n, s + 1);
            }
            in_tag = true;
            s += n;
            if (*s == '>') in_tag = false;
        } else if (in_tag && *s == '"') {
            in_quotes = !in_quotes;
        } else if (in_tag && !in_quotes && *s == '>') {
            in_tag = false;
            if (s[-1] == '/') depth--;
        } else if (*s == '<') {
            fail_msg("< where none may be: %s", s);
        }
    }
    assert_false(in_tag);
    assert_int_equal(depth, 0);
}

/* Every row has as many fields as the first. */
static void check_csv(const char *text, size_t rows)
{
    size_t fields = 0, first = 0, count = 0;
    bool in_quotes = false;
    for (const char *s = text; *s; s++) {
        if (*s == '"') in_quotes = !in_quotes;
        else if (!in_quotes && *s == ',') fields++;
        else if (!in_quotes && *s == '\n') {
            if (count++ == 0) first = fields;
            if (fields != first) fail_msg("row %zu has %zu commas, not %zu: %s", count, fields, first, text);
            fields = 0;
        }
    }
    assert_int_equal(count, rows + 1);
}

/* The numbers of a plot's attributes are finite and near the page, so nothing is drawn beyond it. */
static void check_places(const char *text)
{
    const char *odd = strstr(text, "nan") ? strstr(text, "nan") : strstr(text, "inf");
    if (odd) fail_msg("no number in %.60s", odd - (odd - text < 40 ? odd - text : 40));
    static const char *const attribute[] = {" cx=\"", " cy=\"", " x=\"", " y=\"", "<path d=\"M"};
    for (size_t i = 0; i < sizeof attribute / sizeof attribute[0]; i++)
        for (const char *s = text; (s = strstr(s, attribute[i]));) {
            s += strlen(attribute[i]);
            double x = strtod(s, NULL);
            if (!(x >= 0 && x <= 720)) fail_msg("%.60s", s);
        }
}

static char *text_of(const ErrorReport *report, ErrorReportKind kind)
{
    char *text;
    size_t size;
    Err err = {ERR_NONE, ""};
    assert_true(error_report_write(report, kind, &text, &size, &err));
    assert_int_equal(strlen(text), size);
    return text;
}

/* All three, judged. */
static void check_report(const ErrorReport *report)
{
    char *json = text_of(report, ERROR_REPORT_JSON), *csv = text_of(report, ERROR_REPORT_CSV);
    char *svg = text_of(report, ERROR_REPORT_SVG);
    check_json(json);
    check_csv(csv, report->count);
    check_xml(svg);
    check_places(svg);
    free(json);
    free(csv);
    free(svg);
}

/* ---- reports ---- */

static CurvePoint point_at(double wall_s, double error)
{
    return (CurvePoint){.wall_s = wall_s, .cpu_s = 2 * wall_s, .rays = 1000, .samples = (uint64_t)(wall_s * 1000) + 1,
                        .predicted = error, .greatest_diff = 10 * error, .unfinished = 0.5};
}

static CurvePoint audited_at(double wall_s, double error)
{
    CurvePoint p = point_at(wall_s, error);
    p.audited = true;
    p.audit = (Estimate){error, 0.9 * error, 1.2 * error};
    return p;
}

static ErrorReport report_of(const CurvePoint *point, size_t count)
{
    const CurvePoint *end = &point[count - 1];
    Estimate outcome = {end->predicted, end->predicted, end->predicted};
    return (ErrorReport){.script = "a/temple.lua", .picture = "temple.png", .width = 64, .height = 32, .threads = 2,
                         .max_depth = 4, .seed = UINT64_MAX, .goal_samples = 9, .point = point, .count = count,
                         .rmse = end->audited ? end->audit : outcome, .spatial = outcome, .bits = 8};
}

static void everything_known_is_in_the_json(void **state)
{
    (void)state;
    CurvePoint point[] = {point_at(1, 0.01), audited_at(4, 0.005)};
    ErrorReport report = report_of(point, 2);
    report.goal_samples = 0;
    report.goal_error = 0.005;
    report.has_pixel_error = report.has_reference = true;
    report.median_error = 0.001;
    report.p99_error = 0.03;
    report.reference = (Estimate){0.0052, 0.0052, 0.0052};
    report.truncation = 0.0625;
    report.clipped = 17;
    static const char *const has[] = {
        "\"script\": \"a/temple.lua\"", "\"picture\": \"temple.png\"", "\"width\": 64", "\"height\": 32",
        "\"seed\": 18446744073709551615", "\"goal\": {\"samples\": null, \"error\": 0.005, \"time_s\": null}",
        "\"rmse\": {\"value\": 0.005, \"low\": 0.0045, \"high\": 0.006}", "\n  \"wall_s\": 4,", "\n  \"cpu_s\": 8,",
        "\n  \"rays\": 1000,", "\n  \"samples\": 4001,", "\"predicted\": 0.01, \"audit\": null",
        "\"audit\": {\"value\": 0.005, \"low\": 0.0045, \"high\": 0.006}", "\"greatest_diff\": 0.1", "\"unfinished\": 0.5",
        "\"slope\": -0.5,", "\"pixels\": {\"median\": 0.001, \"p99\": 0.03}", "\"reference\": {\"value\": 0.0052",
        "\"truncation\": 0.0625", "\"numerical\": \"not measured\"", "\"clipped_pixels\": 17", "\"rounding\": 0.00113205935",
    };
    char *json = text_of(&report, ERROR_REPORT_JSON);
    for (size_t i = 0; i < sizeof has / sizeof has[0]; i++)
        if (!strstr(json, has[i])) fail_msg("no %s in %s", has[i], json);
    free(json);
    check_report(&report);

    report.has_reference = report.has_pixel_error = false;
    report.numerical_measured = true;
    report.numerical_rays = 1000;
    report.numerical_wrong = 1;
    report.numerical_error = 1e-15;
    json = text_of(&report, ERROR_REPORT_JSON);
    assert_null(strstr(json, "reference"));
    assert_null(strstr(json, "\"pixels\""));
    assert_non_null(strstr(json, "\"numerical\": {\"rays\": 1000, \"wrong\": 1, \"greatest_error\": 1e-15}"));
    free(json);
    check_report(&report);
}

static void what_is_unknown_is_null(void **state)
{
    (void)state;
    CurvePoint point = point_at(0.5, NAN);
    ErrorReport report = report_of(&point, 1);
    report.truncation = NAN;
    char *json = text_of(&report, ERROR_REPORT_JSON), *svg = text_of(&report, ERROR_REPORT_SVG);
    assert_non_null(strstr(json, "\"rmse\": {\"value\": null, \"low\": null, \"high\": null}"));
    assert_non_null(strstr(json, "\"slope\": null"));
    assert_non_null(strstr(json, "\"truncation\": null"));
    assert_null(strstr(json, "nan"));
    assert_non_null(strstr(svg, "no error is known"));
    free(json);
    free(svg);
    check_report(&report);
}

/* Names of files are any bytes. */
static void names_are_escaped(void **state)
{
    (void)state;
    CurvePoint point = audited_at(1, 0.01);
    ErrorReport report = report_of(&point, 1);
    report.script = "d/a\"b\\c<d>&e\n\x01\xff,\xc3\xa4.lua";
    report.picture = "\xef\xbf\xbf'\"\".png";
    char *json = text_of(&report, ERROR_REPORT_JSON), *csv = text_of(&report, ERROR_REPORT_CSV);
    char *svg = text_of(&report, ERROR_REPORT_SVG);
    assert_non_null(strstr(json, "\"d/a\\\"b\\\\c<d>&e\\u000a\\u0001\\ufffd,\xc3\xa4.lua\""));
    assert_non_null(strstr(csv, "\"d/a\"\"b\\c<d>&e\n\x01\xef\xbf\xbd,\xc3\xa4.lua\",\"\xef\xbf\xbf'\"\"\"\".png\""));
    assert_non_null(strstr(svg, ">a&quot;b\\c&lt;d&gt;&amp;e&#xfffd;&#xfffd;&#xfffd;,\xc3\xa4.lua<"));
    free(json);
    free(csv);
    free(svg);
    check_report(&report);
}

static void long_names_end_in_an_ellipsis(void **state)
{
    (void)state;
    static const struct { const char *text; size_t most; const char *xml; } rows[] = {
        {"", 4, ""}, {"abcd", 4, "abcd"}, {"abcde", 4, "abc&#x2026;"},
        {"\xc3\xa4\xc3\xa4&\xff", 4, "\xc3\xa4\xc3\xa4&amp;&#xfffd;"},
        {"\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4", 4, "\xc3\xa4\xc3\xa4\xc3\xa4&#x2026;"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        char *text;
        size_t size;
        FILE *out = open_memstream(&text, &size);
        assert_non_null(out);
        escape_xml(out, rows[i].text, rows[i].most);
        fclose(out);
        assert_string_equal(text, rows[i].xml);
        free(text);
    }
}

/* A sequence that the length cuts is none. */
static void json_ends_at_its_length(void **state)
{
    (void)state;
    char *text;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    assert_non_null(out);
    escape_json(out, "a\xc3\xa4", 2);
    fclose(out);
    assert_string_equal(text, "\"a\\ufffd\"");
    free(text);
}

/* One point, none above 0, equal times, ranges from a hair's breadth to all that doubles have. */
static void any_numbers_make_a_plot(void **state)
{
    (void)state;
    static const double some[] = {0, 1e-320, 1e-300, 1e-17, 0.00113, 0.01, 0.0100001, 1, 20, 1e9, 1e300, INFINITY, NAN};
    enum { SOME = sizeof some / sizeof some[0] };
    for (size_t a = 0; a < SOME; a++)
        for (size_t b = 0; b < SOME; b++)
            for (size_t t = 0; t < SOME; t++) {
                CurvePoint point[3] = {point_at(0.5, some[a]), point_at(0.5, some[b]), audited_at(0.5, some[a])};
                point[0].wall_s = some[t];
                point[2].wall_s = some[(t + a) % SOME];
                point[2].audit = (Estimate){some[b], some[a], some[t]};
                for (size_t count = 1; count <= 3; count++) {
                    ErrorReport report = report_of(point, count);
                    report.goal_error = some[t];
                    report.has_reference = t % 2 == 0;
                    report.reference = (Estimate){some[a], some[b], some[t]};
                    check_report(&report);
                }
            }
}

static void a_plot_says_its_figures(void **state)
{
    (void)state;
    CurvePoint point[] = {point_at(1, 0.01), point_at(2, 0.006), audited_at(4, 0.005), audited_at(16, 0.00125)};
    ErrorReport report = report_of(point, 4);
    static const char *const has[] = {
        ">temple.lua<", "64 &#215; 32, 9 samples a pixel: RMSE 0.00125 [0.00113, 0.0015] in 16 s<", "8-bit rounding 0.00113",
        "fit, slope &#8722;1.00", ">0.001<", ">0.01<", ">1<", ">10<", "RMSE, linear light", "seconds by the clock",
    };
    char *svg = text_of(&report, ERROR_REPORT_SVG);
    for (size_t i = 0; i < sizeof has / sizeof has[0]; i++)
        if (!strstr(svg, has[i])) fail_msg("no %s in %s", has[i], svg);
    free(svg);
}

/* ---- slopes ---- */

static bool is_near(double x, double expected, double most) { return fabs(x - expected) <= most; }

static void slopes_are_those_of_power_laws(void **state)
{
    (void)state;
    static const double slope[] = {-1.5, -0.75, -0.5, 0, 0.25};
    for (size_t k = 0; k < sizeof slope / sizeof slope[0]; k++) {
        CurvePoint point[8];
        for (int i = 0; i < 8; i++) point[i] = point_at(0.3 * (1 << i), 0.02 * pow(0.3 * (1 << i), slope[k]));
        ErrorFit fit = error_report_fit(point, 8, ERROR_FIT_WALL);
        assert_true(is_near(fit.slope, slope[k], 1e-12));
        assert_true(is_near(fit.log10_at_1, log10(0.02), 1e-12));
        assert_true(is_near(error_report_fit(point, 8, ERROR_FIT_CPU).slope, slope[k], 1e-12));
    }
}

/* The least squares of three points by hand: y = 0, -1, -1 at x = 0, 1, 2 has the slope -1/2 and is -1/6 at 0. */
static void slopes_are_of_least_squares(void **state)
{
    (void)state;
    CurvePoint point[] = {point_at(1, 1), point_at(10, 0.1), point_at(100, 0.1)};
    ErrorFit fit = error_report_fit(point, 3, ERROR_FIT_WALL);
    assert_true(is_near(fit.slope, -0.5, 1e-14));
    assert_true(is_near(fit.log10_at_1, -1.0 / 6, 1e-14));
    for (uint64_t i = 0; i < 3; i++) point[i].samples = 100 * (i + 1) * (i + 1);
    point[2].predicted = 0.1 * 4 / 9;
    point[1].predicted = 0.1;
    point[0].predicted = 0.4;
    assert_true(is_near(error_report_fit(point, 3, ERROR_FIT_SAMPLES).slope, -1, 1e-14));
}

static void without_two_times_there_is_no_slope(void **state)
{
    (void)state;
    CurvePoint point[] = {point_at(1, 0.1), point_at(1, 0.01), point_at(2, 0), point_at(0, 0.3), point_at(3, NAN)};
    assert_true(isnan(error_report_fit(point, 0, ERROR_FIT_WALL).slope));
    for (size_t n = 1; n <= 5; n++) assert_true(isnan(error_report_fit(point, n, ERROR_FIT_WALL).slope));
}

static void audits_go_before_predictions(void **state)
{
    (void)state;
    CurvePoint point[] = {point_at(1, 0.1), point_at(10, 0.1), point_at(100, 0.1)};
    point[0].audited = point[2].audited = true;
    point[0].audit = (Estimate){1, 1, 1};
    point[2].audit = (Estimate){0.1, 0.1, 0.1};
    assert_true(is_near(error_report_fit(point, 3, ERROR_FIT_WALL).slope, -0.5, 1e-14));
    point[0].audited = false;
    assert_true(is_near(error_report_fit(point, 3, ERROR_FIT_WALL).slope, 0, 1e-14));
}

static void rounding_is_a_step_over_root_twelve(void **state)
{
    (void)state;
    assert_true(is_near(error_report_rounding(8), 0.0011320593, 1e-10));
    assert_true(is_near(error_report_rounding(16), 4.4049e-6, 1e-10));
    assert_true(error_report_rounding(0) == 0);
}

/* ---- files ---- */

static void the_ending_tells_the_kind(void **state)
{
    (void)state;
    static const struct { const char *path; ErrorReportKind kind; } good[] = {
        {"a.json", ERROR_REPORT_JSON}, {"x/a.b.CSV", ERROR_REPORT_CSV}, {"a.Svg", ERROR_REPORT_SVG},
    };
    static const char *const bad[] = {"", "json", ".json", "a.txt", "a.json.gz", "a.svg/"};
    for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
        ErrorReportKind kind;
        assert_true(error_report_kind(good[i].path, &kind, NULL));
        assert_int_equal(kind, good[i].kind);
    }
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        ErrorReportKind kind;
        Err err = {ERR_NONE, ""};
        assert_false(error_report_kind(bad[i], &kind, &err));
        assert_int_equal(err.kind, ERR_USAGE);
        assert_non_null(strstr(err.text, "must end in .json, .csv or .svg"));
    }
}

/* A locale whose decimal point is a comma, made here as machines seldom have one. */
static void numbers_have_a_point_in_any_locale(void **state)
{
    (void)state;
    CurvePoint point[] = {point_at(1.5, 0.012), audited_at(4.5, 0.0051)};
    ErrorReport report = report_of(point, 2);
    char *plain[3], folder[] = "/tmp/rt-locale-XXXXXX", command[256];
    for (int k = 0; k < 3; k++) plain[k] = text_of(&report, (ErrorReportKind)k);
    assert_non_null(mkdtemp(folder));
    snprintf(command, sizeof command, "localedef -i de_DE -f UTF-8 %s/de_DE.UTF-8 >%s/log 2>&1", folder, folder);
    int made = system(command);
    setenv("LOCPATH", folder, 1);
    bool comma = made == 0 && setlocale(LC_ALL, "de_DE.UTF-8") && strcmp(localeconv()->decimal_point, ",") == 0;
    for (int k = 0; comma && k < 3; k++) {
        char *text = text_of(&report, (ErrorReportKind)k);
        assert_string_equal(text, plain[k]);
        free(text);
    }
    if (comma) assert_string_equal(localeconv()->decimal_point, ",");
    setlocale(LC_ALL, "C");
    unsetenv("LOCPATH");
    snprintf(command, sizeof command, "rm -r %s", folder);
    assert_int_equal(system(command), 0);
    for (int k = 0; k < 3; k++) free(plain[k]);
    if (!comma) skip();
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(everything_known_is_in_the_json),
        cmocka_unit_test(what_is_unknown_is_null),
        cmocka_unit_test(names_are_escaped),
        cmocka_unit_test(long_names_end_in_an_ellipsis),
        cmocka_unit_test(json_ends_at_its_length),
        cmocka_unit_test(any_numbers_make_a_plot),
        cmocka_unit_test(a_plot_says_its_figures),
        cmocka_unit_test(slopes_are_those_of_power_laws),
        cmocka_unit_test(slopes_are_of_least_squares),
        cmocka_unit_test(without_two_times_there_is_no_slope),
        cmocka_unit_test(audits_go_before_predictions),
        cmocka_unit_test(rounding_is_a_step_over_root_twelve),
        cmocka_unit_test(the_ending_tells_the_kind),
        cmocka_unit_test(numbers_have_a_point_in_any_locale),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
