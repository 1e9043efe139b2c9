/*
 * imports_jobs.c - jobs of an export, each held against its record in the manifest.
 *
 * Results cannot be checked without computing them again: they become answers for their owner
 * alone. What tables are made of them must fit together.
 */
#include "api/imports.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/auth.h"
#include "api/labels.h"
#include "api/study.h"
#include "jobs/submit.h"
#include "store/batch.h"
#include "store/job.h"

static bool is_job_id(const char *id)
{
    return strncmp(id, "job-", 4) == 0 && strlen(id) == 40 &&
           strspn(id + 4, "0123456789abcdef-") == 36;
}

/* Whether process, numeric build and inputs have the digest of the manifest. */
static bool is_asked_unchanged(const json_t *record, const struct store_job *job)
{
    const json_t *wanted = json_object_get(record, "askedSha256");
    char digest[65];

    study_job_digest(digest, job->process, job->numeric_build, job->inputs);
    return !wanted || (json_is_string(wanted) && strcmp(json_string_value(wanted), digest) == 0);
}

/* Whether the table that the process makes of results can be made of these. */
static bool fits_table(struct import *import, const char *name, const json_t *results)
{
    const struct api_process *process = api_process_find(import->call->api, name);
    char why[API_WHY_MAX];

    if (!process->table_fits || process->table_fits(results, why)) {
        return true;
    }
    memcpy(import->why, why, sizeof why);
    return false;
}

bool import_restore_job(struct import *import, const json_t *record, const char *id,
                        const struct import_given *given, int *status)
{
    const struct store_owner owner = call_owner(import->call);
    struct store_job job = {.process = import_text(record, "process"),
                            .inputs = import_text(record, "inputs"),
                            .numeric_build = import_text(record, "numericBuild")};
    json_t *results = json_loadb((const char *)given->bytes, given->size, 0, NULL);
    struct problem_list list = {.errors = NULL};
    struct labels labels;
    bool good, lacking;

    import_read_labels(record, true, &labels, &list);
    job.name = labels.change.name ? strdup(labels.change.name) : NULL;
    job.tags = labels.change.tags ? strdup(labels.change.tags) : NULL;
    lacking = (labels.change.name && !job.name) || (labels.change.tags && !job.tags);
    good = !list.errors && is_job_id(id) && job.process && job.inputs && job.numeric_build &&
           is_asked_unchanged(record, &job) &&
           api_process_find(import->call->api, job.process) != NULL &&
           import_whole(record, "createdMs", 1, INT64_MAX / 2, &job.created_ms) &&
           import_whole(record, "startedMs", 0, INT64_MAX / 2, &job.started_ms) &&
           import_whole(record, "finishedMs", 1, INT64_MAX / 2, &job.finished_ms);
    import->edited = !good;
    good = good && json_is_object(results) &&
           import_unchanged(json_object_get(record, "sha256"), given->bytes, given->size) &&
           fits_table(import, job.process, results);

    json_decref(results);
    json_decref(list.errors);
    labels_clear(&labels);
    if (good) {
        (void)snprintf(job.id, sizeof job.id, "%s", id);
        (void)snprintf(job.owner, sizeof job.owner, "%s", owner.name ? owner.name : "");
        *status = jobs_digest(job.process, job.inputs, job.numeric_build, job.owner, job.digest);
        if (lacking) {
            *status = STORE_NOMEM;
        }
        if (*status == STORE_OK && !json_object_get(import->seen, job.digest)) {
            (void)json_object_set_new(import->seen, job.digest, json_true());
            *status = store_batch_add_job(import->batch, &job, (const char *)given->bytes,
                                          given->size, owner.bytes_max);
        }
    }
    store_job_clear(&job);
    return good;
}
