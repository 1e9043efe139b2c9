/*
 * train_model.c - what the processes train and train-parts keep: of each structure the template, to
 * which other surfaces will be registered, and the mean; and the model.
 *
 * The model is one of principal components as pca keeps it (pca.c), whose record has a member
 * "classifier" as well. All components are kept, so that distances to the training members follow
 * from their scores. The record names the templates, which stay as long as the model does. Of
 * several structures the arrays are of stacked fields, and the record has parts as that of
 * pca-parts.
 */
#include "processes/train.h"

#include <math.h>
#include <stdio.h>

#include "compute/model.h"
#include "toolkit/model_keep.h"
#include "toolkit/registration_options.h"
#include "toolkit/routes.h"

#define NAME_MAX_BYTES 96 /* of a surface */

/* What is kept of one structure. */
struct part {
    size_t index;
    const char *name; /* NULL: of train */
    double *target;   /* [3][(L+1)^2], borrowed */
    double *mean_q;   /* [3][n_theta][n_phi], owned */
};

static const char *process_of(const struct train_answer *answer)
{
    return answer->several ? "train-parts" : "train";
}

/* ---- Surfaces -------------------------------------------------------------------------------- */

/* "template", or "template, left". */
static const char *surface_name(const char *what, const struct part *part,
                                char name[NAME_MAX_BYTES])
{
    (void)snprintf(name, NAME_MAX_BYTES, "%s%s%.60s", what, part->name ? ", " : "",
                   part->name ? part->name : "");
    return name;
}

/* The template as a surface of its own: what it was made of may be encoded here, or mirrored. */
static json_t *keep_template(struct jobs_run *run, const struct train *train,
                             const struct train_answer *answer, const struct srnf_sht *sht,
                             const struct part *part, struct jobs_result *result)
{
    const struct compute_group *group = &answer->group;
    size_t m = part->index * answer->n + answer->trained.medoids[part->index];
    const char *id = train->parts.group.ids[m];
    char name[NAME_MAX_BYTES];
    struct srnf_surface_measures measures;
    struct surface_description description = {
        .name = surface_name("template", part, name),
        .degree = group->degree,
        .coefficients = part->target,
        .measures = &measures,
        .parameterization = "inherited",
        .route = routes_of_group(run, 1, &id, group->bridged + m),
        .source = process_source(run, process_of(answer), NULL, NULL),
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
                         struct train_answer *answer, const struct part *part,
                         struct jobs_result *result)
{
    const struct group_input *members = &train->parts.group;
    const char *const *ids = members->ids + part->index * answer->n;
    size_t from = part->index * answer->n;
    const size_t from_mean = 1;
    double none = 0.0;
    char name[NAME_MAX_BYTES];
    /* Without components: the mean is the point where all scores are 0. All is borrowed. */
    struct compute_model view = {
        .stored = {.lmax = (int64_t)answer->group.degree,
                   .n_theta = (int64_t)answer->n_theta,
                   .n_phi = (int64_t)answer->n_phi,
                   .subjects = (int64_t)answer->n,
                   .arrays = {[STORE_MODEL_MEAN_Q] = part->mean_q}},
        .mean = {.degree = answer->group.degree, .coefficients = part->target},
        .joint = {.n_parts = 1, .weights = {1.0}}};
    struct compute_reconstruction points = {0};
    json_t *record = NULL;

    if (compute_reconstruct(run, &view, 1, &none, &from_mean, &points, result) == 0) {
        struct surface_description description = {
            .name = surface_name("mean", part, name),
            .degree = answer->group.degree,
            .coefficients = points.coefficients,
            .measures = points.measures,
            .parameterization = "inherited",
            .route = routes_of_group(run, answer->n, ids, answer->group.bridged + from),
            .source = process_source(run, process_of(answer), NULL, NULL),
        };

        for (size_t i = 0; i < answer->n; i++) {
            description.scale +=
                process_scale(run, ids[i], answer->group.scales[from + i]) / (double)answer->n;
        }
        answer->mean_energies[part->index] = points.relative_energy[0];
        record = process_keep_surface(run, &description, "the mean", result);
    }
    compute_reconstruction_clear(&points);
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
                      classify_number_names(train->scale != 0,
                                            json_object_get(train->parts.group.cohort, "parts"),
                                            train->covariates),
                      "values", json_nested(answer->numbers, 2, values), "factors",
                      classifier->factors ? json_vector(classifier->factors, classifier->features)
                                          : json_null()));
    }
}

