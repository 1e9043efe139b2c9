/*
 * tap.c - what libmicrohttpd reads, judged before it gets it.
 *
 * libmicrohttpd 0.9.75 takes a line feed alone for the end of a line, cuts values at zero bytes,
 * and answers other faults with pages of its own, some with two heads. It offers no place between
 * the socket and its parser. So this program has functions of the names by which it reads, recv
 * and gnutls_record_recv (--defsym in the Makefile): the dynamic linker gives libmicrohttpd these,
 * and they pass on what was read when frame.c finds it well formed. Otherwise they send the problem
 * themselves and tell libmicrohttpd that the client has gone. That is in good order: while it reads
 * a request it has nothing to send.
 *
 * The end of what a client sends is passed on only while bytes of a request are awaited: where one
 * is being answered, libmicrohttpd would take it for the end of the client, and close.
 *
 * Whatever else calls recv, in this program or in a library, is not affected: a thread that never
 * opened a connection knows no service, and a descriptor that is not one of a connection's is not
 * in the table. With TLS the table is empty, since there recv gets ciphertext.
 *
 * Should libmicrohttpd come to read by other means, no head would be seen here, and each request
 * is refused (tap_saw): the service stops working rather than being open without a word.
 *
 * Threads: a connection's frame belongs to its thread. The table is written by these threads at
 * their own descriptors only.
 */
#include "http/internal.h"

#include <errno.h>
#include <gnutls/gnutls.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

/* recv(2) and gnutls_record_recv(3): the linker gives them these names (Makefile). */
ssize_t tap_recv(int fd, void *buffer, size_t size, int flags);
ssize_t tap_record_recv(gnutls_session_t session, void *data, size_t size);

/* The service whose connections this thread has; set once in a thread's life. */
static _Thread_local const struct http *served;

int tap_start(struct http *http)
{
    struct rlimit limit;

    if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) {
        return -1;
    }
    http->taps = calloc((size_t)limit.rlim_cur, sizeof *http->taps);
    http->judged = calloc((size_t)limit.rlim_cur, sizeof *http->judged);
    http->n_taps = (size_t)limit.rlim_cur;
    return http->taps && http->judged ? 0 : -1;
}

void tap_open(struct connection *connection)
{
    const struct http *http = connection->http;

    served = http;
    if (!http->tls && (size_t)connection->fd < http->n_taps) {
        http->taps[connection->fd] = connection;
    }
}

void tap_close(struct connection *connection)
{
    const struct http *http = connection->http;

    if (!http->tls && (size_t)connection->fd < http->n_taps) {
        http->taps[connection->fd] = NULL;
    }
    frame_clear(&connection->frame);
}

bool tap_saw(struct connection *connection)
{
    return connection->frame.heads > 0;
}

/* Whether the bytes may go on; otherwise the answer was sent. session: NULL without TLS. */
static bool judge(struct connection *connection, gnutls_session_t session, char *bytes, size_t size)
{
    struct head_refusal refusal;
    char text[REFUSAL_MAX], start[5] = "";
    size_t length;

    if (frame_take(&connection->frame, bytes, size, &refusal) == HEAD_COMPLETE) {
        return true;
    }
    for (size_t i = 0; i < sizeof start && i < size; i++) {
        start[i] = bytes[i];
    }
    length = refusal_write(connection->http, &refusal, start, text);
    if (session) {
        (void)!gnutls_record_send(session, text, length);
    } else {
        (void)!send(connection->fd, text, length, MSG_NOSIGNAL | MSG_DONTWAIT);
    }
    front_linger(connection->http, dup(connection->fd));
    return false;
}

/* Whether libmicrohttpd may see now that the peer sends no more. While it waits for bytes of a
   request it closes the connection for it; but it does so too where it has the whole request,
   and its answer is being made. Then it learns of the end when it waits for the next request
   (timer.c). */
static bool may_end(struct connection *connection)
{
    if (atomic_load_explicit(&connection->reads, memory_order_relaxed)) {
        return true;
    }
    atomic_store(&connection->ended, false);
    return false;
}

/* ---- In the place of the libraries' ---------------------------------------------------------- */

ssize_t tap_recv(int fd, void *buffer, size_t size, int flags)
{
    ssize_t n = recvfrom(fd, buffer, size, flags, NULL, NULL);
    struct connection *connection;

    if (n < 0 || !served || served->tls || fd < 0 || (size_t)fd >= served->n_taps) {
        return n;
    }
    connection = served->taps[fd];
    if (n == 0 && size > 0 && connection && !may_end(connection)) {
        errno = EAGAIN;
        return -1;
    }
    return n == 0 || !connection || judge(connection, NULL, buffer, (size_t)n) ? n : 0;
}

ssize_t tap_record_recv(gnutls_session_t session, void *data, size_t size)
{
    unsigned char sequence[8];
    ssize_t n = gnutls_record_recv_seq(session, data, size, sequence);
    struct connection *connection;

    if ((n < 0 && n != GNUTLS_E_PREMATURE_TERMINATION) || !served) {
        return n;
    }
    connection = connection_of(gnutls_session_get_ptr(session));
    if (n <= 0) {
        return connection && !may_end(connection) ? GNUTLS_E_AGAIN : n;
    }
    return !connection || judge(connection, session, data, (size_t)n) ? n : 0;
}
