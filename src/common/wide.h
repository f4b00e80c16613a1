/* Loops over arrays that the compiler turns into vectors. */
#ifndef RT_COMMON_WIDE_H
#define RT_COMMON_WIDE_H

/* Has a function compiled for AVX2 as well, to be chosen when the program starts. Nothing is fused (-ffp-contract=off), so
 * the numbers are the same. Sanitizers run before such choices can be made. */
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__OPTIMIZE__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__) && !defined(__clang__)
#define WIDE __attribute__((target_clones("avx2", "default")))
#else
#define WIDE
#endif

#endif