static json_t *template_json(const struct train_answer *answer, size_t part, const char *surface)
{
    return json_pack("{s:s, s:I}", "surface", surface, "member",
                     (json_int_t)answer->trained.medoids[part]);
}

/* template: of train; taken over. */
static json_t *classifier_json(const struct train *train, const struct train_answer *answer,
                               json_t *template)
{
    const struct srnf_trained *trained = &answer->trained;
    const struct srnf_platt *platt = &trained->classifier.platt;
    const struct classify_classes *classes = &answer->classes;
    json_t *object = json_pack("{s:s, s:o, s:o, s:o, s:o, s:o, s:{s:o, s:o, s:o}, s:o, s:o}",
                               "method", train_methods[train->method], "classes",
                               names_json(classes), "members", counts_json(classes->sizes, classes),
                               "subjects", counts_json(classes->subjects, classes), "priors",
                               json_vector(trained->classifier.priors, classes->count), "template",
                               template, "calibration", "slope", json_finite(platt->slope),
                               "offsets", json_vector(platt->offsets, classes->count), "targets",
                               json_vector(platt->targets, classes->count), "nearest",
                               json_vector(trained->nearest, trained->n), "validation",
                               assessment_json(&trained->assessment, classes->names));

    set_gaussians(object, &trained->classifier);
    set_features(object, train, answer);
    return object;
}

static struct model_parts numbers_of(const struct train_answer *answer)
{
    const struct srnf_trained *trained = &answer->trained;

    return (struct model_parts){.group = &answer->group,
                                .n_theta =
                                    answer->n_parts * answer->n_theta + (answer->positions ? 1 : 0),
                                .n_phi = answer->n_phi,
                                .pca = &trained->pca,
                                .mean_q = trained->mean_q,
                                .residuals = trained->residuals,
                                .distances = trained->distances,
                                .calibration = &trained->calibration};
}

/* What the record of the model holds beside its numbers. parts: with their templates. */
static json_t *record_of(struct jobs_run *run, const struct train *train,
                         const struct train_answer *answer, const struct model_parts *numbers,
                         const json_t *parts)
{
    const struct srnf_register_options *registration = &answer->options.registration;
    json_t *template = json_object_get(json_array_get(parts, 0), "template");
    json_t *record = json_pack(
        "{s:o, s:o}", "totalVariance", json_finite(numbers->pca->total_variance), "classifier",
        classifier_json(train, answer, answer->several ? json_null() : json_incref(template)));
    json_t *made_from;

    if (answer->several) {
        made_from = pca_parts_making(run, process_of(answer), &train->parts.group, answer->n,
                                     numbers, registration);
        (void)json_object_set(record, "parts", answer->parts);
        (void)json_object_set(record, "positions", answer->places);
    } else {
        made_from = model_making(run, process_of(answer), &train->parts.group, numbers,
                                 registration, (const char(*)[STORE_ID_MAX])answer->group.contents);
    }
    (void)json_object_set_new(record, "madeFrom", made_from);
    return record;
}

/* Stores template and mean of a part. first: gets the record of the mean of the first. Returns what
   the record has of it (new reference), or NULL with the problem set. */
