/*
 * job_answers.h - what the job resource and the execution of a process answer alike.
 */
#ifndef SRNFD_API_JOB_ANSWERS_H
#define SRNFD_API_JOB_ANSWERS_H

#include "api/handler.h"

struct store_job; /* store/job.h */

bool job_ended(const struct store_job *job);

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
