/* Grammar files: what a good one means, and the line and words of every fault. */
#include "node/tree/grammar.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "common/rng.h"
#include "support/alloc_fail.h"
#include "support/test_file.h"

enum { SEED = 5 };

static Grammar *load(const char *text)
{
    Err err = {ERR_NONE, ""};
    Grammar *g = grammar_load(test_file("a.grammar", text), &err);
    if (!g) fail_msg("%s\n%s", err.text, text);
    return g;
}

static void assert_error(const char *text, const char *expected)
{
    Err err = {ERR_NONE, ""};
    const char *path = test_file("bad.grammar", text);
    Grammar *g = grammar_load(path, &err);
    if (g) fail_msg("no error, but expected %s", expected);
    assert_int_equal(err.kind, ERR_INPUT);
    assert_memory_equal(err.text, path, strlen(path));
    assert_string_equal(err.text + strlen(path), expected);
}

static const Symbol *find(const Grammar *g, const char *name)
{
    for (uint32_t i = 0; i < g->symbol_count; i++)
        if (strcmp(g->symbol[i].name, name) == 0) return &g->symbol[i];
    fail_msg("no symbol %s", name);
    return NULL;
}

static void the_example(void **state)
{
    (void)state;
    Err err = {ERR_NONE, ""};
    Grammar *g = grammar_load("tests/data/branching.grammar", &err);
    if (!g) fail_msg("%s", err.text);
    const Symbol *f = find(g, "F"), *leaves = find(g, "leaves"), *open = find(g, "("), *shut = find(g, ")");
    assert_ptr_equal(&g->symbol[g->start], f);
    assert_int_equal(f->meaning, SYMBOL_TRUNK);
    assert_true(f->size[0] == 0.1 && f->size[1] == 1 && f->size[2] == 0.1);
    assert_int_equal(leaves->meaning, SYMBOL_LEAF);
    assert_int_equal(leaves->rule_count, 0);
    assert_int_equal(open->meaning, SYMBOL_OPEN);
    assert_int_equal(shut->meaning, SYMBOL_CLOSE);
    assert_ptr_equal(&g->symbol[open->pair], shut);
    assert_ptr_equal(&g->symbol[shut->pair], open);
    assert_int_equal(f->rule_count, 1);
    const Rule *rule = &g->rule[f->first_rule];
    assert_true(rule->probability == 1);
    assert_int_equal(rule->count, 60);
    assert_ptr_equal(&g->symbol[g->body[rule->first]], f);
    assert_ptr_equal(&g->symbol[g->body[rule->first + 2]], open);
    assert_ptr_equal(&g->symbol[g->body[rule->first + rule->count - 1]], shut);
    grammar_destroy(g);
    grammar_destroy(NULL);
}

static void brackets_turn_x_then_y_then_z(void **state)
{
    (void)state;
    Grammar *g = load("A\nbranch ( ) 90 90 0\nbranch [ ] 0 90 90\ntrunk A 1 1 1\n");
    Vec3 p = affine_vector(&find(g, "(")->turn, vec3_make(0, 1, 0));
    assert_true(p.x == 1 && p.y == 0 && p.z == 0);  /* y to z, z to x */
    p = affine_vector(&find(g, "[")->turn, vec3_make(0, 0, 1));
    assert_true(p.x == 0 && p.y == 1 && p.z == 0);  /* z to x, x to y */
    grammar_destroy(g);
}

static void rules_of_a_symbol_stand_together(void **state)
{
    (void)state;
    Grammar *g = load("A\nA 0.25 B\nB 0.5 A A\nA 0.5 C A B\nC 0.125 A\nB 0.25\nA 0.25 A\n");
    const Symbol *a = find(g, "A"), *b = find(g, "B"), *c = find(g, "C");
    assert_int_equal(g->rule_count, 6);
    assert_int_equal(a->rule_count, 3);
    assert_int_equal(b->rule_count, 2);
    assert_int_equal(c->rule_count, 1);
    const Rule *ra = &g->rule[a->first_rule], *rb = &g->rule[b->first_rule];
    assert_true(ra[0].probability == 0.25 && ra[1].probability == 0.5 && ra[2].probability == 0.25);
    assert_true(ra[0].count == 1 && ra[1].count == 3 && ra[2].count == 1);
    assert_true(rb[0].count == 2 && rb[1].count == 0);
    assert_ptr_equal(&g->symbol[g->body[ra[1].first]], c);
    grammar_destroy(g);
}

