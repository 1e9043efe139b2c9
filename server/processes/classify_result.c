/*
 * classify_result.c - the result document of the process classify.
 */
#include "processes/classify.h"

#include "api/warnings.h"
#include "toolkit/assessment.h"
#include "toolkit/group_doubts.h"
#include "toolkit/handedness.h"
#include "toolkit/permutation_test.h"
#include "toolkit/registration_options.h"
#include "toolkit/routes.h"
#include "toolkit/typicality.h"

/* What each fold fits again, and what folds have in common. */
static void set_refitted(json_t *document, const struct srnf_method *method, bool fold)
{
    bool registers = method->metric == SRNF_METRIC_SRNF || method->metric == SRNF_METRIC_SRM;
    json_t *refitted = json_array(), *shared = json_array();
    json_t *registration = fold ? refitted : shared;

    if (registers) {
        (void)json_array_append_new(registration, json_string("template: the medoid"));
        (void)json_array_append_new(registration, json_string("registrations to it"));
    } else {
        (void)json_array_append_new(shared, json_string("distances between pairs"));
    }
    if (method->gauss) {
        (void)json_array_append_new(refitted, json_string("mean"));
        (void)json_array_append_new(refitted, json_string("principal components"));
        (void)json_array_append_new(refitted, json_string("class means and covariances"));
        (void)json_array_append_new(
            refitted, json_string("number of components and kind of covariance, where open"));
    }
    (void)json_object_set_new(document, "refitted", refitted);
    (void)json_object_set_new(document, "shared", shared);
}

/* One subject; evidence under the name of what it is. */
static json_t *subject_json(const struct srnf_classification *r, size_t i,
                            const struct srnf_folds_typicality *typicality,
                            const struct classify_classes *classes, json_t *subject)
{
    json_t *evidence = json_object();
    bool gauss = r->components != NULL;

    for (size_t c = 0; c < r->n_classes; c++) {
        double value = r->evidence[i * r->n_classes + c];

        (void)json_object_set_new(evidence, classes->names[c],
                                  json_finite(gauss ? value : -value + 0.0));
    }
    return json_pack("{s:O, s:s, s:s, s:o, s:o}", "subject", subject, "label",
                     classes->names[classes->labels[i]], "predicted",
                     classes->names[r->predicted[i]], gauss ? "logLikelihoods" : "nearestDistances",
                     evidence, "typicality", typicality_member(typicality, i));
}

static json_t *method_json(const struct srnf_classification *r,
                           const struct srnf_folds_typicality *typicality,
                           const struct srnf_method *method, const struct classify_classes *classes,
                           const json_t *subjects, bool fold)
{
    json_t *confusion = json_array(), *per_subject = json_array();
    json_t *components = r->components ? json_array() : json_null();
    json_t *covariance = r->components ? json_array() : json_null();
    json_t *document;

    for (size_t a = 0; a < r->n_classes; a++) {
        json_t *row = json_array();

        for (size_t b = 0; b < r->n_classes; b++) {
            (void)json_array_append_new(
                row, json_integer((json_int_t)r->confusion[a * r->n_classes + b]));
        }
        (void)json_array_append_new(confusion, row);
    }
    for (size_t i = 0; i < r->n; i++) {
        (void)json_array_append_new(
            per_subject, subject_json(r, i, typicality, classes, json_array_get(subjects, i)));
        if (r->components) {
            (void)json_array_append_new(components, json_integer((json_int_t)r->components[i]));
            (void)json_array_append_new(covariance, json_string(r->pooled[i] ? "pooled" : "class"));
        }
    }
    document = json_pack(
        "{s:f, s:I, s:[f, f], s:f, s:o, s:o, s:o, s:o, s:o, s:o}", "accuracy", r->accuracy,
        "correct", (json_int_t)r->correct, "confidenceInterval", r->interval[0], r->interval[1],
        "effectiveCount", r->effective, "balancedAccuracy", assessment_rate(&r->balanced), "auc",
        assessment_rates(r->auc, r->n_classes, classes->names), "confusion", confusion,
        "perSubject", per_subject, "components", components, "covariance", covariance);
    permutation_set_p(document, "pValue", r->p_value, &r->test);
    set_refitted(document, method, fold);
    return document;
}

json_t *classify_methods_json(const struct classify_methods *asked,
                              const struct classify_answer *answer, const json_t *subjects)
{
    bool fold = answer->asked.comparison.refit == SRNF_REFIT_FOLD;
    json_t *methods = json_object();

    for (size_t m = 0; m < asked->n; m++) {
        const struct srnf_method *method = &asked->list[m];

        (void)json_object_set_new(methods, method->name,
                                  method_json(&answer->results[m], &answer->typicality[m], method,
                                              &answer->classes, subjects, fold));
    }
    return methods;
}

void classify_warn_methods(json_t *warnings, const struct classify_methods *asked,
                           const struct classify_answer *answer)
{
    for (size_t m = 0; m < asked->n; m++) {
        const struct srnf_classification *r = &answer->results[m];

        assessment_warn(warnings, asked->list[m].name, r->n_classes, r->confusion, &r->balanced,
                        answer->classes.names);
    }
}

