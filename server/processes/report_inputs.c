/*
 * report_inputs.c - what a report is of: jobs by their ids, or the last of each process that was
 * given a cohort. Which jobs those are is settled when the report is asked for, and part of the
 * canonical inputs.
 */
#include "processes/report.h"

#include <stdlib.h>
#include <string.h>

#include "api/auth.h"
#include "api/respond.h"
#include "processes/processes.h"
#include "store/cohort.h"
#include "store/job.h"
#include "store/page.h"
#include "toolkit/group.h"

#define INPUTS_MAX ((size_t)64 << 10) /* bytes of a job's inputs that are looked into */
#define DEGREE_UNKNOWN 31
#define COHORT_JOBS_MAX 1000 /* that are looked at, the newest */

/* "job-" and a UUID. */
static bool is_job_id(const char *id)
{
    return id && strncmp(id, "job-", 4) == 0 && strlen(id) == 40 &&
           strspn(id + 4, "0123456789abcdef-") == 36;
}

/* The degree of what the job has computed: that of its model's modes. */
static long degree_of(const struct store_job *job)
{
    size_t length = job->inputs ? strlen(job->inputs) : 0;
    json_t *inputs =
        length && length < INPUTS_MAX ? json_memory_load(job->inputs, length, 0, NULL, NULL) : NULL;
    const json_t *degree = json_object_get(inputs, "lmax");
    long found = json_is_integer(degree) ? (long)json_integer_value(degree) : DEGREE_UNKNOWN;

    json_decref(inputs);
    return found;
}

/* Notes, or answers, why the job cannot be reported. */
static void check_job(struct process_inputs *inputs, const char *id, const char *pointer)
{
    struct api_call *call = inputs->call;
    struct store_job job = {0};
    int status = call_sees(call, id);

    if (status == 0) {
        status = store_job_get(call->api->config.store, id, &job);
    }
    if (status) {
        (void)problem_respond_store(call, status, "no-such-job", id);
        inputs->answered = true;
        return;
    }
    if (job.status != STORE_JOB_SUCCESSFUL) {
        problem_add(inputs->list, pointer, "has no results: it is %s",
                    store_job_status_name(job.status));
    } else if (strcmp(job.process, "report") == 0) {
        problem_add(inputs->list, pointer, "is a report itself; name the jobs that it is of");
    } else {
        long degree = degree_of(&job);

        call->work.degree = degree > call->work.degree ? degree : call->work.degree;
    }
    store_job_clear(&job);
}

static void read_jobs(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *given = json_object_get(inputs->given, input->name);
    size_t n = json_array_size(given);
    char pointer[40];

    if (!json_is_array(given) || n < 1 || n > REPORT_JOBS_MAX) {
        problem_add(inputs->list, "/inputs/jobs",
                    "must be an array of 1 to %d ids of jobs, or cohort given instead",
                    REPORT_JOBS_MAX);
        return;
    }
    for (size_t i = 0; i < n && !inputs->answered; i++) {
        const char *id = json_string_value(json_array_get(given, i));

        (void)snprintf(pointer, sizeof pointer, "/inputs/jobs/%zu", i);
        if (!is_job_id(id)) {
            problem_add(inputs->list, pointer, "must be the id of a job: job- and a UUID");
        } else if (!inputs->shape_only) {
            check_job(inputs, id, pointer);
        }
    }
    /* given is the caller's; the canonical array is one of its own */
    (void)json_object_set_new(inputs->canonical, input->name, json_deep_copy(given));
}

static bool type_jobs(const json_t *value, void *member)
{
    struct report_jobs *jobs = member;

    jobs->n = json_array_size(value);
    for (size_t i = 0; i < jobs->n && i < REPORT_JOBS_MAX; i++) {
        const char *id = json_string_value(json_array_get(value, i));

        if (!is_job_id(id)) {
            return false;
        }
        memcpy(jobs->ids[i], id, strlen(id) + 1);
    }
    return jobs->n >= 1 && jobs->n <= REPORT_JOBS_MAX;
}

const struct input_own report_jobs_own = {
    .schema = "\"type\":[\"array\",\"null\"],\"minItems\":1,\"maxItems\":" PROCESS_TEXT(
        REPORT_JOBS_MAX) ",\"items\":{\"type\":\"string\",\"pattern\":\"^job-[0-9a-f-]{36}$\"}",
    .read = read_jobs,
    .type = type_jobs,
    .refers = true,
};

/* ---- The jobs of a cohort -------------------------------------------------------------------- */

/* The newest job of each process, by its place in the table. */
struct newest {
    struct api_call *call;
    size_t looked_at;
    char ids[API_PROCESSES_MAX][STORE_ID_MAX];
};

