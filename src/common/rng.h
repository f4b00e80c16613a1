/* Random numbers: PCG32 (O'Neill 2014) for sequences, an integer hash for keys.
 * The same seed gives the same numbers on every machine. */
#ifndef RT_COMMON_RNG_H
#define RT_COMMON_RNG_H

#include <stdint.h>

typedef struct { uint64_t state, inc; } Rng;

/* SplitMix64's finaliser (Steele, Lea, Flood 2014): a bijection that mixes every bit. */
static inline uint64_t hash64(uint64_t x)
{
    x += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

static inline uint32_t rng_u32(Rng *rng)
{
    uint64_t old = rng->state;
    rng->state = old * 6364136223846793005u + rng->inc;
    uint32_t x = (uint32_t)(((old >> 18) ^ old) >> 27), r = (uint32_t)(old >> 59);
    return (x >> r) | (x << ((32 - r) & 31));
}

/* Streams with different numbers are independent. */
static inline Rng rng_seed(uint64_t seed, uint64_t stream)
{
    Rng rng = {0, (hash64(stream) << 1) | 1};
    rng_u32(&rng);
    rng.state += hash64(seed);
    rng_u32(&rng);
    return rng;
}

/* Uniform in [0, 1), a multiple of 2^-53. */
static inline double rng_double(Rng *rng)
{
    uint64_t hi = rng_u32(rng), lo = rng_u32(rng);
    return (double)((hi << 32 | lo) >> 11) * 0x1p-53;
}

#endif
