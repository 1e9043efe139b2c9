/*
 * auth.h - who calls, and what the caller may see and do.
 */
#ifndef SRNFD_API_AUTH_H
#define SRNFD_API_AUTH_H

#include "api/handler.h"
#include "owner.h"

struct api_route; /* routes.h */

/* ---- The tokens ------------------------------------------------------------------------------ */

/* config is that of the api layer; NULL without memory. */
struct api_auth *auth_create(const struct api_config *config);
/* Writes down when tokens were last used. */
void auth_destroy(struct api_auth *auth, struct store *store);
/* Who calls, and whether this route is for it: sets request->caller. False when a problem was
   answered (401, 403, 429, 503). On any thread; reads no more than the status of a file. */
bool auth_admit(struct api_call *call, struct api_request *request, const struct api_route *route);
/* Whether what the path names belongs to the caller; otherwise answers that there is no such thing.
   On a request thread, as is the next. */
bool auth_owns_path(struct api_call *call, const struct api_route *route);
/* Whether the file of tokens can be read, where tokens are asked for. */
bool auth_readable(struct api *api);
/* Writes down, now and then, that the caller's token was used. */
void auth_record(struct api *api, const struct api_request *request);

/* ---- A call ---------------------------------------------------------------------------------- */

/* What the caller sees, and for whom it stores. They borrow from the request. */
struct store_view call_view(const struct api_call *call);
struct store_owner call_owner(const struct api_call *call);
/* Whether the caller may see the mesh, surface, model or job of this id: 0, STORE_NOT_FOUND or
   another status of the store. */
int call_sees(const struct api_call *call, const char *id);
/* Counts one more answer of the caller that waits for a job. False when a problem was answered.
   Each that was entered is left again; account may be NULL. */
bool stream_enter(struct api_call *call);
void stream_leave(struct api_auth *auth, struct auth_account *account);
/* Whether the account's token still holds; NULL, where no tokens are asked for, always does. */
bool auth_holds(struct api_auth *auth, const struct auth_account *account);
/* Answers that the token does not hold any more. */
void auth_refuse_revoked(struct api_call *call);

#endif
