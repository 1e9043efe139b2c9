/*
 * jobs_list.c - GET /v1/jobs: pages of jobs, and the places of those that wait.
 */
#include "api/job_answers.h"
#include "api/lists.h"
#include "api/routes.h"
#include "store/job.h"

#include <string.h>

#define INPUTS_LISTED ((size_t)2 << 10) /* bytes of inputs that an entry shows */

static bool add_job(void *user, const struct store_job *job)
{
    return list_add(user, job_with_inputs(job_record(job, NULL), job, INPUTS_LISTED),
                    job->created_ms, job->id);
}

/* The items of a page that wait for their place, by id; borrowed. */
struct waiting {
    json_t *items;
    size_t left;
};

static bool place_job(void *user, const char *id, size_t position)
{
    struct waiting *waiting = user;
    json_t *item = json_object_get(waiting->items, id);

    if (item) {
        (void)json_object_set_new(item, "queuePosition", json_integer((json_int_t)position));
        waiting->left--;
    }
    return waiting->left > 0;
}

/* The places of those jobs of the page that wait, in one look at the queue: not while the page is
   read, which holds the only reader that this thread may have. */
static int place_jobs(struct api_call *call, json_t *items)
{
    struct waiting waiting = {.items = json_object()};
    int status = 0;
    json_t *item;
    size_t i;

    json_array_foreach(items, i, item)
    {
        const char *name = json_string_value(json_object_get(item, "status"));

        if (name && strcmp(name, store_job_status_name(STORE_JOB_ACCEPTED)) == 0) {
            (void)json_object_set(waiting.items, json_string_value(json_object_get(item, "id")),
                                  item);
            waiting.left++;
        }
    }
    if (waiting.left > 0) {
        status = jobs_places(call->api->config.jobs, place_job, &waiting);
    }
    json_decref(waiting.items);
    return status;
}

void jobs_list(struct api_call *call)
{
    struct list list;
    int read;

    if (list_open(call, "jobs", &list)) {
        list.member = "jobs";
        read = jobs_page(call->api->config.jobs, &list.page, add_job, &list);
        list_respond(call, &list, "/v1/jobs", read ? read : place_jobs(call, list.items));
    }
}
