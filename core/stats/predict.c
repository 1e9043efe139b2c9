/*
 * predict.c - what a classifier that is kept makes of other surfaces (srnf/train.h).
 *
 * A surface is treated as one that a fold left out: normalized, registered from nothing to the
 * template, and put into the coordinates of the components. Nothing of it changes the classifier.
 * Since the components are all that the training members span, the distance to member j follows
 * from its scores: ||q - q_j||^2 = |scores - scores_j|^2 + residual^2.
 *
 * Of several structures each is registered to its own template; q is the stack of their fields.
 */
#include "frozen.h"

#include <math.h>

struct asked {
    const struct srnf_sht *sht;
    const struct srnf_frozen *frozen;
    const double *const *surfaces;
    const struct srnf_register_options *registration;
    const double *positions, *features, *priors;
    const double *fields; /* [parts] of the templates */
    struct srnf_stack stack;
    size_t n, counted;
    struct srnf_class_prediction *predictions;
    double *evidence, *probabilities;
};

/* The fields of member i, each registered to the template of its part, stacked. normalized:
   scratch. */
static int place(const struct asked *a, size_t i, double *normalized,
                 const struct srnf_context *context, double *q, struct srnf_error *error)
{
    size_t own = 3 * stats_points(a->stack.own);
    int status = SRNF_OK;

    for (size_t p = 0; p < a->stack.parts && status == SRNF_OK; p++) {
        size_t at = p * a->n + i;
        struct srnf_registration found = {0};

        status = srnf_normalize(a->sht, a->surfaces[at], normalized, NULL);
        if (status) {
            return srnf_fail(error, status, (int64_t)at, "surface %zu: %s", at,
                             srnf_strerror(status));
        }
        status = srnf_register(a->sht, NULL, a->fields + p * own, normalized, a->registration, NULL,
                               context, &found, error);
        status = status < 0 ? status : SRNF_OK;
        if (status == SRNF_OK) {
            srnf_stack_put(&a->stack, p, found.q, q);
        }
        srnf_registration_clear(&found);
    }
    if (status == SRNF_OK && a->stack.positions) {
        srnf_stack_put_positions(&a->stack, a->positions + 3 * a->stack.parts * i, q);
    }
    return status;
}

/* The positions stand after all parts. */
static struct srnf_part_prediction *part_of(const struct asked *a, size_t part,
                                            struct srnf_class_prediction *out)
{
    return part < a->stack.parts ? &out->parts[part] : &out->position;
}

/* What each part has in the distance and the residual. q is overwritten. */
static void take_apart(const struct asked *a, const double *scores, double *q,
                       struct srnf_class_prediction *out)
{
    const struct srnf_pca *pca = a->frozen->pca;
    size_t size = 3 * stats_points(&a->stack.grid);

    for (size_t k = 0; k < size; k++) {
        q[k] -= a->frozen->mean_q[k];
    }
    for (size_t p = 0; p <= a->stack.parts; p++) {
        part_of(a, p, out)->distance = sqrt(srnf_stack_product(&a->stack, p, q, q));
    }
    for (size_t c = 0; c < pca->components; c++) {
        const double *mode = pca->modes + c * size;

        for (size_t k = 0; k < size; k++) {
            q[k] -= scores[c] * mode[k];
        }
    }
    for (size_t p = 0; p <= a->stack.parts; p++) {
        part_of(a, p, out)->residual = sqrt(srnf_stack_product(&a->stack, p, q, q));
    }
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
    const struct srnf_grid *grid = &a->stack.grid;
    size_t numbers = classifier->features;
    size_t d = numbers + classifier->components;
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(a->sht));
    double *q = srnf_alloc(stats_points(grid), 3 * sizeof(double));
    double *memory = srnf_alloc(count + numbers + pca->components + d * (d + 1), sizeof(double));
    double *x = memory ? memory + count : NULL; /* numbers beside shape, then scores */
    double *scores = memory ? x + numbers : NULL;
    const double *features = numbers > 0 ? a->features + i * numbers : NULL;
    double *evidence = a->evidence + i * classifier->classes;
    struct srnf_class_prediction *out = &a->predictions[i];
    int status = q && memory ? place(a, i, memory, context, q, error) : SRNF_ENOMEM;

    if (status == SRNF_OK) {
        srnf_pca_project(grid, pca, a->frozen->mean_q, q, scores, &out->residual);
        out->distance = sqrt(stats_distance2(grid, q, a->frozen->mean_q));
        take_apart(a, scores, q, out);
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
    srnf_free(q);
    srnf_free(memory);
    return status;
}

