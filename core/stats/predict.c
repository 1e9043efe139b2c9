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
    const double *features, *priors, *field; /* field: of the template */
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

/* The nearest training member of each class, and of all by shape alone. */
static double find_nearest(const struct srnf_frozen *frozen, const double *scores, double residual,
                           const double *features, double *evidence)
{
    const struct srnf_classifier *classifier = frozen->classifier;
    const struct srnf_pca *pca = frozen->pca;
    size_t count = classifier->features;
    double nearest = INFINITY;

    for (size_t c = 0; evidence && c < classifier->classes; c++) {
        evidence[c] = -INFINITY;
    }
    for (size_t j = 0; j < pca->n; j++) {
        double square = residual * residual;

        for (size_t k = 0; k < pca->components; k++) {
            double d = scores[k] - pca->scores[j * pca->components + k];

            square += d * d;
        }
        nearest = fmin(nearest, sqrt(square));
        if (evidence && count > 0) {
            square +=
                frozen_apart2(count, classifier->factors, features, frozen->numbers + j * count);
        }
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
    size_t numbers = classifier->features;
    size_t d = numbers + classifier->components;
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(a->sht));
    double *memory = srnf_alloc(count + numbers + pca->components + d * (d + 1), sizeof(double));
    double *x = memory ? memory + count : NULL; /* numbers beside shape, then scores */
    double *scores = memory ? x + numbers : NULL;
    const double *features = numbers > 0 ? a->features + i * numbers : NULL;
    double *evidence = a->evidence + i * classifier->classes;
    struct srnf_class_prediction *out = &a->predictions[i];
    struct srnf_registration found = {0};
    int status = memory ? place(a, i, memory, context, &found, error) : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        srnf_pca_project(grid, pca, a->frozen->mean_q, found.q, scores, &out->residual);
        out->distance = sqrt(stats_distance2(grid, found.q, a->frozen->mean_q));
        out->mahalanobis = srnf_mahalanobis(a->counted, pca->eigenvalues, scores);
        out->nearest = find_nearest(a->frozen, scores, out->residual, features,
                                    classifier->gauss ? NULL : evidence);
        for (size_t k = 0; k < numbers; k++) {
            x[k] = features[k];
        }
        if (classifier->gauss) {
            status = frozen_likelihoods(classifier, x, scores + pca->components, evidence);
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

static int check(const struct srnf_frozen *frozen, const double *features, const double *priors,
                 struct srnf_error *error)
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
    if (classifier->features > 0 && !(features && (classifier->gauss || frozen->numbers))) {
        return srnf_fail(error, SRNF_EINVAL, -1, "the %zu numbers beside shape are not given",
                         classifier->features);
    }
    for (size_t c = 0; c < classifier->classes; c++) {
        if (!(priors[c] > 0.0 && priors[c] <= 1.0)) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)c, "prior %zu is not from 0 to 1", c);
        }
    }
    return SRNF_OK;
}

int srnf_predict(const struct srnf_sht *sht, const struct srnf_frozen *frozen, size_t n,
                 const double *const *surfaces, const double *features,
                 const struct srnf_register_options *registration, const double *priors,
                 const struct srnf_context *context, struct srnf_class_prediction *predictions,
                 double *evidence, double *probabilities, struct srnf_error *error)
{
    struct asked a = {.sht = sht,
                      .frozen = frozen,
                      .surfaces = surfaces,
                      .features = features,
                      .registration = registration,
                      .priors = priors ? priors : frozen->classifier->priors,
                      .predictions = predictions,
                      .evidence = evidence,
                      .probabilities = probabilities};
    struct stats_progress progress = {0.0, 1.0, "registering to the template"};
    struct srnf_register_options own = *registration;
    struct srnf_error first = {0};
    double *field = NULL;
    int status = check(frozen, features, a.priors, &first);

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
