/*
 * remote.c - content of other servers over HTTP, by libcurl (remote.h).
 *
 * What libcurl may do is said here in full: HTTP/1.1 of two schemes and nothing else, no proxy, no
 * cookies, no credentials, no encodings, certificates verified. It follows no redirection: each is
 * judged as the first address was. Each connection is judged by its address (remote_reaches), after
 * names were resolved.
 *
 * Bounds: bytes of the content, counted as they come and charged to the thread's account before
 * they are kept; bytes of heads, and of what comes with another status; redirections; seconds, all
 * together. libcurl's own buffers are not charged. About once a second, and with each piece, the
 * account is asked whether to go on.
 *
 * A name is looked up by a thread of libcurl's, which nothing can end. It is left behind when the
 * time is over, the client has gone or the service stops: the C library's own limits end it (some
 * tens of seconds), and only servers that the settings list have names to be looked up.
 *
 * What a server sends with another status than 200 is passed over, and told to nobody but by that
 * status.
 */
#include "api/remote.h"

#include <curl/curl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "clock.h"
#include "jobs/memory.h"

#define REDIRECTS_MAX 5
#define HEADS_MAX ((size_t)64 << 10) /* bytes of the head of an answer, and of what is no content */
#define FIRST ((size_t)64 << 10)     /* bytes that are allocated to begin with */
#define CONNECT_SECONDS 10L
#define STATUS_OK 200L

struct fetch {
    const struct remote_rules *rules;
    CURL *curl;
    struct remote_content *content;
    size_t most, capacity, heads;
    bool full, no_memory, private, stopped;
};

/* ---- What libcurl calls ---------------------------------------------------------------------- */

static curl_socket_t open_socket(void *user, curlsocktype purpose, struct curl_sockaddr *address)
{
    struct fetch *fetch = user;

    if (purpose != CURLSOCKTYPE_IPCXN || !remote_reaches(fetch->rules, &address->addr)) {
        fetch->private = true;
        return CURL_SOCKET_BAD;
    }
    return socket(address->family, address->socktype | SOCK_CLOEXEC, address->protocol);
}

static long status_of(CURL *curl)
{
    long status = 0;

    (void)curl_easy_getinfo(curl, CURLINFO_RESPONSE_CODE, &status);
    return status;
}

/* Room for so many bytes, doubling, charged. */
static bool grow(struct fetch *fetch, size_t size)
{
    struct remote_content *content = fetch->content;
    size_t capacity = fetch->capacity ? fetch->capacity : FIRST;
    unsigned char *bytes;

    while (capacity < size) {
        capacity *= 2;
    }
    capacity = capacity < fetch->most ? capacity : fetch->most;
    if (!jobs_memory_charge(jobs_memory_current(), capacity - content->charged)) {
        return false;
    }
    content->charged = capacity;
    bytes = realloc(content->bytes, capacity);
    if (!bytes) {
        return false;
    }
    content->bytes = bytes;
    fetch->capacity = capacity;
    return true;
}

static size_t take_bytes(char *data, size_t one, size_t size, void *user)
{
    struct fetch *fetch = user;
    struct remote_content *content = fetch->content;

    size *= one;
    if (status_of(fetch->curl) != STATUS_OK) { /* the status says enough */
        fetch->heads += size;
        return fetch->heads <= HEADS_MAX ? size : 0;
    }
    if (size > fetch->most - content->size) {
        fetch->full = true;
        return 0;
    }
    if (content->size + size > fetch->capacity && !grow(fetch, content->size + size)) {
        fetch->no_memory = true;
        return 0;
    }
    if (size > 0) {
        memcpy(content->bytes + content->size, data, size);
    }
    content->size += size;
    return size;
}

static size_t take_head(char *data, size_t one, size_t size, void *user)
{
    struct fetch *fetch = user;

    (void)data;
    fetch->heads += one * size;
    return fetch->heads <= HEADS_MAX ? one * size : 0;
}

static int ask(void *user, curl_off_t wanted, curl_off_t got, curl_off_t to_send, curl_off_t sent)
{
    struct fetch *fetch = user;

    (void)wanted;
    (void)got;
    (void)to_send;
    (void)sent;
    fetch->stopped = fetch->stopped || jobs_memory_told(jobs_memory_current());
    return fetch->stopped;
}

