/*
 * head.h - the form of a request's head, judged from its bytes.
 */
#ifndef SRNFD_HTTP_HEAD_H
#define SRNFD_HTTP_HEAD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define HEAD_FIELDS_MAX 64
#define HEAD_FIELD_BYTES_MAX ((size_t)16 << 10)
#define HEAD_TARGET_MAX ((size_t)8 << 10)
#define HEAD_METHOD_MAX ((size_t)32)
#define HEAD_PARAMETERS_MAX ((size_t)128)
/* What libmicrohttpd takes of a connection's 32 KiB for each field, query parameter and cookie, for
   all of them beside the copy of the cookies, and with the head itself. It reads into half of the
   32 KiB first, and where it runs out of them it answers by a page of its own, or never. */
#define HEAD_ITEM_BYTES ((size_t)64)
#define HEAD_ITEMS_BYTES_MAX ((size_t)15872)
#define HEAD_MEMORY_MAX ((size_t)31 << 10)
/* Enough to see that either limit is passed. */
#define HEAD_BYTES_MAX (HEAD_FIELD_BYTES_MAX + HEAD_TARGET_MAX + 512)

enum head_verdict {
    HEAD_INCOMPLETE, /* nothing wrong so far; its end has not come */
    HEAD_COMPLETE,   /* well formed, to its end */
    HEAD_REFUSED,
};

/* Why: static texts. */
struct head_refusal {
    int status;
    const char *code, *detail;
};

/*
 * Judges the first size bytes of a request: request line, header fields, empty line. What follows
 * the empty line is not looked at. refusal [out] is set with HEAD_REFUSED only. Pure.
 */
enum head_verdict head_check(const char *bytes, size_t size, struct head_refusal *refusal);

/* What a complete head says of what follows it. */
struct head_end {
    size_t size;     /* bytes of the head */
    bool chunked;    /* the body's end is told by its chunks */
    uint64_t length; /* bytes of the body otherwise */
    /* Of the field that says so: where its value begins, its bytes, and those of blanks behind. */
    size_t value, value_size, blanks;
};
/* The same; end [out] is set with HEAD_COMPLETE only. */
enum head_verdict head_read(const char *bytes, size_t size, struct head_refusal *refusal,
                            struct head_end *end);

/* The value of a field in a head that is complete, without blanks around it, and its length; NULL
   where there is none of that name. */
const char *head_field(const char *bytes, size_t size, const char *name, size_t *length);
/* Like head_check for the first record of a client that is to speak TLS (RFC 8446, 5.1), of which
   only the form is judged: complete once all of it is there. */
enum head_verdict head_check_tls(const char *bytes, size_t size, struct head_refusal *refusal);

#endif
