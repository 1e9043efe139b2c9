/*
 * users.c - GET /v1/users: who may call, with which quotas, and what each holds; for admins.
 *
 * A user is a name among the tokens. Tokens are added and revoked on the command line alone, since
 * whoever could do so over HTTP would need no more than one stolen token. Secrets are nowhere: the
 * file of tokens has their digests only, and even these are not told.
 */
#include "api/respond.h"
#include "api/routes.h"

#include "store/holdings.h"
#include "store/job.h"
#include "store/page.h"
#include "store/token.h"

#include <string.h>

/* A time, or nothing where there is none. */
static void set_time(json_t *object, const char *name, int64_t ms)
{
    if (ms > 0) {
        (void)json_object_set_new(object, name, json_time(ms));
    }
}

/* Its quotas after the defaults of the service; 0: no limit. */
static json_t *quotas_of(const struct api_call *call, const struct store_token *token)
{
    json_t *quotas = json_object();

    for (int k = 0; k < STORE_QUOTAS; k++) {
        int64_t most = token->quotas[k] >= 0 ? token->quotas[k] : call->api->config.quotas[k];

        (void)json_object_set_new(quotas, store_quota_name((enum store_quota)k),
                                  json_integer((json_int_t)most));
    }
    return quotas;
}

static json_t *token_json(const struct api_call *call, const struct store_token *token)
{
    json_t *one = json_pack("{s:s, s:s, s:o}", "id", token->id, "role",
                            store_role_name(token->role), "quotas", quotas_of(call, token));

    set_time(one, "created", token->created_ms);
    set_time(one, "expires", token->expires_ms);
    set_time(one, "lastUsed", token->last_ms);
    return one;
}

static bool stop(void *user, const struct store_job *job)
{
    (void)user;
    (void)job;
    return false;
}

/* Jobs of the owner in this state; negative: a status of the store. */
static int64_t count_jobs(struct api_call *call, const char *owner, enum store_job_status state)
{
    int64_t total = 0;
    const struct store_page page = {
        .limit = 1, .owner = owner, .status = store_job_status_name(state), .total = &total};
    int status = store_job_list(call->api->config.store, &page, stop, NULL);

    return status ? status : total;
}

/* The user of that name without its tokens, or NULL where the store failed. */
static json_t *user_json(struct api_call *call, const char *name)
{
    int64_t bytes = 0, waiting = count_jobs(call, name, STORE_JOB_ACCEPTED);
    int64_t running = count_jobs(call, name, STORE_JOB_RUNNING);
    int status = store_owner_bytes(call->api->config.store, name, &bytes, NULL);

    if (status == 0 && (waiting < 0 || running < 0)) {
        status = (int)(waiting < 0 ? waiting : running);
    }
    if (status) {
        (void)problem_respond_store(call, status, "not-found", name);
        return NULL;
    }
    return json_pack("{s:s, s:I, s:I, s:I, s:[]}", "name", name, "bytes", (json_int_t)bytes,
                     "jobsWaiting", (json_int_t)waiting, "jobsRunning", (json_int_t)running,
                     "tokens");
}

static json_t *find_user(const json_t *users, const char *name)
{
    json_t *one;
    size_t i;

    json_array_foreach(users, i, one)
    {
        if (strcmp(json_string_value(json_object_get(one, "name")), name) == 0) {
            return one;
        }
    }
    return NULL;
}

/* Users in the order of their first tokens, and the tokens of each; NULL with an answer. */
static json_t *users_of(struct api_call *call, const struct store_tokens *tokens)
{
    json_t *users = json_array();

    for (size_t i = 0; i < tokens->n; i++) {
        const struct store_token *token = &tokens->list[i];
        json_t *user = find_user(users, token->name);

        if (!user) {
            user = user_json(call, token->name);
            if (!user) {
                json_decref(users);
                return NULL;
            }
            (void)json_array_append_new(users, user);
        }
        (void)json_array_append_new(json_object_get(user, "tokens"), token_json(call, token));
    }
    return users;
}

void users_list(struct api_call *call)
{
    const char *directory = call->api->config.tokens;
    struct store_tokens tokens = {.n = 0};
    json_t *users;
    int status;

    if (call->request->caller.restricted) {
        (void)problem_respond(call, "forbidden",
                              "The role of this token is %s; the list of users is for admins.",
                              call->request->caller.role);
        return;
    }
    status = directory ? store_tokens_load(directory, &tokens) : 0;
    if (status) {
        (void)problem_respond_store(call, status, "not-found", "the file of tokens");
        return;
    }
    if (directory) {
        store_tokens_uses(directory, &tokens);
    }
    users = users_of(call, &tokens);
    store_tokens_clear(&tokens);
    if (users) {
        (void)api_response_header_text(call->response, "Cache-Control", "private, no-store");
        respond_json(call, 200, json_pack("{s:o}", "items", users));
    }
}
