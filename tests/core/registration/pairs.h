/*
 * pairs.h - what the tests of geodesics and of shooting share: two surfaces of one degree with the
 * same frame, and a watcher of what a long computation tells its caller.
 */
#ifndef TESTS_SHAPE_PAIRS_H
#define TESTS_SHAPE_PAIRS_H

#include "core/figures.h"

struct pair {
    struct shapes_surface from, to;
    double *velocity; /* toward `to`: NULL before pair_aim */
};

/* Two bodies of shapes_cases; from NULL: two different random stars. */
static inline void pair_open(struct pair *p, size_t degree, const char *from, const char *to)
{
    p->velocity = NULL;
    shapes_open(&p->from, degree);
    shapes_open(&p->to, degree);
    if (from) {
        shapes_fill(&p->from, shapes_find(from)->formula, shapes_find(from)->parameter);
        shapes_fill(&p->to, shapes_find(to)->formula, shapes_find(to)->parameter);
    } else {
        shapes_fill_random_star(&p->from, 1, NULL);
        shapes_fill_random_star(&p->to, 2, NULL);
    }
}

/* Computes the velocity. */
static inline void pair_aim(struct pair *p)
{
    p->velocity = shapes_doubles(3 * p->from.points);
    assert_int_equal(srnf_velocity_toward(p->from.sht, p->from.f, p->to.f, p->velocity), SRNF_OK);
}

static inline void pair_close(struct pair *p)
{
    srnf_free(p->velocity);
    shapes_close(&p->to);
    shapes_close(&p->from);
}

/* Stands for a caller: cancels after so many questions, and demands that progress never falls. */
struct watcher {
    size_t calls, reports;
    size_t stop_after; /* SIZE_MAX: never */
    double last;
};

static inline bool watcher_canceled(void *user)
{
    struct watcher *w = user;

    return w->calls++ >= w->stop_after;
}

static inline void watcher_progress(void *user, double fraction, const char *message)
{
    struct watcher *w = user;

    assert_non_null(message);
    assert_true(fraction >= w->last && fraction <= 1.0);
    w->last = fraction;
    w->reports++;
}

static inline struct srnf_context watcher_context(struct watcher *w)
{
    return (struct srnf_context){
        .user = w, .progress = watcher_progress, .canceled = watcher_canceled};
}

#endif
