/* L-systems: the number and places of what is drawn, chance, depth, limits. */
#include "node/tree/lsystem.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "support/alloc_fail.h"
#include "support/test_file.h"

enum { SEED = 12 };

#define NO_LIMIT UINT64_MAX

typedef struct {
    uint64_t trunks, leaves, stop_after;
    Affine place[64];  /* the first ones */
    double checksum;
} Drawn;

static bool draw(void *context, SymbolMeaning meaning, const Affine *place)
{
    Drawn *d = context;
    uint64_t count = d->trunks + d->leaves;
    if (count < 64) d->place[count] = *place;
    d->trunks += meaning == SYMBOL_TRUNK;
    d->leaves += meaning == SYMBOL_LEAF;
    for (int i = 0; i < 3; i++) d->checksum = 0.9 * d->checksum + place->m[i][3];
    return d->stop_after == 0 || count + 1 < d->stop_after;
}

static Grammar *load(const char *text)
{
    Err err = {ERR_NONE, ""};
    Grammar *g = grammar_load(test_file("l.grammar", text), &err);
    if (!g) fail_msg("%s", err.text);
    return g;
}

static Drawn walk(const Grammar *g, uint32_t depth, uint64_t seed)
{
    Drawn d = {0};
    Err err = {ERR_NONE, ""};
    if (!lsystem_walk(g, depth, seed, NO_LIMIT, draw, &d, &err)) fail_msg("%s", err.text);
    return d;
}

static Drawn walk_text(const char *text, uint32_t depth)
{
    Grammar *g = load(text);
    Drawn d = walk(g, depth, SEED);
    grammar_destroy(g);
    return d;
}

static void assert_place(const Affine *place, double x, double y, double z)
{
    double px = place->m[0][3], py = place->m[1][3], pz = place->m[2][3];
    if (fabs(px - x) > 1e-12 || fabs(py - y) > 1e-12 || fabs(pz - z) > 1e-12)
        fail_msg("(%g, %g, %g) instead of (%g, %g, %g)", px, py, pz, x, y, z);
}

static void symbols_stand_on_each_other(void **state)
{
    (void)state;
    Drawn d = walk_text("A\nA 1 T L T\ntrunk T 0.5 2 0.25\nleaf L 1 3 1\n", 1);
    assert_int_equal(d.trunks, 2);
    assert_int_equal(d.leaves, 1);
    assert_place(&d.place[0], 0, 2, 0);
    assert_place(&d.place[1], 0, 4 + 3, 0);
    assert_place(&d.place[2], 0, 10 + 2, 0);
    assert_true(d.place[0].m[0][0] == 0.5 && d.place[0].m[1][1] == 2 && d.place[0].m[2][2] == 0.25);
}

/* "in A ( B ) [ C ] D, B and C branch off A, and D goes straight on from A" */
static void brackets_branch_off(void **state)
{
    (void)state;
    Drawn d = walk_text("S\nS 1 A ( B B ) [ C ] A\ntrunk A 1 1 1\ntrunk B 1 2 1\ntrunk C 1 3 1\n"
                        "branch ( ) 0 0 90\nbranch [ ] 90 0 0\n", 1);
    assert_int_equal(d.trunks, 5);
    assert_place(&d.place[0], 0, 1, 0);
    assert_place(&d.place[1], -2, 2, 0);  /* +y turned by 90 degrees about z is -x */
    assert_place(&d.place[2], -6, 2, 0);
    assert_place(&d.place[3], 0, 2, 3);   /* about x it is +z */
    assert_place(&d.place[4], 0, 3, 0);
    Vec3 up = affine_vector(&d.place[1], vec3_make(0, 1, 0));
    assert_true(up.x == -2 && up.y == 0 && up.z == 0);
}