static void forms_that_are_allowed(void **state)
{
    (void)state;
    static const char *const good[] = {
        "A\ntrunk A 1 1 1",
        "A\r\ntrunk A 1 1 1\r\n\r\nA 1.0 A A\r\n",
        "\n \t\n  A  \n\ttrunk\tA 1\t1 1\n",
        "\xef\xbb\xbf\101\ntrunk A 1 1 1\n",  /* \101 is A: a letter A would lengthen the \xbf */
        "A\nA 1\n",                                                /* disappears */
        "A\nA 0.0 A\n",
        "A\ntrunk A -1 1e-3 +2.5\ntrunk B 1 1 1\nleaf C 1 1 1\nleaf D 1 1 1\n",
        "A\ntrunk A 1 1 1\nA 0.1 A\nA 0.1 A\nA 0.1 A\nA 0.1 A\nA 0.1 A\nA 0.1 A\nA 0.1 A\nA 0.1 A\nA 0.1 A\nA 0.1 A\n",
        "A\nA 0.7 A\nA 0.2 A\nA 0.1 A\n",
        "A\nbranch begin end 1 2 3\nA 1 begin A begin end end A\n",
        "A\nA 1 ( A )\nbranch ( ) 0 0 0\n",                        /* meanings may come last */
        "trunk\ntrunk trunk 1 1 1\n",
        "\xc3\xa4\ntrunk \xc3\xa4 1 1 1\n",
    };
    for (size_t i = 0; i < sizeof good / sizeof *good; i++) grammar_destroy(load(good[i]));
}

