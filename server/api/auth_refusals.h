/*
 * auth_refusals.h - the answers of auth_refusals.c, for auth.c.
 */
#ifndef SRNFD_API_AUTH_REFUSALS_H
#define SRNFD_API_AUTH_REFUSALS_H

#include "api/handler.h"
#include "store/token.h"

struct api_route; /* routes.h */

/* What became of the look at a token. */
enum admission { ADMITTED, UNREADABLE, UNKNOWN, EXPIRED, TOO_MANY, NO_MEMORY };

/* Answers 401: the token is UNKNOWN, or EXPIRED. */
void auth_refuse_token(struct api_call *call, enum admission admission);
/* Answers what is not ADMITTED; wait: the seconds until there is a request in the bucket. */
void auth_refuse(struct api_call *call, enum admission admission, double wait);
/* 403 where a viewer would change something, and where the role does not reach the route. */
bool auth_role_allows(struct api_call *call, enum store_role role, const struct api_route *route);

#endif
