/*
 * remote.h - content of other servers, which links in the inputs of an execution name, where the
 * settings allow it (--link-prefixes).
 */
#ifndef SRNFD_API_REMOTE_H
#define SRNFD_API_REMOTE_H

#include <stdbool.h>
#include <stddef.h>
#include <sys/socket.h>

#include "api/handler.h"

/* ---- Rules (remote_rules.c): pure ------------------------------------------------------------ */

#define REMOTE_URL_MAX 2048
#define REMOTE_TYPE_MAX 96

struct remote_rules;

/*
 * Reads the settings.
 *   prefixes [in]  addresses under which content may lie, separated by commas: each has a scheme,
 *                  http or https, a host, and a path that ends in a slash; "": none
 *   networks [in]  addresses of the Internet Protocol, or networks as 10.1.0.0/16, separated by
 *                  commas, that links may lead to although they are not public; "": none
 *   message  [out] a sentence on failure
 * Returns NULL on failure. To be called once before threads fetch.
 */
struct remote_rules *remote_rules_read(const char *prefixes, const char *networks, char *message,
                                       size_t size);
void remote_rules_free(struct remote_rules *rules);
/* Whether anything may be fetched at all; NULL: nothing. */
bool remote_enabled(const struct remote_rules *rules);
/* Whether the address lies under one of the prefixes; then url is it in its normal form, which is
   what must be asked for. */
bool remote_permits(const struct remote_rules *rules, const char *address,
                    char url[REMOTE_URL_MAX]);
/* Whether a connection to this address may be opened: it is public, or in one of the networks. */
bool remote_reaches(const struct remote_rules *rules, const struct sockaddr *address);

/* ---- Fetching (remote.c) --------------------------------------------------------------------- */

enum remote_result {
    REMOTE_FETCHED,
    REMOTE_FAILED,    /* content->detail says why */
    REMOTE_TOO_LARGE, /* the same */
    REMOTE_NO_MEMORY,
    REMOTE_STOPPED, /* the thread's account was told to stop */
};

struct remote_content {
    unsigned char *bytes;
    size_t size, charged;
    char type[REMOTE_TYPE_MAX]; /* its media type, or "" */
    char detail[300];
};

/*
 * Fetches what is at the address, which remote_permits has given, charged to the thread's account.
 *   most    [in]  bytes that it may have
 *   seconds [in]  that it may take, all redirections together
 *   content [out] to be cleared in any case
 */
enum remote_result remote_fetch(const struct remote_rules *rules, const char *url, size_t most,
                                double seconds, struct remote_content *content);
void remote_clear(struct remote_content *content);

/* ---- Links in inputs (remote_input.c) -------------------------------------------------------- */

/*
 * Fetches what a link leads to and keeps it for the caller as an upload of the same bytes.
 *   href, type [in]     of the link, which remote_permits; type may be NULL
 *   pointer    [in]     of the input
 *   seconds    [in/out] left for all links of this request
 * Returns the id of the mesh or volume (new reference), or NULL with a problem answered.
 */
json_t *remote_input(struct api_call *call, const char *href, const char *type, const char *pointer,
                     double *seconds);

#endif
