/*
 * refusing.h - memory that runs out when a test says so.
 *
 * A program that includes this header, in one file, brings its own srnf_alloc and srnf_free, which
 * the linker prefers to those of the library (core/memory.c). They keep what those promise -
 * zeroed, 64-byte aligned, overflow is a refusal -, count what is alive, and refuse one request or,
 * where a test says so, all from one on.
 * What the limits on memory need, sizes and the highest water, is not counted here. Not for
 * programs whose allocations come from several threads at once.
 */
#ifndef TESTS_REFUSING_H
#define TESTS_REFUSING_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "srnf.h"

static struct {
    size_t requests; /* since the last refusing_at or refusing_none */
    size_t refused;  /* index of the request to refuse; SIZE_MAX: none */
    bool lasting;    /* and all after it: there is no memory to clean up with either */
    size_t alive;    /* blocks */
} refusing = {.refused = SIZE_MAX};

void *srnf_alloc(size_t count, size_t size)
{
    size_t index = refusing.requests++;
    void *pointer;

    if (index == refusing.refused || (refusing.lasting && index > refusing.refused) ||
        (size > 0 && count > PTRDIFF_MAX / size - 64)) {
        return NULL;
    }
    pointer = aligned_alloc(64, (count * size + 64) / 64 * 64);
    if (pointer) {
        memset(pointer, 0, count * size);
        refusing.alive++;
    }
    return pointer;
}

void srnf_free(void *pointer)
{
    refusing.alive -= pointer != NULL;
    free(pointer);
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define REFUSING_SANITIZED 1
#else
#define REFUSING_SANITIZED 0
#endif

/* Counts from 0 again and refuses the request of this index. */
static inline void refusing_at(size_t index)
{
    refusing.requests = 0;
    refusing.refused = index;
}

/* Counts from 0 again and refuses nothing. */
static inline void refusing_none(void)
{
    refusing_at(SIZE_MAX);
}

/* Requests that a run makes when all are granted. It must succeed and leave nothing alive. */
static inline size_t refusing_count(const char *name, int (*run)(void))
{
    size_t before = refusing.alive;
    int status;

    refusing_none();
    status = run();
    if (status < 0) {
        fail_msg("%s, nothing refused: status %d %s", name, status, srnf_strerror(status));
    }
    assert_int_equal(refusing.alive, before);
    assert_true(refusing.requests > 0);
    return refusing.requests;
}

/* Runs with one request refused: the first `each` requests in turn, then every stride-th; or every
   STRIDE-th of all where the environment says so, as "make faults" does with 1. Sanitizers, which
   look at each run more closely, see fewer of them. Every
   such run must come to the refusal, end in SRNF_ENOMEM and leave nothing alive; after the last one
   a run that is refused nothing must do what the first one did. Returns how many requests that
   makes. */
static inline size_t refusing_sweep(const char *name, int (*run)(void), size_t each, size_t stride)
{
    size_t total = refusing_count(name, run), before = refusing.alive;
    const char *asked = getenv("STRIDE");

    if (asked && strtoul(asked, NULL, 10) > 0) {
        each = 0;
        stride = strtoul(asked, NULL, 10);
    }
    printf("# %s: %zu allocations%s\n", name, total, refusing.lasting ? ", one and all after" : "");
    if (REFUSING_SANITIZED && !asked) {
        each /= 2;
        stride *= 3;
    }
    for (size_t n = 0; n < total; n += n < each ? 1 : stride) {
        size_t made;
        int status;

        refusing_at(n);
        status = run();
        made = refusing.requests;
        refusing_none(); /* what a failed test leaves behind refuses nothing */
        if (made <= n) {
            fail_msg("%s makes fewer requests than before", name);
        }
        if (status != SRNF_ENOMEM) {
            fail_msg("%s, request %zu refused: status %d", name, n, status);
        }
        assert_int_equal(refusing.alive, before);
    }
    assert_int_equal(refusing_count(name, run), total);
    return total;
}

#endif
