/* Streams with AVX2 and FMA, eight rays or a node's eight boxes at once. Everything below is compiled for it; the kernel
 * runs only where the processor has it. */
#if defined(__x86_64__)
#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx2,fma,bmi,bmi2,lzcnt,popcnt"))), apply_to = function)
#else
#pragma GCC target("avx2,fma,bmi,bmi2,lzcnt,popcnt")
#endif

#include <immintrin.h>
#include <stddef.h>
#include <stdint.h>

#include "common/ray.h"

enum { LANES = 8 };

typedef __m256 Lanes;
typedef __m256i LanesInt;
typedef __m256 Mask;

static inline Lanes lanes_set(float x) { return _mm256_set1_ps(x); }
static inline LanesInt lanes_set_int(uint32_t x) { return _mm256_set1_epi32((int)x); }
static inline Lanes lanes_fma(Lanes a, Lanes b, Lanes c) { return _mm256_fmadd_ps(a, b, c); }
static inline Lanes lanes_fms(Lanes a, Lanes b, Lanes c) { return _mm256_fmsub_ps(a, b, c); }
static inline Lanes lanes_min(Lanes a, Lanes b) { return _mm256_min_ps(a, b); }
static inline Lanes lanes_max(Lanes a, Lanes b) { return _mm256_max_ps(a, b); }
static inline Lanes lanes_abs(Lanes a) { return _mm256_andnot_ps(_mm256_set1_ps(-0.0f), a); }
static inline Lanes lanes_sign(Lanes a) { return _mm256_and_ps(a, _mm256_set1_ps(-0.0f)); }
static inline Lanes lanes_flip(Lanes a, Lanes sign) { return _mm256_xor_ps(a, sign); }
static inline Mask lanes_le(Lanes a, Lanes b) { return _mm256_cmp_ps(a, b, _CMP_LE_OQ); }
static inline Mask lanes_lt(Lanes a, Lanes b) { return _mm256_cmp_ps(a, b, _CMP_LT_OQ); }
static inline Lanes lanes_pick(Mask m, Lanes a, Lanes b) { return _mm256_blendv_ps(b, a, m); }
static inline LanesInt lanes_pick_int(Mask m, LanesInt a, LanesInt b)
{
    return _mm256_blendv_epi8(b, a, _mm256_castps_si256(m));
}

static inline float lanes_least(Lanes a)
{
    __m128 m = _mm_min_ps(_mm256_castps256_ps128(a), _mm256_extractf128_ps(a, 1));
    m = _mm_min_ps(m, _mm_movehl_ps(m, m));
    return _mm_cvtss_f32(_mm_min_ss(m, _mm_movehdup_ps(m)));
}

static inline float lanes_greatest(Lanes a)
{
    __m128 m = _mm_max_ps(_mm256_castps256_ps128(a), _mm256_extractf128_ps(a, 1));
    m = _mm_max_ps(m, _mm_movehl_ps(m, m));
    return _mm_cvtss_f32(_mm_max_ss(m, _mm_movehdup_ps(m)));
}

static inline Mask mask_and(Mask a, Mask b) { return _mm256_and_ps(a, b); }
static inline Mask mask_or(Mask a, Mask b) { return _mm256_or_ps(a, b); }
static inline Mask mask_without(Mask a, Mask b) { return _mm256_andnot_ps(b, a); }
static inline uint32_t mask_bits(Mask m) { return (uint32_t)_mm256_movemask_ps(m); }

static inline Mask mask_of(uint32_t bits)
{
    const __m256i bit = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
    return _mm256_castsi256_ps(_mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32((int)bits), bit), bit));
}

typedef __m256 Eight;

static inline Eight eight_set(float x) { return _mm256_set1_ps(x); }
static inline Eight eight_load(const float *p) { return _mm256_load_ps(p); }
static inline void eight_store(float *p, Eight a) { _mm256_store_ps(p, a); }
static inline Eight eight_add(Eight a, Eight b) { return _mm256_add_ps(a, b); }
static inline Eight eight_sub(Eight a, Eight b) { return _mm256_sub_ps(a, b); }
static inline Eight eight_mul(Eight a, Eight b) { return _mm256_mul_ps(a, b); }
static inline Eight eight_fms(Eight a, Eight b, Eight c) { return _mm256_fmsub_ps(a, b, c); }
static inline Eight eight_min(Eight a, Eight b) { return _mm256_min_ps(a, b); }
static inline Eight eight_max(Eight a, Eight b) { return _mm256_max_ps(a, b); }
static inline uint32_t eight_le(Eight a, Eight b)
{
    return (uint32_t)_mm256_movemask_ps(_mm256_cmp_ps(a, b, _CMP_LE_OQ));
}

