/*
 * metrics_series.h - the families and their series, as the files of the metrics share them.
 */
#ifndef SRNFD_METRICS_SERIES_H
#define SRNFD_METRICS_SERIES_H

#include "metrics.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdint.h>

#define METRIC_CHAINS 64 /* of the hash table of one family */
#define METRIC_BOUNDS_MAX 14

enum metric_kind { KIND_COUNTER, KIND_GAUGE, KIND_HISTOGRAM };

struct metric_family {
    enum metric_kind kind;
    const char *name, *help;
    const char *labels[METRIC_LABELS_MAX]; /* NULL: no more */
    const double *bounds;                  /* of a histogram: upper ones, ended by 0 */
};

extern const struct metric_family metric_families[METRICS];

struct series {
    struct series *next;                  /* of its chain */
    _Atomic double value;                 /* of a histogram: the sum */
    const atomic_size_t *_Atomic watched; /* holds the value in its place; may be NULL */
    /* Observations, not cumulated; last: the rest. */
    atomic_uint_least64_t bucket[METRIC_BOUNDS_MAX + 1];
    size_t key_length;
    char key[]; /* the label values, each with its zero */
};

struct metrics {
    struct {
        pthread_mutex_t mutex;
        struct series *_Atomic chains[METRIC_CHAINS];
        size_t n_series;
    } of[METRICS];
};

/* The number of a series that is no histogram. */
double series_value(const struct series *series);
/* The observations of one bucket of a histogram. */
uint64_t series_bucket(const struct series *series, size_t bucket);

#endif
