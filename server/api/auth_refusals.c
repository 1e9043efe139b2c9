/*
 * auth_refusals.c - what is answered to those who are not admitted, and which role reaches what.
 *
 * A viewer reads, a user also changes, and both know only what belongs to the token's name; an
 * admin sees and changes everything. /metrics, which counts what all owners do, is for admins and
 * for tokens of the role metrics, which reach nothing else. So leases of tasks are for admins and
 * for tokens of the role worker.
 */
#include "api/auth_refusals.h"

#include "api/auth.h"
#include "api/routes.h"

#include <math.h>
#include <string.h>

void auth_refuse_token(struct api_call *call, enum admission admission)
{
    const char *detail = admission == EXPIRED ? "The token has expired."
                                              : "The token is not known here; it may have been "
                                                "revoked.";

    (void)problem_respond(call, "token-invalid", "%s", detail);
    (void)api_response_header_text(call->response, "WWW-Authenticate",
                                   "Bearer realm=\"srnfd\", error=\"invalid_token\"");
}

void auth_refuse_revoked(struct api_call *call)
{
    auth_refuse_token(call, UNKNOWN);
}

void auth_refuse(struct api_call *call, enum admission admission, double wait)
{
    switch (admission) {
    case UNKNOWN:
    case EXPIRED:
        auth_refuse_token(call, admission);
        break;
    case TOO_MANY:
        quota_respond(call, STORE_QUOTA_REQUESTS, (int)ceil(wait));
        break;
    case NO_MEMORY:
        (void)problem_respond(call, "out-of-memory", "There is not enough memory for this.");
        break;
    case UNREADABLE:
    case ADMITTED:
        (void)problem_respond(call, "not-ready",
                              "The file of tokens in the data directory cannot be read.");
        break;
    }
}

/* What a token of this role may not do there, as the rest of a sentence; NULL: it may. */
static const char *refuses_role(enum store_role role, const struct api_route *route,
                                const char *method)
{
    bool reads = strcmp(method, "GET") == 0 || strcmp(method, "HEAD") == 0 ||
                 (route->flags & ROUTE_READS) != 0;

    if (role == STORE_ROLE_ADMIN) {
        return NULL;
    }
    if (route->flags & ROUTE_ADMINS) {
        return "; this is for the role admin.";
    }
    if (route->flags & ROUTE_MONITORS) {
        return role == STORE_ROLE_METRICS ? NULL : "; /metrics is for the roles admin and metrics.";
    }
    if (route->flags & ROUTE_WORKERS) {
        return role == STORE_ROLE_WORKER ? NULL : "; leases are for the roles admin and worker.";
    }
    if (role == STORE_ROLE_METRICS) {
        return ", which may read /metrics alone.";
    }
    if (role == STORE_ROLE_WORKER) {
        return ", which may lease tasks, read what they are about and "
               "return their results, and nothing else.";
    }
    return role == STORE_ROLE_USER || reads ? NULL : ", which may only read.";
}

bool auth_role_allows(struct api_call *call, enum store_role role, const struct api_route *route)
{
    const char *sentence = refuses_role(role, route, call->request->method);

    if (!sentence) {
        return true;
    }
    (void)problem_respond(call, "forbidden", "The role of this token is %s%s",
                          store_role_name(role), sentence);
    (void)api_response_header_text(call->response, "WWW-Authenticate",
                                   "Bearer realm=\"srnfd\", error=\"insufficient_scope\"");
    return false;
}
