/*
 * listen.c - the listening socket: "host:port" with a numeric IPv4 address, or "[host]:port" with
 * an IPv6 one. Names are not resolved: what a daemon listens on should not depend on a resolver.
 */
#include "http/internal.h"

#include <arpa/inet.h>
#include <errno.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

/* A burst that comes while the front does not run waits here, instead of a second at the client. */
#define BACKLOG 4096
/* Of a response in the socket's buffer, beside what is on its way; for each connection. Without it
   one that is not read would fill megabytes, and its copying would keep others waiting. */
#define UNSENT_MAX (128 << 10)

union address {
    struct sockaddr any;
    struct sockaddr_in v4;
    struct sockaddr_in6 v6;
};

/* Splits and converts; false where the text is no address with a port. */
static bool parse(const char *text, union address *address, socklen_t *length)
{
    const char *colon = strrchr(text, ':');
    size_t host_length = colon ? (size_t)(colon - text) : 0;
    char host[64], *end = NULL;
    long port;

    if (!colon || host_length == 0 || host_length >= sizeof host || colon[1] < '0' ||
        colon[1] > '9') {
        return false;
    }
    port = strtol(colon + 1, &end, 10);
    if (*end || port > 65535) {
        return false;
    }
    memset(address, 0, sizeof *address);
    if (text[0] == '[' && text[host_length - 1] == ']') {
        memcpy(host, text + 1, host_length - 2);
        host[host_length - 2] = '\0';
        address->v6.sin6_family = AF_INET6;
        address->v6.sin6_port = htons((uint16_t)port);
        *length = sizeof address->v6;
        return inet_pton(AF_INET6, host, &address->v6.sin6_addr) == 1;
    }
    memcpy(host, text, host_length);
    host[host_length] = '\0';
    address->v4.sin_family = AF_INET;
    address->v4.sin_port = htons((uint16_t)port);
    *length = sizeof address->v4;
    return inet_pton(AF_INET, host, &address->v4.sin_addr) == 1;
}

bool http_is_address(const char *listen_text)
{
    union address address;
    socklen_t length;

    return parse(listen_text, &address, &length);
}

bool http_is_loopback(const char *listen_text)
{
    union address address;
    socklen_t length;

    if (!parse(listen_text, &address, &length)) {
        return false;
    }
    if (address.any.sa_family == AF_INET6) {
        return IN6_IS_ADDR_LOOPBACK(&address.v6.sin6_addr);
    }
    return (ntohl(address.v4.sin_addr.s_addr) >> 24) == 127;
}

static void write_address(const union address *bound, char *address, size_t size)
{
    char host[INET6_ADDRSTRLEN] = "";

    if (bound->any.sa_family == AF_INET6) {
        (void)inet_ntop(AF_INET6, &bound->v6.sin6_addr, host, sizeof host);
        (void)snprintf(address, size, "[%s]:%u", host, (unsigned)ntohs(bound->v6.sin6_port));
    } else {
        (void)inet_ntop(AF_INET, &bound->v4.sin_addr, host, sizeof host);
        (void)snprintf(address, size, "%s:%u", host, (unsigned)ntohs(bound->v4.sin_port));
    }
}

int listen_open(const char *text, char *address, size_t address_size, char *message, size_t size)
{
    union address wanted;
    socklen_t length;
    int fd, on = 1, unsent = UNSENT_MAX;

    if (!parse(text, &wanted, &length)) {
        (void)snprintf(message, size, HTTP_NO_ADDRESS, text);
        return -1;
    }
    fd = socket(wanted.any.sa_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd < 0 || setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) != 0 ||
        setsockopt(fd, IPPROTO_TCP, TCP_NOTSENT_LOWAT, &unsent, sizeof unsent) != 0 ||
        bind(fd, &wanted.any, length) != 0 || listen(fd, BACKLOG) != 0 ||
        getsockname(fd, &wanted.any, &length) != 0) {
        (void)snprintf(message, size, "cannot listen on %s: %s", text, strerror(errno));
        if (fd >= 0) {
            (void)close(fd);
        }
        return -1;
    }
    write_address(&wanted, address, address_size);
    return fd;
}