static json_t *keep_part(struct jobs_run *run, const struct train *train,
                         struct train_answer *answer, const struct srnf_sht *sht,
                         const struct part *part, json_t **first, struct jobs_result *result)
{
    json_t *template = keep_template(run, train, answer, sht, part, result);
    json_t *mean = template ? keep_mean(run, train, answer, part, result) : NULL;
    json_t *own = NULL;

    if (mean) {
        const char *id = json_string_value(json_object_get(template, "id"));

        own = json_pack("{s:s*, s:f, s:O, s:o, s:o}", "name", part->name, "weight",
                        answer->several ? train->parts.weights[part->index] : 1.0, "mean",
                        json_object_get(mean, "id"), "relativeEnergy",
                        json_finite(answer->mean_energies[part->index]), "template",
                        template_json(answer, part->index, id));
    }
    if (part->index == 0) {
        *first = json_incref(mean);
    }
    json_decref(template);
    json_decref(mean);
    return own;
}

/* Where the parts are in the mean, as the record has it; null without positions (new reference). */
static json_t *places_json(const struct train_answer *answer, const struct srnf_stack *stack)
{
    double mean[3 * SRNF_PARTS_MAX] = {0.0};
    const size_t sizes[2] = {answer->n_parts, 3};

    if (!answer->positions) {
        return json_null();
    }
    srnf_stack_take_positions(stack, answer->trained.mean_q, mean);
    return json_pack("{s:f, s:o}", "weight", answer->options.position_weight, "mean",
                     json_nested(mean, 2, sizes));
}

/* Of all parts, in order (new reference), or NULL with the problem set. places is set. */
static json_t *keep_parts(struct jobs_run *run, const struct train *train,
                          struct train_answer *answer, const struct srnf_sht *sht, json_t **first,
                          struct jobs_result *result)
{
    const json_t *names = json_object_get(train->parts.group.cohort, "parts");
    size_t count = 3 * srnf_coefficient_count(answer->group.degree);
    json_t *parts = json_array();
    struct srnf_stack stack;
    struct part part = {.mean_q = srnf_alloc(answer->n_theta * answer->n_phi, 3 * sizeof(double))};
    int status = srnf_stack_open(srnf_sht_grid(sht), answer->n_parts,
                                 answer->several ? train->parts.weights : (const double[]){1.0},
                                 answer->positions ? answer->options.position_weight : 0.0, &stack);

    status = part.mean_q ? status : SRNF_ENOMEM;
    if (status) {
        (void)compute_fail(result, status, NULL, "keeping the classifier");
    }
    for (size_t p = 0; p < answer->n_parts && status == 0; p++) {
        json_t *own;

        part.index = p;
        part.name = answer->several ? json_string_value(json_array_get(names, p)) : NULL;
        part.target = answer->trained.target + p * count;
        srnf_stack_take(&stack, p, answer->trained.mean_q, part.mean_q);
        own = keep_part(run, train, answer, sht, &part, first, result);
        status = own ? json_array_append_new(parts, own) : -1;
    }
    if (status == 0) {
        answer->places = places_json(answer, &stack);
    }
    srnf_free(part.mean_q);
    srnf_stack_clear(&stack);
    if (status) {
        json_decref(parts);
        return NULL;
    }
    return parts;
}

json_t *train_keep(struct jobs_run *run, const struct train *train, struct train_answer *answer,
                   struct jobs_result *result)
{
    const struct srnf_sht *sht = NULL;
    const struct srnf_trained *trained = &answer->trained;
    const struct model_parts numbers = numbers_of(answer);
    json_t *mean = NULL, *record = NULL;

    if (!model_is_sound(&numbers, result) ||
        !process_finite(trained->n, trained->nearest, "the nearest distances", result)) {
        return NULL;
    }
    if (jobs_transform_acquire(jobs_run_jobs(run), answer->group.degree, SRNF_GRID_GAUSS_LEGENDRE,
                               0, 0, &sht)) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "preparing the harmonic transform");
        return NULL;
    }
    answer->parts = keep_parts(run, train, answer, sht, &mean, result);
    jobs_transform_release(jobs_run_jobs(run), sht);
    if (answer->parts) {
        record = model_keep(run, &numbers, record_of(run, train, answer, &numbers, answer->parts),
                            mean, result);
    } else {
        json_decref(mean);
    }
    return record;
}
