/* Tests of the processors that a process may use, on copies of what Linux shows under /proc and /sys. */
#include <sched.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include <cmocka.h>

#include "common/cpu.h"

#define ROOT "build/test-tmp/cpu"

/* Writes a file below ROOT, and the folders it needs. */
static void put(const char *path, const char *text)
{
    char full[512];
    snprintf(full, sizeof full, ROOT "%s", path);
    for (char *slash = strchr(full, '/'); slash; slash = strchr(slash + 1, '/')) {
        *slash = '\0';
        mkdir(full, 0777);
        *slash = '/';
    }
    FILE *file = fopen(full, "w");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
}

static int start(void **state)
{
    (void)state;
    return system("rm -rf " ROOT);
}

static uint32_t quota(void) { return cpu_quota(ROOT); }

static void without_groups_there_is_no_quota(void **state)
{
    (void)state;
    assert_int_equal(quota(), UINT32_MAX);
    put("/proc/self/cgroup", "");
    assert_int_equal(quota(), UINT32_MAX);
    put("/proc/self/cgroup", "nonsense\n1:x\n0::/a\n");
    assert_int_equal(quota(), UINT32_MAX);
}

static void version_2_rounds_up(void **state)
{
    (void)state;
    put("/proc/self/cgroup", "0::/job\n");
    put("/sys/fs/cgroup/job/cpu.max", "250000 100000\n");
    assert_int_equal(quota(), 3);
    put("/sys/fs/cgroup/job/cpu.max", "200000 100000\n");
    assert_int_equal(quota(), 2);
    put("/sys/fs/cgroup/job/cpu.max", "1000 100000\n");
    assert_int_equal(quota(), 1);
    put("/sys/fs/cgroup/job/cpu.max", "max 100000\n");
    assert_int_equal(quota(), UINT32_MAX);
}

static void the_least_quota_of_the_groups_around_counts(void **state)
{
    (void)state;
    put("/proc/self/cgroup", "0::/a/b/c\n");
    put("/sys/fs/cgroup/a/b/c/cpu.max", "max 100000\n");
    put("/sys/fs/cgroup/a/b/cpu.max", "400000 100000\n");
    put("/sys/fs/cgroup/a/cpu.max", "600000 100000\n");
    assert_int_equal(quota(), 4);
    put("/sys/fs/cgroup/cpu.max", "150000 50000\n");
    assert_int_equal(quota(), 3);
}

static void a_path_of_the_host_leads_to_the_containers_group(void **state)
{
    (void)state;
    put("/proc/self/cgroup", "0::/system.slice/docker-0123.scope\n");
    put("/sys/fs/cgroup/cpu.max", "200000 100000\n");
    assert_int_equal(quota(), 2);
    put("/proc/self/cgroup", "0::/\n");
    assert_int_equal(quota(), 2);
}

static void version_1_is_read_too(void **state)
{
    (void)state;
    put("/proc/self/cgroup", "12:cpuset:/\n5:cpu,cpuacct:/job\n1:name=systemd:/job\n");
    put("/sys/fs/cgroup/cpu,cpuacct/job/cpu.cfs_quota_us", "550000\n");
    put("/sys/fs/cgroup/cpu,cpuacct/job/cpu.cfs_period_us", "100000\n");
    assert_int_equal(quota(), 6);
    put("/sys/fs/cgroup/cpu,cpuacct/job/cpu.cfs_quota_us", "-1\n");
    assert_int_equal(quota(), UINT32_MAX);
    put("/sys/fs/cgroup/cpu/cpu.cfs_quota_us", "50000\n");
    put("/sys/fs/cgroup/cpu/cpu.cfs_period_us", "100000\n");
    assert_int_equal(quota(), 1);
}

static void a_group_of_another_controller_has_no_quota(void **state)
{
    (void)state;
    put("/proc/self/cgroup", "5:cpuset:/job\n4:cpuacct,memory:/job\n");
    put("/sys/fs/cgroup/cpu/job/cpu.cfs_quota_us", "50000\n");
    put("/sys/fs/cgroup/cpu/job/cpu.cfs_period_us", "100000\n");
    assert_int_equal(quota(), UINT32_MAX);
}

static void affinity_is_respected(void **state)
{
    (void)state;
    cpu_set_t before, one;
    assert_int_equal(sched_getaffinity(0, sizeof before, &before), 0);
    assert_in_range(cpu_allowed(), 1, (uintmax_t)CPU_COUNT(&before));
    CPU_ZERO(&one);
    for (size_t i = 0; i < CPU_SETSIZE && CPU_COUNT(&one) == 0; i++)
        if (CPU_ISSET(i, &before)) CPU_SET(i, &one);
    assert_int_equal(sched_setaffinity(0, sizeof one, &one), 0);
    assert_int_equal(cpu_allowed(), 1);
    assert_int_equal(sched_setaffinity(0, sizeof before, &before), 0);
}

static void clocks_and_memory_go_up(void **state)
{
    (void)state;
    double wall = cpu_wall_s(), cpu = cpu_time_s();
    uint64_t peak = cpu_peak_bytes();
    size_t size = (size_t)64 << 20;
    volatile char *block = malloc(size);
    assert_non_null(block);
    for (size_t i = 0; i < size; i += 512) block[i] = 1;
    assert_true(cpu_peak_bytes() >= peak + size / 2);
    assert_true(cpu_wall_s() > wall && cpu_time_s() > cpu);
    free((void *)block);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(without_groups_there_is_no_quota, start),
        cmocka_unit_test_setup(version_2_rounds_up, start),
        cmocka_unit_test_setup(the_least_quota_of_the_groups_around_counts, start),
        cmocka_unit_test_setup(a_path_of_the_host_leads_to_the_containers_group, start),
        cmocka_unit_test_setup(version_1_is_read_too, start),
        cmocka_unit_test_setup(a_group_of_another_controller_has_no_quota, start),
        cmocka_unit_test(affinity_is_respected),
        cmocka_unit_test(clocks_and_memory_go_up),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
