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
 * q_i and its Gauss-Newton matrix come from tables (mean_tools.c), links carry the points by tables
 * as well, to some 1e-9 in all. In exact mode nothing is tabulated. What is handed over in the end
 * is evaluated without tables in either case (mean_surface.c).
 */
#include "mean.h"

#include <string.h>

void mean_subject_clear(struct mean_subject *subject)
{
    srnf_warp_clear(&subject->warp);
    srnf_free(subject->pieces);
    mean_tools_clear(&subject->tools);
}

/* ---- The warp -------------------------------------------------------------------------------- */

static size_t count_tabulated(const struct mean_run *run, const struct srnf_warp *warp)
{
    size_t count = 0;

    while (!run->registration.exact && count < warp->n_links &&
           (warp->links[count].kind == SRNF_WARP_ROTATION ||
            warp->links[count].kind == SRNF_WARP_EXP)) {
        count++;
    }
    return count;
}

int mean_take_registered(const struct mean_run *run, size_t i, const double rotation[9],
                         struct srnf_warp *warp)
{
    struct mean_subject *subject = &run->subjects[i];

    subject->tabulated = count_tabulated(run, warp);
    memcpy(subject->at.rotation, rotation, sizeof subject->at.rotation);
    return mean_chain_set(run, i, warp);
}

int mean_register_failed(size_t i, int status, const struct srnf_error *why,
                         struct srnf_error *error)
{
    return srnf_fail(error, status, (int64_t)i, "registering surface %zu to the mean: %s", i,
                     status == SRNF_EUNMATCHED ? why->message : srnf_strerror(status));
}

/* The points that a search has carried along its chain: the bits of mean_replay. */
static int take_points(const struct mean_run *run, size_t i, const struct warp *found)
{
    struct mean_points points;
    int status = mean_points_open(run, i, false, &points);

    if (status == SRNF_OK) {
        run->subjects[i].tools.sampled = false;
        mean_points_in(run, found->points, found->jacobian, &points);
        status = mean_points_keep(run, i, &points);
    }
    return status;
}

int mean_register(const struct mean_run *run, size_t i, const struct srnf_context *context,
                  bool *placed, struct srnf_error *error)
{
    struct mean_subject *subject = &run->subjects[i];
    const bool guided = mean_is_guided(run);
    const struct srnf_landmarks landmarks =
        guided ? mean_landmarks_of(run, i) : (struct srnf_landmarks){.n = 0};
    struct srnf_warp recalled = {0};
    struct warp found;
    struct srnf_error why = {0};
    struct tabulated_tools *tools;
    int status;

    *placed = false;
    if (run->iterations == 0 && mean_recall_registered(run, i, context, &recalled)) {
        subject->tabulated = count_tabulated(run, &recalled);
        if (run->spill) { /* it is there already */
            mean_chain_close(run, &recalled);
            return SRNF_OK;
        }
        return mean_chain_set(run, i, &recalled);
    }
    status = tools_take(run->pool, &tools);
    if (status == SRNF_OK) {
        status = registration_to_field(run->work, run->mean_q, run->norm2, run->surfaces[i],
                                       &run->registration, guided ? &landmarks : NULL, tools,
                                       context, &found, &why);
    }
    tools_give_back(run->pool, tools);
    if (status) {
        return mean_register_failed(i, status, &why, error);
    }
    status = mean_take_registered(run, i, found.rotation, &found.chain);
    if (status == SRNF_OK && run->iterations == 0) {
        mean_keep_registered(run, i, context);
    }
    if (status == SRNF_OK && found.points) {
        *placed = true;
        status = take_points(run, i, &found);
    }
    warp_clear(&found);
    return status;
}

struct cloud mean_cloud_of(const struct mean_run *run, const struct mean_points *points)
{
    struct cloud cloud = {.n = run->padded, .jacobian = points->jacobian};

    for (size_t c = 0; c < 3; c++) {
        cloud.point[c] = points->gamma[c];
    }
    return cloud;
}

void mean_points_out(const struct mean_run *run, const struct mean_points *points, double *gamma,
                     double *jacobian)
{
    for (size_t k = 0; k < run->points; k++) {
        for (size_t c = 0; c < 3; c++) {
            gamma[3 * k + c] = points->gamma[c][k];
        }
        jacobian[k] = points->jacobian[k];
    }
}

void mean_points_in(const struct mean_run *run, const double *gamma, const double *jacobian,
                    const struct mean_points *points)
{
    for (size_t k = 0; k < run->padded; k++) {
        size_t at = k < run->points ? k : run->points - 1;

        for (size_t c = 0; c < 3; c++) {
            points->gamma[c][k] = gamma[3 * at + c];
        }
        points->jacobian[k] = jacobian[at];
    }
}

/* Points and Jacobians along links that tables cannot follow. */
static int follow_directly(const struct mean_run *run, const struct srnf_warp *warp,
                           const struct mean_points *points)
{
    double *gamma = srnf_alloc(4 * run->points, sizeof(double));
    double *jacobian = gamma ? gamma + 3 * run->points : NULL;
    int status = SRNF_ENOMEM;

    if (gamma) {
        mean_points_out(run, points, gamma, jacobian);
        status = warp_follow(warp, run->context, run->points, gamma, jacobian);
        mean_points_in(run, gamma, jacobian, points);
    }
    srnf_free(gamma);
    return status;
}

/* The nodes along a chain whose first links are tabulated. */
static int follow(const struct mean_run *run, const struct srnf_warp *chain, size_t tabulated,
                  const struct mean_points *points)
{
    const struct srnf_warp first = {.n_links = tabulated, .links = chain->links};
    const struct srnf_warp rest = {.n_links = chain->n_links - tabulated,
                                   .links = chain->links + tabulated};
    struct cloud cloud = mean_cloud_of(run, points);
    int status = SRNF_OK;

    for (size_t k = 0; k < run->padded; k++) {
        size_t at = k < run->points ? k : run->points - 1;

        for (size_t c = 0; c < 3; c++) {
            points->gamma[c][k] = run->nodes[3 * at + c];
        }
        points->jacobian[k] = 1.0;
    }
    if (first.n_links > 0) {
        struct tabulated_tools *tools;

        status = tools_take(run->pool, &tools);
        if (status == SRNF_OK) {
            status = cloud_follow(&cloud, &first, &follow_table, tools, run->context);
        }
        tools_give_back(run->pool, tools);
    }
    if (status == SRNF_OK && rest.n_links > 0) {
        status = follow_directly(run, &rest, points);
    }
    return status;
}

int mean_replay(const struct mean_run *run, size_t i)
{
    size_t tabulated = run->subjects[i].tabulated;
    struct mean_points points;
    struct srnf_warp chain;
    int status = mean_chain_open(run, i, &chain);

    run->subjects[i].tools.sampled = false;
    if (status) {
        return status;
    }
    if (tabulated > chain.n_links) {
        status = SRNF_EIO;
    }
    status = status ? status : mean_points_open(run, i, false, &points);
    if (status == SRNF_OK) {
        status = follow(run, &chain, tabulated, &points);
        if (status == SRNF_OK) {
            status = mean_points_keep(run, i, &points);
        } else {
            mean_points_drop(&points);
        }
    }
    mean_chain_close(run, &chain);
    return status;
}
