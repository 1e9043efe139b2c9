/*
 * head.h - the form of a request's head, judged from its bytes.
 */
#ifndef SRNFD_HTTP_HEAD_H
#define SRNFD_HTTP_HEAD_H

#include <stdbool.h>
#include <stddef.h>

#define HEAD_FIELDS_MAX 64
#define HEAD_FIELD_BYTES_MAX ((size_t)16 << 10)
#define HEAD_TARGET_MAX ((size_t)8 << 10)
#define HEAD_METHOD_MAX ((size_t)32)
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

/* Whether this is what a method and a field's name are made of (RFC 9110, 5.6.2). */
bool head_is_token(const char *text, size_t length);

/*
 * Judges the first size bytes of a request: request line, header fields, empty line. What follows
 * the empty line is not looked at. refusal [out] is set with HEAD_REFUSED only. Pure.
 */
enum head_verdict head_check(const char *bytes, size_t size, struct head_refusal *refusal);

#endif
