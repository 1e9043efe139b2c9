/*
 * internal.h - what the folders of core/ share and the public header does not show.
 */
#ifndef SRNF_INTERNAL_H
#define SRNF_INTERNAL_H

#include "srnf.h"

#define SRNF_PI 3.14159265358979323846
#define SRNF_SQRT_4_PI 3.5449077018110320546 /* a constant field c is this times c Y_00 */

/* Fills error (may be NULL) and returns status, so that a failure is one statement. */
__attribute__((format(printf, 4, 5))) int srnf_fail(struct srnf_error *error, int status,
                                                    int64_t element, const char *format, ...);

/* True where all n numbers are finite; otherwise error names the first that is not. */
bool srnf_check_finite(size_t n, const double *values, const char *what, struct srnf_error *error);

static inline bool srnf_is_canceled(const struct srnf_context *context)
{
    return context && context->canceled && context->canceled(context->user);
}

/* Asks before every so many items of a loop of many cheap ones: is it to break off before this one?
   What it was making is then unfinished, and the function that was called asks once more. */
#define SRNF_ITEMS_ASKED 4096
static inline bool srnf_asks(const struct srnf_context *context, size_t item)
{
    return item % SRNF_ITEMS_ASKED == 0 && srnf_is_canceled(context);
}

/* Counts what was unpacked down from what a reader may still unpack (unpack_left of its limits). */
static inline bool srnf_unpack_count(size_t *left, size_t bytes)
{
    bool enough = !left || bytes <= *left;

    if (left) {
        *left = enough ? *left - bytes : 0;
    }
    return enough;
}

static inline void srnf_report_progress(const struct srnf_context *context, double fraction,
                                        const char *message)
{
    if (context && context->progress) {
        context->progress(context->user, fraction, message);
    }
}

static inline double srnf_seconds(const struct srnf_context *context)
{
    return context && context->seconds ? context->seconds(context->user) : 0.0;
}

/* The context of one of several parts: without progress, since each would count from 0 again. */
static inline struct srnf_context srnf_quiet(const struct srnf_context *context)
{
    struct srnf_context quiet = context ? *context : (struct srnf_context){0};

    quiet.progress = NULL;
    return quiet;
}

/* A parallel loop whose indexes are passed over once its context is canceled. */
struct srnf_loop {
    const struct srnf_context *context;
    void (*body)(void *argument, size_t index);
    void *argument;
};

static inline void srnf_loop_body(void *argument, size_t index)
{
    const struct srnf_loop *loop = (const struct srnf_loop *)argument;

    if (!srnf_is_canceled(loop->context)) {
        loop->body(loop->argument, index);
    }
}

/* Runs body(argument, i) for i in [0, count): by the caller's threads, or here in order. Asks for
   cancellation before each; SRNF_ECANCELED: some were passed over. */
SRNF_CHECKED static inline int srnf_parallel_for(const struct srnf_context *context, size_t count,
                                                 void (*body)(void *argument, size_t index),
                                                 void *argument)
{
    struct srnf_loop loop = {context, body, argument};

    if (context && context->parallel_for) {
        context->parallel_for(context->user, count, srnf_loop_body, &loop);
    } else {
        for (size_t i = 0; i < count; i++) {
            srnf_loop_body(&loop, i);
        }
    }
    return srnf_is_canceled(context) ? SRNF_ECANCELED : SRNF_OK;
}

#endif
