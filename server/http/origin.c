/*
 * origin.c - keeps web pages away from a service that asks for no token.
 *
 * A browser on the same machine carries requests of any site here. It can be told by two fields
 * that a page cannot forge: Host, which names the site's own domain where that was pointed at
 * 127.0.0.1 (DNS rebinding), and Origin, which a browser adds to every POST, PUT, PATCH and DELETE
 * across sites. So Host must be localhost, 127.0.0.1, [::1] or the address listened on, with its
 * port, or one of the allowed hosts; and Origin, where a request may change something, one of the
 * same. A service that listens beyond loopback without tokens cannot know by which addresses it is
 * reached: there Host may also be any address in numbers, which no site's domain can be made to
 * look like, and Origin whatever Host is. Programs that send no Origin are not affected.
 */
#include "http/internal.h"

#include <arpa/inet.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

static const char *const names[] = {"localhost", "127.0.0.1", "[::1]"};

static bool equal(const char *a, size_t length, const char *b, size_t b_length)
{
    return length == b_length && strncasecmp(a, b, length) == 0;
}

/* name and port: "localhost", ":8080"; a host without port means port 80. */
static bool is_name_with(const char *host, const char *name, size_t name_length, const char *port)
{
    if (strncasecmp(host, name, name_length) != 0) {
        return false;
    }
    return strcmp(host + name_length, port) == 0 ||
           (host[name_length] == '\0' && strcmp(port, ":80") == 0);
}

/* Among the hosts separated by commas; one without a port stands for every port. */
static bool is_listed(const char *host, const char *list)
{
    const char *colon = strrchr(host, ':');
    size_t name_length = colon && !strchr(colon, ']') ? (size_t)(colon - host) : strlen(host);

    while (list && *list) {
        size_t length;

        list += strspn(list, ", ");
        length = strcspn(list, ", ");
        if (length > 0 &&
            (equal(host, strlen(host), list, length) || equal(host, name_length, list, length))) {
            return true;
        }
        list += length;
    }
    return false;
}

/* An address in numbers, with a port or without. */
static bool is_numeric(const char *host)
{
    unsigned char bytes[sizeof(struct in6_addr)];
    char name[INET6_ADDRSTRLEN + 1];
    bool bracket = host[0] == '[';
    size_t length = strcspn(host + bracket, bracket ? "]" : ":");
    const char *rest = host + bracket + length;

    if (length >= sizeof name || (bracket && *rest++ != ']') || (*rest && *rest != ':') ||
        (*rest == ':' && rest[1 + strspn(rest + 1, "0123456789")] != '\0')) {
        return false;
    }
    (void)snprintf(name, sizeof name, "%.*s", (int)length, host + bracket);
    return inet_pton(bracket ? AF_INET6 : AF_INET, name, bytes) == 1;
}

static bool is_ours(const char *address, const char *extra, const char *host)
{
    const char *port = strrchr(address, ':');

    if (is_name_with(host, address, (size_t)(port - address), port) || is_listed(host, extra)) {
        return true;
    }
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        if (is_name_with(host, names[i], strlen(names[i]), port)) {
            return true;
        }
    }
    return false;
}

const char *origin_check(const char *address, const char *extra, bool local, const char *method,
                         const char *host, const char *origin)
{
    bool reads =
        strcmp(method, "GET") == 0 || strcmp(method, "HEAD") == 0 || strcmp(method, "OPTIONS") == 0;
    const char *site = origin ? strstr(origin, "://") : NULL;

    if (host && !is_ours(address, extra, host) && (local || !is_numeric(host))) {
        return "Host names neither a loopback address with the port of this service nor one of "
               "the allowed hosts (--allowed-hosts).";
    }
    if (origin && !reads && site && !local && host && strcasecmp(site + 3, host) == 0) {
        return NULL;
    }
    if (origin && !reads && !(site && is_ours(address, extra, site + 3))) {
        return "Origin is another site: requests that change something come from this service's "
               "own address or from one of the allowed hosts (--allowed-hosts).";
    }
    return NULL;
}
