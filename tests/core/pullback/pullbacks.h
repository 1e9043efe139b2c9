/*
 * pullbacks.h - what the tests of the pulled-back metric share: pairs of surfaces, distances of
 * fields, contexts.
 */
#ifndef TESTS_SHAPE_PULLBACKS_H
#define TESTS_SHAPE_PULLBACKS_H

#include "core/stats/group.h"

#include "pullback/pullback.h"

/* Two surfaces of one degree; transform, grid and workspace are those of from. */
struct pullback_pair {
    struct shapes_surface from, to;
};

static inline void pullback_open_stars(struct pullback_pair *p, size_t degree)
{
    shapes_open(&p->from, degree);
    shapes_open(&p->to, degree);
    shapes_fill_random_star(&p->from, 1, NULL);
    shapes_fill_random_star(&p->to, 2, NULL);
}

static inline void pullback_open_bodies(struct pullback_pair *p, size_t degree, const char *from,
                                        const char *to)
{
    shapes_open(&p->from, degree);
    shapes_open(&p->to, degree);
    shapes_fill(&p->from, shapes_find(from)->formula, shapes_find(from)->parameter);
    shapes_fill(&p->to, shapes_find(to)->formula, shapes_find(to)->parameter);
}

/* Both thalami, the right one registered to the left; false where the meshes are not there. */
static inline bool pullback_open_thalami(struct pullback_pair *p, size_t degree)
{
    struct srnf_registration registration;
    bool there;

    shapes_open(&p->from, degree);
    shapes_open(&p->to, degree);
    there = shapes_fill_structure(&p->from, "L_thalamus", SRNF_PARAMETERIZATION_STAR) &&
            shapes_fill_structure(&p->to, "R_thalamus", SRNF_PARAMETERIZATION_STAR);
    if (there) {
        assert_true(srnf_register(p->from.sht, p->from.f, NULL, p->to.f, NULL, NULL, NULL,
                                  &registration, NULL) >= 0);
        memcpy(p->to.f, registration.coefficients, p->to.count * sizeof(double));
        srnf_registration_clear(&registration);
        shapes_update(&p->to);
    }
    return there;
}

static inline void pullback_close(struct pullback_pair *p)
{
    shapes_close(&p->from);
    shapes_close(&p->to);
}

/* ||a - b|| of two fields. */
static inline double pullback_apart(const struct shapes_surface *s, const double *a,
                                    const double *b)
{
    double *difference = shapes_doubles(3 * s->points);
    double distance = pullback_distance(s->grid, a, b, difference);

    srnf_free(difference);
    return distance;
}

/* ||Q(a) - Q(b)|| */
static inline double pullback_chord(const struct shapes_surface *s, const double *a,
                                    const double *b)
{
    double *q = shapes_doubles(6 * s->points);
    double distance;

    srnf_field(s->sht, a, q, s->workspace);
    srnf_field(s->sht, b, q + 3 * s->points, s->workspace);
    distance = pullback_apart(s, q, q + 3 * s->points);
    srnf_free(q);
    return distance;
}

/* Calls of canceled are counted; from stop_after on it says yes. */
struct pullback_watch {
    size_t calls, reports, stop_after;
    double last;
};

static inline bool pullback_watch_canceled(void *user)
{
    struct pullback_watch *watch = user;

    return watch->calls++ >= watch->stop_after;
}

static inline void pullback_watch_progress(void *user, double fraction, const char *message)
{
    struct pullback_watch *watch = user;

    assert_non_null(message);
    assert_true(fraction >= watch->last && fraction <= 1.0);
    watch->last = fraction;
    watch->reports++;
}

/*
 * Runs something to its end, watching, and then again and again with a cancellation that comes
 * after some number of questions: `run` must return SRNF_ECANCELED each time.
 */
static inline void pullback_check_cancellation(int (*run)(void *argument,
                                                          const struct srnf_context *context),
                                               void *argument)
{
    struct pullback_watch watch = {.stop_after = SIZE_MAX};
    struct srnf_context context = {
        .user = &watch, .progress = pullback_watch_progress, .canceled = pullback_watch_canceled};
    size_t calls;

    assert_true(run(argument, &context) >= 0);
    calls = watch.calls;
    assert_true(calls > 2 && watch.reports > 1);
    for (size_t stop = 0; stop < calls; stop += 1 + calls / 5) {
        watch = (struct pullback_watch){.stop_after = stop};
        assert_int_equal(run(argument, &context), SRNF_ECANCELED);
    }
}

#endif
