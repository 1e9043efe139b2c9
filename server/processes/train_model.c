/*
 * train_model.c - what the process train keeps: the template, to which other surfaces will be
 * registered, the mean, and the model.
 *
 * The model is one of principal components as pca keeps it (pca.c), whose record has a member
 * "classifier" as well. All components are kept, so that distances to the training members follow
 * from their scores. The record names the template, which stays as long as the model does.
 */
#include "processes/train.h"

#include <math.h>

#include "compute/model.h"
#include "toolkit/assessment.h"
#include "toolkit/model_keep.h"
#include "toolkit/registration_options.h"
#include "toolkit/routes.h"

/* ---- Surfaces -------------------------------------------------------------------------------- */

/* The template as a surface of its own: what it was made of may be encoded here, or mirrored. */
static json_t *keep_template(struct jobs_run *run, const struct train *train,
                             const struct train_answer *answer, const struct srnf_sht *sht,
                             struct jobs_result *result)
{
    const struct compute_group *group = &answer->group;
    size_t m = answer->trained.medoid;
    const char *id = train->group.ids[m];
    struct srnf_surface_measures measures;
    struct surface_description description = {
        .name = "template",
        .degree = group->degree,
        .coefficients = answer->trained.target,
        .measures = &measures,
        .parameterization = "inherited",
        .route = routes_of_group(run, 1, &id, group->bridged + m),
        .source = process_source(run, "train", NULL, NULL),
    };
    double *copy = srnf_alloc(srnf_coefficient_count(group->degree), 3 * sizeof(double));
    double log_scale = 0.0;
    int status = copy ? srnf_normalize(sht, group->surfaces[m], copy, &log_scale) : SRNF_ENOMEM;

    srnf_free(copy);
    if (status) {
        json_decref(description.source);
        (void)compute_fail(result, status, NULL, "measuring the template");
        return NULL;
    }
    description.scale = process_scale(run, id, group->scales[m]) * exp(log_scale);
    if (compute_measure(run, group->degree, 1, description.coefficients, &measures, result)) {
        json_decref(description.source);
        return NULL;
    }
    return process_keep_surface(run, &description, "the template", result);
}

/* The surface of the mean SRNF, inverted from the template on. */
static json_t *keep_mean(struct jobs_run *run, const struct train *train,
                         struct train_answer *answer, struct jobs_result *result)
{
    const struct group_input *members = &train->group;
    const size_t from_mean = 1;
    struct compute_model view = {
        .stored = {.lmax = (int64_t)answer->group.degree,
                   .n_theta = (int64_t)answer->n_theta,
                   .n_phi = (int64_t)answer->n_phi,
                   .subjects = (int64_t)answer->group.n,
                   .components = (int64_t)answer->trained.pca.components},
        .mean = {.degree = answer->group.degree, .coefficients = answer->trained.target},
        .pca = answer->trained.pca,
        .joint = {.n_parts = 1, .weights = {1.0}}};
    double *scores = srnf_alloc(view.pca.components, sizeof(double));
    struct compute_reconstruction points = {0};
    json_t *record = NULL;

    view.stored.arrays[STORE_MODEL_MEAN_Q] = answer->trained.mean_q;
    view.stored.arrays[STORE_MODEL_MODES] = view.pca.modes; /* all of them are borrowed */
    view.stored.arrays[STORE_MODEL_EIGENVALUES] = view.pca.eigenvalues;
    view.stored.arrays[STORE_MODEL_SCORES] = view.pca.scores;
    if (!scores) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "inverting the mean");
        return NULL;
    }
    if (compute_reconstruct(run, &view, 1, scores, &from_mean, &points, result) == 0) {
        struct surface_description description = {
            .name = "mean",
            .degree = answer->group.degree,
            .coefficients = points.coefficients,
            .measures = points.measures,
            .parameterization = "inherited",
            .route = routes_of_group(run, members->n, members->ids, answer->group.bridged),
            .source = process_source(run, "train", NULL, NULL),
        };

        for (size_t i = 0; i < members->n; i++) {
            description.scale +=
                process_scale(run, members->ids[i], answer->group.scales[i]) / (double)members->n;
        }
        answer->mean_energy = points.relative_energy[0];
        record = process_keep_surface(run, &description, "the mean", result);
    }
    compute_reconstruction_clear(&points);
    srnf_free(scores);
    return record;
}

/* ---- The record ------------------------------------------------------------------------------ */

static json_t *counts_json(const size_t *counts, const struct classify_classes *classes)
{
    json_t *object = json_object();

    for (size_t c = 0; c < classes->count; c++) {
        (void)json_object_set_new(object, classes->names[c], json_integer((json_int_t)counts[c]));
    }
    return object;
}

static json_t *names_json(const struct classify_classes *classes)
{
    json_t *names = json_array();

    for (size_t c = 0; c < classes->count; c++) {
        (void)json_array_append_new(names, json_string(classes->names[c]));
    }
    return names;
}