/* Indices of the set bits, in order, as lanes. */
static inline __m256i eight_packed(uint32_t bits)
{
    uint64_t bytes = _pdep_u64(bits, 0x0101010101010101u) * 0xff;
    return _mm256_cvtepu8_epi32(_mm_cvtsi64_si128((long long)_pext_u64(0x0706050403020100u, bytes)));
}

/* The children whose enter <= leave, in the order given (three bits each, `reverse`: from the highest), onto the stack. */
static inline uint32_t eight_push(float *entry, uint32_t *child, Eight enter, Eight leave, const uint32_t *children,
                                  uint32_t order, uint32_t reverse)
{
    __m256i shift = _mm256_setr_epi32(0, 3, 6, 9, 12, 15, 18, 21);
    if (reverse) shift = _mm256_sub_epi32(_mm256_set1_epi32(21), shift);
    __m256i at = _mm256_srlv_epi32(_mm256_set1_epi32((int)order), shift);
    Eight e = _mm256_permutevar8x32_ps(enter, at), l = _mm256_permutevar8x32_ps(leave, at);
    uint32_t met = eight_le(e, l);
    __m256i packed = eight_packed(met);
    __m256i c = _mm256_permutevar8x32_epi32(_mm256_load_si256((const __m256i *)children), at);
    _mm256_storeu_ps(entry, _mm256_permutevar8x32_ps(e, packed));
    _mm256_storeu_si256((__m256i *)child, _mm256_permutevar8x32_epi32(c, packed));
    return (uint32_t)__builtin_popcount(met);
}

/* Those of the first n whose entry is at most tmax, moved to another place. */
static inline uint32_t eight_keep(float *entry, uint32_t *child, const float *from, const uint32_t *from_child, uint32_t n,
                                  float tmax)
{
    Eight e = _mm256_loadu_ps(from);
    __m256i c = _mm256_loadu_si256((const __m256i *)from_child);
    uint32_t kept = eight_le(e, eight_set(tmax)) & ((1u << n) - 1);
    __m256i packed = eight_packed(kept);
    _mm256_storeu_ps(entry, _mm256_permutevar8x32_ps(e, packed));
    _mm256_storeu_si256((__m256i *)child, _mm256_permutevar8x32_epi32(c, packed));
    return (uint32_t)__builtin_popcount(kept);
}

typedef __m128 Four;

static inline Four four_set(float x) { return _mm_set1_ps(x); }
static inline Four four_load(const float *p) { return _mm_load_ps(p); }
static inline void four_store(float *p, Four a) { _mm_store_ps(p, a); }
static inline Four four_fma(Four a, Four b, Four c) { return _mm_fmadd_ps(a, b, c); }
static inline Four four_fms(Four a, Four b, Four c) { return _mm_fmsub_ps(a, b, c); }
static inline Four four_abs(Four a) { return _mm_andnot_ps(_mm_set1_ps(-0.0f), a); }
static inline Four four_sign(Four a) { return _mm_and_ps(a, _mm_set1_ps(-0.0f)); }
static inline Four four_flip(Four a, Four sign) { return _mm_xor_ps(a, sign); }
static inline uint32_t four_lt(Four a, Four b) { return (uint32_t)_mm_movemask_ps(_mm_cmp_ps(a, b, _CMP_LT_OQ)); }

typedef __m256d Doubles;

enum { DOUBLES = 4 };

static inline Doubles doubles_set(double x) { return _mm256_set1_pd(x); }
static inline Doubles doubles_max(Doubles a, Doubles b) { return _mm256_max_pd(a, b); }
static inline Doubles doubles_min(Doubles a, Doubles b) { return _mm256_min_pd(a, b); }
static inline Doubles doubles_sqrt(Doubles a) { return _mm256_sqrt_pd(a); }
static inline Doubles doubles_abs(Doubles a) { return _mm256_andnot_pd(_mm256_set1_pd(-0.0), a); }
static inline uint32_t doubles_lt(Doubles a, Doubles b)
{
    return (uint32_t)_mm256_movemask_pd(_mm256_cmp_pd(a, b, _CMP_LT_OQ));
}
static inline Doubles doubles_of_floats(const float *p) { return _mm256_cvtps_pd(_mm_loadu_ps(p)); }
static inline void doubles_to_floats(float *to, Doubles a) { _mm_storeu_ps(to, _mm256_cvtpd_ps(a)); }

typedef __m256d DoublesMask;

static inline DoublesMask doubles_le(Doubles a, Doubles b) { return _mm256_cmp_pd(a, b, _CMP_LE_OQ); }
static inline DoublesMask doubles_mask_of(uint32_t bits)
{
    const __m256i bit = _mm256_setr_epi64x(1, 2, 4, 8);
    return _mm256_castsi256_pd(_mm256_cmpeq_epi64(_mm256_and_si256(_mm256_set1_epi64x(bits), bit), bit));
}

