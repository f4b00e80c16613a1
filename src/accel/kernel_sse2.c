/* Streams with SSE2, which every x86-64 has: four rays or four boxes at once. */
#if defined(__x86_64__)
#include <emmintrin.h>
#include <stddef.h>
#include <stdint.h>

#include "common/ray.h"

enum { LANES = 4 };

typedef __m128 Lanes;
typedef __m128i LanesInt;
typedef __m128 Mask;

static inline Lanes lanes_set(float x) { return _mm_set1_ps(x); }
static inline LanesInt lanes_set_int(uint32_t x) { return _mm_set1_epi32((int)x); }
static inline Lanes lanes_fma(Lanes a, Lanes b, Lanes c) { return _mm_add_ps(_mm_mul_ps(a, b), c); }
static inline Lanes lanes_fms(Lanes a, Lanes b, Lanes c) { return _mm_sub_ps(_mm_mul_ps(a, b), c); }
static inline Lanes lanes_min(Lanes a, Lanes b) { return _mm_min_ps(a, b); }
static inline Lanes lanes_max(Lanes a, Lanes b) { return _mm_max_ps(a, b); }
static inline Lanes lanes_abs(Lanes a) { return _mm_andnot_ps(_mm_set1_ps(-0.0f), a); }
static inline Lanes lanes_sign(Lanes a) { return _mm_and_ps(a, _mm_set1_ps(-0.0f)); }
static inline Lanes lanes_flip(Lanes a, Lanes sign) { return _mm_xor_ps(a, sign); }
static inline Mask lanes_le(Lanes a, Lanes b) { return _mm_cmple_ps(a, b); }
static inline Mask lanes_lt(Lanes a, Lanes b) { return _mm_cmplt_ps(a, b); }
static inline Lanes lanes_pick(Mask m, Lanes a, Lanes b) { return _mm_or_ps(_mm_and_ps(m, a), _mm_andnot_ps(m, b)); }
static inline LanesInt lanes_pick_int(Mask m, LanesInt a, LanesInt b)
{
    __m128i k = _mm_castps_si128(m);
    return _mm_or_si128(_mm_and_si128(k, a), _mm_andnot_si128(k, b));
}

static inline float lanes_least(Lanes a)
{
    __m128 m = _mm_min_ps(a, _mm_movehl_ps(a, a));
    return _mm_cvtss_f32(_mm_min_ss(m, _mm_shuffle_ps(m, m, 1)));
}

static inline float lanes_greatest(Lanes a)
{
    __m128 m = _mm_max_ps(a, _mm_movehl_ps(a, a));
    return _mm_cvtss_f32(_mm_max_ss(m, _mm_shuffle_ps(m, m, 1)));
}

static inline Mask mask_and(Mask a, Mask b) { return _mm_and_ps(a, b); }
static inline Mask mask_or(Mask a, Mask b) { return _mm_or_ps(a, b); }
static inline Mask mask_without(Mask a, Mask b) { return _mm_andnot_ps(b, a); }
static inline uint32_t mask_bits(Mask m) { return (uint32_t)_mm_movemask_ps(m); }

static inline Mask mask_of(uint32_t bits)
{
    const __m128i bit = _mm_setr_epi32(1, 2, 4, 8);
    return _mm_castsi128_ps(_mm_cmpeq_epi32(_mm_and_si128(_mm_set1_epi32((int)bits), bit), bit));
}

typedef struct { __m128 a, b; } Eight;

