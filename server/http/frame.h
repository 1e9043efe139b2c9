/*
 * frame.h - where the requests of a connection begin and end, judged from all bytes that come on
 * it: each head (head.h), and each body by its length or its chunks.
 */
#ifndef SRNFD_HTTP_FRAME_H
#define SRNFD_HTTP_FRAME_H

#include "http/head.h"

#define FRAME_CHUNK_LINE_MAX ((size_t)256) /* of a chunk's size with its extensions */
#define FRAME_TRAILERS_MAX ((size_t)4096)  /* of the fields behind the last chunk */

enum frame_state {
    FRAME_HEAD,      /* in a head, or before it */
    FRAME_BODY,      /* of a length that is known */
    FRAME_SIZE,      /* in the digits of a chunk's size */
    FRAME_EXTENSION, /* in what follows them up to CR */
    FRAME_SIZE_LF,   /* before the line feed */
    FRAME_CHUNK,     /* in the bytes of a chunk */
    FRAME_CHUNK_CR,
    FRAME_CHUNK_LF, /* behind them */
    FRAME_TRAILER,  /* at the start of a line behind the last chunk */
    FRAME_TRAILER_LINE,
    FRAME_TRAILER_LF,
    FRAME_END_LF, /* before the very last line feed */
};

/* Zero it to begin with. */
struct frame {
    enum frame_state state;
    uint64_t left;    /* bytes of the body or the chunk that are to come */
    size_t line;      /* bytes of the chunk's line, or of the trailers */
    char *head;       /* the beginning of a head that came in pieces; malloc's, or NULL */
    size_t head_size; /* its bytes */
    size_t heads;     /* that were complete */
};

/* Takes the next bytes. HEAD_REFUSED with refusal [out] set where they go wrong: then none of them
   is to be used, and nothing more may be taken. Otherwise HEAD_COMPLETE. bytes [in/out]: blanks
   behind the value of Content-Length or Transfer-Encoding are moved before it. */
enum head_verdict frame_take(struct frame *frame, char *bytes, size_t size,
                             struct head_refusal *refusal);
void frame_clear(struct frame *frame);

#endif