/* Means and covariances, or nulls. */
static void set_gaussians(json_t *object, const struct srnf_classifier *classifier)
{
    size_t k = classifier->components, d = classifier->features + k;
    const size_t means[2] = {classifier->classes, d};
    const size_t covariances[3] = {classifier->pooled ? 1 : classifier->classes, d, d};
    bool gauss = classifier->gauss;

    (void)json_object_set_new(object, "components",
                              gauss ? json_integer((json_int_t)k) : json_null());
    (void)json_object_set_new(object, "covariance",
                              gauss ? json_string(classifier->pooled ? "pooled" : "class")
                                    : json_null());
    (void)json_object_set_new(object, "means",
                              gauss ? json_nested(classifier->means, 2, means) : json_null());
    (void)json_object_set_new(object, "covariances",
                              gauss ? json_nested(classifier->covariances, 3, covariances)
                                    : json_null());
}

/* Numbers beside shape, of the members too: neighbours are told by them, and who is beyond them. A
   classifier of shape alone has none. */
static void set_features(json_t *object, const struct train *train,
                         const struct train_answer *answer)
{
    const struct srnf_classifier *classifier = &answer->trained.classifier;
    const size_t values[2] = {answer->trained.n, classifier->features};

    if (classifier->features > 0) {
        (void)json_object_set_new(
            object, "features",
            json_pack("{s:b, s:o, s:o, s:o}", "size", train->scale != 0, "names",
                      classify_number_names(train->scale != 0, train->covariates), "values",
                      json_nested(answer->numbers, 2, values), "factors",
                      classifier->factors ? json_vector(classifier->factors, classifier->features)
                                          : json_null()));
    }
}

static json_t *classifier_json(const struct train *train, const struct train_answer *answer,
                               const char *template)
{
    const struct srnf_trained *trained = &answer->trained;
    const struct srnf_platt *platt = &trained->classifier.platt;
    const struct classify_classes *classes = &answer->classes;
    json_t *object = json_pack(
        "{s:s, s:o, s:o, s:o, s:o, s:{s:s, s:I}, s:{s:o, s:o, s:o}, s:o, s:o}", "method",
        train_methods[train->method], "classes", names_json(classes), "members",
        counts_json(classes->sizes, classes), "subjects", counts_json(classes->subjects, classes),
        "priors", json_vector(trained->classifier.priors, classes->count), "template", "surface",
        template, "member", (json_int_t)trained->medoid, "calibration", "slope",
        json_finite(platt->slope), "offsets", json_vector(platt->offsets, classes->count),
        "targets", json_vector(platt->targets, classes->count), "nearest",
        json_vector(trained->nearest, trained->n), "validation",
        assessment_json(&trained->assessment, classes->names));

    set_gaussians(object, &trained->classifier);
    set_features(object, train, answer);
    return object;
}

static struct model_parts parts_of(const struct train_answer *answer)
{
    const struct srnf_trained *trained = &answer->trained;

    return (struct model_parts){.group = &answer->group,
                                .n_theta = answer->n_theta,
                                .n_phi = answer->n_phi,
                                .pca = &trained->pca,
                                .mean_q = trained->mean_q,
                                .residuals = trained->residuals,
                                .distances = trained->distances,
                                .calibration = &trained->calibration};
}

/* What the record of the model holds beside its numbers. */
static json_t *record_of(struct jobs_run *run, const struct train *train,
                         const struct train_answer *answer, const struct model_parts *parts,
                         const char *template)
{
    const struct srnf_register_options *registration = &answer->options.registration;
    json_t *made_from = model_making(run, "train", &train->group, parts, registration,
                                     (const char(*)[STORE_ID_MAX])answer->group.contents);

    return json_pack("{s:o, s:o, s:o}", "totalVariance", json_finite(parts->pca->total_variance),
                     "classifier", classifier_json(train, answer, template), "madeFrom", made_from);
}

json_t *train_keep(struct jobs_run *run, const struct train *train, struct train_answer *answer,
                   struct jobs_result *result)
{
    const struct srnf_sht *sht = NULL;
    const struct srnf_trained *trained = &answer->trained;
    const struct model_parts parts = parts_of(answer);
    json_t *template = NULL, *mean = NULL, *record = NULL;

    if (!model_is_sound(&parts, result) ||
        !process_finite(trained->n, trained->nearest, "the nearest distances", result)) {
        return NULL;
    }
    if (jobs_transform_acquire(jobs_run_jobs(run), answer->group.degree, SRNF_GRID_GAUSS_LEGENDRE,
                               0, 0, &sht)) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "preparing the harmonic transform");
        return NULL;
    }
    template = keep_template(run, train, answer, sht, result);
    jobs_transform_release(jobs_run_jobs(run), sht);
    mean = template ? keep_mean(run, train, answer, result) : NULL;
    if (mean) {
        const char *id = json_string_value(json_object_get(template, "id"));

        record = model_keep(run, &parts, record_of(run, train, answer, &parts, id), mean, result);
    }
    json_decref(template);
    return record;
}