/* Whether a method is right of each member. */
static void mark_right(const struct classify_answer *answer, size_t m, bool *right)
{
    for (size_t i = 0; i < answer->classes.n; i++) {
        right[i] = answer->results[m].predicted[i] == answer->classes.labels[i];
    }
}

json_t *classify_comparisons_json(const struct classify_methods *asked,
                                  const struct classify_answer *answer, const size_t *subjects)
{
    size_t n = answer->classes.n;
    bool *right = srnf_alloc(2 * n, sizeof *right);
    json_t *array = right ? json_array() : NULL;
    int status = SRNF_OK;

    for (size_t a = 0; right && a < asked->n; a++) {
        mark_right(answer, a, right);
        for (size_t b = a + 1; b < asked->n && status == SRNF_OK; b++) {
            size_t only[2] = {0, 0};
            double p = 1.0;

            mark_right(answer, b, right + n);
            status = srnf_mcnemar(n, subjects, right, right + n, only, &p);
            (void)json_array_append_new(
                array, json_pack("{s:s, s:s, s:I, s:I, s:o}", "first", asked->list[a].name,
                                 "second", asked->list[b].name, "onlyFirst", (json_int_t)only[0],
                                 "onlySecond", (json_int_t)only[1], "pValue", json_finite(p)));
        }
    }
    srnf_free(right);
    if (status) {
        json_decref(array);
        array = NULL;
    }
    return array;
}

/* The warnings, those of members and classes apart that classify tells of by itself. */
static void warn(struct jobs_run *run, const struct classify *classify,
                 const struct classify_answer *answer, json_t *document)
{
    const struct group_input *group = &classify->group;
    struct typicality_method named[CLASSIFY_METHODS];
    json_t *called = group_subjects(run, group->surfaces, NULL);

    for (size_t m = 0; m < classify->methods.n; m++) {
        named[m] = classify_method_named(&classify->methods.list[m]);
    }
    permutation_warn(warnings_of(document), &answer->results[0].test,
                     "No p-value of this result can be");
    classify_warn_methods(warnings_of(document), &classify->methods, answer);
    group_warn_duplicates(run, document, group->surfaces, group->cohort,
                          (const char(*)[STORE_ID_MAX])answer->group.contents);
    warnings_put(document, handedness_of_names(run, group->surfaces, group->cohort));
    typicality_warn_members(warnings_of(document), classify->methods.n, answer->typicality, named,
                            called);
    json_decref(called);
}

/* What the members and classes are doubted for; false with the problem set. */
static bool warn_members(struct jobs_run *run, const struct classify *classify,
                         const struct classify_answer *answer, json_t *document,
                         struct jobs_result *result)
{
    const struct group_doubts doubts = {.surfaces = classify->group.surfaces,
                                        .cohort = classify->group.cohort,
                                        .group = &answer->group,
                                        .pairs = answer->pairs,
                                        .classes = answer->classes.labels,
                                        .n_classes = answer->classes.count,
                                        .names = answer->classes.names,
                                        .rotates = !classify->common_pose,
                                        .mirrors = true};

    return group_doubts_warn(run, &doubts, document, result);
}

/* What counts beside shape. */
json_t *classify_document(struct jobs_run *run, const struct classify *classify,
                          const struct classify_answer *answer, struct jobs_result *result)
{
    const struct group_input *group = &classify->group;
    const struct classify_classes *classes = &answer->classes;
    json_t *document = json_object(), *order = json_array();
    json_t *comparisons = classify_comparisons_json(&classify->methods, answer, group->subjects);
    json_t *subjects =
        group_subjects(run, group->surfaces, json_object_get(group->cohort, "subjects"));

    if (!comparisons) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "comparing the methods");
        json_decref(document);
        json_decref(order);
        json_decref(subjects);
        return NULL;
    }
    for (size_t c = 0; c < classes->count; c++) {
        (void)json_array_append_new(order, json_string(classes->names[c]));
    }
    (void)json_object_set_new(document, "methods",
                              classify_methods_json(&classify->methods, answer, subjects));
    (void)json_object_set_new(document, "comparisons", comparisons);
    (void)json_object_set_new(
        document, "features",
        classify_number_names(classify->scale != 0, NULL, classify->covariates));
    (void)json_object_set_new(document, "members", json_integer((json_int_t)classes->n));
    (void)json_object_set_new(document, "subjects", json_integer((json_int_t)group->n_subjects));
    (void)json_object_set_new(document, "chance", json_real(1.0 / (double)classes->count));
    (void)json_object_set_new(document, "majorityRate", json_real(answer->results[0].majority));
    permutation_set_test(document, &answer->results[0].test);
    routes_set_bridged(document, group->n, group->ids, answer->group.bridged);
    (void)json_object_set_new(document, "classes", order);
    (void)json_object_set_new(document, "lmax", json_integer((json_int_t)answer->group.degree));
    (void)json_object_set_new(document, "registration",
                              registration_json(&answer->asked.comparison.registration));
    warn(run, classify, answer, document);
    json_decref(subjects);
    if (!warn_members(run, classify, answer, document, result)) {
        json_decref(document);
        document = NULL;
    }
    return document;
}
