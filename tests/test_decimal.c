/* Decimal numbers against strtod, bit by bit: hard cases, ties, random texts, printed doubles; its table against GMP. */
#include "tools/decimal.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <gmp.h>

#include "common/rng.h"

enum { SEED = 2101, ROOM = 1200 };

static locale_t c_locale;

static int set_up(void **state)
{
    (void)state;
    c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    return c_locale ? 0 : -1;
}

static int tear_down(void **state)
{
    (void)state;
    freelocale(c_locale);
    return 0;
}

/* Value and end as strtod's. */
static void assert_as_strtod(const char *text)
{
    const char *at = text;
    char *end;
    double x, expected = strtod(text, &end);
    if (!decimal_read(&at, &x, c_locale)) fail_msg("seed %d: '%s' is no number", SEED, text);
    if (memcmp(&x, &expected, sizeof x) != 0 || at != end)
        fail_msg("seed %d: '%s': %a instead of %a, %td bytes instead of %td", SEED, text, x, expected, at - text,
                 end - text);
}

static uint64_t bits64(Rng *rng) { return (uint64_t)rng_u32(rng) << 32 | rng_u32(rng); }

static double double_of(uint64_t bits)
{
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* The exact decimal expansion of the middle between a double and the next, and texts a little beside it. */
static void assert_ties(double x)
{
    char text[ROOM];
    long double middle = ((long double)x + (long double)nextafter(x, INFINITY)) / 2;
    int length = snprintf(text, sizeof text, "%.*Le", 780, middle);
    assert_true(length > 0 && length < ROOM - 8);
    assert_as_strtod(text);
    char *e = strchr(text, 'e');
    char exponent[16];
    snprintf(exponent, sizeof exponent, "%s", e);
    for (int digits = 17; digits < 60; digits++) {
        char shorter[ROOM];
        memcpy(shorter, text, (size_t)digits);
        snprintf(shorter + digits, sizeof shorter - (size_t)digits, "%s", exponent);
        assert_as_strtod(shorter);
        shorter[digits - 1] = shorter[digits - 1] == '9' ? '8' : (char)(shorter[digits - 1] + 1);
        assert_as_strtod(shorter);
    }
    snprintf(e, 20, "1%s", exponent);
    assert_as_strtod(text);
}

static void hard_cases(void **state)
{
    (void)state;
    static const char *const hard[] = {
        "0", "-0", "+0", "0.", ".0", "00000000000000000000000000", "0e5", "0e999999999999", "-0.0e-999999999999",
        "9007199254740992", "9007199254740993", "9007199254740994", "9007199254740995", "-9007199254740993",
        "9007199254740992.9999999999999999", "9007199254740993.0000000000000000", "9007199254740993.0000000000000001",
        "18446744073709551615", "18446744073709551616", "18446744073709551617e-10", "99999999999999999999", "1e22", "1e23",
        "-1e23", "8.5e-1", "123456789012345678e-5", "9223372036854775807e-19", "9999999999999999999e-19",
        "9999999999999999999e19", "9999999999999999999e-64", "9999999999999999999e63", "9999999999999999999e64", "1e-64",
        "1e-65", "1e63", "1e64", "0.30000001192092896", "00000000000000000000000001.5", "1.00000000000000000000000000000",
        "0.000000000000000000000000000000000000000000000000000000000001", "100000000000000000000000000000000000000000",
        "2.2250738585072011e-308", "2.2250738585072012e-308", "2.2250738585072014e-308", "4.9e-324", "2.4703282292062327e-324",
        "2.4703282292062328e-324", "2e-324", "1e-400", "1.7976931348623157e308", "1.7976931348623158e308",
        "1.7976931348623159e308", "1e309", "-1e999999999999999999999", "1e-999999999999999999999", "5e-324",
        "6250000000000000000000000000000000e-45", "0.500000000000000166533453693773481063544750213623046875",
        "3.518437208883201171875e13", "62.5364939768271845828", "8.10109172351e-10", "1.50000000000000011102230246251565",
        "30078505129381147446200", "1.00000000000000011102230246251565404236316680908203125",
        "1.00000000000000011102230246251565404236316680908203124", "1.00000000000000011102230246251565404236316680908203126",
        /* Paxson 1991, "A Program for Testing IEEE Decimal-Binary Conversion", table 3: nearest to a tie, 64 bits and less */
        "5e125", "69e267", "999e-26", "7861e-34", "75569e-254", "928609e-261", "9210917e80", "84863171e114", "653777767e273",
        "5232604057e-298", "27235667517e-109", "653532977297e-123", "3142213164987e-294", "46202199371337e-72",
        "231010996856685e-73", "9324754620109615e212", "78459735791271921e49", "272104041512242479e200",
        "6802601037806061975e198", "20505426358836677347e-221", "836168422905420598437e-234", "4891559871276714924261e222",
        /* table 4: farthest from one */
        "9e-265", "85e-37", "623e100", "3571e263", "81661e153", "920657e-23", "4603285e-24", "87575437e-309", "245540327e122",
        "6138508175e120", "83356057653e193", "619534293513e124", "2335141086879e218", "36167929443327e-159",
        "609610927149051e-255", "3743626360493413e-165", "94080055902682397e-242", "899810892172646163e283",
        "7120190517612959703e120", "25188282901709339043e-252", "308984926168550152811e-52", "6372891218502368041059e64"};
    for (size_t i = 0; i < sizeof hard / sizeof *hard; i++) assert_as_strtod(hard[i]);
}

static void ties_and_their_neighbours(void **state)
{
    (void)state;
    Rng rng = rng_seed(SEED, 0);
    for (int i = 0; i < 3000; i++) {
        double x = double_of(bits64(&rng) & INT64_MAX);
        if (isfinite(x) && x < 0x1.fffffffffffffp1023) assert_ties(x);
        assert_ties(ldexp(1 + rng_double(&rng), (int)(rng_u32(&rng) % 240) - 120));
    }
}

/* A random text of the grammar: what is in it doesn't matter as long as every length and exponent comes up. */
static void random_text(Rng *rng, char *text)
{
    char *at = text;
    static const uint32_t lengths[] = {3, 8, 12, 20, 24, 45};
    uint32_t before = rng_u32(rng) % lengths[rng_u32(rng) % 6], behind = rng_u32(rng) % lengths[rng_u32(rng) % 6];
    uint32_t kind = rng_u32(rng);
    if (kind % 4 == 0) *at++ = "+-"[kind / 4 % 2];
    if (before + behind == 0) before = 1;
    char fill = "0559"[kind / 8 % 4];
    for (uint32_t i = 0; i < before + behind; i++) {
        if (i == before) *at++ = '.';
        *at++ = kind / 32 % 4 == 0 ? fill : (char)('0' + rng_u32(rng) % 10);
    }
    if (behind == 0 && kind / 128 % 4 == 0) *at++ = '.';
    if (kind / 512 % 2) {
        *at++ = "eE"[kind / 1024 % 2];
        if (kind / 2048 % 2) *at++ = "+-"[kind / 4096 % 2];
        at += sprintf(at, "%" PRIu32, rng_u32(rng) % (kind / 8192 % 8 ? 70u : 400u));
    }
    *at = '\0';
}

static void random_texts(void **state)
{
    (void)state;
    enum { COUNT = 1500000 };
    Rng rng = rng_seed(SEED, 1);
    char text[128];
    for (int i = 0; i < COUNT; i++) {
        random_text(&rng, text);
        assert_as_strtod(text);
    }
}

static void printed_doubles_come_back(void **state)
{
    (void)state;
    enum { COUNT = 500000 };
    Rng rng = rng_seed(SEED, 2);
    char text[64];
    for (int i = 0; i < COUNT; i++) {
        double any = double_of(bits64(&rng)), near = 200 * rng_double(&rng) - 100, x = i % 2 && isfinite(any) ? any : near;
        snprintf(text, sizeof text, "%.17g", x);
        const char *at = text;
        double again;
        assert_true(decimal_read(&at, &again, c_locale));
        assert_memory_equal(&again, &x, sizeof x);
        snprintf(text, sizeof text, "%.*g", 1 + (int)(rng_u32(&rng) % 25), x);
        assert_as_strtod(text);
        snprintf(text, sizeof text, "%.*f", (int)(rng_u32(&rng) % 18), near);
        assert_as_strtod(text);
        snprintf(text, sizeof text, "%.9g", (double)(float)near);
        assert_as_strtod(text);
    }
}

static void what_is_no_number(void **state)
{
    (void)state;
    static const char *const bad[] = {"", "-", "+", ".", "-.", "e5", ".e5", "1e", "1e+", "1e-x", "1.5E", "x", "nan",
                                      "inf", "--1", "+-1", " 1", "1e 5"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        const char *at = bad[i];
        double x = 7;
        if (decimal_read(&at, &x, c_locale)) fail_msg("'%s' is a number", bad[i]);
        assert_true(at == bad[i] && x == 7);
    }
}

/* What follows a number stays where it is. */
static void the_number_ends_where_it_ends(void **state)
{
    (void)state;
    static const struct { const char *text; double x; size_t length; } some[] = {
        {"1 2", 1, 1}, {"-2.5.5", -2.5, 4}, {"0x10", 0, 1}, {"1,5", 1, 1}, {"1e5e5", 1e5, 3}, {"1.e1/", 10, 4},
        {"12345678901234567890123x", 12345678901234567890123., 23}, {"3\n4", 3, 1}, {"1e400 ", INFINITY, 5}};
    for (size_t i = 0; i < sizeof some / sizeof *some; i++) {
        const char *at = some[i].text;
        double x;
        assert_true(decimal_read(&at, &x, c_locale));
        assert_true(x == some[i].x);
        assert_int_equal(at - some[i].text, some[i].length);
    }
}

/* Millions of digits or of zeros, with an exponent that makes up for them. */
static void numbers_of_many_digits(void **state)
{
    (void)state;
    enum { ZEROS = 2000000 };
    char *text = malloc(ZEROS + 64);
    assert_non_null(text);
    static const char *const exponents[] = {"15e2000000", "15e20000000", "15e-1", "15e-2000000", "15e200000000000000000000"};
    for (size_t i = 0; i < sizeof exponents / sizeof *exponents; i++) {
        memset(text, '0', ZEROS);
        text[1] = '.';
        strcpy(text + ZEROS, exponents[i]);
        assert_as_strtod(text);
        text[0] = '3';
        text[1] = '0';
        assert_as_strtod(text);
    }
    free(text);
}

/* 5^q, or 2^400 / 5^-q rounded down, cut to its 128 highest bits. */
static void powers_of_five(void **state)
{
    (void)state;
    mpz_t five, high, low;
    mpz_inits(five, high, low, NULL);
    for (int q = DECIMAL_LEAST_POWER; q < DECIMAL_END_POWER; q++) {
        mpz_ui_pow_ui(five, 5, (unsigned long)abs(q));
        mpz_set_ui(high, 1);
        mpz_mul_2exp(high, high, 400);
        if (q < 0)
            mpz_fdiv_q(five, high, five);
        else
            mpz_mul_2exp(five, five, 128);
        mpz_fdiv_q_2exp(five, five, mpz_sizeinbase(five, 2) - 128);
        mpz_fdiv_q_2exp(high, five, 64);
        mpz_fdiv_r_2exp(low, five, 64);
        const uint64_t *power = decimal_power_of_five[q - DECIMAL_LEAST_POWER];
        if (power[0] != mpz_get_ui(high) || power[1] != mpz_get_ui(low)) fail_msg("5^%d is wrong", q);
    }
    mpz_clears(five, high, low, NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(powers_of_five),
        cmocka_unit_test(hard_cases),
        cmocka_unit_test(ties_and_their_neighbours),
        cmocka_unit_test(random_texts),
        cmocka_unit_test(printed_doubles_come_back),
        cmocka_unit_test(what_is_no_number),
        cmocka_unit_test(the_number_ends_where_it_ends),
        cmocka_unit_test(numbers_of_many_digits),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
