/*
 * metrics.h - what the daemon counts of itself, for GET /metrics: one table of families, each with
 * its labels, and the Prometheus text format (version 0.0.4) of what was counted.
 *
 * A registry is shared by all layers; every function may be called from any thread, and with NULL
 * for a registry, which does nothing. Values that are known only when asked for (sizes, lengths)
 * are set in a registry of their own, made for one answer.
 */
#ifndef SRNFD_METRICS_H
#define SRNFD_METRICS_H

#include <stdatomic.h>
#include <stddef.h>

struct metrics;

/* The families, in the order of the table in metrics.c and of the output. */
enum metric {
    METRIC_BUILD_INFO,            /* version, numeric_build */
    METRIC_HTTP_REQUESTS,         /* route, method, status */
    METRIC_HTTP_SECONDS,          /* route */
    METRIC_HTTP_RECEIVED,         /* bytes of bodies */
    METRIC_HTTP_SENT,             /* bytes of bodies */
    METRIC_HTTP_REFUSALS,         /* code */
    METRIC_HTTP_ACCEPTED,         /* connections */
    METRIC_HTTP_CONNECTIONS,      /* place: waiting, serving */
    METRIC_HTTP_CONNECTIONS_MAX,  /* place */
    METRIC_HTTP_CUT,              /* reason: late, abandoned, crowded, displaced */
    METRIC_HTTP_IN_PROGRESS,      /* requests */
    METRIC_HTTP_STREAMS,          /* of server-sent events */
    METRIC_HTTP_BUFFERED,         /* bytes of bodies held at this moment */
    METRIC_UPLOAD_MEMORY,         /* bytes that reading bodies has in use */
    METRIC_UPLOAD_MEMORY_LIMIT,   /* bytes */
    METRIC_JOBS_SUBMITTED,        /* process, how: new, joined, cached */
    METRIC_JOBS_ENDED,            /* process, status */
    METRIC_JOB_SECONDS,           /* process */
    METRIC_JOB_WAIT_SECONDS,      /* process */
    METRIC_JOB_MEMORY,            /* process */
    METRIC_JOB_MEMORY_LIMIT,      /* bytes */
    METRIC_ENCODINGS,             /* source: made, kept */
    METRIC_MESHES,                /* source: made, kept */
    METRIC_JOBS,                  /* process, status: accepted, running */
    METRIC_QUEUE_LENGTH,          /* accepted jobs */
    METRIC_QUEUE_AGE,             /* seconds that the oldest accepted job has waited */
    METRIC_WORKERS,               /* worker threads */
    METRIC_WORKERS_BUSY,          /* those with a job of their own */
    METRIC_EXPRESS,               /* threads for short jobs, beside them */
    METRIC_EXPRESS_BUSY,          /* those with a job */
    METRIC_TASKS,                 /* kind, event: leased, done, lost, returned */
    METRIC_TASK_SECONDS,          /* kind: of leases that ended with a result */
    METRIC_TASK_BYTES,            /* kind, part: contents, results */
    METRIC_TASKS_LEASED,          /* at this moment */
    METRIC_REMOTE_WORKERS,        /* processes on other machines, or on this one */
    METRIC_PILOTS,                /* state: pending, running */
    METRIC_STORE_BYTES,           /* part: database, wal, blobs */
    METRIC_STORE_FREE,            /* bytes free on the file system */
    METRIC_LOG_DROPPED,           /* lines */
    METRIC_PROCESS_CPU_SECONDS,   /* of all threads */
    METRIC_PROCESS_RESIDENT,      /* bytes */
    METRIC_PROCESS_VIRTUAL,       /* bytes */
    METRIC_PROCESS_OPEN_FDS,      /* descriptors */
    METRIC_PROCESS_MAX_FDS,       /* their limit */
    METRIC_PROCESS_THREADS,       /* threads */
    METRIC_PROCESS_START_SECONDS, /* since the epoch */
    METRICS
};

#define METRIC_LABELS_MAX 3
#define METRIC_SERIES_MAX 2000 /* of one family; what comes beyond is counted under "other" */

/* Label values, in the order of the family's labels. */
#define METRIC_LABELS(...) ((const char *const[METRIC_LABELS_MAX]){__VA_ARGS__})

/* One combination of label values of a family; it stays as long as the registry. */
struct series;

/* NULL when memory is short. */
struct metrics *metrics_create(void);
void metrics_destroy(struct metrics *metrics);

/* Adds to a counter, or to a gauge, where value may be negative. labels: METRIC_LABELS(..), or NULL
   for a family without. A new series that there is no memory for is not counted. */
void metrics_add(struct metrics *metrics, enum metric metric, const char *const *labels,
                 double value);
void metrics_set(struct metrics *metrics, enum metric metric, const char *const *labels,
                 double value);
/* From now on the gauge, of a family without labels, is what the counter holds when it is asked
   for; NULL: what it held last stays. The caller keeps the counter until then. */
void metrics_watch(struct metrics *metrics, enum metric metric, const atomic_size_t *counter);
/* One observation of a histogram, in its unit: seconds or bytes. */
void metrics_observe(struct metrics *metrics, enum metric metric, const char *const *labels,
                     double value);

/* The series itself, for who counts in it again and again; NULL when memory is short, or metrics is
   NULL. The two below are metrics_add and metrics_observe without the search; NULL does nothing. */
struct series *metrics_series(struct metrics *metrics, enum metric metric,
                              const char *const *labels);
void series_add(struct series *series, double value);
void series_observe(struct series *series, enum metric metric, double value);

/* The value of a counter or gauge, or the number of observations; 0 for what was never counted. */
double metrics_value(struct metrics *metrics, enum metric metric, const char *const *labels);

/* The text of all families that have series in one of the registries, each family once (that of
   the first registry which has it). malloc; NULL when memory is short. */
char *metrics_text(struct metrics *const *registries, size_t count, size_t *size);

/* Sets the process_* families from /proc/self. */
void metrics_set_process(struct metrics *metrics);

#endif
