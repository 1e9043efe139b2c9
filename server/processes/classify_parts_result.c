/*
 * classify_parts_result.c - the result document of the process classify-parts.
 */
#include "processes/classify_parts.h"

#include "api/warnings.h"
#include "toolkit/handedness.h"
#include "toolkit/permutation_test.h"
#include "toolkit/registration_options.h"
#include "toolkit/routes.h"
#include "toolkit/typicality.h"

/* Names of the subjects. New reference. */
static json_t *subject_names(const struct classify_parts *asked)
{
    const json_t *subjects = json_object_get(asked->parts.group.cohort, "subjects");
    json_t *names = json_array();

    for (size_t i = 0; i < asked->parts.n; i++) {
        (void)json_array_append(names, json_array_get(subjects, i));
    }
    return names;
}

static void mark_right(const struct srnf_classification *found, const size_t *labels, bool *right)
{
    for (size_t i = 0; i < found->n; i++) {
        right[i] = found->predicted[i] == labels[i];
    }
}

/* What one part says alone, beside all together; NULL without memory. */
static json_t *alone_json(const struct srnf_classification *alone,
                          const struct srnf_classification *together, const size_t *labels)
{
    bool *right = srnf_alloc(2 * alone->n, sizeof *right);
    size_t only[2] = {0, 0};
    double p = 1.0;
    int status = SRNF_ENOMEM;

    if (right) {
        mark_right(together, labels, right);
        mark_right(alone, labels, right + alone->n);
        status = srnf_mcnemar(alone->n, NULL, right, right + alone->n, only, &p);
    }
    srnf_free(right);
    return status ? NULL
                  : json_pack("{s:f, s:I, s:[f, f], s:I, s:I, s:o}", "accuracy", alone->accuracy,
                              "correct", (json_int_t)alone->correct, "confidenceInterval",
                              alone->interval[0], alone->interval[1], "onlyTogether",
                              (json_int_t)only[0], "onlyAlone", (json_int_t)only[1], "pValue",
                              json_finite(p));
}

/* NULL without memory. */
static json_t *parts_json(const struct classify_parts *asked, const struct classify_answer *answer,
                          const struct classify_parts_alone *alone)
{
    const json_t *names = json_object_get(asked->parts.group.cohort, "parts");
    json_t *parts = json_array();

    for (size_t p = 0; p < asked->parts.n_parts; p++) {
        json_t *methods = json_object();

        for (size_t m = 0; m < asked->methods.n; m++) {
            json_t *one =
                alone_json(&alone[p].results[m], &answer->results[m], answer->classes.labels);

            if (!one) {
                json_decref(methods);
                json_decref(parts);
                return NULL;
            }
            (void)json_object_set_new(methods, asked->methods.list[m].name, one);
        }
        (void)json_array_append_new(parts, json_pack("{s:O, s:f, s:o}", "name",
                                                     json_array_get(names, p), "weight",
                                                     asked->parts.weights[p], "methods", methods));
    }
    return parts;
}

static void warn(struct jobs_run *run, const struct classify_parts *asked,
                 const struct classify_answer *answer, const json_t *subjects, json_t *document)
{
    const struct group_input *group = &asked->parts.group;
    struct typicality_method named[CLASSIFY_METHODS];

    for (size_t m = 0; m < asked->methods.n; m++) {
        named[m] = classify_method_named(&asked->methods.list[m]);
    }
    permutation_warn(warnings_of(document), &answer->results[0].test,
                     "No p-value of this result can be");
    classify_warn_methods(warnings_of(document), &asked->methods, answer);
    group_warn_duplicates(run, document, group->surfaces, group->cohort,
                          (const char(*)[STORE_ID_MAX])answer->group.contents);
    typicality_warn_members(warnings_of(document), asked->methods.n, answer->typicality, named,
                            subjects);
}

json_t *classify_parts_document(struct jobs_run *run, const struct classify_parts *asked,
                                const struct classify_answer *answer,
                                const struct classify_parts_alone *alone,
                                struct jobs_result *result)
{
    const struct group_input *group = &asked->parts.group;
    const struct classify_classes *classes = &answer->classes;
    json_t *comparisons = classify_comparisons_json(&asked->methods, answer, NULL);
    json_t *parts = parts_json(asked, answer, alone);
    json_t *document, *order, *subjects;

    if (!comparisons || !parts) {
        json_decref(comparisons);
        json_decref(parts);
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "comparing the methods");
        return NULL;
    }
    order = json_array();
    for (size_t c = 0; c < classes->count; c++) {
        (void)json_array_append_new(order, json_string(classes->names[c]));
    }
    subjects = subject_names(asked);
    document = json_pack(
        "{s:o, s:o, s:o, s:o, s:I, s:f, s:f, s:o, s:I, s:o}", "methods",
        classify_methods_json(&asked->methods, answer, subjects), "comparisons", comparisons,
        "parts", parts, "features",
        classify_number_names(asked->scale != 0, json_object_get(group->cohort, "parts"),
                              asked->covariates),
        "subjects", (json_int_t)classes->n, "chance", 1.0 / (double)classes->count, "majorityRate",
        answer->results[0].majority, "classes", order, "lmax", (json_int_t)answer->group.degree,
        "registration", registration_json(&answer->asked.comparison.registration));
    permutation_set_test(document, &answer->results[0].test);
    routes_set_bridged(document, group->n, group->ids, answer->group.bridged);
    warn(run, asked, answer, subjects, document);
    json_decref(subjects);
    return document;
}
