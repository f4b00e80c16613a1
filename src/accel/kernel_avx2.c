/* Packets with AVX2 and FMA. Everything below is compiled for them; the kernel runs only where the processor has both. No
 * product and sum are fused but on purpose (-ffp-contract=off): in the float filter, and where a product is to be exact.
 * Hits are decided by the same values in double as in any other kernel. */
#if defined(__x86_64__)
#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx2,fma"))), apply_to = function)
#else
#pragma GCC target("avx2,fma")
#endif

#define PACKET_LANES 8

#include "accel/packet_kernel.h"

const Kernel kernel_avx2 = {"avx2", intersect, occluded};

#if defined(__clang__)
#pragma clang attribute pop
#endif
#endif
