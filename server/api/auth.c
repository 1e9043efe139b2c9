/*
 * auth.c - who calls: tokens, tickets and passes.
 *
 * Where the data directory has a file of tokens (store/token.h), every request but those for the
 * public routes carries one: Authorization: Bearer (RFC 6750). The file is looked at, by stat, with
 * every request and read anew when it was replaced. One that cannot be read, or that was taken
 * away from a running daemon, lets nobody in. Without the file the service has one caller who sees
 * all and has no quotas.
 *
 * What a role reaches is in auth_refusals.c, what belongs to whom in auth_owners.c, quotas of
 * requests and streams in accounts.c. A pass, which the service makes for workers that it starts
 * (jobs/tasks.h), is as good as a token of the role worker, for the tasks of one job, also where no
 * tokens are asked for.
 *
 * A browser's EventSource cannot send a token. For routes that say so a ticket stands in for one,
 * once (tickets.h); it is as good as the token at that moment.
 *
 * Lock: auth->mutex (rank: innermost but for that of the tickets; nothing else is called while it
 * is held but the reading of a file that was replaced) protects the tokens and the accounts.
 * Accounts are never freed before the end: there is one for each token that was ever used.
 */
#include "api/respond.h"
#include "api/routes.h"

#include "api/accounts.h"
#include "api/auth.h"
#include "api/auth_refusals.h"
#include "api/tickets.h"
#include "jobs/tasks.h"
#include "log.h"
#include "owner.h"
#include "store/holdings.h"
#include "store/store.h"
#include "store/token.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define SECRET_MAX 512           /* of an Authorization header that is looked at */
#define RECORD_MS INT64_C(60000) /* between two records of a token's use */

struct api_auth {
    pthread_mutex_t mutex; /* protects all below it */
    char *directory;       /* NULL: no tokens are asked for */
    int64_t defaults[STORE_QUOTAS];
    struct store_tokens tokens;
    bool required; /* a file was there: from then on tokens are asked for */
    bool readable;
    struct auth_account *accounts;
    struct tickets *tickets;
};

/* ---- The file -------------------------------------------------------------------------------- */

/* Reads the tokens anew; the mutex is held. */
static void reload(struct api_auth *auth, const struct store_token_stamp *stamp)
{
    struct store_tokens tokens;
    int status = store_tokens_load(auth->directory, &tokens);

    auth->readable = status == STORE_OK && tokens.stamp.exists;
    store_tokens_clear(&auth->tokens);
    auth->tokens = tokens;
    if (status != STORE_OK) {
        /* It is not read again before it changes. */
        auth->tokens.stamp = *stamp;
        LOG_ERROR("tokens-unreadable", log_text("message", store_strerror(status)));
    } else {
        LOG("tokens-read", log_number("tokens", (double)tokens.n));
    }
}

/* Takes notice of a file that was replaced; the mutex is held. */
static void refresh(struct api_auth *auth)
{
    struct store_token_stamp stamp;

    if (!auth->directory) {
        return;
    }
    if (store_token_look(auth->directory, &stamp) != STORE_OK) {
        auth->readable = false;
        auth->tokens.stamp.exists = false;
        return;
    }
    if (!stamp.exists && auth->required && auth->tokens.stamp.exists) {
        LOG_ERROR("tokens-missing", log_text("message", "the file of tokens was taken away"));
    }
    if (stamp.exists) {
        auth->required = true;
    }
    if (!store_token_same(&stamp, &auth->tokens.stamp)) {
        reload(auth, &stamp);
    }
}

struct api_auth *auth_create(const struct api_config *config)
{
    struct api_auth *auth = calloc(1, sizeof *auth);

    if (!auth) {
        return NULL;
    }
    (void)pthread_mutex_init(&auth->mutex, NULL);
    memcpy(auth->defaults, config->quotas, sizeof auth->defaults);
    auth->directory = config->tokens ? strdup(config->tokens) : NULL;
    auth->tickets = tickets_create();
    if ((config->tokens && !auth->directory) || !auth->tickets) {
        auth_destroy(auth, NULL);
        return NULL;
    }
    (void)pthread_mutex_lock(&auth->mutex);
    refresh(auth);
    (void)pthread_mutex_unlock(&auth->mutex);
    return auth;
}

void auth_destroy(struct api_auth *auth, struct store *store)
{
    if (!auth) {
        return;
    }
    while (auth->accounts) {
        struct auth_account *account = auth->accounts;

        auth->accounts = account->next;
        if (store && account->used_ms > account->recorded_ms) {
            (void)store_token_used(store, account->token, account->used_ms);
        }
        free(account);
    }
    store_tokens_clear(&auth->tokens);
    tickets_destroy(auth->tickets);
    (void)pthread_mutex_destroy(&auth->mutex);
    free(auth->directory);
    free(auth);
}

