/* Double-double arithmetic: a value as the unevaluated sum hi + lo, |lo| <= ulp(hi) / 2, about 106 bits.
 * Error-free transformations of Dekker 1971, Knuth and Moller; sums and products as in Joldes, Muller, Popescu 2017.
 * Exact as long as nothing overflows (inputs of a product below 2^995) and no low part underflows. */
#ifndef RT_COMMON_DD_H
#define RT_COMMON_DD_H

#include <math.h>

typedef struct { double hi, lo; } Dd;

/* u^2 of double-double, with the slack that its sums, products, quotients and roots need: relative error of each. */
#define DD_ROUNDOFF 0x1p-102

/* a + b exactly; |a| >= |b| or a = 0. */
static inline Dd dd_quick_sum(double a, double b)
{
    double s = a + b;
    return (Dd){s, b - (s - a)};
}

/* a + b exactly. */
static inline Dd dd_sum(double a, double b)
{
    double s = a + b, bb = s - a;
    return (Dd){s, (a - (s - bb)) + (b - bb)};
}

/* a * b exactly. Where the processor's fma isn't known at compile time, a call of fma() costs more than Dekker's
 * product; both are exact, so the result is the same. */
static inline Dd dd_prod(double a, double b)
{
    double p = a * b;
#if defined(FP_FAST_FMA) || defined(__FMA__)
    return (Dd){p, fma(a, b, -p)};
#else
    double ca = 0x8000001p0 * a, ah = ca - (ca - a), al = a - ah;
    double cb = 0x8000001p0 * b, bh = cb - (cb - b), bl = b - bh;
    return (Dd){p, ((ah * bh - p) + ah * bl + al * bh) + al * bl};
#endif
}

static inline Dd dd_neg(Dd a) { return (Dd){-a.hi, -a.lo}; }

static inline Dd dd_add(Dd a, Dd b)
{
    Dd s = dd_sum(a.hi, b.hi), t = dd_sum(a.lo, b.lo);
    s = dd_quick_sum(s.hi, s.lo + t.hi);
    return dd_quick_sum(s.hi, s.lo + t.lo);
}

static inline Dd dd_sub(Dd a, Dd b) { return dd_add(a, dd_neg(b)); }
static inline Dd dd_add_d(Dd a, double b) { return dd_add(a, (Dd){b, 0}); }

static inline Dd dd_mul(Dd a, Dd b)
{
    Dd p = dd_prod(a.hi, b.hi);
    return dd_quick_sum(p.hi, p.lo + (a.hi * b.lo + a.lo * b.hi));
}

static inline Dd dd_mul_d(Dd a, double b)
{
    Dd p = dd_prod(a.hi, b);
    return dd_quick_sum(p.hi, p.lo + a.lo * b);
}

/* b must not be 0. A quotient that overflows is infinite. */
static inline Dd dd_div(Dd a, Dd b)
{
    double q = a.hi / b.hi;
    if (!isfinite(q) || q == 0) return (Dd){q, 0};
    Dd r = dd_sub(a, dd_mul_d(b, q));
    return dd_quick_sum(q, r.hi / b.hi);
}

/* a >= 0. */
static inline Dd dd_sqrt(Dd a)
{
    if (!(a.hi > 0)) return (Dd){0, 0};
    double s = sqrt(a.hi);
    Dd r = dd_sub(a, dd_prod(s, s));
    return dd_quick_sum(s, r.hi / (2 * s));
}

static inline double dd_round(Dd a) { return a.hi + a.lo; }

#endif
