/*
 * predict_model.c - a classifier as train kept it: its arrays, its template, and the member
 * "classifier" of its record, which the id of the model is made of. A record that came with an
 * import is checked all the same: what does not fit its sizes is no classifier.
 */
#include "processes/predict.h"
#include "processes/train.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "toolkit/model.h"
#include "toolkit/registration_options.h"
#include "toolkit/typicality.h"
#include "api/model_parts.h"
#include "api/models.h"

void kept_clear(struct kept *kept)
{
    srnf_classifier_clear(&kept->classifier);
    srnf_free(kept->names);
    srnf_free(kept->labels);
    srnf_free(kept->weights);
    srnf_free(kept->nearest);
    srnf_free(kept->numbers);
    srnf_free(kept->target);
    json_decref(kept->record);
    json_decref(kept->made);
    compute_model_clear(&kept->model);
    *kept = (struct kept){.method = NULL};
}

const char *predict_what(const struct kept *kept)
{
    return kept->parts ? "Subject" : "Surface";
}

size_t kept_class(const struct kept *kept, const char *name)
{
    size_t c = 0;

    while (c < kept->classes && !(name && strcmp(kept->names[c], name) == 0)) {
        c++;
    }
    return c;
}

/* Numbers of nested arrays, in order; returns how many there are up to `most` and one more. */
static size_t flatten(const json_t *value, size_t most, size_t count, double *numbers)
{
    if (json_is_array(value)) {
        for (size_t i = 0; i < json_array_size(value) && count <= most; i++) {
            count = flatten(json_array_get(value, i), most, count, numbers);
        }
        return count;
    }
    if (!json_is_number(value) || count >= most) {
        return most + 1;
    }
    numbers[count] = json_number_value(value);
    return count + 1;
}

/* A new array of `count` finite numbers; false where there are not as many, or no memory. */
static bool read_numbers(const json_t *value, size_t count, double **numbers)
{
    *numbers = srnf_alloc(count, sizeof(double));
    return *numbers && flatten(value, count, 0, *numbers) == count;
}

/* Shares that are divided by: with one of 0 no probability is a number. */
static bool read_shares(const json_t *value, size_t count, double **shares)
{
    bool good = read_numbers(value, count, shares);

    for (size_t k = 0; good && k < count; k++) {
        good = (*shares)[k] > 0.0;
    }
    return good;
}

static bool read_lengths(const json_t *value, size_t count, double **lengths)
{
    bool good = read_numbers(value, count, lengths);

    for (size_t k = 0; good && k < count; k++) {
        good = (*lengths)[k] >= 0.0;
    }
    return good;
}

static bool read_names(const json_t *classifier, struct kept *kept)
{
    const json_t *names = json_object_get(classifier, "classes");

    kept->classes = json_array_size(names);
    kept->names = srnf_alloc(kept->classes ? kept->classes : 1, sizeof *kept->names);
    for (size_t c = 0; kept->names && c < kept->classes; c++) {
        kept->names[c] = json_string_value(json_array_get(names, c));
        if (!kept->names[c]) {
            return false;
        }
    }
    return kept->names && kept->classes >= 2;
}

/* The class of each member, and how much it weighs. */
static bool read_members(struct kept *kept)
{
    const json_t *groups = json_object_get(kept->made, "groups");
    size_t n = kept->model.pca.n, largest;
    size_t *numbers = group_subject_numbers(json_object_get(kept->made, "subjects"), n,
                                            &kept->subjects, &largest);

    kept->labels = srnf_alloc(n, sizeof *kept->labels);
    kept->weights = numbers ? typicality_weights(n, numbers) : NULL;
    srnf_free(numbers);
    for (size_t i = 0; kept->labels && i < n; i++) {
        kept->labels[i] = kept_class(kept, json_string_value(json_array_get(groups, i)));
        if (kept->labels[i] == kept->classes) {
            return false;
        }
    }
    return kept->labels && kept->weights;
}

static bool read_gaussians(const json_t *object, struct srnf_classifier *classifier)
{
    const char *covariance = json_string_value(json_object_get(object, "covariance"));
    size_t k = (size_t)json_integer_value(json_object_get(object, "components"));
    size_t d = classifier->features + k, blocks;

    classifier->pooled = covariance && strcmp(covariance, "pooled") == 0;
    blocks = classifier->pooled ? 1 : classifier->classes;
    classifier->components = k;
    return k >= 1 && k <= PROCESS_CLASSIFY_COMPONENTS_MAX &&
           read_numbers(json_object_get(object, "means"), classifier->classes * d,
                        &classifier->means) &&
           read_numbers(json_object_get(object, "covariances"), blocks * d * d,
                        &classifier->covariances);
}

/* Numbers beside shape; a classifier of shape alone has none. */
static bool read_features(const json_t *object, struct kept *kept)
{
    const json_t *features = json_object_get(object, "features");
    const json_t *names = json_object_get(features, "names");
    size_t count = json_array_size(names);

    kept->feature_names = names;
    kept->sizes = json_is_true(json_object_get(features, "size")) ? kept->model.joint.n_parts : 0;
    kept->classifier.features = count;
    for (size_t k = 0; k < count; k++) {
        if (!json_is_string(json_array_get(names, k))) {
            return false;
        }
    }
    return !features ||
           (count >= 1 && count >= kept->sizes && count <= SRNF_FEATURES_MAX &&
            read_numbers(json_object_get(features, "values"), kept->model.pca.n * count,
                         &kept->numbers) &&
            (kept->classifier.gauss ||
             read_numbers(json_object_get(features, "factors"), count, &kept->classifier.factors)));
}