static inline uint32_t doubles_mask_bits(DoublesMask m) { return (uint32_t)_mm256_movemask_pd(m); }
static inline DoublesMask doubles_mask_and(DoublesMask a, DoublesMask b) { return _mm256_and_pd(a, b); }
static inline DoublesMask doubles_mask_without(DoublesMask a, DoublesMask b) { return _mm256_andnot_pd(b, a); }
static inline Doubles doubles_pick(DoublesMask m, Doubles a, Doubles b) { return _mm256_blendv_pd(b, a, m); }

/* a b - p, exactly, p being the rounded product. */
static inline Doubles doubles_rest(Doubles a, Doubles b, Doubles p) { return _mm256_fmsub_pd(a, b, p); }

/* The power of two below or equal, of positive normal numbers; and 1 over it. */
static inline Doubles doubles_power(Doubles a, Doubles *reciprocal)
{
    __m256i e = _mm256_and_si256(_mm256_castpd_si256(a), _mm256_set1_epi64x(0x7ff0000000000000));
    *reciprocal = _mm256_castsi256_pd(_mm256_sub_epi64(_mm256_set1_epi64x(2046LL << 52), e));
    return _mm256_castsi256_pd(e);
}

/* Four records of eight numbers each become eight fields. */
static inline void doubles_fields(const double *record, Doubles f[8])
{
    for (int half = 0; half < 8; half += 4) {
        Doubles r[4], s[4];
        for (int i = 0; i < 4; i++) r[i] = _mm256_loadu_pd(record + 8 * i + half);
        for (int i = 0; i < 4; i += 2) {
            s[i] = _mm256_unpacklo_pd(r[i], r[i + 1]);
            s[i + 1] = _mm256_unpackhi_pd(r[i], r[i + 1]);
        }
        for (int k = 0; k < 2; k++) {
            f[half + k] = _mm256_permute2f128_pd(s[k], s[k + 2], 0x20);
            f[half + k + 2] = _mm256_permute2f128_pd(s[k], s[k + 2], 0x31);
        }
    }
}

static inline uint32_t lanes_equal_int(LanesInt a, LanesInt b)
{
    return (uint32_t)_mm256_movemask_ps(_mm256_castsi256_ps(_mm256_cmpeq_epi32(a, b)));
}

static inline void doubles_store(double *p, Doubles a) { _mm256_storeu_pd(p, a); }

/* The numbers of the lanes in `bits`, moved together; what is after them in `to` may be anything. */
static inline void doubles_keep(double *to, const double *from, uint32_t bits)
{
    for (; bits; bits &= bits - 1) *to++ = from[__builtin_ctz(bits)];
}

/* Whole numbers as the bits of doubles. */
static inline Doubles doubles_of_ints(const uint32_t *p)
{
    return _mm256_castsi256_pd(_mm256_cvtepu32_epi64(_mm_loadu_si128((const __m128i *)p)));
}

/* The numbers of a lane, one after the other, to the lane's place, `offset` bytes behind what is there. */
static inline void doubles_store_pairs(Hit *const *to, size_t offset, Doubles a, Doubles b)
{
    Doubles even = _mm256_unpacklo_pd(a, b), odd = _mm256_unpackhi_pd(a, b);
#define PAIR(i, pairs) _mm_storeu_pd((double *)((char *)to[i] + offset), _mm256_extractf128_pd(pairs, (i) / 2))
    PAIR(0, even), PAIR(1, odd), PAIR(2, even), PAIR(3, odd);
#undef PAIR
}

static inline Doubles doubles_first(Doubles a) { return _mm256_permute4x64_pd(a, 0); }

/* Of sixteen numbers those with these indices. */
static inline Doubles doubles_chosen(const double *of, const uint32_t *index)
{
    return _mm256_setr_pd(of[index[0]], of[index[1]], of[index[2]], of[index[3]]);
}

/* Four vectors of three from four places. */
static inline void doubles_gather(const double *const *p, Doubles *x, Doubles *y, Doubles *z)
{
    const __m256i three = _mm256_setr_epi64x(-1, -1, -1, 0);
    Doubles r[4];
    for (int i = 0; i < 4; i++) r[i] = _mm256_maskload_pd(p[i], three);
    Doubles xz = _mm256_unpacklo_pd(r[0], r[1]), xz2 = _mm256_unpacklo_pd(r[2], r[3]);
    *x = _mm256_permute2f128_pd(xz, xz2, 0x20);
    *z = _mm256_permute2f128_pd(xz, xz2, 0x31);
    *y = _mm256_permute2f128_pd(_mm256_unpackhi_pd(r[0], r[1]), _mm256_unpackhi_pd(r[2], r[3]), 0x20);
}

#include "accel/stream_kernel.h"

const Kernel kernel_avx2 = {"avx2", intersect, occluded};

#if defined(__clang__)
#pragma clang attribute pop
#endif
#endif
