#include "common/cpu.h"

#include <errno.h>
#include <sched.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

enum { MAX_PROCESSORS = 1 << 20, PATH_ROOM = 4096, TEXT_ROOM = 16384 };

/* The affinity mask is as long as the kernel's, which may be longer than cpu_set_t. */
static uint32_t by_affinity(void)
{
    for (size_t n = CPU_SETSIZE; n <= MAX_PROCESSORS; n *= 2) {
        cpu_set_t *set = CPU_ALLOC(n);
        if (!set) break;
        bool ok = sched_getaffinity(0, CPU_ALLOC_SIZE(n), set) == 0;
        bool too_short = !ok && errno == EINVAL;
        int count = ok ? CPU_COUNT_S(CPU_ALLOC_SIZE(n), set) : 0;
        CPU_FREE(set);
        if (count > 0) return (uint32_t)count;
        if (!too_short) break;
    }
    long online = sysconf(_SC_NPROCESSORS_ONLN);
    return online > 0 ? (uint32_t)online : 1;
}

/* The beginning of a file as a string; false if it can't be read. */
static bool read_text(const char *path, char *text, size_t room)
{
    FILE *file = fopen(path, "re");
    if (!file) return false;
    size_t n = fread(text, 1, room - 1, file);
    bool ok = !ferror(file);
    fclose(file);
    text[n] = '\0';
    return ok;
}

static bool read_number(const char *path, double *number)
{
    char text[64], *end;
    if (!read_text(path, text, sizeof text)) return false;
    *number = strtod(text, &end);
    return end != text;
}

/* Processors that one group may use: time allowed per period of time, rounded up; UINT32_MAX without a quota. */
static uint32_t quota_processors(double quota, double period)
{
    if (!(quota > 0 && period > 0)) return UINT32_MAX;
    double n = quota / period;
    if (n >= MAX_PROCESSORS) return UINT32_MAX;
    uint32_t whole = (uint32_t)n;
    return whole < n ? whole + 1 : whole;
}

static uint32_t quota_v2(const char *folder)
{
    char path[PATH_ROOM], text[64];
    double quota, period = 100000;
    if ((size_t)snprintf(path, sizeof path, "%s/cpu.max", folder) >= sizeof path) return UINT32_MAX;
    if (!read_text(path, text, sizeof text) || sscanf(text, "%lf %lf", &quota, &period) < 1) return UINT32_MAX;
    return quota_processors(quota, period);
}

static uint32_t quota_v1(const char *folder)
{
    char path[PATH_ROOM];
    double quota, period;
    if ((size_t)snprintf(path, sizeof path, "%s/cpu.cfs_quota_us", folder) >= sizeof path) return UINT32_MAX;
    if (!read_number(path, &quota)) return UINT32_MAX;
    if ((size_t)snprintf(path, sizeof path, "%s/cpu.cfs_period_us", folder) >= sizeof path) return UINT32_MAX;
    if (!read_number(path, &period)) return UINT32_MAX;
    return quota_processors(quota, period);
}

/* The least quota of a group and of those that it lies in. Within a container the group's path may be the host's; what
 * can't be read has no quota then, and the mount point itself is the container's group. */
static uint32_t least_quota(const char *mount, const char *group, uint32_t (*quota)(const char *folder))
{
    char folder[PATH_ROOM];
    uint32_t least = UINT32_MAX;
    if ((size_t)snprintf(folder, sizeof folder, "%s%s", mount, group) >= sizeof folder) return least;
    size_t mount_length = strlen(mount);
    for (;;) {
        uint32_t n = quota(folder);
        if (n < least) least = n;
        char *slash = strrchr(folder, '/');
        if (!slash || (size_t)(slash - folder) < mount_length) return least;
        *slash = '\0';
    }
}

/* Whether "cpu" is one of the names in a list parted by commas. */
static bool lists_cpu(const char *controllers)
{
    for (const char *name = controllers; *name;) {
        size_t length = strcspn(name, ",");
        if (length == 3 && memcmp(name, "cpu", 3) == 0) return true;
        name += length + (name[length] == ',');
    }
    return false;
}

/* One line of /proc/self/cgroup: "0::/group" (version 2) or "4:cpu,cpuacct:/group" (version 1). */
static uint32_t line_quota(const char *root, char *line)
{
    char mount[PATH_ROOM];
    char *controllers = strchr(line, ':');
    char *group = controllers ? strchr(controllers + 1, ':') : NULL;
    if (!group) return UINT32_MAX;
    controllers++;
    *group++ = '\0';
    if (strcmp(group, "/") == 0) group++;
    if (!*controllers) {
        snprintf(mount, sizeof mount, "%s/sys/fs/cgroup", root);
        uint32_t n = least_quota(mount, group, quota_v2);
        snprintf(mount, sizeof mount, "%s/sys/fs/cgroup/unified", root);
        uint32_t hybrid = least_quota(mount, group, quota_v2);
        return n < hybrid ? n : hybrid;
    }
    if (!lists_cpu(controllers)) return UINT32_MAX;
    snprintf(mount, sizeof mount, "%s/sys/fs/cgroup/%s", root, controllers);
    uint32_t n = least_quota(mount, group, quota_v1);
    snprintf(mount, sizeof mount, "%s/sys/fs/cgroup/cpu", root);
    uint32_t plain = least_quota(mount, group, quota_v1);
    return n < plain ? n : plain;
}

uint32_t cpu_quota(const char *root)
{
    char path[PATH_ROOM], text[TEXT_ROOM], *rest = text;
    if ((size_t)snprintf(path, sizeof path, "%s/proc/self/cgroup", root) >= sizeof path) return UINT32_MAX;
    if (!read_text(path, text, sizeof text)) return UINT32_MAX;
    uint32_t least = UINT32_MAX;
    for (char *line; (line = strsep(&rest, "\n"));) {
        uint32_t n = line_quota(root, line);
        if (n < least) least = n;
    }
    return least;
}

uint32_t cpu_allowed(void)
{
    uint32_t affinity = by_affinity(), quota = cpu_quota("");
    return affinity < quota ? affinity : quota;
}

static double clock_s(clockid_t clock)
{
    struct timespec t;
    return clock_gettime(clock, &t) == 0 ? (double)t.tv_sec + (double)t.tv_nsec * 1e-9 : 0;
}

double cpu_wall_s(void) { return clock_s(CLOCK_MONOTONIC); }

double cpu_time_s(void) { return clock_s(CLOCK_PROCESS_CPUTIME_ID); }

/* The kernel's VmHWM is this program's own; getrusage also knows the peak of the process that started it. */
uint64_t cpu_peak_bytes(void)
{
    char text[TEXT_ROOM];
    unsigned long long kilobytes;
    const char *line = read_text("/proc/self/status", text, sizeof text) ? strstr(text, "\nVmHWM:") : NULL;
    if (line && sscanf(line, "\nVmHWM: %llu kB", &kilobytes) == 1) return (uint64_t)kilobytes * 1024;
    struct rusage usage;
    return getrusage(RUSAGE_SELF, &usage) == 0 ? (uint64_t)usage.ru_maxrss * 1024 : 0;
}
