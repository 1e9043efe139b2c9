/*
 * job_answers.h - what the job resource, its list and the execution of a process answer alike.
 */
#ifndef SRNFD_API_JOB_ANSWERS_H
#define SRNFD_API_JOB_ANSWERS_H

#include "api/handler.h"

struct store_job; /* store/job.h */

bool job_ended(const struct store_job *job);
/* The record with the inputs as the job has them, unless they have more than most bytes (arrays of
   numbers): then the results alone tell them. Takes over and returns the record. */
json_t *job_with_inputs(json_t *record, const struct store_job *job, size_t most);
/* The problem of a failed job; NULL for any other. */
json_t *job_problem(const struct store_job *job, const char *request_id);

struct framing; /* framing.h */

/* 200 with the results of a successful job; the problem of a failed one with its status; 410 for a
   dismissed one; 409 with Retry-After before the end, or 404, which the standard has, where the
   results are not wanted plain. */
void job_respond_results(struct api_call *call, const struct store_job *job,
                         const struct framing *framing);

struct framing_member; /* framing.h */

/* Answers with an output of a successful job as a file, where its schema says that it is one
   (jobs_content.c); otherwise false. */
bool job_respond_content(struct api_call *call, const struct store_job *job,
                         const struct framing_member *member);

#endif
