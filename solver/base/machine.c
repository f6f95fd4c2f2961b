#include "solver/base/machine.h"

#include <limits.h>
#include <math.h>
#include <sched.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Limits of version 1 from this one on mean none: it counts in pages and cannot say "max". */
#define NO_LIMIT ((uint64_t)1 << 62)

/* A folder of a group under root, while its ancestors are walked. */
typedef struct group {
    const char *root;
    char path[PATH_MAX];
    size_t mount; /* length of the part that is no group's */
} group;

/* The first line of a file of a group that begins with these words; false when there is none. */
static bool read_line(const group *g, const char *file, const char *words, char *line, size_t size) {
    char path[2 * PATH_MAX];
    const int length = snprintf(path, sizeof path, "%s%s/%s", g->root, g->path, file);
    FILE *stream = length > 0 && (size_t)length < sizeof path ? fopen(path, "r") : NULL;
    bool found = false;
    if (stream == NULL) return false;
    while (!found && fgets(line, (int)size, stream) != NULL) found = strncmp(line, words, strlen(words)) == 0;
    fclose(stream);
    return found;
}

/* The number in a file; UINT64_MAX for "max", for -1 and without the file. */
static uint64_t read_number(const group *g, const char *file) {
    char line[64], *end;
    if (!read_line(g, file, "", line, sizeof line) || line[0] == '-') return UINT64_MAX;
    const unsigned long long value = strtoull(line, &end, 10);
    return end == line || value >= NO_LIMIT ? UINT64_MAX : (uint64_t)value;
}

static void limit_quota(machine *out, double time, double period) {
    if (time > 0 && period > 0) out->quota = fmin(out->quota, time / period);
}

/* *left: at most what `allowed` leaves beside `used`. */
static void limit_left(uint64_t allowed, uint64_t used, uint64_t *left) {
    const uint64_t rest = allowed > used ? allowed - used : 0;
    if (rest < *left) *left = rest;
}

/* Pages of files that were not read of late are given back before anything is refused. */
static void limit_memory(const group *g, const char *most_file, const char *used_file, const char *old_files,
                         machine *out) {
    char line[64];
    const uint64_t allowed = read_number(g, most_file);
    uint64_t used = read_number(g, used_file);
    unsigned long long old = 0;
    if (allowed == UINT64_MAX) return;
    if (used == UINT64_MAX) used = 0;
    if (read_line(g, "memory.stat", old_files, line, sizeof line))
        old = strtoull(line + strlen(old_files), NULL, 10);
    if (allowed < out->memory_most) out->memory_most = allowed;
    limit_left(allowed, used > old ? used - old : 0, &out->memory_left);
}

/* All limits of one folder, by the names of either version. */
static void read_group(const group *g, machine *out) {
    char line[64];
    double time, period;
    if (read_line(g, "cpu.max", "", line, sizeof line) && sscanf(line, "%lf %lf", &time, &period) == 2)
        limit_quota(out, time, period);
    const uint64_t quota = read_number(g, "cpu.cfs_quota_us"), every = read_number(g, "cpu.cfs_period_us");
    if (quota != UINT64_MAX && every != UINT64_MAX) limit_quota(out, (double)quota, (double)every);
    limit_memory(g, "memory.max", "memory.current", "inactive_file ", out);
    limit_memory(g, "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file ", out);
    const uint64_t tasks = read_number(g, "pids.max"), running = read_number(g, "pids.current");
    if (tasks != UINT64_MAX) limit_left(tasks, running != UINT64_MAX ? running : 0, &out->tasks_left);
}

/* A group and its ancestors, whose limits hold too. Inside a container the path may be that of the host, of
 * which only the top is there. */
static void read_groups(const char *root, const char *controllers, const char *path, machine *out) {
    group g = {.root = root};
    const int mount =
        snprintf(g.path, sizeof g.path, "/sys/fs/cgroup%s%s", *controllers != '\0' ? "/" : "", controllers);
    if (mount < 0 || (size_t)mount + strlen(path) >= sizeof g.path) return;
    g.mount = (size_t)mount;
    memcpy(g.path + g.mount, path, strlen(path) + 1);
    for (;;) {
        char *slash = strrchr(g.path + g.mount, '/');
        if (slash != NULL && slash[1] == '\0') *slash = '\0';
        read_group(&g, out);
        slash = strrchr(g.path + g.mount, '/');
        if (slash == NULL) break;
        *slash = '\0';
    }
}

/* Lines "4:memory:/path" of version 1, "0::/path" of version 2. */
static void read_cgroup_line(const char *root, char *line, machine *out) {
    char *controllers = strchr(line, ':'), *path = controllers != NULL ? strchr(controllers + 1, ':') : NULL;
    if (path == NULL) return;
    *path++ = '\0';
    path[strcspn(path, "\n")] = '\0';
    controllers++;
    if (path[0] != '/' || strncmp(controllers, "name=", 5) == 0) return;
    read_groups(root, controllers, path, out);
    if (*controllers == '\0') read_groups(root, "unified", path, out); /* beside those of version 1 */
    /* A folder of several controllers has a link for each of them. */
    char *rest = NULL;
    for (char *name = strtok_r(controllers, ",", &rest); name != NULL; name = strtok_r(NULL, ",", &rest))
        read_groups(root, name, path, out);
}

static size_t processors_of_process(size_t otherwise) {
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof set, &set) != 0) return otherwise;
    return (size_t)CPU_COUNT(&set);
}

void machine_read(const char *root, machine *out) {
    char line[PATH_MAX];
    const long online = sysconf(_SC_NPROCESSORS_ONLN);
    *out = (machine){.processors = online > 0 ? (size_t)online : 1,
                     .quota = (double)INFINITY,
                     .tasks_left = UINT64_MAX,
                     .memory_most = UINT64_MAX,
                     .memory_left = UINT64_MAX};
    out->own = processors_of_process(out->processors);
    snprintf(line, sizeof line, "%s/proc/self/cgroup", root);
    FILE *stream = fopen(line, "r");
    if (stream == NULL) return;
    while (fgets(line, sizeof line, stream) != NULL) read_cgroup_line(root, line, out);
    fclose(stream);
}

size_t machine_threads(const machine *m, size_t beside, char *why, size_t why_size) {
    size_t threads = m->processors;
    snprintf(why, why_size, "%s", "");
    if (m->own < threads) {
        threads = m->own;
        snprintf(why, why_size, "the process may run on %zu of %zu processors", m->own, m->processors);
    }
    if (ceil(m->quota) < (double)threads) {
        threads = m->quota > 1 ? (size_t)ceil(m->quota) : 1;
        snprintf(why, why_size, "its control group has the time of %.4g processors", m->quota);
    }
    if (m->tasks_left < threads + beside) {
        threads = m->tasks_left > beside + 1 ? (size_t)m->tasks_left - beside : 1;
        snprintf(why, why_size, "its control group may start %llu more threads",
                 (unsigned long long)m->tasks_left);
    }
    return threads > 0 ? threads : 1;
}
