/*
 * jobs_record.c - a job as JSON.
 *
 * The record is a statusInfo of OGC API - Processes 1.0 with members of our own; what is not known
 * is absent.
 */
#include "api/job_answers.h"

#include "api/json_memory.h"
#include "api/labels.h"
#include "api/links.h"
#include "store/job.h"

#include <stdio.h>
#include <string.h>

static json_t *job_links(const struct store_job *job)
{
    json_t *links = json_array();
    char path[128];

    (void)snprintf(path, sizeof path, "/v1/jobs/%s", job->id);
    link_add(links, path, "self", LINK_JSON, "The job");
    (void)snprintf(path, sizeof path, "/v1/jobs/%s/events", job->id);
    link_add(links, path, "monitor", "text/event-stream", "Its changes");
    if (job->status == STORE_JOB_SUCCESSFUL || job->status == STORE_JOB_FAILED) {
        (void)snprintf(path, sizeof path, "/v1/jobs/%s/results", job->id);
        link_add(links, path, LINK_OGC "results", LINK_JSON, "What it gave");
    }
    (void)snprintf(path, sizeof path, "/v1/processes/%s", job->process);
    link_add(links, path, LINK_OGC "process-desc", LINK_JSON, "The process");
    link_add(links, "/v1/jobs", "up", LINK_JSON, "All jobs");
    return links;
}

json_t *job_problem(const struct store_job *job, const char *request_id)
{
    char instance[96];

    if (job->status != STORE_JOB_FAILED) {
        return NULL;
    }
    (void)snprintf(instance, sizeof instance, "/v1/jobs/%s", job->id);
    return problem_json(job->problem_code ? job->problem_code : "internal-error",
                        job->problem_detail, instance, request_id);
}

/* Sets a member unless the value is null: what is not known is absent. */
static void set_known(json_t *document, const char *name, json_t *value)
{
    if (json_is_null(value)) {
        json_decref(value);
    } else {
        (void)json_object_set_new(document, name, value);
    }
}

/* What holds at this moment, and only of jobs that wait or run. */
static void set_moment(json_t *document, const struct store_job *job)
{
    if (job->progress >= 0) {
        (void)json_object_set_new(document, "progress", json_integer((json_int_t)job->progress));
    }
    if (job->status == STORE_JOB_RUNNING && job->seconds_left >= 0) {
        (void)json_object_set_new(document, "estimatedSecondsLeft", json_real(job->seconds_left));
    }
    if (job->status == STORE_JOB_ACCEPTED && job->queue_position > 0) {
        (void)json_object_set_new(document, "queuePosition",
                                  json_integer((json_int_t)job->queue_position));
    }
}

json_t *job_record(const struct store_job *job, const char *cache)
{
    json_t *document = json_object();
    json_t *problem = job_problem(job, NULL);

    (void)json_object_set_new(document, "jobID", json_string(job->id));
    (void)json_object_set_new(document, "id", json_string(job->id));
    (void)json_object_set_new(document, "type", json_string("process"));
    (void)json_object_set_new(document, "name", json_string(job->name ? job->name : ""));
    labels_set_tags(document, job->tags);
    (void)json_object_set_new(document, "processID", json_string(job->process));
    if (job->owner[0]) {
        (void)json_object_set_new(document, "owner", json_string(job->owner));
    }
    (void)json_object_set_new(document, "status", json_string(store_job_status_name(job->status)));
    (void)json_object_set_new(document, "message", json_string(job->message ? job->message : ""));
    set_moment(document, job);
    set_known(document, "created", json_time(job->created_ms));
    set_known(document, "started", json_time(job->started_ms));
    set_known(document, "finished", json_time(job->finished_ms));
    set_known(document, "updated", json_time(job->updated_ms));
    (void)json_object_set_new(document, "attempt", json_integer(job->attempt));
    (void)json_object_set_new(document, "cancelRequested", json_boolean(job->cancel_requested));
    (void)json_object_set_new(document, "cache", json_string(cache ? cache : "miss"));
    (void)json_object_set_new(document, "inputsDigest", json_string(job->digest));
    (void)json_object_set_new(document, "numericBuild",
                              json_string(job->numeric_build ? job->numeric_build : ""));
    if (problem) {
        (void)json_object_set_new(document, "exception", problem);
    }
    (void)json_object_set_new(document, "links", job_links(job));
    return document;
}

bool job_ended(const struct store_job *job)
{
    return job->status != STORE_JOB_ACCEPTED && job->status != STORE_JOB_RUNNING;
}

json_t *job_with_inputs(json_t *record, const struct store_job *job, size_t most)
{
    size_t length = job->inputs ? strlen(job->inputs) : 0;
    json_t *inputs = length <= most ? json_memory_load(job->inputs, length, 0, NULL, NULL) : NULL;

    if (inputs) {
        (void)json_object_set_new(record, "inputs", inputs);
    }
    return record;
}