static void brackets_turn_within_brackets(void **state)
{
    (void)state;
    Drawn d = walk_text("S\nS 1 ( T ( T ) T ) T\ntrunk T 1 1 1\nbranch ( ) 0 0 90\n", 1);
    assert_place(&d.place[0], -1, 0, 0);
    assert_place(&d.place[1], -2, -1, 0);
    assert_place(&d.place[2], -3, 0, 0);
    assert_place(&d.place[3], 0, 1, 0);
}

static void depth_counts_replacements(void **state)
{
    (void)state;
    Grammar *g = load("F\nF 1 F F\ntrunk F 1 1 1\n");
    for (uint32_t depth = 0; depth <= 16; depth++) {
        Drawn d = walk(g, depth, SEED);
        assert_int_equal(d.trunks, 1u << depth);
    }
    grammar_destroy(g);
    /* a symbol without meaning draws nothing, at whatever depth it is left */
    assert_int_equal(walk_text("F\nF 1 F T\ntrunk T 1 1 1\n", 0).trunks, 0);
    assert_int_equal(walk_text("F\nF 1 F T\ntrunk T 1 1 1\n", 5).trunks, 5);
    /* a symbol with both draws only when it isn't replaced any more */
    assert_int_equal(walk_text("F\nF 1 T\ntrunk T 1 1 1\nleaf F 1 1 1\n", 1).leaves, 0);
    assert_int_equal(walk_text("F\nF 1 T\ntrunk T 1 1 1\nleaf F 1 1 1\n", 0).leaves, 1);
}

/* The example of SPEC 8: each F gives 8 F and 12 leaves, so at depth n there are 8^n F and 12 (8^n - 1) / 7 leaves;
 * 5,692,268 symbols at depth 7. */
static void the_example_of_the_specification(void **state)
{
    (void)state;
    Err err;
    Grammar *g = grammar_load("tests/data/branching.grammar", &err);
    assert_non_null(g);
    uint64_t trunks = 1;
    for (uint32_t depth = 0; depth <= 7; depth++, trunks *= 8) {
        Drawn d = walk(g, depth, SEED);
        assert_int_equal(d.trunks, trunks);
        assert_int_equal(d.leaves, 12 * (trunks - 1) / 7);
        if (depth == 7) assert_int_equal(d.trunks + d.leaves, 5692268);
    }
    grammar_destroy(g);
}

static void chances_are_as_given(void **state)
{
    (void)state;
    enum { N = 20000 };
    Grammar *g = load("S\nS 0.2 A\nS 0.5 A A A\ntrunk A 1 1 1\n");
    int count[4] = {0};
    for (uint64_t seed = 0; seed < N; seed++) {
        Drawn d = walk(g, 1, seed);
        assert_true(d.trunks == 0 || d.trunks == 1 || d.trunks == 3);
        count[d.trunks]++;
    }
    assert_true(fabs(count[0] / (double)N - 0.3) < 0.02);
    assert_true(fabs(count[1] / (double)N - 0.2) < 0.02);
    assert_true(fabs(count[3] / (double)N - 0.5) < 0.02);
    grammar_destroy(g);
}

/* Of eight symbols in one string some take the one rule and some the other. */
static void each_symbol_has_its_own_draw(void **state)
{
    (void)state;
    int mixed = 0;
    Grammar *g = load("S\nS 1 A A A A A A A A\nA 0.5 T\nA 0.5 L\ntrunk T 1 1 1\nleaf L 1 1 1\n");
    for (uint64_t seed = 0; seed < 100; seed++) {
        Drawn d = walk(g, 2, seed);
        assert_int_equal(d.trunks + d.leaves, 8);
        mixed += d.trunks > 0 && d.leaves > 0;
    }
    assert_true(mixed > 90);
    grammar_destroy(g);
}

