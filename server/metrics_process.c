/*
 * metrics_process.c - the process_* families, by the names that Prometheus clients use everywhere,
 * read from /proc/self when asked for. What cannot be read is left out.
 */
#include "metrics.h"

#include <dirent.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

/* Fields of /proc/self/stat (proc(5)), counted from the one after the command's closing bracket,
   which is the third. */
enum { STAT_UTIME = 14, STAT_STIME = 15, STAT_THREADS = 20, STAT_START = 22, STAT_VSIZE = 23 };
#define STAT_RSS 24
#define STAT_FIELDS 25

static bool read_text(const char *path, char *text, size_t size)
{
    FILE *file = fopen(path, "re");
    size_t length = file ? fread(text, 1, size - 1, file) : 0;

    text[length] = '\0';
    if (file) {
        (void)fclose(file);
    }
    return length > 0;
}

/* Seconds since the epoch at which the machine was started; 0 where that is unknown. */
static double boot_time(void)
{
    FILE *file = fopen("/proc/stat", "re");
    double seconds = 0.0;
    char *line = NULL;
    size_t size = 0;

    while (file && seconds == 0.0 && getline(&line, &size, file) > 0) {
        if (strncmp(line, "btime ", 6) == 0) {
            seconds = strtod(line + 6, NULL);
        }
    }
    free(line);
    if (file) {
        (void)fclose(file);
    }
    return seconds;
}

static void set_from_stat(struct metrics *metrics)
{
    double fields[STAT_FIELDS] = {0.0}, ticks = (double)sysconf(_SC_CLK_TCK), boot = boot_time();
    char text[1024], *at;

    if (!read_text("/proc/self/stat", text, sizeof text)) {
        return;
    }
    at = strrchr(text, ')');
    if (!at || strlen(at) < 4) {
        return;
    }
    at += 3; /* over the bracket, a space and the state */
    for (int i = 4; i < STAT_FIELDS; i++) {
        fields[i] = strtod(at, &at);
    }
    metrics_set(metrics, METRIC_PROCESS_CPU_SECONDS, NULL,
                (fields[STAT_UTIME] + fields[STAT_STIME]) / ticks);
    metrics_set(metrics, METRIC_PROCESS_THREADS, NULL, fields[STAT_THREADS]);
    metrics_set(metrics, METRIC_PROCESS_VIRTUAL, NULL, fields[STAT_VSIZE]);
    metrics_set(metrics, METRIC_PROCESS_RESIDENT, NULL,
                fields[STAT_RSS] * (double)sysconf(_SC_PAGESIZE));
    if (boot > 0) {
        metrics_set(metrics, METRIC_PROCESS_START_SECONDS, NULL, boot + fields[STAT_START] / ticks);
    }
}

static void set_descriptors(struct metrics *metrics)
{
    struct rlimit limit;
    DIR *folder = opendir("/proc/self/fd");
    double count = -3; /* itself, and the two names of every folder */

    if (getrlimit(RLIMIT_NOFILE, &limit) == 0) {
        metrics_set(metrics, METRIC_PROCESS_MAX_FDS, NULL, (double)limit.rlim_cur);
    }
    if (!folder) {
        return;
    }
    while (readdir(folder)) {
        count++;
    }
    (void)closedir(folder);
    metrics_set(metrics, METRIC_PROCESS_OPEN_FDS, NULL, count);
}

void metrics_set_process(struct metrics *metrics)
{
    set_from_stat(metrics);
    set_descriptors(metrics);
}
