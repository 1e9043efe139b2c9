/*
 * fuzz_head.c - any bytes at all as the head of a request. A refusal has a status, a code and a
 * sentence; and the verdict on a beginning is that on the whole, unless it is that more must come.
 */
#include "fuzz/fuzz_require.h"
#include "http/head.h"

#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct head_refusal whole = {0}, part = {0};
    enum head_verdict verdict = head_check((const char *)data, size, &whole);

    if (verdict == HEAD_REFUSED) {
        fuzz_require(whole.status >= 400 && whole.status <= 505);
        fuzz_require(whole.code && whole.code[0] && whole.detail && whole.detail[0]);
    }
    for (size_t n = 0; n < size; n += 1 + size / 16) {
        /* A copy, so that reading past the beginning is seen. */
        char *beginning = malloc(n + 1);
        enum head_verdict early;

        fuzz_require(beginning != NULL);
        memcpy(beginning, data, n);
        beginning = realloc(beginning, n > 0 ? n : 1);
        early = head_check(beginning, n, &part);
        fuzz_require(early == HEAD_INCOMPLETE || early == verdict);
        fuzz_require(early != HEAD_REFUSED || strcmp(part.code, whole.code) == 0);
        free(beginning);
    }
    return 0;
}
