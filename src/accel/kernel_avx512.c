/* Streams with AVX-512 (F, VL, DQ, BW), sixteen rays or a node's eight boxes at once. Everything below is compiled for it;
 * the kernel runs only where the processor has it. */
#if defined(__x86_64__)
#if defined(__clang__)
#pragma clang attribute push(                                                                                       \
    __attribute__((target("avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi,bmi2,lzcnt,popcnt"))), apply_to = function)
#else
#pragma GCC target("avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi,bmi2,lzcnt,popcnt,prefer-vector-width=512")
#endif

#include <immintrin.h>
#include <stddef.h>
#include <stdint.h>

#include "common/ray.h"

enum { LANES = 16 };

typedef __m512 Lanes;
typedef __m512i LanesInt;
typedef __mmask16 Mask;

static inline Lanes lanes_set(float x) { return _mm512_set1_ps(x); }
static inline LanesInt lanes_set_int(uint32_t x) { return _mm512_set1_epi32((int)x); }
static inline Lanes lanes_fma(Lanes a, Lanes b, Lanes c) { return _mm512_fmadd_ps(a, b, c); }
static inline Lanes lanes_fms(Lanes a, Lanes b, Lanes c) { return _mm512_fmsub_ps(a, b, c); }
static inline Lanes lanes_min(Lanes a, Lanes b) { return _mm512_min_ps(a, b); }
static inline Lanes lanes_max(Lanes a, Lanes b) { return _mm512_max_ps(a, b); }
static inline Lanes lanes_abs(Lanes a) { return _mm512_abs_ps(a); }
static inline Lanes lanes_sign(Lanes a) { return _mm512_and_ps(a, _mm512_set1_ps(-0.0f)); }
static inline Lanes lanes_flip(Lanes a, Lanes sign) { return _mm512_xor_ps(a, sign); }
static inline Mask lanes_le(Lanes a, Lanes b) { return _mm512_cmp_ps_mask(a, b, _CMP_LE_OQ); }
static inline Mask lanes_lt(Lanes a, Lanes b) { return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ); }
static inline Lanes lanes_pick(Mask m, Lanes a, Lanes b) { return _mm512_mask_blend_ps(m, b, a); }
static inline LanesInt lanes_pick_int(Mask m, LanesInt a, LanesInt b) { return _mm512_mask_blend_epi32(m, b, a); }
static inline float lanes_least(Lanes a) { return _mm512_reduce_min_ps(a); }
static inline float lanes_greatest(Lanes a) { return _mm512_reduce_max_ps(a); }
static inline Mask mask_and(Mask a, Mask b) { return (Mask)(a & b); }
static inline Mask mask_or(Mask a, Mask b) { return (Mask)(a | b); }
static inline Mask mask_without(Mask a, Mask b) { return (Mask)(a & ~b); }
static inline uint32_t mask_bits(Mask m) { return m; }
static inline Mask mask_of(uint32_t bits) { return (Mask)bits; }

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
static inline uint32_t eight_le(Eight a, Eight b) { return _mm256_cmp_ps_mask(a, b, _CMP_LE_OQ); }

/* The children whose enter <= leave, in the order given (three bits each, `reverse`: from the highest), onto the stack. */
static inline uint32_t eight_push(float *entry, uint32_t *child, Eight enter, Eight leave, const uint32_t *children,
                                  uint32_t order, uint32_t reverse)
{
    __m256i shift = _mm256_setr_epi32(0, 3, 6, 9, 12, 15, 18, 21);
    if (reverse) shift = _mm256_sub_epi32(_mm256_set1_epi32(21), shift);
    __m256i at = _mm256_srlv_epi32(_mm256_set1_epi32((int)order), shift);
    Eight e = _mm256_permutexvar_ps(at, enter), l = _mm256_permutexvar_ps(at, leave);
    __m256i c = _mm256_permutexvar_epi32(at, _mm256_load_si256((const __m256i *)children));
    __mmask8 met = _mm256_cmp_ps_mask(e, l, _CMP_LE_OQ);
    _mm256_storeu_ps(entry, _mm256_maskz_compress_ps(met, e));
    _mm256_storeu_si256((__m256i *)child, _mm256_maskz_compress_epi32(met, c));
    return (uint32_t)__builtin_popcount(met);
}

