/*
 * frame.c - follows the requests on a connection, byte by byte (RFC 9112, 6 and 7).
 *
 *   chunk = 1*16hex [ *BWS ";" extensions ] CRLF  bytes CRLF    last chunk: size 0, trailers, CRLF
 *
 * Heads are judged by head.c; one that comes in pieces is kept until it is complete, within its
 * limits. Of chunks the form is strict where servers differ: CR LF and nothing else ends a line, a
 * size is hexadecimal digits alone, extensions are bounded and have no control characters. What
 * trailers say is not looked at; nobody here uses them. What is passed on is as it came, but for
 * blanks (move_blanks).
 *
 * Cost: a pass over each head and over the lines of chunks; the bytes of bodies are skipped.
 */
#include "http/frame.h"

#include <stdlib.h>
#include <string.h>

#define SIZE_DIGITS_MAX 15 /* of a chunk's size: fits, and no sum of it overflows */

static enum head_verdict refuse(struct head_refusal *refusal, const char *detail)
{
    *refusal = (struct head_refusal){400, "malformed-request", detail};
    return HEAD_REFUSED;
}

static int hex_value(char c)
{
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                  : -1;
}

static bool is_text(char c)
{
    unsigned char byte = (unsigned char)c;

    return (byte >= 0x20 && byte != 0x7f) || c == '\t';
}

/* ---- Heads ----------------------------------------------------------------------------------- */

static void begin_body(struct frame *frame, const struct head_end *end)
{
    frame->heads++;
    frame->line = 0;
    frame->left = end->chunked ? 0 : end->length;
    frame->state = end->chunked ? FRAME_SIZE : end->length > 0 ? FRAME_BODY : FRAME_HEAD;
}

/* Adds to the head that is kept; false without memory. */
static bool keep(struct frame *frame, const char *bytes, size_t size)
{
    if (!frame->head) {
        frame->head = malloc(HEAD_BYTES_MAX);
        frame->head_size = 0;
    }
    if (frame->head) {
        memcpy(frame->head + frame->head_size, bytes, size);
        frame->head_size += size;
    }
    return frame->head != NULL;
}

/* Blanks behind a value are no part of it (RFC 9112, 5), but libmicrohttpd 0.9.75 takes them for
   one: they go before it. before: bytes of the head that have been passed on, and cannot be
   changed. */
static bool move_blanks(char *bytes, size_t before, const struct head_end *end)
{
    if (end->blanks > 0 && end->value >= before) {
        char *value = bytes + (end->value - before);

        memmove(value + end->blanks, value, end->value_size);
        memset(value, ' ', end->blanks);
    }
    return end->blanks == 0 || end->value >= before;
}

/* Takes bytes of a head: how many goes to *used. */
static enum head_verdict take_head(struct frame *frame, char *bytes, size_t size,
                                   struct head_refusal *refusal, size_t *used)
{
    size_t before = frame->head ? frame->head_size : 0, room = HEAD_BYTES_MAX - before;
    struct head_end end;
    enum head_verdict verdict;

    *used = size < room ? size : room;
    if (frame->head) {
        (void)keep(frame, bytes, *used);
    }
    verdict = frame->head ? head_read(frame->head, frame->head_size, refusal, &end)
                          : head_read(bytes, *used, refusal, &end);
    if (verdict == HEAD_COMPLETE) {
        *used = end.size - before;
        frame_clear(frame);
        if (!move_blanks(bytes, before, &end)) {
            return refuse(refusal, "The length or the coding of the body has blanks behind it, in "
                                   "a head that comes in pieces.");
        }
        begin_body(frame, &end);
    } else if (verdict == HEAD_INCOMPLETE) {
        if (*used == room) {
            return refuse(refusal, "The head has no end.");
        }
        if (!frame->head && !keep(frame, bytes, *used)) {
            *refusal = (struct head_refusal){503, "out-of-memory",
                                             "There is not enough memory for the head."};
            return HEAD_REFUSED;
        }
        verdict = HEAD_COMPLETE;
    }
    return verdict;
}