static inline Eight eight_set(float x) { return (Eight){_mm_set1_ps(x), _mm_set1_ps(x)}; }
static inline Eight eight_load(const float *p) { return (Eight){_mm_load_ps(p), _mm_load_ps(p + 4)}; }
static inline void eight_store(float *p, Eight a) { _mm_store_ps(p, a.a), _mm_store_ps(p + 4, a.b); }
static inline Eight eight_add(Eight x, Eight y) { return (Eight){_mm_add_ps(x.a, y.a), _mm_add_ps(x.b, y.b)}; }
static inline Eight eight_sub(Eight x, Eight y) { return (Eight){_mm_sub_ps(x.a, y.a), _mm_sub_ps(x.b, y.b)}; }
static inline Eight eight_mul(Eight x, Eight y) { return (Eight){_mm_mul_ps(x.a, y.a), _mm_mul_ps(x.b, y.b)}; }
static inline Eight eight_fms(Eight x, Eight y, Eight z) { return eight_sub(eight_mul(x, y), z); }
static inline Eight eight_min(Eight x, Eight y) { return (Eight){_mm_min_ps(x.a, y.a), _mm_min_ps(x.b, y.b)}; }
static inline Eight eight_max(Eight x, Eight y) { return (Eight){_mm_max_ps(x.a, y.a), _mm_max_ps(x.b, y.b)}; }
static inline uint32_t eight_le(Eight x, Eight y)
{
    return (uint32_t)_mm_movemask_ps(_mm_cmple_ps(x.a, y.a)) | (uint32_t)_mm_movemask_ps(_mm_cmple_ps(x.b, y.b)) << 4;
}

/* The children whose enter <= leave, in the order given (three bits each, `reverse`: from the highest), onto the stack. */
static inline uint32_t eight_push(float *entry, uint32_t *child, Eight enter, Eight leave, const uint32_t *children,
                                  uint32_t order, uint32_t reverse)
{
    float e[8];
    _mm_storeu_ps(e, enter.a);
    _mm_storeu_ps(e + 4, enter.b);
    uint32_t met = eight_le(enter, leave), n = 0;
    for (uint32_t i = 0; i < 8; i++) {
        uint32_t k = order >> (reverse ? 21 - 3 * i : 3 * i) & 7;
        if (!(met >> k & 1)) continue;
        entry[n] = e[k];
        child[n++] = children[k];
    }
    return n;
}

/* Those of the first n whose entry is at most tmax, moved to another place. */
static inline uint32_t eight_keep(float *entry, uint32_t *child, const float *from, const uint32_t *from_child, uint32_t n,
                                  float tmax)
{
    uint32_t kept = 0;
    for (uint32_t i = 0; i < n; i++) {
        entry[kept] = from[i];
        child[kept] = from_child[i];
        kept += from[i] <= tmax;
    }
    return kept;
}

typedef __m128 Four;

static inline Four four_set(float x) { return _mm_set1_ps(x); }
static inline Four four_load(const float *p) { return _mm_load_ps(p); }
static inline void four_store(float *p, Four a) { _mm_store_ps(p, a); }
static inline Four four_fma(Four a, Four b, Four c) { return lanes_fma(a, b, c); }
static inline Four four_fms(Four a, Four b, Four c) { return lanes_fms(a, b, c); }
static inline Four four_abs(Four a) { return lanes_abs(a); }
static inline Four four_sign(Four a) { return lanes_sign(a); }
static inline Four four_flip(Four a, Four sign) { return lanes_flip(a, sign); }
static inline uint32_t four_lt(Four a, Four b) { return (uint32_t)_mm_movemask_ps(_mm_cmplt_ps(a, b)); }

typedef __m128d Doubles;

enum { DOUBLES = 2 };

static inline Doubles doubles_set(double x) { return _mm_set1_pd(x); }
static inline Doubles doubles_max(Doubles a, Doubles b) { return _mm_max_pd(a, b); }
static inline Doubles doubles_min(Doubles a, Doubles b) { return _mm_min_pd(a, b); }
static inline Doubles doubles_sqrt(Doubles a) { return _mm_sqrt_pd(a); }
static inline Doubles doubles_abs(Doubles a) { return _mm_andnot_pd(_mm_set1_pd(-0.0), a); }
static inline uint32_t doubles_lt(Doubles a, Doubles b) { return (uint32_t)_mm_movemask_pd(_mm_cmplt_pd(a, b)); }
static inline Doubles doubles_of_floats(const float *p)
{
    return _mm_cvtps_pd(_mm_castsi128_ps(_mm_loadl_epi64((const __m128i *)p)));
}

static inline void doubles_to_floats(float *to, Doubles a) { _mm_storel_pi((__m64 *)to, _mm_cvtpd_ps(a)); }

typedef __m128d DoublesMask;

static inline DoublesMask doubles_le(Doubles a, Doubles b) { return _mm_cmple_pd(a, b); }
static inline DoublesMask doubles_mask_of(uint32_t bits)
{
    int low = -(int)(bits & 1), high = -(int)(bits >> 1 & 1);
    return _mm_castsi128_pd(_mm_set_epi32(high, high, low, low));
}

