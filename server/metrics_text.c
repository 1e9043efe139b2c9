/*
 * metrics_text.c - what was counted, in the text format of Prometheus (version 0.0.4).
 */
#include "metrics_series.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const kind_names[] = {"counter", "gauge", "histogram"};

/* A label's value: backslash, quote and newline are escaped. */
static void put_escaped(FILE *out, const char *value)
{
    for (; *value; value++) {
        if (*value == '\\' || *value == '"') {
            (void)fputc('\\', out);
        }
        if (*value == '\n') {
            (void)fputs("\\n", out);
        } else {
            (void)fputc(*value, out);
        }
    }
}

/* {route="/healthz",le="0.1"}, or nothing; bound NULL: without le. */
static void put_labels(FILE *out, const struct metric_family *family, const struct series *series,
                       const char *bound)
{
    const char *value = series->key;
    const char *separator = "{";

    for (size_t i = 0; i < METRIC_LABELS_MAX && family->labels[i]; i++) {
        (void)fprintf(out, "%s%s=\"", separator, family->labels[i]);
        put_escaped(out, value);
        (void)fputc('"', out);
        value += strlen(value) + 1;
        separator = ",";
    }
    if (bound) {
        (void)fprintf(out, "%sle=\"%s\"", separator, bound);
        separator = ",";
    }
    if (separator[0] == ',') {
        (void)fputc('}', out);
    }
}

static void put_histogram(FILE *out, const struct metric_family *family,
                          const struct series *series)
{
    uint64_t cumulated = 0;
    char bound[32];

    for (size_t i = 0; i < METRIC_BOUNDS_MAX && family->bounds[i] > 0; i++) {
        cumulated += series_bucket(series, i);
        (void)snprintf(bound, sizeof bound, "%.15g", family->bounds[i]);
        (void)fprintf(out, "%s_bucket", family->name);
        put_labels(out, family, series, bound);
        (void)fprintf(out, " %llu\n", (unsigned long long)cumulated);
    }
    cumulated += series_bucket(series, METRIC_BOUNDS_MAX);
    (void)fprintf(out, "%s_bucket", family->name);
    put_labels(out, family, series, "+Inf");
    (void)fprintf(out, " %llu\n%s_sum", (unsigned long long)cumulated, family->name);
    put_labels(out, family, series, NULL);
    (void)fprintf(out, " %.15g\n%s_count", atomic_load(&series->value), family->name);
    put_labels(out, family, series, NULL);
    (void)fprintf(out, " %llu\n", (unsigned long long)cumulated);
}

static void put_family(FILE *out, struct metrics *metrics, enum metric metric)
{
    const struct metric_family *family = &metric_families[metric];

    (void)fprintf(out, "# HELP %s %s\n# TYPE %s %s\n", family->name, family->help, family->name,
                  kind_names[family->kind]);
    for (size_t chain = 0; chain < METRIC_CHAINS; chain++) {
        const struct series *series = metrics->of[metric].chains[chain];

        for (; series; series = series->next) {
            if (family->bounds) {
                put_histogram(out, family, series);
                continue;
            }
            (void)fputs(family->name, out);
            put_labels(out, family, series, NULL);
            (void)fprintf(out, " %.15g\n", series_value(series));
        }
    }
}

char *metrics_text(struct metrics *const *registries, size_t count, size_t *size)
{
    char *text = NULL;
    FILE *out = open_memstream(&text, size);
    bool written = false;

    if (!out) {
        return NULL;
    }
    for (int metric = 0; metric < METRICS; metric++) {
        bool done = false;

        for (size_t i = 0; i < count && !done; i++) {
            (void)pthread_mutex_lock(&registries[i]->of[metric].mutex);
            if (registries[i]->of[metric].n_series > 0) {
                put_family(out, registries[i], (enum metric)metric);
                done = true;
            }
            (void)pthread_mutex_unlock(&registries[i]->of[metric].mutex);
        }
    }
    written = !ferror(out);
    if (fclose(out) != 0 || !written) {
        free(text);
        text = NULL;
    }
    return text;
}
