/* The bump allocator: alignment, distinctness, reuse after a reset, memory that runs out. */
#include "common/arena.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "common/rng.h"
#include "support/alloc_fail.h"

enum { SEED = 77, COUNT = 3000 };

static void allocations_are_aligned_and_apart(void **state)
{
    (void)state;
    Arena *arena = arena_create();
    Rng rng = rng_seed(SEED, 0);
    static unsigned char *block[COUNT];
    static size_t size[COUNT];
    for (int round = 0; round < 3; round++) {
        for (int i = 0; i < COUNT; i++) {
            size[i] = rng_u32(&rng) % (i % 100 == 0 ? 200000 : 300);
            block[i] = arena_alloc(arena, size[i]);
            assert_non_null(block[i]);
            assert_int_equal((uintptr_t)block[i] % (size[i] >= 64 ? 64 : 16), 0);
            memset(block[i], i % 251, size[i]);
        }
        for (int i = 0; i < COUNT; i++)
            for (size_t k = 0; k < size[i]; k++)
                if (block[i][k] != i % 251) fail_msg("seed %d, block %d was overwritten", SEED, i);
        arena_reset(arena);
    }
    arena_destroy(arena);
    arena_destroy(NULL);
}

static void a_reset_keeps_the_memory(void **state)
{
    (void)state;
    Arena *arena = arena_create();
    for (int i = 0; i < 1000; i++) assert_non_null(arena_alloc(arena, 1000));
    size_t bytes = arena_bytes(arena);
    assert_true(bytes >= 1000 * 1000);
    for (int round = 0; round < 50; round++) {
        arena_reset(arena);
        for (int i = 0; i < 1000; i++) assert_non_null(arena_alloc(arena, 1000));
        assert_int_equal(arena_bytes(arena), bytes);
    }
    arena_destroy(arena);
}

static void zeroed_memory_and_strings(void **state)
{
    (void)state;
    Arena *arena = arena_create();
    for (int round = 0; round < 2; round++) {
        unsigned char *p = arena_alloc_zero(arena, 500);
        for (int i = 0; i < 500; i++) assert_int_equal(p[i], 0);
        memset(p, 255, 500);
        char text[] = "text";
        char *copy = arena_strdup(arena, text);
        text[0] = 'x';
        assert_string_equal(copy, "text");
        assert_string_equal(arena_strdup(arena, ""), "");
        arena_reset(arena);
    }
    arena_destroy(arena);
}

static void sizes_that_no_machine_has(void **state)
{
    (void)state;
    Arena *arena = arena_create();
    assert_non_null(arena_alloc(arena, 0));
    assert_null(arena_alloc(arena, SIZE_MAX));
    assert_null(arena_alloc(arena, SIZE_MAX - 64));
    assert_null(arena_alloc_zero(arena, SIZE_MAX - 80));
    assert_non_null(arena_alloc(arena, 8));
    arena_destroy(arena);
}

static void every_allocation_may_fail(void **state)
{
    (void)state;
    for (long n = 1, failed = true; failed; n++) {
        alloc_fail_at(n);
        Arena *arena = arena_create();
        bool done = arena && arena_alloc(arena, 100) && arena_alloc(arena, 100000) && arena_strdup(arena, "text") &&
                    arena_alloc_zero(arena, 1000000);
        failed = alloc_fail_stop();
        assert_true(done == !failed);
        if (arena) assert_non_null(arena_alloc(arena, 5000000));  /* it can still be used */
        arena_destroy(arena);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(allocations_are_aligned_and_apart),
        cmocka_unit_test(a_reset_keeps_the_memory),
        cmocka_unit_test(zeroed_memory_and_strings),
        cmocka_unit_test(sizes_that_no_machine_has),
        cmocka_unit_test(every_allocation_may_fail),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
