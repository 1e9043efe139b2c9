/*
 * encodings.c - encodings of meshes that earlier jobs have made, in the store.
 *
 * The name of one covers its owner (nobody learns from a fast answer what others have), the numeric
 * build, and what the caller says of its options.
 */
#include "jobs/internal.h"
#include "store/digest.h"
#include "store/encoding.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* 64 hex digits; false without memory. */
static bool name_of(const struct jobs_run *run, const char *mesh, const char *options,
                    char name[65])
{
    char *text = NULL;
    int length = asprintf(&text, "%s\n%s\n%s\n%s", jobs_run_owner(run), jobs_run_numeric_build(run),
                          mesh, options);

    if (length < 0) {
        return false;
    }
    store_sha256_hex(name, text, (size_t)length);
    free(text);
    return true;
}

bool jobs_run_encoding_recall(struct jobs_run *run, const char *mesh, const char *options,
                              size_t size_min, unsigned char **value, size_t *size)
{
    const struct jobs_config *config = &run->jobs->config;
    char name[65];
    bool found = config->kept_encodings > 0 && name_of(run, mesh, options, name) &&
                 store_encoding_get(config->store, name, value, size) == STORE_OK;

    if (found && *size < size_min) {
        free(*value);
        found = false;
    }
    metrics_add(config->metrics, METRIC_ENCODINGS, METRIC_LABELS(found ? "kept" : "made"), 1);
    return found;
}

void jobs_run_encoding_keep(struct jobs_run *run, const char *mesh, const char *sphere,
                            const char *options, const void *value, size_t size)
{
    const struct jobs_config *config = &run->jobs->config;
    char name[65];

    if (config->kept_encodings > 0 && name_of(run, mesh, options, name)) {
        (void)store_encoding_put(config->store, name, mesh, sphere, value, size,
                                 (int64_t)config->kept_encodings);
    }
}

void jobs_run_mesh_read(struct jobs_run *run, bool kept)
{
    metrics_add(run->jobs->config.metrics, METRIC_MESHES, METRIC_LABELS(kept ? "kept" : "made"), 1);
}
