/*
 * link.c - requests by libcurl: TLS, keep-alive and time limits are its.
 *
 * Redirects are not followed and proxies not used: the token goes to the service that was named and
 * to nobody else. The file of the token is read for each request, so that one that was replaced
 * counts from then on. An answer has a bound, beyond which it counts as none.
 */
#include "worker/link.h"

#include "clock.h"

#define CURL_DISABLE_TYPECHECK
#include <curl/curl.h>

#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define ANSWER_MAX ((size_t)64 << 20)
#define CONNECT_SECONDS 10L
/* That a request which may be broken off is waited for: an answer on its way may be a lease, and
   nobody would give that back. */
#define ARRIVAL_SECONDS 0.25

struct link {
    const struct link_target *target;
    const atomic_bool *stop;
    double left; /* when a request that may be broken off is, since it was to stop; 0: it is not */
    CURL *curl;
    char error[CURL_ERROR_SIZE];
};

static bool is_loopback(const char *host)
{
    return strcasecmp(host, "localhost") == 0 || strncmp(host, "127.", 4) == 0 ||
           strcmp(host, "[::1]") == 0 || strcmp(host, "::1") == 0;
}

const char *link_problem(const struct link_target *target)
{
    CURLU *url = curl_url();
    char *scheme = NULL, *host = NULL;
    const char *problem = "--server must be as in https://host:8443 or http://127.0.0.1:8080";

    if (url && curl_url_set(url, CURLUPART_URL, target->url, 0) == CURLUE_OK &&
        curl_url_get(url, CURLUPART_SCHEME, &scheme, 0) == CURLUE_OK &&
        curl_url_get(url, CURLUPART_HOST, &host, 0) == CURLUE_OK) {
        if (strcmp(scheme, "https") == 0) {
            problem = NULL;
        } else if (strcmp(scheme, "http") == 0) {
            problem = is_loopback(host) ? NULL
                                        : "--server must be https beyond this machine: in clear "
                                          "text everyone on the way could read the token";
        }
    }
    curl_free(scheme);
    curl_free(host);
    curl_url_cleanup(url);
    return problem;
}

struct link *link_create(const struct link_target *target, const atomic_bool *stop)
{
    struct link *link = calloc(1, sizeof *link);

    if (link) {
        *link = (struct link){.target = target, .stop = stop, .curl = curl_easy_init()};
        if (!link->curl) {
            free(link);
            link = NULL;
        }
    }
    return link;
}

void link_destroy(struct link *link)
{
    if (link) {
        curl_easy_cleanup(link->curl);
        free(link);
    }
}

void link_answer_clear(struct link_answer *answer)
{
    free(answer->bytes);
    *answer = (struct link_answer){.status = 0};
}

static size_t on_bytes(char *bytes, size_t size, size_t count, void *user)
{
    struct link_answer *answer = user;
    size_t more = size * count;
    unsigned char *grown;

    if (more > ANSWER_MAX - answer->size) {
        return 0;
    }
    grown = realloc(answer->bytes, answer->size + more + 1);
    if (!grown) {
        return 0;
    }
    memcpy(grown + answer->size, bytes, more);
    answer->bytes = grown;
    answer->size += more;
    grown[answer->size] = '\0';
    return more;
}

static int on_progress(void *user, curl_off_t total, curl_off_t now, curl_off_t up_total,
                       curl_off_t up_now)
{
    struct link *link = user;

    (void)total;
    (void)now;
    (void)up_total;
    (void)up_now;
    if (!atomic_load(link->stop)) {
        return 0;
    }
    if (link->left <= 0.0) {
        link->left = clock_now() + ARRIVAL_SECONDS;
    }
    return clock_now() >= link->left;
}

/* Adds a header; false without memory. */
static bool add(struct curl_slist **headers, const char *name, const char *value)
{
    char line[512];
    struct curl_slist *longer;

    if (!value) {
        return true;
    }
    (void)snprintf(line, sizeof line, "%s: %s", name, value);
    longer = curl_slist_append(*headers, line);
    sodium_memzero(line, sizeof line);
    *headers = longer ? longer : *headers;
    return longer != NULL;
}