static void the_seed_decides(void **state)
{
    (void)state;
    Err err;
    Grammar *g = grammar_load("tests/data/flower.grammar", &err);
    assert_non_null(g);
    int different = 0;
    for (uint64_t seed = 0; seed < 50; seed++) {
        Drawn a = walk(g, 12, seed), b = walk(g, 12, seed), c = walk(g, 12, seed + 1);
        assert_true(a.trunks == b.trunks && a.leaves == b.leaves && a.checksum == b.checksum);
        different += a.checksum != c.checksum;
    }
    assert_true(different > 25);
    grammar_destroy(g);
}

/* Neither the depth of the replacements nor that of the brackets takes any stack. */
static void great_depths(void **state)
{
    (void)state;
    enum { DEPTH = 200000 };
    Drawn d = walk_text("F\nF 1 T F T\ntrunk T 1 1 1\n", DEPTH);
    assert_int_equal(d.trunks, 2 * DEPTH);
    d = walk_text("F\nF 1 ( T F )\ntrunk T 1 1 1\nbranch ( ) 0 0 1\n", DEPTH);
    assert_int_equal(d.trunks, DEPTH);
    d = walk_text("F\nF 1 F\nleaf F 1 1 1\n", DEPTH);
    assert_int_equal(d.leaves, 1);
    d = walk_text("F\nF 1\n", DEPTH);
    assert_int_equal(d.trunks, 0);
}

static void limits_end_the_walk(void **state)
{
    (void)state;
    Grammar *g = load("F\nF 1 F F\ntrunk F 1 1 1\n");
    Drawn d = {0};
    Err err = {ERR_NONE, ""};
    assert_false(lsystem_walk(g, 40, SEED, 100000, draw, &d, &err));
    assert_int_equal(err.kind, ERR_LIMIT);
    assert_string_equal(err.text, "the L-system has more than the limit of 100000 symbols");
    assert_true(d.trunks <= 100000);
    /* depth 3: 1 + 2 + 4 + 8 symbols are visited */
    assert_true(lsystem_walk(g, 3, SEED, 15, draw, &d, &err));
    assert_false(lsystem_walk(g, 3, SEED, 14, draw, &d, &err));
    grammar_destroy(g);
    g = load("F\nF 1 F F\n");  /* draws nothing, and would go on for ever */
    assert_false(lsystem_walk(g, UINT32_MAX, SEED, 100000, draw, &d, &err));
    assert_int_equal(err.kind, ERR_LIMIT);
    grammar_destroy(g);
}

/* Without chance they are what the walk counts; with it what the least lucky seed does. */
static void the_fewest_symbols(void **state)
{
    (void)state;
    static const char *const certain[] = {"F\nF 1 F ( G F )\ntrunk F 1 1 1\nleaf G 1 1 1\nbranch ( ) 0 0 1\n",
                                          "A\nA 1 B B B\nB 1 A L\nleaf L 1 1 1\n", "F\nF 1\ntrunk F 1 1 1\n",
                                          "F\ntrunk F 1 1 1\n"};
    LsystemCount fewest;
    Err err = {ERR_NONE, ""};
    for (size_t i = 0; i < sizeof certain / sizeof *certain; i++) {
        Grammar *g = load(certain[i]);
        for (uint32_t depth = 0; depth < 8; depth++) {
            Drawn d = walk(g, depth, SEED);
            assert_true(lsystem_fewest(g, depth, &fewest, &err));
            assert_int_equal(fewest.drawn, d.trunks + d.leaves);
            assert_true(lsystem_walk(g, depth, SEED, fewest.visited, draw, &d, &err));
            assert_false(lsystem_walk(g, depth, SEED, fewest.visited - 1, draw, &d, &err));
        }
        grammar_destroy(g);
    }
    Grammar *g = load("F\nF 0.5 F F F\nF 0.5 T T\ntrunk F 1 1 1\nleaf T 1 1 1\n");
    uint64_t least = UINT64_MAX;
    for (uint64_t seed = 0; seed < 100; seed++) {
        Drawn d = walk(g, 2, seed);
        if (d.trunks + d.leaves < least) least = d.trunks + d.leaves;
    }
    assert_true(lsystem_fewest(g, 2, &fewest, &err));
    assert_int_equal(fewest.drawn, least);
    grammar_destroy(g);
    g = load("F\nF 0.99 F F\ntrunk F 1 1 1\n");
    assert_true(lsystem_fewest(g, 60, &fewest, &err));
    assert_true(fewest.drawn == 0 && fewest.visited == 1);
    grammar_destroy(g);
    g = load("F\nF 1 F F\ntrunk F 1 1 1\n");
    assert_true(lsystem_fewest(g, 60, &fewest, &err));
    assert_true(fewest.drawn == (uint64_t)1 << 60);
    assert_true(lsystem_fewest(g, UINT32_MAX, &fewest, &err));
    assert_true(fewest.visited == UINT64_MAX);
    grammar_destroy(g);
}

