/* Scrambling by hashing: Laine, Karras, "Stratified sampling for stochastic transparency" (EGSR 2011), in the form of
 * Burley, "Practical hash-based Owen scrambling" (JCGT 2020), with the hash constants found by Vegdahl (2021). */
#include "render/sample.h"

#include "common/rng.h"
#include "common/wide.h"

static inline uint32_t reverse_bits(uint32_t x)
{
    x = (x >> 16) | (x << 16);
    x = ((x & 0x00ff00ffu) << 8) | ((x >> 8) & 0x00ff00ffu);
    x = ((x & 0x0f0f0f0fu) << 4) | ((x >> 4) & 0x0f0f0f0fu);
    x = ((x & 0x33333333u) << 2) | ((x >> 2) & 0x33333333u);
    return ((x & 0x55555555u) << 1) | ((x >> 1) & 0x55555555u);
}

/* Nested uniform scrambling of a bit-reversed number: each bit is flipped by a hash of the lower ones, which after the
 * reversal are the more significant. */
static inline uint32_t scramble_reversed(uint32_t x, uint32_t seed)
{
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

/* Sobol's second dimension, bit-reversed: the direction numbers are the rows of Pascal's triangle mod 2, so the matrix
 * is applied in five steps. */
static inline uint32_t sobol_1_reversed(uint32_t index)
{
    uint32_t x = index;
    x ^= (x >> 1) & 0x55555555u;
    x ^= (x >> 2) & 0x33333333u;
    x ^= (x >> 4) & 0x0f0f0f0fu;
    x ^= (x >> 8) & 0x00ff00ffu;
    x ^= (x >> 16) & 0x0000ffffu;
    return x;
}

uint64_t sample_key(uint64_t seed, uint32_t x, uint32_t y, uint32_t replicate)
{
    return hash64(hash64(hash64(seed) ^ ((uint64_t)y << 32 | x)) + replicate);
}

/* x 2^-32, by way of a signed number, which vectors of integers turn into doubles. */
static inline double unit_of(uint32_t x) { return ((double)(int32_t)(x ^ 0x80000000u) + 0x1p31) * 0x1p-32; }

static inline Sample2 place(uint32_t low, uint32_t high, uint32_t index)
{
    uint32_t a = reverse_bits(scramble_reversed(index, low));
    uint32_t b = reverse_bits(scramble_reversed(sobol_1_reversed(index), high));
    return (Sample2){unit_of(a), unit_of(b)};
}

Sample2 sample_place(uint64_t key, uint32_t index) { return place((uint32_t)key, (uint32_t)(key >> 32), index); }

WIDE void sample_places(const uint32_t *restrict low, const uint32_t *restrict high, const uint32_t *restrict index,
                        double *restrict x, double *restrict y, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        Sample2 at = place(low[i], high[i], index[i]);
        x[i] = at.x;
        y[i] = at.y;
    }
}