/* "Bearer " and the first line of the file of the token; "" where it cannot be read. */
static void read_token(const char *path, char value[LINK_TOKEN_MAX])
{
    FILE *file = path ? fopen(path, "re") : NULL;
    char line[LINK_TOKEN_MAX - 8];

    value[0] = '\0';
    if (file && fgets(line, sizeof line, file)) {
        line[strcspn(line, "\r\n")] = '\0';
        (void)snprintf(value, LINK_TOKEN_MAX, "Bearer %s", line);
        sodium_memzero(line, sizeof line);
    }
    if (file) {
        (void)fclose(file);
    }
}

static bool make_headers(const struct link *link, const struct link_request *request,
                         struct curl_slist **headers)
{
    char token[LINK_TOKEN_MAX];
    bool made;

    if (link->target->token) {
        (void)snprintf(token, sizeof token, "Bearer %s", link->target->token);
    } else {
        read_token(link->target->token_file, token);
    }
    made = add(headers, "Authorization", token[0] ? token : NULL) &&
           add(headers, "Lease-Secret", request->secret) &&
           add(headers, "Content-Type", request->type) &&
           add(headers, "Content-Digest", request->digest) && add(headers, "Expect", "");
    if (request->made) {
        made = made && add(headers, "Worker-Host", link->target->host) &&
               add(headers, "Worker-CPU", link->target->cpu) &&
               add(headers, "Worker-Build", link->target->build);
    }
    sodium_memzero(token, sizeof token);
    return made;
}

static void set_options(struct link *link, const struct link_request *request,
                        struct link_answer *answer, const char *url)
{
    CURL *curl = link->curl;

    curl_easy_reset(curl); /* connections stay */
    (void)curl_easy_setopt(curl, CURLOPT_URL, url);
    (void)curl_easy_setopt(curl, CURLOPT_CUSTOMREQUEST, request->method);
    (void)curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L);
    (void)curl_easy_setopt(curl, CURLOPT_NOPROXY, "*");
    (void)curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT, CONNECT_SECONDS);
    (void)curl_easy_setopt(curl, CURLOPT_TIMEOUT_MS, (long)(1e3 * request->seconds));
    (void)curl_easy_setopt(curl, CURLOPT_TCP_NODELAY, 1L);
    (void)curl_easy_setopt(curl, CURLOPT_ERRORBUFFER, link->error);
    (void)curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, on_bytes);
    (void)curl_easy_setopt(curl, CURLOPT_WRITEDATA, answer);
    if (request->stops) {
        (void)curl_easy_setopt(curl, CURLOPT_NOPROGRESS, 0L);
        (void)curl_easy_setopt(curl, CURLOPT_XFERINFOFUNCTION, on_progress);
        (void)curl_easy_setopt(curl, CURLOPT_XFERINFODATA, link);
    }
    if (link->target->certificate) { /* instead of the system's, a file and a folder */
        (void)curl_easy_setopt(curl, CURLOPT_CAPATH, NULL);
        (void)curl_easy_setopt(curl, CURLOPT_CAINFO, link->target->certificate);
    }
    if (request->type) {
        (void)curl_easy_setopt(curl, CURLOPT_POSTFIELDSIZE_LARGE, (curl_off_t)request->size);
        (void)curl_easy_setopt(curl, CURLOPT_POSTFIELDS, request->body ? request->body : "");
    }
}

void link_send(struct link *link, const struct link_request *request, struct link_answer *answer)
{
    struct curl_slist *headers = NULL;
    char url[600];
    CURLcode code = CURLE_OUT_OF_MEMORY;

    *answer = (struct link_answer){.status = 0};
    link->error[0] = '\0';
    link->left = 0.0;
    (void)snprintf(url, sizeof url, "%s%s", link->target->url, request->path);
    set_options(link, request, answer, url);
    if (make_headers(link, request, &headers)) {
        (void)curl_easy_setopt(link->curl, CURLOPT_HTTPHEADER, headers);
        code = curl_easy_perform(link->curl);
    }
    if (code == CURLE_OK) {
        (void)curl_easy_getinfo(link->curl, CURLINFO_RESPONSE_CODE, &answer->status);
    } else {
        link_answer_clear(answer);
        (void)snprintf(answer->why, sizeof answer->why, "%s",
                       link->error[0] ? link->error : curl_easy_strerror(code));
    }
    curl_slist_free_all(headers);
}