static void the_caller_may_stop(void **state)
{
    (void)state;
    Grammar *g = load("F\nF 1 F F\ntrunk F 1 1 1\n");
    Drawn d = {.stop_after = 10};
    Err err = {ERR_NONE, "untouched"};
    assert_false(lsystem_walk(g, 10, SEED, NO_LIMIT, draw, &d, &err));
    assert_int_equal(d.trunks, 10);
    assert_int_equal(err.kind, ERR_NONE);
    assert_string_equal(err.text, "untouched");
    grammar_destroy(g);
}

/* Grammars that no file gives: brackets that don't pair. */
static void unpaired_brackets(void **state)
{
    (void)state;
    Symbol symbol[3] = {{.name = "S", .rule_count = 1},
                        {.name = "(", .meaning = SYMBOL_OPEN, .pair = 2, .turn = affine_identity()},
                        {.name = ")", .meaning = SYMBOL_CLOSE, .pair = 1}};
    uint32_t body[2] = {1, 1};
    Rule rule = {1, 0, 2};
    Grammar g = {.symbol = symbol, .symbol_count = 3, .rule = &rule, .rule_count = 1, .body = body};
    Drawn d = {0};
    Err err;
    assert_false(lsystem_walk(&g, 1, SEED, NO_LIMIT, draw, &d, &err));
    assert_int_equal(err.kind, ERR_SCENE);
    assert_string_equal(err.text, "the bracket '(' isn't closed");
    body[0] = 2;
    assert_false(lsystem_walk(&g, 1, SEED, NO_LIMIT, draw, &d, &err));
    assert_string_equal(err.text, "the bracket ')' closes none that is open");
}

static void every_allocation_may_fail(void **state)
{
    (void)state;
    Grammar *g = load("F\nF 1 ( T F T )\ntrunk T 1 1 1\nbranch ( ) 0 0 1\n");
    for (long n = 1, failed = true; failed; n++) {
        Drawn d = {0};
        Err err = {ERR_NONE, ""};
        alloc_fail_at(n);
        bool done = lsystem_walk(g, 200, SEED, NO_LIMIT, draw, &d, &err);
        failed = alloc_fail_stop();
        assert_true(done == !failed);
        if (!failed) continue;
        assert_int_equal(err.kind, ERR_LIMIT);
        assert_string_equal(err.text, "out of memory for an L-system");
    }
    grammar_destroy(g);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(symbols_stand_on_each_other),
        cmocka_unit_test(brackets_branch_off),
        cmocka_unit_test(brackets_turn_within_brackets),
        cmocka_unit_test(depth_counts_replacements),
        cmocka_unit_test(the_example_of_the_specification),
        cmocka_unit_test(chances_are_as_given),
        cmocka_unit_test(each_symbol_has_its_own_draw),
        cmocka_unit_test(the_seed_decides),
        cmocka_unit_test(great_depths),
        cmocka_unit_test(limits_end_the_walk),
        cmocka_unit_test(the_fewest_symbols),
        cmocka_unit_test(the_caller_may_stop),
        cmocka_unit_test(unpaired_brackets),
        cmocka_unit_test(every_allocation_may_fail),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