static int check(const struct srnf_frozen *frozen, const double *positions, const double *features,
                 const double *priors, struct srnf_error *error)
{
    const struct srnf_classifier *classifier = frozen->classifier;

    if (frozen->n_parts < 1 || frozen->n_parts > SRNF_PARTS_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%zu parts are not 1 to %zu", frozen->n_parts,
                         SRNF_PARTS_MAX);
    }
    if ((positions != NULL) != (frozen->position_weight != 0.0)) {
        return srnf_fail(error, SRNF_EINVAL, -1, "positions are %sgiven, of a classifier %s them",
                         positions ? "" : "not ", positions ? "without" : "with");
    }
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

/* The fields of the templates, and the stack that they make up. */
static int open_parts(struct asked *a, const struct srnf_context *context, double **fields,
                      struct srnf_error *error)
{
    const struct srnf_frozen *frozen = a->frozen;
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(a->sht));
    const double *targets[SRNF_PARTS_MAX];
    double weights[SRNF_PARTS_MAX];
    int status;

    for (size_t p = 0; p < frozen->n_parts; p++) {
        targets[p] = frozen->target ? frozen->target + p * count : NULL;
        weights[p] = frozen->weights ? frozen->weights[p] : 1.0;
    }
    status = srnf_stack_open(srnf_sht_grid(a->sht), frozen->n_parts, weights,
                             frozen->position_weight, &a->stack);
    if (status) {
        return srnf_fail(error, status, -1, "the weights of the parts are not above 0");
    }
    a->fields = *fields =
        srnf_alloc(frozen->n_parts * stats_points(a->stack.own), 3 * sizeof(double));
    return *fields ? stats_fields(a->sht, frozen->n_parts, targets, context, *fields, error)
                   : SRNF_ENOMEM;
}

int srnf_predict(const struct srnf_sht *sht, const struct srnf_frozen *frozen, size_t n,
                 const double *const *surfaces, const double *positions, const double *features,
                 const struct srnf_register_options *registration, const double *priors,
                 const struct srnf_context *context, struct srnf_class_prediction *predictions,
                 double *evidence, double *probabilities, struct srnf_error *error)
{
    struct asked a = {.sht = sht,
                      .frozen = frozen,
                      .surfaces = surfaces,
                      .positions = positions,
                      .features = features,
                      .registration = registration,
                      .priors = priors ? priors : frozen->classifier->priors,
                      .n = n,
                      .predictions = predictions,
                      .evidence = evidence,
                      .probabilities = probabilities};
    struct stats_progress progress = {0.0, 1.0, "registering to the template"};
    struct srnf_register_options own = *registration;
    struct srnf_error first = {0};
    double *fields = NULL;
    int status = check(frozen, positions, features, a.priors, &first);

    status = status ? status : stats_check_surfaces(sht, frozen->n_parts * n, surfaces, &first);
    status = status ? status : open_parts(&a, context, &fields, &first);
    if (status == SRNF_OK) {
        own.representation = SRNF_REPRESENTATION_SRNF;
        own.symmetric = false; /* as in the folds */
        a.registration = &own;
        a.counted = srnf_mahalanobis_components(frozen->subjects, frozen->pca->components,
                                                frozen->pca->eigenvalues);
        status = stats_run(context, n, predict_body, &a, progress, &first);
    }
    srnf_stack_clear(&a.stack);
    srnf_free(fields);
    return status ? stats_fail(error, status, &first) : SRNF_OK;
}
