/* Packets with the vector instructions that every machine of this kind has: SSE2 on x86-64. */
#define PACKET_LANES 4

#include "accel/packet_kernel.h"

const Kernel kernel_packet = {"packet", intersect, occluded};