/* ---- Accounts -------------------------------------------------------------------------------- */

void auth_record(struct api *api, const struct api_request *request)
{
    struct auth_account *account = request->caller.account;
    int64_t used = 0;

    if (!account) {
        return;
    }
    (void)pthread_mutex_lock(&api->auth->mutex);
    if (account->used_ms - account->recorded_ms >= RECORD_MS) {
        used = account->recorded_ms = account->used_ms;
    }
    (void)pthread_mutex_unlock(&api->auth->mutex);
    if (used > 0) {
        /* Where it fails, the next use is written down. */
        (void)store_token_used(api->config.store, account->token, used);
    }
}

bool stream_enter(struct api_call *call)
{
    const struct api_caller *caller = &call->request->caller;
    int64_t most = caller->quotas[STORE_QUOTA_STREAMS];
    bool entered = true;

    if (!caller->account) {
        return true;
    }
    (void)pthread_mutex_lock(&call->api->auth->mutex);
    entered = most <= 0 || caller->account->streams < (size_t)most;
    caller->account->streams += entered;
    (void)pthread_mutex_unlock(&call->api->auth->mutex);
    if (!entered) {
        quota_respond(call, STORE_QUOTA_STREAMS, 1);
    }
    return entered;
}

void stream_leave(struct api_auth *auth, struct auth_account *account)
{
    if (account) {
        (void)pthread_mutex_lock(&auth->mutex);
        account->streams--;
        (void)pthread_mutex_unlock(&auth->mutex);
    }
}

/* ---- Admission ------------------------------------------------------------------------------- */

/* The token after "Bearer" in a value that may be NULL, or NULL where there is none. */
static const char *bearer(const char *value)
{
    if (!value || strncasecmp(value, "Bearer ", 7) != 0) {
        return NULL;
    }
    value += 7;
    return value + strspn(value, " ");
}

/* Whether the token holds at this moment. The mutex is held. */
static bool holds(const struct api_auth *auth, const struct store_token *token)
{
    return auth->readable && token &&
           (token->expires_ms == 0 || token->expires_ms > store_now_ms());
}

bool api_knows(struct api *api, const char *authorization, size_t length)
{
    struct api_auth *auth = api->auth;
    char value[SECRET_MAX + sizeof "Bearer "], job[STORE_ID_MAX];
    const char *secret;
    bool known = false;

    if (length >= sizeof value) {
        return false;
    }
    memcpy(value, authorization, length);
    value[length] = '\0';
    secret = bearer(value);
    if (secret) {
        (void)pthread_mutex_lock(&auth->mutex);
        refresh(auth);
        known = holds(auth, store_tokens_find(&auth->tokens, secret));
        (void)pthread_mutex_unlock(&auth->mutex);
        known = known || jobs_pass_find(api->config.jobs, secret, job);
    }
    return known;
}

static const struct store_token *token_by_id(const struct api_auth *auth, const char *id)
{
    for (size_t i = 0; i < auth->tokens.n; i++) {
        if (strcmp(auth->tokens.list[i].id, id) == 0) {
            return &auth->tokens.list[i];
        }
    }
    return NULL;
}

bool auth_holds(struct api_auth *auth, const struct auth_account *account)
{
    bool held;

    if (!account) {
        return true;
    }
    (void)pthread_mutex_lock(&auth->mutex);
    refresh(auth);
    held = holds(auth, token_by_id(auth, account->token));
    (void)pthread_mutex_unlock(&auth->mutex);
    return held;
}

/* The token of a ticket in the query, or NULL. The ticket is used up, but not by HEAD, which opens
   no stream. The mutex is held. */
static const struct store_token *token_of_ticket(struct api_auth *auth,
                                                 const struct api_request *request)
{
    const char *query = request->query;
    bool found;
    char ticket[TICKET_SIZE], id[STORE_TOKEN_ID_MAX];
    struct query_pair pair;

    while (query_next(&query, &pair)) {
        if (pair.name_length != 6 || strncmp(pair.name, "ticket", 6) != 0 ||
            pair.value_length != TICKET_SIZE - 1) {
            continue;
        }
        memcpy(ticket, pair.value, TICKET_SIZE - 1);
        ticket[TICKET_SIZE - 1] = '\0';
        found = strcmp(request->method, "HEAD") == 0 ? tickets_look_at(auth->tickets, ticket, id)
                                                     : tickets_redeem(auth->tickets, ticket, id);
        return found ? token_by_id(auth, id) : NULL;
    }
    return NULL;
}

/* Looks the token up, by what the request says of it, and draws from its bucket. The mutex is
   held. */