static bool read_classifier(struct kept *kept)
{
    const json_t *object = json_object_get(kept->record, "classifier");
    const json_t *calibration = json_object_get(object, "calibration");
    struct srnf_classifier *classifier = &kept->classifier;
    struct srnf_platt *platt = &classifier->platt;

    kept->method = json_string_value(json_object_get(object, "method"));
    if (!kept->method || !read_names(object, kept) || !read_members(kept)) {
        return false;
    }
    classifier->classes = platt->classes = kept->classes;
    classifier->gauss = strcmp(kept->method, train_methods[0]) == 0;
    if (!(classifier->gauss || strcmp(kept->method, train_methods[1]) == 0) ||
        !read_features(object, kept)) {
        return false;
    }
    platt->slope = json_number_value(json_object_get(calibration, "slope"));
    return json_is_number(json_object_get(calibration, "slope")) && platt->slope >= 0.0 &&
           read_shares(json_object_get(object, "priors"), kept->classes, &classifier->priors) &&
           read_numbers(json_object_get(calibration, "offsets"), kept->classes, &platt->offsets) &&
           read_shares(json_object_get(calibration, "targets"), kept->classes, &platt->targets) &&
           read_lengths(json_object_get(object, "nearest"), kept->model.pca.n, &kept->nearest) &&
           (!classifier->gauss || read_gaussians(object, classifier)) &&
           classifier->components <= kept->model.pca.components;
}

static int load_template(struct jobs_run *run, struct kept *kept, size_t part,
                         struct jobs_result *result)
{
    const struct store_model *stored = &kept->model.stored;
    size_t count = 3 * srnf_coefficient_count((size_t)stored->lmax);
    const char *id = model_template(kept->record, part);
    struct compute_surface surface = {.degree = 0};
    int status = id ? compute_surface_load(run, id, 0.0, &surface, result)
                    : compute_fail_store(result, STORE_CORRUPT, stored->id);

    if (status == 0 && surface.degree != (size_t)stored->lmax) {
        status = compute_fail_store(result, STORE_CORRUPT, stored->id);
    }
    if (status == 0) {
        memcpy(kept->target + part * count, surface.coefficients, count * sizeof(double));
    }
    compute_surface_clear(&surface);
    return status;
}

/* What the record tells; the arrays are those of kept->model. False where it is no classifier that
   fits them. */
static bool read_record(struct kept *kept)
{
    const struct store_model *stored = &kept->model.stored;
    const json_t *parts;

    kept->record = json_loads(stored->record ? stored->record : "{}", 0, NULL);
    kept->made = model_made_from(stored);
    parts = json_object_get(kept->record, "parts");
    kept->parts = json_array_size(parts) > 0 ? parts : NULL;
    return stored->arrays[STORE_MODEL_CALIBRATION] && read_classifier(kept) &&
           registration_read(json_object_get(kept->made, "registration"), &kept->registration);
}

/* Whether its Gaussians can be asked: with another covariance each prediction would fail. */
static bool check_covariances(const struct kept *kept, char why[API_WHY_MAX])
{
    struct srnf_error error = {0};
    int status = srnf_classifier_check(&kept->classifier, &error);

    if (status == SRNF_ENUMERIC && kept->classifier.pooled) {
        (void)snprintf(why, API_WHY_MAX, "the covariance of its classes is not positive definite");
    } else if (status == SRNF_ENUMERIC) {
        (void)snprintf(why, API_WHY_MAX,
                       "the covariance of its class \"%.60s\" is not positive definite",
                       kept->names[error.element]);
    }
    return status == SRNF_OK;
}

/* Probabilities are given by the names of classes. */
static bool check_names(const struct kept *kept, char why[API_WHY_MAX])
{
    for (size_t c = 1; c < kept->classes; c++) {
        if (kept_class(kept, kept->names[c]) < c) {
            (void)snprintf(why, API_WHY_MAX, "two of its classes are called \"%.60s\"",
                           kept->names[c]);
            return false;
        }
    }
    return true;
}

bool predict_model_fits(const struct store_model *model, char why[API_WHY_MAX])
{
    struct kept kept = {.model = {.stored = *model}};
    bool good = strcmp(model_kind(model), "classifier") != 0;

    if (!good) {
        kept.model.pca = (struct srnf_pca){.n = (size_t)model->subjects,
                                           .components = (size_t)model->components};
        good = model_joint(model, &kept.model.joint) && read_record(&kept);
        for (size_t part = 0; part < kept.model.joint.n_parts; part++) {
            good = good && model_template(kept.record, part);
        }
        good = good && check_names(&kept, why) && check_covariances(&kept, why);
    }
    kept.model = (struct compute_model){.pca = {.n = 0}}; /* it was borrowed */
    kept_clear(&kept);
    return good;
}

int kept_load(struct jobs_run *run, const char *id, struct kept *kept, struct jobs_result *result)
{
    const struct store_model *stored = &kept->model.stored;
    size_t n_parts;
    int status;

    *kept = (struct kept){.method = NULL};
    status = model_load(run, id, &kept->model, result);
    if (status) {
        return status;
    }
    n_parts = kept->model.joint.n_parts;
    if (!read_record(kept)) {
        return compute_fail_store(result, STORE_CORRUPT, id);
    }
    kept->target =
        srnf_alloc(n_parts, 3 * srnf_coefficient_count((size_t)stored->lmax) * sizeof(double));
    status = kept->target ? 0 : compute_fail(result, SRNF_ENOMEM, NULL, "reading the templates");
    for (size_t p = 0; p < n_parts && status == 0; p++) {
        status = load_template(run, kept, p, result);
    }
    return status;
}