static bool note_newest(void *user, const struct store_job *job)
{
    struct newest *newest = user;
    const struct api_process *const *rows = processes.rows;
    size_t i = 0;

    while (rows[i] && strcmp(rows[i]->id, job->process) != 0) {
        i++;
    }
    if (rows[i] && rows[i]->methods && i < API_PROCESSES_MAX && !newest->ids[i][0]) {
        long degree = degree_of(job);
        long *highest = &newest->call->work.degree;

        memcpy(newest->ids[i], job->id, sizeof job->id);
        *highest = degree > *highest ? degree : *highest;
    }
    return true;
}

/* The ids (new reference), in the order of the processes. */
static json_t *jobs_of_cohort(struct process_inputs *inputs, const struct store_cohort *cohort)
{
    struct newest newest = {.call = inputs->call};
    const struct store_page page = {.limit = COHORT_JOBS_MAX,
                                    .owner = cohort->owner,
                                    .cohort = cohort->name,
                                    .status = "successful"};
    json_t *ids = json_array();
    int status = store_job_list(inputs->call->api->config.store, &page, note_newest, &newest);

    if (status) {
        (void)problem_respond_store(inputs->call, status, "no-such-job", cohort->name);
        inputs->answered = true;
    }
    for (size_t i = 0; i < API_PROCESSES_MAX && json_array_size(ids) < REPORT_JOBS_MAX; i++) {
        if (newest.ids[i][0]) {
            (void)json_array_append_new(ids, json_string(newest.ids[i]));
        }
    }
    return ids;
}

static void read_cohort(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *given = json_object_get(inputs->given, input->name);
    struct store_cohort cohort = {.record = NULL};
    json_t *ids;

    if (!given || json_is_null(given)) {
        (void)json_object_set_new(inputs->canonical, input->name, json_null());
        return;
    }
    if (group_find_cohort(inputs, given, &cohort)) {
        ids = jobs_of_cohort(inputs, &cohort);
        if (!inputs->answered && json_array_size(ids) == 0) {
            problem_add(inputs->list, "/inputs/cohort",
                        "has no analysis that ended successfully; start one, or name jobs");
        }
        (void)json_object_set_new(inputs->canonical, input->name,
                                  json_pack("{s:s, s:o}", "name", cohort.name, "jobs", ids));
    }
    store_cohort_clear(&cohort);
}

static bool type_cohort(const json_t *value, void *member)
{
    return json_is_null(value) || type_jobs(json_object_get(value, "jobs"), member);
}

const struct input_own report_cohort_own = {
    .schema = "\"type\":[\"string\",\"null\"],\"pattern\":\"" COHORT_NAME_PATTERN "\"",
    .read = read_cohort,
    .type = type_cohort,
    .refers = true,
};

/* ---- The title ------------------------------------------------------------------------------- */

static void read_title(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *given = json_object_get(inputs->given, input->name);
    const char *text = json_string_value(given), *wrong;

    if (!given) {
        return; /* report_complete */
    }
    wrong = text ? name_problem(text) : "must be a text";
    if (wrong || !text[0]) {
        problem_add(inputs->list, "/inputs/title", "%s", wrong ? wrong : "must not be empty");
        return;
    }
    (void)json_object_set_new(inputs->canonical, input->name, json_string(text));
}

static bool type_title(const json_t *value, void *member)
{
    const char *text = json_string_value(value);
    bool fits = text && strlen(text) < sizeof((struct report *)NULL)->title;

    if (fits) {
        memcpy(member, text, strlen(text) + 1);
    }
    return fits;
}

const struct input_own report_title_own = {
    .schema =
        "\"type\":\"string\",\"minLength\":1,\"maxLength\":" PROCESS_TEXT(NAME_CHARACTERS_MAX),
    .read = read_title,
    .type = type_title,
};

/* The name of the job, if it has one that fits. */
static json_t *name_of_job(struct process_inputs *given, const char *id)
{
    struct store_job job = {0};
    json_t *name = NULL;

    if (store_job_get(given->call->api->config.store, id, &job) == 0 && job.name && job.name[0]) {
        name = json_string(job.name);
    }
    store_job_clear(&job);
    return name;
}

void report_complete(struct process_inputs *given)
{
    const json_t *jobs = json_object_get(given->canonical, "jobs");
    const json_t *cohort = json_object_get(given->canonical, "cohort");
    json_t *title = NULL;

    if (json_object_get(given->canonical, "title")) {
        return;
    }
    if (json_array_size(jobs) == 1) {
        title = name_of_job(given, json_string_value(json_array_get(jobs, 0)));
    } else if (json_is_object(cohort)) {
        title = json_incref(json_object_get(cohort, "name"));
    }
    (void)json_object_set_new(given->canonical, "title", title ? title : json_string("Report"));
}
