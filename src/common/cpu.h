/* The machine: processors this process may use, clocks, memory. */
#ifndef RT_COMMON_CPU_H
#define RT_COMMON_CPU_H

#include <stdint.h>

/* Processors by affinity mask and cgroup quota (v1 and v2), at least 1. */
uint32_t cpu_allowed(void);

/* Processors by the quotas of the cgroups that this process is in, rounded up; UINT32_MAX without any. `root` goes in
 * front of /proc and /sys: "" but in tests. */
uint32_t cpu_quota(const char *root);

double cpu_wall_s(void);        /* monotonic clock */
double cpu_time_s(void);        /* user and system time of this process, all threads */
uint64_t cpu_peak_bytes(void);  /* greatest resident memory so far */

#endif
