/*
 * machine.c - how much memory there is to share among jobs: what the system tells of the machine,
 * the limits of the control groups (version 2) that the daemon runs in, such as MemoryMax of its
 * unit or the memory of a container, and that of its address space (ulimit -v), as batch systems
 * set it.
 */
#include "jobs/memory.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

#define PATH_BYTES 4096
#define UPLOADS_LEAST ((size_t)384 << 20)
#define UNKNOWN_MEMORY ((size_t)1 << 30) /* where the system does not tell */

/* The path of the control group, from its root, "" for the root itself; false: there is none. */
static bool read_group(const char *self, char path[PATH_BYTES])
{
    FILE *file = fopen(self, "re");
    bool found = false;

    while (file && !found && fgets(path, PATH_BYTES, file)) {
        found = strncmp(path, "0::/", 4) == 0;
    }
    if (file) {
        (void)fclose(file);
    }
    if (found) {
        memmove(path, path + 3, strlen(path + 3) + 1);
        path[strcspn(path, "\n")] = '\0';
    }
    if (found && strcmp(path, "/") == 0) {
        path[0] = '\0';
    }
    return found;
}

/* memory.max of one group; SIZE_MAX where there is none, or no such group. */
static size_t group_limit(const char *groups, const char *path)
{
    char name[2 * PATH_BYTES], text[32] = "";
    unsigned long long bytes = 0;
    FILE *file;
    char *end;

    (void)snprintf(name, sizeof name, "%s%s/memory.max", groups, path);
    file = fopen(name, "re");
    if (!file) {
        return SIZE_MAX;
    }
    if (fgets(text, sizeof text, file)) {
        bytes = strtoull(text, &end, 10);
        bytes = end == text ? 0 : bytes; /* "max" */
    }
    (void)fclose(file);
    return bytes > 0 && bytes < SIZE_MAX ? (size_t)bytes : SIZE_MAX;
}

size_t jobs_group_memory(const char *self, const char *groups)
{
    char path[PATH_BYTES];
    size_t least = SIZE_MAX;

    if (!read_group(self, path)) {
        return SIZE_MAX;
    }
    for (bool more = true; more;) {
        size_t limit = group_limit(groups, path);
        char *last = strrchr(path, '/');

        least = limit < least ? limit : least;
        more = last != NULL;
        if (last) {
            *last = '\0';
        }
    }
    return least;
}

size_t jobs_machine_memory(void)
{
    long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
    size_t machine = pages > 0 && page > 0 ? (size_t)pages * (size_t)page : UNKNOWN_MEMORY;
    size_t group = jobs_group_memory("/proc/self/cgroup", "/sys/fs/cgroup");
    struct rlimit space;

    machine = group < machine ? group : machine;
    if (getrlimit(RLIMIT_AS, &space) == 0 && space.rlim_cur < machine) { /* infinity is above */
        machine = (size_t)space.rlim_cur;
    }
    return machine;
}

size_t jobs_memory_share(size_t workers)
{
    return jobs_machine_memory() / 4 * 3 / (workers > 0 ? workers : 1);
}

size_t jobs_memory_of_uploads(void)
{
    size_t part = jobs_machine_memory() / 8;

    return part > UPLOADS_LEAST ? part : UPLOADS_LEAST;
}