/* Those of the first n whose entry is at most tmax, moved to another place. */
static inline uint32_t eight_keep(float *entry, uint32_t *child, const float *from, const uint32_t *from_child, uint32_t n,
                                  float tmax)
{
    Eight e = _mm256_loadu_ps(from);
    __m256i c = _mm256_loadu_si256((const __m256i *)from_child);
    __mmask8 kept = (__mmask8)(_mm256_cmp_ps_mask(e, _mm256_set1_ps(tmax), _CMP_LE_OQ) & ((1u << n) - 1));
    _mm256_storeu_ps(entry, _mm256_maskz_compress_ps(kept, e));
    _mm256_storeu_si256((__m256i *)child, _mm256_maskz_compress_epi32(kept, c));
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
static inline uint32_t four_lt(Four a, Four b) { return _mm_cmp_ps_mask(a, b, _CMP_LT_OQ); }


typedef __m512d Doubles;

enum { DOUBLES = 8 };

static inline Doubles doubles_set(double x) { return _mm512_set1_pd(x); }
static inline Doubles doubles_max(Doubles a, Doubles b) { return _mm512_max_pd(a, b); }
static inline Doubles doubles_min(Doubles a, Doubles b) { return _mm512_min_pd(a, b); }
static inline Doubles doubles_sqrt(Doubles a) { return _mm512_sqrt_pd(a); }
static inline Doubles doubles_abs(Doubles a) { return _mm512_abs_pd(a); }
static inline uint32_t doubles_lt(Doubles a, Doubles b) { return _mm512_cmp_pd_mask(a, b, _CMP_LT_OQ); }
static inline Doubles doubles_of_floats(const float *p) { return _mm512_cvtps_pd(_mm256_loadu_ps(p)); }
static inline void doubles_to_floats(float *to, Doubles a) { _mm256_storeu_ps(to, _mm512_cvtpd_ps(a)); }

typedef __mmask8 DoublesMask;

static inline DoublesMask doubles_le(Doubles a, Doubles b) { return _mm512_cmp_pd_mask(a, b, _CMP_LE_OQ); }
static inline DoublesMask doubles_mask_of(uint32_t bits) { return (DoublesMask)bits; }
static inline uint32_t doubles_mask_bits(DoublesMask m) { return m; }
static inline DoublesMask doubles_mask_and(DoublesMask a, DoublesMask b) { return (DoublesMask)(a & b); }
static inline DoublesMask doubles_mask_without(DoublesMask a, DoublesMask b) { return (DoublesMask)(a & ~b); }
static inline Doubles doubles_pick(DoublesMask m, Doubles a, Doubles b) { return _mm512_mask_blend_pd(m, b, a); }

/* a b - p, exactly, p being the rounded product. */
static inline Doubles doubles_rest(Doubles a, Doubles b, Doubles p) { return _mm512_fmsub_pd(a, b, p); }

/* The power of two below or equal, of positive normal numbers; and 1 over it. */
static inline Doubles doubles_power(Doubles a, Doubles *reciprocal)
{
    __m512i e = _mm512_and_epi64(_mm512_castpd_si512(a), _mm512_set1_epi64(0x7ff0000000000000));
    *reciprocal = _mm512_castsi512_pd(_mm512_sub_epi64(_mm512_set1_epi64(2046LL << 52), e));
    return _mm512_castsi512_pd(e);
}

/* Eight records of eight numbers each become eight fields. */
static inline void doubles_fields(const double *record, Doubles f[8])
{
    Doubles r[8], s[8];
    for (int i = 0; i < 8; i++) r[i] = _mm512_loadu_pd(record + 8 * i);
    for (int i = 0; i < 8; i += 2) {
        s[i] = _mm512_unpacklo_pd(r[i], r[i + 1]);
        s[i + 1] = _mm512_unpackhi_pd(r[i], r[i + 1]);
    }
    for (int k = 0; k < 2; k++) {
        Doubles a = _mm512_shuffle_f64x2(s[k], s[k + 2], 0x88), b = _mm512_shuffle_f64x2(s[k + 4], s[k + 6], 0x88);
        Doubles c = _mm512_shuffle_f64x2(s[k], s[k + 2], 0xdd), d = _mm512_shuffle_f64x2(s[k + 4], s[k + 6], 0xdd);
        f[k] = _mm512_shuffle_f64x2(a, b, 0x88);
        f[k + 4] = _mm512_shuffle_f64x2(a, b, 0xdd);
        f[k + 2] = _mm512_shuffle_f64x2(c, d, 0x88);
        f[k + 6] = _mm512_shuffle_f64x2(c, d, 0xdd);
    }
}

static inline uint32_t lanes_equal_int(LanesInt a, LanesInt b) { return _mm512_cmpeq_epi32_mask(a, b); }
static inline void doubles_store(double *p, Doubles a) { _mm512_storeu_pd(p, a); }

/* The numbers of the lanes in `bits`, moved together; what is after them in `to` may be anything. */
static inline void doubles_keep(double *to, const double *from, uint32_t bits)
{
    _mm512_storeu_pd(to, _mm512_maskz_compress_pd((__mmask8)bits, _mm512_loadu_pd(from)));
}

/* Whole numbers as the bits of doubles. */
static inline Doubles doubles_of_ints(const uint32_t *p)
{
    return _mm512_castsi512_pd(_mm512_cvtepu32_epi64(_mm256_loadu_si256((const __m256i *)p)));
}

/* The numbers of a lane, one after the other, to the lane's place, `offset` bytes behind what is there. */
static inline void doubles_store_pairs(Hit *const *to, size_t offset, Doubles a, Doubles b)
{
    Doubles even = _mm512_unpacklo_pd(a, b), odd = _mm512_unpackhi_pd(a, b);
#define PAIR(i, pairs) _mm_storeu_pd((double *)((char *)to[i] + offset), _mm512_extractf64x2_pd(pairs, (i) / 2))
    PAIR(0, even), PAIR(1, odd), PAIR(2, even), PAIR(3, odd), PAIR(4, even), PAIR(5, odd), PAIR(6, even), PAIR(7, odd);
#undef PAIR
}

static inline Doubles doubles_first(Doubles a) { return _mm512_broadcastsd_pd(_mm512_castpd512_pd128(a)); }

/* Of sixteen numbers those with these indices. */
static inline Doubles doubles_chosen(const double *of, const uint32_t *index)
{
    __m512i at = _mm512_cvtepu32_epi64(_mm256_loadu_si256((const __m256i *)index));
    return _mm512_permutex2var_pd(_mm512_load_pd(of), at, _mm512_load_pd(of + 8));
}

/* Eight vectors of three from eight places. */
static inline void doubles_gather(const double *const *p, Doubles *x, Doubles *y, Doubles *z)
{
    Doubles r[4];
    for (int i = 0; i < 4; i++)
        r[i] = _mm512_insertf64x4(_mm512_castpd256_pd512(_mm256_maskz_loadu_pd(7, p[i])),
                                  _mm256_maskz_loadu_pd(7, p[i + 4]), 1);
    const __m512i low = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13), high = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
    Doubles xz = _mm512_unpacklo_pd(r[0], r[1]), xz2 = _mm512_unpacklo_pd(r[2], r[3]);
    *x = _mm512_permutex2var_pd(xz, low, xz2);
    *z = _mm512_permutex2var_pd(xz, high, xz2);
    *y = _mm512_permutex2var_pd(_mm512_unpackhi_pd(r[0], r[1]), low, _mm512_unpackhi_pd(r[2], r[3]));
}

#include "accel/stream_kernel.h"

const Kernel kernel_avx512 = {"avx512", intersect, occluded};

#if defined(__clang__)
#pragma clang attribute pop
#endif
#endif