static void faults_name_the_line(void **state)
{
    (void)state;
    static const char *const bad[][2] = {
        {"", ":1: no start symbol"},
        {"\n \n", ":1: no start symbol"},
        {"trunk F 1 1 1\nF\n", ":1: the first line must be the start symbol alone"},
        {"\nF G\n", ":2: the first line must be the start symbol alone"},
        {"F\n", ":1: 'F' has neither a meaning nor a rule"},
        {"F\ntrunk F 1 1 1\nF 1.0 F X\nX 1.0 Y\n", ":4: 'Y' has neither a meaning nor a rule"},
        {"F\ntrunk F 1 1 1\nleaf G 1 1 1\nleaf F 1 1 1\n", ":4: 'F' has two meanings; the first is on line 2"},
        {"F\ntrunk F 1 1 1\n\ntrunk F 1 1 1\n", ":4: 'F' has two meanings; the first is on line 2"},
        {"F\nbranch ( ) 0 0 1\ntrunk ( 1 1 1\n", ":3: '(' has two meanings; the first is on line 2"},
        {"F\nbranch ( ) 0 0 1\nbranch [ ) 0 0 1\n", ":3: ')' has two meanings; the first is on line 2"},
        {"F\nbranch | | 0 0 1\n", ":2: '|' can't be both brackets of a pair"},
        {"F\ntrunk F 1 1 1\nbranch ( ) 0 0 1\nF 1 F\nF 0 ( F\n", ":5: '(' is not closed"},
        {"F\ntrunk F 1 1 1\nF 1 F )\nbranch ( ) 0 0 1\n", ":3: ')' closes a bracket that isn't open"},
        {"F\ntrunk F 1 1 1\nbranch ( ) 0 0 1\nbranch [ ] 0 0 2\nF 1 ( F [ F ) ]\n",
         ":5: '[' is not closed by its own bracket"},
        {"F\ntrunk F 1 1 1\nbranch ( ) 0 0 1\nF 1 ( F\nF 0 )\n", ":4: '(' is not closed"},
        {"F\ntrunk F 1 1 1\nbranch ( ) 0 0 1\n( 1 F\n", ":4: '(' is a bracket and can't have a rule"},
        {"F\ntrunk F 1 1 1\n) 1 F\nbranch ( ) 0 0 1\n", ":3: ')' is a bracket and can't have a rule"},
        {"(\nbranch ( ) 0 0 1\n", ":1: '(' is a bracket and can't be the start"},
        {"F\nF 1.1 F\n", ":2: the probabilities of 'F' add up to 1.1, which is more than 1"},
        {"F\nF 0.5 F\nG 0.6 F\nF 0.3 F\nF 0.3 F\nF 0.1 F\n",
         ":5: the probabilities of 'F' add up to 1.1, which is more than 1"},
        {"F\nF 0.3333 F\nF 0.3333 F\nF 0.33341 F\n", ":4: the probabilities of 'F' add up to 1.00001, which is more than 1"},
        {"F\nF -0.5 F\n", ":2: '-0.5' is no probability"},
        {"F\nF\n", ":2: 'F' needs a probability and symbols"},
        {"F\nF F F\n", ":2: 'F' is not a finite number"},
        {"F\nF nan F\n", ":2: 'nan' is not a finite number"},
        {"F\nF 0x1 F\n", ":2: '0x1' is not a finite number"},
        {"F\nF 0,5 F\n", ":2: '0,5' is not a finite number"},
        {"F\nF 1e F\n", ":2: '1e' is not a finite number"},
        {"F\nF 1e999 F\n", ":2: '1e999' is not a finite number"},
        {"F\ntrunk F 1 1\n", ":2: trunk needs a symbol and three sizes"},
        {"F\nleaf F 1 1 1 1\n", ":2: leaf needs a symbol and three sizes"},
        {"F\ntrunk F 1 one 1\n", ":2: 'one' is not a finite number"},
        {"F\nleaf F 1 inf 1\n", ":2: 'inf' is not a finite number"},
        {"F\ntrunk F 1 0 1\n", ":2: '0' is no size"},
        {"F\nbranch ( ) 0 0\n", ":2: branch needs two brackets and three angles"},
        {"F\nbranch ( ) 0 0 0 0\n", ":2: branch needs two brackets and three angles"},
        {"F\nbranch ( ) 0 0 left\n", ":2: 'left' is not a finite number"},
        {"F\nF aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa F\n",
         ":2: 'aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa...' is not a finite number"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) assert_error(bad[i][0], bad[i][1]);
}

static void files_that_cant_be_read(void **state)
{
    (void)state;
    Err err;
    assert_null(grammar_load("build/none.grammar", &err));
    assert_int_equal(err.kind, ERR_INPUT);
    assert_string_equal(err.text, "can't open build/none.grammar: No such file or directory");
    assert_null(grammar_load("src", &err));
    assert_string_equal(err.text, "can't open src: Is a directory");
    assert_null(grammar_load(test_file_bytes("zero.grammar", "F\nF\0 1", 6), &err));
    assert_string_equal(err.text, test_message("", "zero.grammar", ":2: a zero byte; this is no text file"));
}

static void thousands_of_symbols(void **state)
{
    (void)state;
    enum { N = 5000 };
    char *text = malloc(N * 40), *at = text;
    assert_non_null(text);
    at += sprintf(at, "s0\n");
    for (int i = 0; i < N; i++) at += sprintf(at, "s%d 0.5 s%d s%d\n", i, (i + 1) % N, (i * 7) % N);
    Grammar *g = load(text);
    assert_int_equal(g->symbol_count, N);
    for (uint32_t i = 0; i < N; i++) assert_int_equal(g->symbol[i].rule_count, 1);
    grammar_destroy(g);
    free(text);
}

static void damaged_files_do_no_harm(void **state)
{
    (void)state;
    size_t size;
    char *good = test_read("tests/data/branching.grammar", &size), *text = malloc(size + 1);
    assert_non_null(text);
    static const char bytes[] = " \n()[]{}<>F0123.-e\r";
    Rng rng = rng_seed(SEED, 0);
    for (int i = 0; i < 2000; i++) {
        memcpy(text, good, size + 1);
        for (uint32_t k = 1 + rng_u32(&rng) % 4; k > 0; k--)
            text[rng_u32(&rng) % size] = bytes[rng_u32(&rng) % (sizeof bytes - 1)];
        Err err = {ERR_NONE, ""};
        Grammar *g = grammar_load(test_file("damaged.grammar", text), &err);
        if (!g) assert_int_equal(err.kind, ERR_INPUT);
        grammar_destroy(g);
    }
    free(text);
    free(good);
}

static void every_allocation_may_fail(void **state)
{
    (void)state;
    for (long n = 1, failed = true; failed; n++) {
        GrammarSource source = {.path = "tests/data/branching.grammar"};
        Err err = {ERR_NONE, ""};
        alloc_fail_at(n);
        bool done = grammar_source_load(&source, &err);
        failed = alloc_fail_stop();
        assert_true(done == !failed);
        grammar_destroy(source.loaded);
        if (!failed) continue;
        assert_int_equal(err.kind, ERR_LIMIT);
        assert_string_equal(err.text, "out of memory for tests/data/branching.grammar");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_example),
        cmocka_unit_test(brackets_turn_x_then_y_then_z),
        cmocka_unit_test(rules_of_a_symbol_stand_together),
        cmocka_unit_test(forms_that_are_allowed),
        cmocka_unit_test(faults_name_the_line),
        cmocka_unit_test(files_that_cant_be_read),
        cmocka_unit_test(thousands_of_symbols),
        cmocka_unit_test(damaged_files_do_no_harm),
        cmocka_unit_test(every_allocation_may_fail),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
