/*
 * mean_subject.c - one subject of a group mean: where its registration puts it.
 *
 * The state of a subject is its rotation O and the chain of its warp. All else follows from them:
 * the points gamma(s) of the working grid, their Jacobians J, q_i and its derivative at the
 * points, and
 *
 *   q(s) = O sqrt(J(s)) q_i(gamma_i(s)).
 *
 * Nothing is resampled, so nothing is lost from one iteration to the next. Points and Jacobians are
 * the same bits whether they were moved link by link as the chain grew or are replayed from it: a
 * run that is resumed from its chains goes on with the same bits.
 *
 * The first registration is a search from nothing. Later ones only move the warp on (mean_step.c).
 * Where the domain is not warped but only rotated, each is a search.
 *
 * A replay costs one evaluation of f at P points and one of a field for each link of the chain.
 */
#include "mean.h"

#include <lapacke.h>
#include <math.h>
#include <string.h>

/* Damping of the steps, relative to the mean diagonal of H: small, as it is never raised. */
#define DAMPING 1e-3

int mean_prepare(const struct mean_run *run, size_t i)
{
    struct mean_subject *subject = &run->subjects[i];
    size_t degree = srnf_sht_degree(run->sht);
    struct problem problem = {.moving = &subject->moving};
    int status = moving_create(&subject->moving, degree, run->surfaces[i], degree, run->context);

    status = status ? status : samples_create(&subject->samples, run->points);
    if (status || !mean_is_warped(run)) {
        return status;
    }
    problem.target.norm2 = run->norm2;
    if (!run->registration.exact) {
        problem.penalty.displacement = run->registration.penalty_displacement;
    }
    return level_create(&subject->level, &problem, run->degree);
}

void mean_subject_clear(struct mean_subject *subject)
{
    srnf_warp_clear(&subject->warp);
    moving_clear(&subject->moving);
    level_clear(&subject->level);
    samples_clear(&subject->samples);
}

int mean_register(const struct mean_run *run, size_t i, const struct srnf_context *context,
                  struct srnf_error *error)
{
    struct mean_subject *subject = &run->subjects[i];
    struct search_result found = {.iterations = 0};
    struct search search;
    int status = search_create(&search, run->work, run->mean_q, NULL, run->surfaces[i],
                               &run->registration, NULL, context);

    if (status == SRNF_OK) {
        search.full.target.norm2 = run->norm2;
        status = search_run(&search, &found);
        search_clear(&search);
    }
    if (status) {
        return srnf_fail(error, status, (int64_t)i, "registering surface %zu to the mean: %s", i,
                         srnf_strerror(status));
    }
    srnf_warp_clear(&subject->warp);
    subject->warp = found.warp.chain;
    found.warp.chain = (struct srnf_warp){0};
    memcpy(subject->rotation, found.warp.rotation, sizeof subject->rotation);
    search_result_clear(&found);
    return SRNF_OK;
}

int mean_replay(const struct mean_run *run, size_t i)
{
    double *gamma = run->gamma + 3 * i * run->points;
    double *jacobian = run->jacobian + i * run->points;

    memcpy(gamma, run->nodes, 3 * run->points * sizeof(double));
    for (size_t k = 0; k < run->points; k++) {
        jacobian[k] = 1.0;
    }
    return warp_follow(&run->subjects[i].warp, run->context, run->points, gamma, jacobian);
}

/* ---- Against the mean ------------------------------------------------------------------------ */

static struct problem problem_of(const struct mean_run *run, size_t i)
{
    const struct srnf_register_options *o = &run->registration;
    struct problem problem = {.target = {run->points, run->nodes, run->weight, run->target,
                                         run->norm2, run->reference, run->area},
                              .moving = &run->subjects[i].moving,
                              .free_rotation = o->rotation && !o->common_pose};

    if (!o->exact) {
        problem.penalty = (struct penalty){o->penalty_jacobian, o->penalty_displacement};
    }
    return problem;
}

/* The subject's points as a warp, which owns nothing. */
static struct warp warp_of(const struct mean_run *run, size_t i)
{
    struct warp warp = {.n = run->points,
                        .points = run->gamma + 3 * i * run->points,
                        .jacobian = run->jacobian + i * run->points};

    memcpy(warp.rotation, run->subjects[i].rotation, sizeof warp.rotation);
    return warp;
}

void mean_measure(const struct mean_run *run, size_t i)
{
    struct mean_subject *subject = &run->subjects[i];
    struct problem problem = problem_of(run, i);
    struct warp warp = warp_of(run, i);

    registration_measure(&problem, &warp, &subject->samples, subject->displacement);
    memcpy(subject->rotation, warp.rotation, sizeof subject->rotation);
    subject->energy = warp.energy;
    subject->penalty = warp.objective - warp.energy;
}

void mean_penalize(const struct mean_run *run, size_t i)
{
    struct mean_subject *subject = &run->subjects[i];
    struct problem problem = problem_of(run, i);
    struct warp warp = warp_of(run, i);

    registration_measure(&problem, &warp, &subject->samples, subject->displacement);
    subject->penalty = warp.objective - warp.energy;
}

void mean_evaluate(const struct mean_run *run, size_t i)
{
    struct mean_subject *subject = &run->subjects[i];

    moving_evaluate(&subject->moving, run->gamma + 3 * i * run->points, &subject->samples);
    mean_measure(run, i);
}

void mean_field(const struct mean_run *run, size_t i)
{
    const struct mean_subject *subject = &run->subjects[i];
    const double *jacobian = run->jacobian + i * run->points;
    double *q = run->q + 3 * i * run->points;

    for (size_t k = 0; k < run->points; k++) {
        const double *x = subject->samples.q + 3 * k;
        double root = sqrt(jacobian[k]);

        for (size_t c = 0; c < 3; c++) {
            const double *o = subject->rotation + 3 * c;

            q[c * run->points + k] = root * (o[0] * x[0] + o[1] * x[1] + o[2] * x[2]);
        }
    }
}

/* step <- (H + damping + penalties)^-1 step, for the fields of one subject. */
static bool solve(const struct mean_subject *subject, size_t unknowns, double curvature,
                  double *damping, double *factor, double *step)
{
    lapack_int n = (lapack_int)unknowns;

    registration_damping(&subject->level, unknowns, damping);
    return registration_factor(&subject->level, unknowns, curvature, DAMPING, damping, factor) &&
           LAPACKE_dpotrs_work(LAPACK_COL_MAJOR, 'L', n, 1, factor, n, step, n) == 0;
}

int mean_potentials(const struct mean_run *run, size_t i, double *potentials)
{
    const struct mean_subject *subject = &run->subjects[i];
    struct problem problem = problem_of(run, i);
    struct warp warp = warp_of(run, i);
    size_t k = registration_unknowns(run->degree);
    double *factor = srnf_alloc(k * k + 2 * k, sizeof(double));
    double *damping = factor ? factor + k * k : NULL;
    double *step = factor ? damping + k : NULL;
    double curvature;
    int status = SRNF_ENOMEM;

    if (factor) {
        status = registration_gradient(&problem, &subject->level, &warp, &subject->samples,
                                       subject->displacement, step, &curvature);
    }
    if (status == SRNF_OK &&
        !solve(subject, problem.free_rotation ? k : k - 3, curvature, damping, factor, step)) {
        status = SRNF_ENUMERIC;
    }
    if (status == SRNF_OK) {
        registration_potentials(&subject->level.fields, step, potentials);
    }
    srnf_free(factor);
    return status;
}
