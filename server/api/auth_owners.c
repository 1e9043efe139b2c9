/*
 * auth_owners.c - what belongs to whom. What belongs to another is answered as what is not there.
 */
#include "api/auth.h"
#include "api/routes.h"
#include "store/holdings.h"

#include <string.h>

/* What the first parameter of a path names. */
static const struct {
    const char *prefix, *code;
} owned_paths[] = {
    {"/v1/meshes/{id}", "no-such-mesh"},      {"/v1/volumes/{id}", "no-such-volume"},
    {"/v1/surfaces/{id}", "no-such-surface"}, {"/v1/models/{id}", "no-such-model"},
    {"/v1/jobs/{id}", "no-such-job"},
};

struct store_view call_view(const struct api_call *call)
{
    const struct api_caller *caller = &call->request->caller;

    return (struct store_view){.owner = caller->name, .all = !caller->restricted};
}

struct store_owner call_owner(const struct api_call *call)
{
    const struct api_caller *caller = &call->request->caller;

    return (struct store_owner){.name = caller->name,
                                .bytes_max = caller->quotas[STORE_QUOTA_BYTES]};
}

int call_sees(const struct api_call *call, const char *id)
{
    const struct api_caller *caller = &call->request->caller;

    return caller->restricted ? store_owner_has(call->api->config.store, caller->name, id) : 0;
}

bool auth_owns_path(struct api_call *call, const struct api_route *route)
{
    int status = 0;

    for (size_t i = 0; i < sizeof owned_paths / sizeof owned_paths[0]; i++) {
        if (strncmp(route->pattern, owned_paths[i].prefix, strlen(owned_paths[i].prefix)) == 0) {
            status = call_sees(call, call->parameters[0]);
            if (status != 0) {
                (void)problem_respond_store(call, status, owned_paths[i].code, call->parameters[0]);
            }
        }
    }
    return status == 0;
}
