/*
 * predict.c - what a classifier that is kept makes of other surfaces (srnf/train.h).
 *
 * A surface is treated as one that a fold left out: normalized, registered from nothing to the
 * template, and put into the coordinates of the components. Nothing of it changes the classifier.
 * Since the components are all that the training members span, the distance to member j follows
 * from its scores: ||q - q_j||^2 = |scores - scores_j|^2 + residual^2.
 */
#include "frozen.h"

#include <math.h>

struct asked {
    const struct srnf_sht *sht;
    const struct srnf_frozen *frozen;
    const double *const *surfaces;
    const struct srnf_register_options *registration;
    const double *priors, *field; /* field: of the template */
    size_t counted;
    struct srnf_class_prediction *predictions;
    double *evidence, *probabilities;
};

/* The field of surface i, registered; srnf_registration_clear. normalized: scratch. */
static int place(const struct asked *a, size_t i, double *normalized,
                 const struct srnf_context *context, struct srnf_registration *found,
                 struct srnf_error *error)
{
    int status = srnf_normalize(a->sht, a->surfaces[i], normalized, NULL);

    if (status) {
        return srnf_fail(error, status, (int64_t)i, "surface %zu: %s", i, srnf_strerror(status));
    }
    status = srnf_register(a->sht, NULL, a->field, normalized, a->registration, NULL, context,
                           found, error);
    return status < 0 ? status : SRNF_OK;
}

/* The nearest training member of each class, and of all. */
static double find_nearest(const struct srnf_frozen *frozen, const double *scores, double residual,
                           double *evidence)
{
    const struct srnf_pca *pca = frozen->pca;
    double nearest = INFINITY;

    for (size_t c = 0; evidence && c < frozen->classifier->classes; c++) {
        evidence[c] = -INFINITY;
    }
    for (size_t j = 0; j < pca->n; j++) {
        double square = residual * residual;

        for (size_t k = 0; k < pca->components; k++) {
            double d = scores[k] - pca->scores[j * pca->components + k];

            square += d * d;
        }
        nearest = fmin(nearest, sqrt(square));
        if (evidence) {
            evidence[frozen->labels[j]] = fmax(evidence[frozen->labels[j]], -sqrt(square));
        }
    }
    return nearest;
}

static int predict_body(void *argument, size_t i, const struct srnf_context *context,
                        struct srnf_error *error)
{
    const struct asked *a = argument;
    const struct srnf_classifier *classifier = a->frozen->classifier;
    const struct srnf_pca *pca = a->frozen->pca;
    const struct srnf_grid *grid = srnf_sht_grid(a->sht);
    size_t k = classifier->components;
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(a->sht));
    double *memory = srnf_alloc(count + pca->components + k * (k + 1), sizeof(double));
    double *scores = memory ? memory + count : NULL;
    double *evidence = a->evidence + i * classifier->classes;
    struct srnf_class_prediction *out = &a->predictions[i];
    struct srnf_registration found = {0};
    int status = memory ? place(a, i, memory, context, &found, error) : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        srnf_pca_project(grid, pca, a->frozen->mean_q, found.q, scores, &out->residual);
        out->distance = sqrt(stats_distance2(grid, found.q, a->frozen->mean_q));
        out->mahalanobis = srnf_mahalanobis(a->counted, pca->eigenvalues, scores);
        out->nearest =
            find_nearest(a->frozen, scores, out->residual, classifier->gauss ? NULL : evidence);
        if (classifier->gauss) {
            status =
                frozen_likelihoods(classifier, scores, memory + count + pca->components, evidence);
        }
    }
    for (size_t c = 0; c < classifier->classes && status == SRNF_OK; c++) {
        status = isfinite(evidence[c]) ? SRNF_OK : SRNF_ENUMERIC;
    }
    if (status == SRNF_OK) {
        srnf_platt_apply(&classifier->platt, a->priors, evidence,
                         a->probabilities + i * classifier->classes);
    }
    srnf_registration_clear(&found);
    srnf_free(memory);
    return status;
}

static int check(const struct srnf_frozen *frozen, const double *priors, struct srnf_error *error)
{
    const struct srnf_classifier *classifier = frozen->classifier;

    if (classifier->components > frozen->pca->components) {
        return srnf_fail(error, SRNF_EINVAL, -1, "the classifier has %zu components of %zu",
                         classifier->components, frozen->pca->components);
    }
    for (size_t i = 0; i < frozen->pca->n; i++) {
        if (frozen->labels[i] >= classifier->classes) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)i,
                             "label %zu of member %zu is not below %zu", frozen->labels[i], i,
                             classifier->classes);
        }
    }
    for (size_t c = 0; c < classifier->classes; c++) {
        if (!(priors[c] > 0.0 && priors[c] <= 1.0)) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)c, "prior %zu is not from 0 to 1", c);
        }
    }
    return SRNF_OK;
}

int srnf_predict(const struct srnf_sht *sht, const struct srnf_frozen *frozen, size_t n,
                 const double *const *surfaces, const struct srnf_register_options *registration,
                 const double *priors, const struct srnf_context *context,
                 struct srnf_class_prediction *predictions, double *evidence, double *probabilities,
                 struct srnf_error *error)
{
    struct asked a = {
        sht,  frozen, surfaces,    registration, priors ? priors : frozen->classifier->priors,
        NULL, 0,      predictions, evidence,     probabilities};
    struct stats_progress progress = {0.0, 1.0, "registering to the template"};
    struct srnf_register_options own = *registration;
    struct srnf_error first = {0};
    double *field = NULL;
    int status = check(frozen, a.priors, &first);

    status = status ? status : stats_check_surfaces(sht, n, surfaces, &first);
    if (status == SRNF_OK) {
        field = srnf_alloc(stats_points(srnf_sht_grid(sht)), 3 * sizeof(double));
        status =
            field ? stats_fields(sht, 1, &frozen->target, context, field, &first) : SRNF_ENOMEM;
    }
    if (status == SRNF_OK) {
        own.representation = SRNF_REPRESENTATION_SRNF;
        own.symmetric = false; /* as in the folds */
        a.registration = &own;
        a.field = field;
        a.counted = srnf_mahalanobis_components(frozen->subjects, frozen->pca->components,
                                                frozen->pca->eigenvalues);
        status = stats_run(context, n, predict_body, &a, progress, &first);
    }
    srnf_free(field);
    return status ? stats_fail(error, status, &first) : SRNF_OK;
}
