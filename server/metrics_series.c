/*
 * metrics_series.c - the series of a registry: found by their labels, counted, observed.
 *
 * A series is kept under the values of its labels in a small hash table of its family. Series are
 * made when first counted and stay; their number is bounded (METRIC_SERIES_MAX) so that no client
 * can make the daemon hold, or a monitor store, more than the tables of routes, processes and
 * problems amount to.
 *
 * Counting takes no lock: a series is added at the head of its chain when it is complete, never
 * moves and never goes before the registry does, and its numbers are atomic. Lock: one mutex for
 * each family, to add a series; rank: innermost, nothing is called while it is held.
 */
#include "metrics_series.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#define LABEL_BYTES_MAX 512

struct metrics *metrics_create(void)
{
    struct metrics *metrics = calloc(1, sizeof *metrics);

    for (size_t i = 0; metrics && i < METRICS; i++) {
        (void)pthread_mutex_init(&metrics->of[i].mutex, NULL);
    }
    return metrics;
}

void metrics_destroy(struct metrics *metrics)
{
    if (!metrics) {
        return;
    }
    for (size_t i = 0; i < METRICS; i++) {
        for (size_t chain = 0; chain < METRIC_CHAINS; chain++) {
            while (metrics->of[i].chains[chain]) {
                struct series *series = metrics->of[i].chains[chain];

                metrics->of[i].chains[chain] = series->next;
                free(series);
            }
        }
        (void)pthread_mutex_destroy(&metrics->of[i].mutex);
    }
    free(metrics);
}

/* ---- Series ---------------------------------------------------------------------------------- */

/* The label values, each with its zero, into key; returns their length in all. Values that do not
   fit are cut. */
static size_t make_key(enum metric metric, const char *const *labels, char key[LABEL_BYTES_MAX])
{
    size_t length = 0;

    for (size_t i = 0; i < METRIC_LABELS_MAX && metric_families[metric].labels[i]; i++) {
        const char *value = labels && labels[i] ? labels[i] : "other";
        size_t room = (LABEL_BYTES_MAX - length) / (METRIC_LABELS_MAX - i);
        size_t n = strnlen(value, room - 1);

        memcpy(key + length, value, n);
        key[length + n] = '\0';
        length += n + 1;
    }
    return length;
}

/* FNV-1a. */
static size_t chain_of(const char *key, size_t length)
{
    uint32_t hash = 2166136261u;

    for (size_t i = 0; i < length; i++) {
        hash = (hash ^ (unsigned char)key[i]) * 16777619u;
    }
    return (hash ^ (hash >> 16)) % METRIC_CHAINS;
}

static struct series *look_up(struct metrics *metrics, enum metric metric, const char *key,
                              size_t length)
{
    struct series *series = atomic_load_explicit(&metrics->of[metric].chains[chain_of(key, length)],
                                                 memory_order_acquire);

    while (series && !(series->key_length == length && memcmp(series->key, key, length) == 0)) {
        series = series->next;
    }
    return series;
}

static struct series *add_series(struct metrics *metrics, enum metric metric, const char *key,
                                 size_t length)
{
    struct series *_Atomic *chain = &metrics->of[metric].chains[chain_of(key, length)];
    struct series *series = calloc(1, sizeof *series + length + 1);

    if (series) {
        memcpy(series->key, key, length);
        series->key_length = length;
        series->next = atomic_load_explicit(chain, memory_order_relaxed);
        atomic_store_explicit(chain, series, memory_order_release);
        metrics->of[metric].n_series++;
    }
    return series;
}

/* The series of these labels, made if it is new; NULL when memory is short. */
static struct series *find(struct metrics *metrics, enum metric metric, const char *const *labels)
{
    char key[LABEL_BYTES_MAX];
    size_t length = make_key(metric, labels, key);
    struct series *series = look_up(metrics, metric, key, length);

    if (series) {
        return series;
    }
    (void)pthread_mutex_lock(&metrics->of[metric].mutex);
    if (metrics->of[metric].n_series >= METRIC_SERIES_MAX) {
        length = make_key(metric, NULL, key);
    }
    series = look_up(metrics, metric, key, length);
    if (!series) {
        series = add_series(metrics, metric, key, length);
    }
    (void)pthread_mutex_unlock(&metrics->of[metric].mutex);
    return series;
}

static void add(_Atomic double *sum, double value)
{
    double before = atomic_load_explicit(sum, memory_order_relaxed);

    while (!atomic_compare_exchange_weak_explicit(sum, &before, before + value,
                                                  memory_order_relaxed, memory_order_relaxed)) {
    }
}

struct series *metrics_series(struct metrics *metrics, enum metric metric,
                              const char *const *labels)
{
    return metrics ? find(metrics, metric, labels) : NULL;
}

void series_add(struct series *series, double value)
{
    if (series) {
        add(&series->value, value);
    }
}

void metrics_add(struct metrics *metrics, enum metric metric, const char *const *labels,
                 double value)
{
    series_add(metrics_series(metrics, metric, labels), value);
}

void metrics_set(struct metrics *metrics, enum metric metric, const char *const *labels,
                 double value)
{
    struct series *series = metrics_series(metrics, metric, labels);

    if (series) {
        atomic_store_explicit(&series->value, value, memory_order_relaxed);
    }
}

double series_value(const struct series *series)
{
    const atomic_size_t *watched = atomic_load(&series->watched);

    return watched ? (double)atomic_load(watched) : atomic_load(&series->value);
}

void metrics_watch(struct metrics *metrics, enum metric metric, const atomic_size_t *counter)
{
    struct series *series = metrics_series(metrics, metric, NULL);

    if (series) {
        atomic_store(&series->value, series_value(series));
        atomic_store(&series->watched, counter);
    }
}

void series_observe(struct series *series, enum metric metric, double value)
{
    const double *bounds = metric_families[metric].bounds;
    size_t bucket = 0;

    if (!series || !bounds) {
        return;
    }
    while (bucket < METRIC_BOUNDS_MAX && bounds[bucket] > 0 && value > bounds[bucket]) {
        bucket++;
    }
    if (bucket < METRIC_BOUNDS_MAX && bounds[bucket] <= 0) {
        bucket = METRIC_BOUNDS_MAX;
    }
    add(&series->value, value);
    atomic_fetch_add_explicit(&series->bucket[bucket], 1, memory_order_relaxed);
}

void metrics_observe(struct metrics *metrics, enum metric metric, const char *const *labels,
                     double value)
{
    series_observe(metrics_series(metrics, metric, labels), metric, value);
}

uint64_t series_bucket(const struct series *series, size_t bucket)
{
    return atomic_load_explicit(&series->bucket[bucket], memory_order_relaxed);
}

double metrics_value(struct metrics *metrics, enum metric metric, const char *const *labels)
{
    char key[LABEL_BYTES_MAX];
    size_t length = make_key(metric, labels, key);
    const struct series *series = look_up(metrics, metric, key, length);
    double value = 0.0;

    if (series && metric_families[metric].bounds) {
        for (size_t i = 0; i <= METRIC_BOUNDS_MAX; i++) {
            value += (double)series_bucket(series, i);
        }
    } else if (series) {
        value = series_value(series);
    }
    return value;
}