/* ---- One fetch ------------------------------------------------------------------------------- */

static bool set_protocols(CURL *curl)
{
#if LIBCURL_VERSION_NUM >= 0x075500
    return curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, "http,https") == CURLE_OK;
#else
    return curl_easy_setopt(curl, CURLOPT_PROTOCOLS, CURLPROTO_HTTP | CURLPROTO_HTTPS) == CURLE_OK;
#endif
}

/* Lets curl_easy_cleanup not wait for the thread that looks up a name. */
static bool set_quick_exit(CURL *curl)
{
#if LIBCURL_VERSION_NUM >= 0x075700
    return curl_easy_setopt(curl, CURLOPT_QUICK_EXIT, 1L) == CURLE_OK;
#else
    (void)curl; /* it waits: Debian 12 has 7.88 */
    return true;
#endif
}

/* False where one of them cannot be set: nothing is fetched then. */
static bool set_options(struct fetch *fetch, char error[CURL_ERROR_SIZE])
{
    CURL *curl = fetch->curl;
    CURLcode code = CURLE_OK;

#define SET(option, value) \
    code = code == CURLE_OK ? curl_easy_setopt(curl, CURLOPT_##option, (value)) : code
    SET(NOSIGNAL, 1L);
    SET(FOLLOWLOCATION, 0L);
    SET(HTTP_VERSION, (long)CURL_HTTP_VERSION_1_1);
    SET(HTTP09_ALLOWED, 0L);
    SET(PROXY, "");
    SET(NETRC, (long)CURL_NETRC_IGNORED);
    SET(DISALLOW_USERNAME_IN_URL, 1L);
    SET(PATH_AS_IS, 1L);
    SET(SSL_VERIFYPEER, 1L);
    SET(SSL_VERIFYHOST, 2L);
    SET(SSLVERSION, (long)CURL_SSLVERSION_TLSv1_2);
    SET(CONNECTTIMEOUT, CONNECT_SECONDS);
    SET(MAXFILESIZE_LARGE, (curl_off_t)fetch->most);
    SET(USERAGENT, "srnfd");
    SET(ERRORBUFFER, error);
    SET(OPENSOCKETFUNCTION, open_socket);
    SET(OPENSOCKETDATA, fetch);
    SET(WRITEFUNCTION, take_bytes);
    SET(WRITEDATA, fetch);
    SET(HEADERFUNCTION, take_head);
    SET(HEADERDATA, fetch);
    SET(NOPROGRESS, 0L);
    SET(XFERINFOFUNCTION, ask);
    SET(XFERINFODATA, fetch);
#undef SET
    return code == CURLE_OK && set_protocols(curl) && set_quick_exit(curl);
}

/* Whether libcurl's own limits to a line of the head were met. To versions before 8.6 a line that
   is too long for their buffer is a lack of memory; here it is one only before the answer begins,
   since what libcurl allocates later is such lines. */
static bool is_long_line(CURL *curl, CURLcode code)
{
    curl_off_t began = 0;

#if LIBCURL_VERSION_NUM >= 0x080600
    if (code == CURLE_TOO_LARGE) {
        return true;
    }
#endif
    return code == CURLE_OUT_OF_MEMORY &&
           curl_easy_getinfo(curl, CURLINFO_STARTTRANSFER_TIME_T, &began) == CURLE_OK && began > 0;
}

/* What came of one request: REMOTE_FETCHED with any status. */
static enum remote_result judge(struct fetch *fetch, CURLcode code, const char *error)
{
    char *detail = fetch->content->detail;
    size_t size = sizeof fetch->content->detail;
    bool long_line = is_long_line(fetch->curl, code);

    if (fetch->stopped) {
        return REMOTE_STOPPED;
    }
    if (fetch->no_memory || (code == CURLE_OUT_OF_MEMORY && !long_line)) {
        return REMOTE_NO_MEMORY;
    }
    if (fetch->full || code == CURLE_FILESIZE_EXCEEDED) {
        (void)snprintf(detail, size, "it has more than %zu bytes, the limit here", fetch->most);
        return REMOTE_TOO_LARGE;
    }
    if (code == CURLE_OK) {
        return REMOTE_FETCHED;
    }
    if (long_line) {
        (void)snprintf(detail, size, "the server's answer has a line that is too long");
        return REMOTE_FAILED;
    }
    if (fetch->heads > HEADS_MAX) {
        (void)snprintf(detail, size, "the server's answer, of status %ld, is too long",
                       status_of(fetch->curl));
        return REMOTE_FAILED;
    }
    if (fetch->private) {
        (void)snprintf(detail, size,
                       "its host has an address that is not public, and not in --link-networks");
    } else if (code == CURLE_OPERATION_TIMEDOUT) {
        (void)snprintf(detail, size, "it did not come in time (--link-seconds)");
    } else {
        (void)snprintf(detail, size, "%s", error[0] ? error : curl_easy_strerror(code));
    }
    return REMOTE_FAILED;
}

static enum remote_result ask_once(struct fetch *fetch, const char *url, double seconds,
                                   char error[CURL_ERROR_SIZE])
{
    CURLcode code;

    if (!(seconds > 0)) {
        return judge(fetch, CURLE_OPERATION_TIMEDOUT, "");
    }
    error[0] = '\0';
    fetch->heads = 0;
    if (curl_easy_setopt(fetch->curl, CURLOPT_URL, url) != CURLE_OK ||
        curl_easy_setopt(fetch->curl, CURLOPT_TIMEOUT_MS, (long)(1e3 * seconds) + 1) != CURLE_OK) {
        return REMOTE_NO_MEMORY;
    }
    code = curl_easy_perform(fetch->curl);
    return judge(fetch, code, error);
}

static enum remote_result follow(struct fetch *fetch, const char *first, double end,
                                 char error[CURL_ERROR_SIZE])
{
    struct remote_content *content = fetch->content;
    char url[REMOTE_URL_MAX];

    (void)snprintf(url, sizeof url, "%s", first);
    for (int i = 0; i <= REDIRECTS_MAX; i++) {
        enum remote_result result = ask_once(fetch, url, end - clock_now(), error);
        const char *next = NULL, *type = NULL;

        if (result != REMOTE_FETCHED) {
            return result;
        }
        if (status_of(fetch->curl) == STATUS_OK) {
            (void)curl_easy_getinfo(fetch->curl, CURLINFO_CONTENT_TYPE, &type);
            (void)snprintf(content->type, sizeof content->type, "%.*s",
                           type ? (int)strcspn(type, "; \t") : 0, type ? type : "");
            return REMOTE_FETCHED;
        }
        (void)curl_easy_getinfo(fetch->curl, CURLINFO_REDIRECT_URL, &next);
        if (!next) {
            (void)snprintf(content->detail, sizeof content->detail,
                           "the server answered with status %ld", status_of(fetch->curl));
            return REMOTE_FAILED;
        }
        if (!remote_permits(fetch->rules, next, url)) {
            (void)snprintf(content->detail, sizeof content->detail,
                           "the server redirects to where this service fetches nothing from "
                           "(--link-prefixes)");
            return REMOTE_FAILED;
        }
    }
    (void)snprintf(content->detail, sizeof content->detail,
                   "the server redirects more than %d times", REDIRECTS_MAX);
    return REMOTE_FAILED;
}

enum remote_result remote_fetch(const struct remote_rules *rules, const char *url, size_t most,
                                double seconds, struct remote_content *content)
{
    struct fetch fetch = {.rules = rules, .content = content, .most = most};
    char error[CURL_ERROR_SIZE] = "";
    enum remote_result result = REMOTE_NO_MEMORY;
    double end = clock_now() + seconds;

    *content = (struct remote_content){.size = 0};
    fetch.curl = curl_easy_init();
    if (fetch.curl && set_options(&fetch, error)) {
        result = follow(&fetch, url, end, error);
    }
    curl_easy_cleanup(fetch.curl);
    return result;
}

void remote_clear(struct remote_content *content)
{
    free(content->bytes);
    jobs_memory_discharge(jobs_memory_current(), content->charged);
    *content = (struct remote_content){.size = 0};
}