static inline uint32_t doubles_mask_bits(DoublesMask m) { return (uint32_t)_mm_movemask_pd(m); }
static inline DoublesMask doubles_mask_and(DoublesMask a, DoublesMask b) { return _mm_and_pd(a, b); }
static inline DoublesMask doubles_mask_without(DoublesMask a, DoublesMask b) { return _mm_andnot_pd(b, a); }
static inline Doubles doubles_pick(DoublesMask m, Doubles a, Doubles b)
{
    return _mm_or_pd(_mm_and_pd(m, a), _mm_andnot_pd(m, b));
}

/* a b - p, exactly, p being the rounded product (Dekker 1971, as in dd.h). */
static inline Doubles doubles_rest(Doubles a, Doubles b, Doubles p)
{
    Doubles ca = doubles_set(0x8000001p0) * a, ah = ca - (ca - a), al = a - ah;
    Doubles cb = doubles_set(0x8000001p0) * b, bh = cb - (cb - b), bl = b - bh;
    return ((ah * bh - p) + ah * bl + al * bh) + al * bl;
}

/* The power of two below or equal, of positive normal numbers; and 1 over it. */
static inline Doubles doubles_power(Doubles a, Doubles *reciprocal)
{
    __m128i e = _mm_and_si128(_mm_castpd_si128(a), _mm_set1_epi64x(0x7ff0000000000000));
    *reciprocal = _mm_castsi128_pd(_mm_sub_epi64(_mm_set1_epi64x(2046LL << 52), e));
    return _mm_castsi128_pd(e);
}

/* Two records of eight numbers each become eight fields. */
static inline void doubles_fields(const double *record, Doubles f[8])
{
    for (int k = 0; k < 8; k += 2) {
        Doubles a = _mm_loadu_pd(record + k), b = _mm_loadu_pd(record + 8 + k);
        f[k] = _mm_unpacklo_pd(a, b);
        f[k + 1] = _mm_unpackhi_pd(a, b);
    }
}

static inline uint32_t lanes_equal_int(LanesInt a, LanesInt b)
{
    return (uint32_t)_mm_movemask_ps(_mm_castsi128_ps(_mm_cmpeq_epi32(a, b)));
}

static inline void doubles_store(double *p, Doubles a) { _mm_storeu_pd(p, a); }

/* The numbers of the lanes in `bits`, moved together; what is after them in `to` may be anything. */
static inline void doubles_keep(double *to, const double *from, uint32_t bits)
{
    for (; bits; bits &= bits - 1) *to++ = from[__builtin_ctz(bits)];
}

/* Whole numbers as the bits of doubles. */
static inline Doubles doubles_of_ints(const uint32_t *p)
{
    return _mm_castsi128_pd(_mm_unpacklo_epi32(_mm_loadl_epi64((const __m128i *)p), _mm_setzero_si128()));
}

/* The numbers of a lane, one after the other, to the lane's place, `offset` bytes behind what is there. */
static inline void doubles_store_pairs(Hit *const *to, size_t offset, Doubles a, Doubles b)
{
    _mm_storeu_pd((double *)((char *)to[0] + offset), _mm_unpacklo_pd(a, b));
    _mm_storeu_pd((double *)((char *)to[1] + offset), _mm_unpackhi_pd(a, b));
}

static inline Doubles doubles_first(Doubles a) { return _mm_unpacklo_pd(a, a); }

/* Of sixteen numbers those with these indices. */
static inline Doubles doubles_chosen(const double *of, const uint32_t *index)
{
    return _mm_setr_pd(of[index[0]], of[index[1]]);
}

/* Two vectors of three from two places. */
static inline void doubles_gather(const double *const *p, Doubles *x, Doubles *y, Doubles *z)
{
    Doubles a = _mm_loadu_pd(p[0]), b = _mm_loadu_pd(p[1]);
    *x = _mm_unpacklo_pd(a, b);
    *y = _mm_unpackhi_pd(a, b);
    *z = _mm_setr_pd(p[0][2], p[1][2]);
}

#include "accel/stream_kernel.h"

const Kernel kernel_sse2 = {"sse2", intersect, occluded};
#endif
