/*
 * service.h - all that lives while the daemon serves.
 */
#ifndef SRNFD_MAIN_SERVICE_H
#define SRNFD_MAIN_SERVICE_H

#include <pthread.h>

#include "build.h"
#include "config.h"
#include "http/http.h"
#include "jobs/jobs.h"
#include "main/executor.h"

#define SERVICE_PROCESSES_MAX 64

/* In the order of its making. */
struct link {
    pthread_rwlock_t lock;
    struct http *http;
    struct slurm *slurm;
};

struct service {
    struct store *store;
    struct jobs *jobs;
    struct api *api;
    struct http *http;
    struct metrics *metrics;
    struct executor executor;
    struct slurm *slurm;
    struct link link;
    struct jobs_process table[SERVICE_PROCESSES_MAX];
    char numeric_build[BUILD_ID_SIZE];
    char faulty[STORE_ID_MAX]; /* the job that the last run died of */
};

/* Starts all layers; service is zeroed but for its lock. 0, or -1 with a sentence; service_stop in
   any case. */
int service_start(struct service *service, const struct config *config, char *message, size_t size);
void service_stop(struct service *service, double grace_seconds);

#endif