/* ---- Chunks ---------------------------------------------------------------------------------- */

/* A byte of the line with the size. */
static enum head_verdict take_size(struct frame *frame, char c, struct head_refusal *refusal)
{
    int digit = hex_value(c);

    if (++frame->line > FRAME_CHUNK_LINE_MAX) {
        return refuse(refusal, "The line of a chunk is too long.");
    }
    if (frame->state == FRAME_SIZE && digit >= 0 && frame->line <= SIZE_DIGITS_MAX) {
        frame->left = frame->left * 16 + (uint64_t)digit;
    } else if (c == '\r' && frame->line > 1) {
        frame->state = FRAME_SIZE_LF;
    } else if (frame->state == FRAME_SIZE && c == ';' && frame->line > 1) {
        frame->state = FRAME_EXTENSION;
    } else if (frame->state == FRAME_SIZE || !is_text(c)) {
        return refuse(refusal, "A chunk does not begin with its size and CR LF.");
    }
    return HEAD_COMPLETE;
}

static enum head_verdict take_trailer(struct frame *frame, char c, struct head_refusal *refusal)
{
    if (++frame->line > FRAME_TRAILERS_MAX || !(is_text(c) || c == '\r')) {
        return refuse(refusal, "What follows the last chunk is no field, or too long.");
    }
    if (frame->state == FRAME_TRAILER) {
        frame->state = c == '\r' ? FRAME_END_LF : FRAME_TRAILER_LINE;
    } else if (c == '\r') {
        frame->state = FRAME_TRAILER_LF;
    }
    return HEAD_COMPLETE;
}

/* A line feed, or the CR behind a chunk, and what comes after it. */
static enum head_verdict take_line_end(struct frame *frame, char c, struct head_refusal *refusal)
{
    if (c != (frame->state == FRAME_CHUNK_CR ? '\r' : '\n')) {
        return refuse(refusal, "A line among the chunks does not end in CR LF.");
    }
    switch (frame->state) {
    case FRAME_SIZE_LF:
        frame->state = frame->left > 0 ? FRAME_CHUNK : FRAME_TRAILER;
        frame->line = 0;
        break;
    case FRAME_CHUNK_CR:
        frame->state = FRAME_CHUNK_LF;
        break;
    case FRAME_CHUNK_LF:
        frame->state = FRAME_SIZE; /* left is 0 */
        frame->line = 0;
        break;
    case FRAME_TRAILER_LF:
        frame->state = FRAME_TRAILER;
        break;
    default:
        frame->state = FRAME_HEAD;
        break;
    }
    return HEAD_COMPLETE;
}

/* Passes over what is left of the body or of the chunk; how many bytes. */
static size_t skip(struct frame *frame, size_t size)
{
    size_t used = frame->left < size ? (size_t)frame->left : size;

    frame->left -= used;
    if (frame->left == 0) {
        frame->state = frame->state == FRAME_BODY ? FRAME_HEAD : FRAME_CHUNK_CR;
    }
    return used;
}

enum head_verdict frame_take(struct frame *frame, char *bytes, size_t size,
                             struct head_refusal *refusal)
{
    enum head_verdict verdict = HEAD_COMPLETE;
    size_t used;

    for (size_t at = 0; at < size && verdict == HEAD_COMPLETE; at += used) {
        used = 1;
        switch (frame->state) {
        case FRAME_HEAD:
            verdict = take_head(frame, bytes + at, size - at, refusal, &used);
            break;
        case FRAME_BODY:
        case FRAME_CHUNK:
            used = skip(frame, size - at);
            break;
        case FRAME_SIZE:
        case FRAME_EXTENSION:
            verdict = take_size(frame, bytes[at], refusal);
            break;
        case FRAME_TRAILER:
        case FRAME_TRAILER_LINE:
            verdict = take_trailer(frame, bytes[at], refusal);
            break;
        default:
            verdict = take_line_end(frame, bytes[at], refusal);
            break;
        }
    }
    return verdict;
}

void frame_clear(struct frame *frame)
{
    free(frame->head);
    frame->head = NULL;
    frame->head_size = 0;
}