static enum admission look_up(struct api_auth *auth, const struct store_token *token,
                              struct api_caller *caller, enum store_role *role, double *wait)
{
    if (!auth->readable) {
        return UNREADABLE;
    }
    if (!token) {
        return UNKNOWN;
    }
    if (token->expires_ms > 0 && token->expires_ms <= store_now_ms()) {
        return EXPIRED;
    }
    caller->account = account_of(&auth->accounts, token);
    if (!caller->account) {
        return NO_MEMORY;
    }
    memcpy(caller->name, token->name, sizeof caller->name);
    *role = token->role;
    caller->role = store_role_name(token->role);
    caller->restricted = token->role != STORE_ROLE_ADMIN;
    for (size_t i = 0; i < STORE_QUOTAS; i++) {
        caller->quotas[i] = token->quotas[i] >= 0 ? token->quotas[i] : auth->defaults[i];
    }
    caller->account->used_ms = store_now_ms();
    *wait = account_draw(caller->account, caller->quotas[STORE_QUOTA_REQUESTS]);
    return *wait > 0 ? TOO_MANY : ADMITTED;
}

/* Admits, or refuses, whoever comes with what looks like a pass. */
static bool admit_pass(struct api_call *call, struct api_request *request, const char *secret,
                       const struct api_route *route)
{
    struct api_caller *caller = &request->caller;

    if (strlen(secret) >= SECRET_MAX ||
        !jobs_pass_find(call->api->config.jobs, secret, caller->job)) {
        auth_refuse_token(call, UNKNOWN);
        return false;
    }
    /* No token has a colon in its name. */
    (void)snprintf(caller->name, sizeof caller->name, "slurm:%.50s", caller->job);
    caller->role = store_role_name(STORE_ROLE_WORKER);
    caller->restricted = true;
    return auth_role_allows(call, STORE_ROLE_WORKER, route);
}

bool auth_admit(struct api_call *call, struct api_request *request, const struct api_route *route)
{
    struct api_auth *auth = call->api->auth;
    const char *secret = bearer(api_request_header(request, "Authorization"));
    enum store_role role = STORE_ROLE_VIEWER;
    enum admission admission = ADMITTED;
    const struct store_token *token = NULL;
    bool required;
    double wait = 0;

    memset(&request->caller, 0, sizeof request->caller);
    if (route->flags & ROUTE_PUBLIC) {
        /* Nothing that belongs to anyone is there; the file need not be looked at. */
        request->caller.restricted = true;
        return true;
    }
    if (secret && strncmp(secret, JOBS_PASS_PREFIX, sizeof JOBS_PASS_PREFIX - 1) == 0) {
        return admit_pass(call, request, secret, route);
    }
    (void)pthread_mutex_lock(&auth->mutex);
    refresh(auth);
    required = auth->required;
    if (required && secret) {
        token = strlen(secret) < SECRET_MAX ? store_tokens_find(&auth->tokens, secret) : NULL;
    } else if (required && (route->flags & ROUTE_TICKETS)) {
        token = token_of_ticket(auth, request);
    }
    if (required && (secret || token)) {
        admission = look_up(auth, token, &request->caller, &role, &wait);
    }
    (void)pthread_mutex_unlock(&auth->mutex);
    if (!required) {
        return true;
    }
    if (!secret && !token) {
        (void)problem_respond(
            call, "token-required",
            "Send a token: Authorization: Bearer, and what srnfd token add gave.");
        (void)api_response_header_text(call->response, "WWW-Authenticate",
                                       "Bearer realm=\"srnfd\"");
        return false;
    }
    if (admission != ADMITTED) {
        auth_refuse(call, admission, wait);
        return false;
    }
    return auth_role_allows(call, role, route);
}

bool auth_readable(struct api *api)
{
    struct api_auth *auth = api->auth;
    bool readable;

    (void)pthread_mutex_lock(&auth->mutex);
    refresh(auth);
    readable = !auth->required || auth->readable;
    (void)pthread_mutex_unlock(&auth->mutex);
    return readable;
}

void tickets_create_one(struct api_call *call)
{
    const struct auth_account *account = call->request->caller.account;
    const char *length = api_request_header(call->request, "Content-Length");
    char ticket[TICKET_SIZE];

    if ((length && strcmp(length, "0") != 0) ||
        api_request_header(call->request, "Transfer-Encoding")) {
        (void)problem_respond(call, "invalid-input",
                              "A ticket is asked for without a body: there is nothing to say.");
        return;
    }
    tickets_issue(call->api->auth->tickets, account ? account->token : "", ticket);
    (void)api_response_header_text(call->response, "Cache-Control", "no-store");
    respond_json(
        call, 201,
        json_pack("{s:s, s:i}", "ticket", ticket, "expiresInSeconds", (int)TICKET_SECONDS));
}
