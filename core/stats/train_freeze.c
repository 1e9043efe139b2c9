/*
 * train_freeze.c - the classifier of all members (train.h). It is calibrated as each fold is, with
 * nobody left out.
 */
#include "train.h"

#include <math.h>
#include <string.h>

static void find_nearest(const struct training *t, double *nearest)
{
    for (size_t i = 0; i < t->n; i++) {
        nearest[i] = INFINITY;
        for (size_t j = 0; j < t->n; j++) {
            if (t->subjects.of[j] != t->subjects.of[i]) {
                nearest[i] = fmin(nearest[i], t->folds->distances[i * t->n + j]);
            }
        }
    }
}

/* The registered fields, stacked, [n]; those of the parts are let go. */
static int stack_fields(const struct training *t, const struct srnf_stack *stack, double **q)
{
    size_t own = 3 * stats_points(stack->own);
    size_t size = 3 * stats_points(&stack->grid);

    *q = srnf_alloc(t->n, size * sizeof(double));
    for (size_t p = 0; p < stack->parts && *q; p++) {
        for (size_t i = 0; i < t->n; i++) {
            srnf_stack_put(stack, p, t->parts[p].registered + i * own, *q + i * size);
        }
        srnf_free(t->parts[p].registered);
        t->parts[p].registered = NULL;
    }
    for (size_t i = 0; stack->positions && *q && i < t->n; i++) {
        srnf_stack_put_positions(stack, t->sum.positions + 3 * stack->parts * i, *q + i * size);
    }
    return *q ? SRNF_OK : SRNF_ENOMEM;
}

/* q: the fields, [n]. */
static int fit_fields(const struct training *t, const struct srnf_grid *grid, const double *q,
                      const struct srnf_context *context)
{
    struct srnf_trained *out = t->out;
    size_t size = 3 * stats_points(grid);
    int status;

    out->mean_q = srnf_alloc(size, sizeof(double));
    out->distances = srnf_alloc(t->n, sizeof(double));
    out->residuals = srnf_alloc(t->n, sizeof(double));
    out->nearest = srnf_alloc(t->n, sizeof(double));
    if (!out->mean_q || !out->distances || !out->residuals || !out->nearest) {
        return SRNF_ENOMEM;
    }
    stats_average(grid, t->n, q, out->mean_q);
    for (size_t i = 0; i < t->n; i++) {
        out->distances[i] = sqrt(stats_distance2(grid, q + i * size, out->mean_q));
    }
    find_nearest(t, out->nearest);
    status = srnf_pca_fit_within(grid, t->n, out->mean_q, q, 0, context, &out->pca);
    if (status == SRNF_OK && out->pca.components == 0) {
        return SRNF_EDEGENERATE; /* they are all the same */
    }
    status =
        status ? status : srnf_pca_residuals(grid, &out->pca, out->mean_q, t->n, q, out->residuals);
    return status ? status
                  : srnf_calibrate(grid, &out->pca, out->mean_q, q, t->options->subjects, context,
                                   &out->calibration);
}

int train_fit_components(const struct training *t, const struct srnf_grid *grid,
                         const struct srnf_context *context)
{
    struct srnf_stack stack;
    double *q = NULL;
    int status = srnf_stack_open(grid, t->options->n_parts, t->weights,
                                 t->sum.positions ? t->sum.position_weight : 0.0, &stack);

    status = status ? status : stack_fields(t, &stack, &q);
    status = status ? status : fit_fields(t, &stack.grid, q, context);
    srnf_free(q);
    srnf_stack_clear(&stack);
    return status;
}

static int fit_gauss(const struct training *t, struct srnf_classifier *classifier,
                     struct srnf_error *error)
{
    const struct srnf_pca *pca = &t->out->pca;
    size_t kept = t->components < pca->components ? t->components : pca->components;
    double *scores = srnf_alloc(t->n * kept, sizeof(double));
    struct frozen_members members = {.n = t->n,
                                     .components = kept,
                                     .classes = t->classes,
                                     .n_features = t->options->n_features,
                                     .scores = scores,
                                     .features = t->options->features,
                                     .labels = t->labels,
                                     .subjects = t->subjects.of};
    int status = scores ? SRNF_OK : SRNF_ENOMEM;

    if (status == SRNF_OK && t->classifier.components > kept) {
        status = srnf_fail(error, SRNF_EINVAL, -1, "components is %zu, and there are %zu",
                           t->classifier.components, kept);
    }
    for (size_t i = 0; i < t->n && status == SRNF_OK; i++) {
        memcpy(scores + i * kept, pca->scores + i * pca->components, kept * sizeof(double));
    }
    status = status ? status : frozen_fit_gauss(&members, &t->classifier, classifier, error);
    srnf_free(scores);
    return status;
}

/* What the classifier is made of beside its components, from the products of all. */
static int fit(const struct training *t, const double *products, struct srnf_error *error)
{
    struct srnf_classifier *classifier = &t->out->classifier;
    const struct frozen_numbers numbers = train_numbers(t);

    *classifier = (struct srnf_classifier){.classes = t->classes};
    if (t->options->gauss) {
        return fit_gauss(t, classifier, error);
    }
    if (numbers.count == 0) {
        return SRNF_OK;
    }
    classifier->features = numbers.count;
    classifier->factors = srnf_alloc(numbers.count, sizeof(double));
    return classifier->factors
               ? frozen_factors(&t->subjects, products, &numbers, classifier->factors)
               : SRNF_ENOMEM;
}

int train_freeze(const struct training *t, const struct srnf_context *context,
                 struct srnf_error *error)
{
    struct srnf_classifier *classifier = &t->out->classifier;
    double *products = train_products(t, SIZE_MAX);
    int status = products ? fit(t, products, error) : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        classifier->priors = srnf_alloc(t->classes, sizeof(double));
        status = classifier->priors ? SRNF_OK : SRNF_ENOMEM;
    }
    if (status == SRNF_OK) {
        memcpy(classifier->priors, t->priors, t->classes * sizeof(double));
        status = train_calibrate(t, products, TRAIN_NOBODY, context, &classifier->platt, error);
    }
    srnf_free(products);
    return status;
}
