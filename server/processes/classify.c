/*
 * classify.c - the process classify over HTTP: canonical inputs and result document.
 *
 * Labels and subjects are those of the cohort's members, as they were when the job was made;
 * classes are in the order in which their labels first appear. What the training subjects of a fold
 * cannot determine is refused before a job is made. Subjects whose members have different labels,
 * as at end diastole and end systole, are left out as a whole like all others; but they cannot
 * exchange their labels, so that permutations are refused.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "toolkit/group_doubts.h"
#include "toolkit/handedness.h"
#include "toolkit/permutation_test.h"
#include "toolkit/group.h"
#include "toolkit/routes.h"
#include "toolkit/registration_options.h"
#include "toolkit/typicality.h"
#include "api/warnings.h"
#include "compute/classify.h"

static const char *const names[] = {
    "cohort",       "method", "components", "covariance", "validation", "scale",       "sizeWeight",
    "permutations", "seed",   "refit",      "commonPose", "lmax",       "mixedRoutes", NULL};
static const char *const covariances[] = {"auto", "pooled", "class", NULL};
static const char *const validations[] = {"loo", NULL};
static const char *const scales[] = {"shape", "shape-and-size", NULL};
static const char *const refits[] = {"fold", "shared", NULL};

/* Fields that are held for each surface: registrations of all, and of the folds that run. */
#define COPIES 12
#define COMPONENTS_KEPT 20 /* of which auto chooses */
#define SHARE 20.0         /* percent of the job that encoding its meshes takes */

#define WHY_NOT_PERMUTED                                                                      \
    "A permutation test exchanges the labels of whole subjects, which is not possible here. " \
    "Take permutations 0 (leaving whole subjects out is right all the same), or one member "  \
    "of each subject. A test of changes within subjects, change, is planned and not there yet."

/* The classes of a cohort's labels, and whose members they are. */
struct classes {
    size_t n, count, n_subjects, largest;
    size_t *labels;     /* [n] */
    size_t *sizes;      /* [n], of the first count classes: members */
    size_t *n_of;       /* [n], likewise: subjects */
    size_t *subjects;   /* [n] group_subject_numbers */
    size_t determined;  /* features of one covariance in any fold: srnf_classify_gauss */
    const char **names; /* [n], likewise, borrowed from the labels */
};

static void classes_clear(struct classes *classes)
{
    srnf_free(classes->labels);
    srnf_free(classes->sizes);
    srnf_free(classes->n_of);
    srnf_free(classes->subjects);
    srnf_free(classes->names);
}

/* Whether an earlier member of the same subject has the label of member i. */
static bool is_again(const struct classes *classes, size_t i)
{
    for (size_t j = 0; j < i; j++) {
        if (classes->subjects[j] == classes->subjects[i] &&
            classes->labels[j] == classes->labels[i]) {
            return true;
        }
    }
    return false;
}

/* Subjects of each class. Without the one that is in most classes, the pooled covariance has one
   degree of freedom less for each of those. */
static void count_subjects(struct classes *classes)
{
    size_t all = 0, most = 0;

    for (size_t i = 0; i < classes->n; i++) {
        size_t own = 0;

        if (!is_again(classes, i)) {
            classes->n_of[classes->labels[i]]++;
            all++;
        }
        for (size_t j = 0; j < classes->n && classes->subjects[i] == i; j++) {
            own += classes->subjects[j] == i && !is_again(classes, j);
        }
        most = own > most ? own : most;
    }
    classes->determined = all > classes->count + most ? all - classes->count - most : 0;
}

/* cohort: the canonical one. missing: first member without a label, or n. False: no memory. */
static bool classes_find(const json_t *cohort, struct classes *classes, size_t *missing)
{
    const json_t *labels = json_object_get(cohort, "labels");
    size_t n = json_array_size(labels);

    *classes = (struct classes){.n = n,
                                .labels = srnf_alloc(n, sizeof(size_t)),
                                .sizes = srnf_alloc(n, sizeof(size_t)),
                                .n_of = srnf_alloc(n, sizeof(size_t)),
                                .names = srnf_alloc(n, sizeof(char *))};
    *missing = n;
    classes->subjects = group_subject_numbers(json_object_get(cohort, "subjects"), n,
                                              &classes->n_subjects, &classes->largest);
    if (!classes->labels || !classes->sizes || !classes->n_of || !classes->subjects ||
        !classes->names) {
        return false;
    }
    for (size_t i = n; i-- > 0;) {
        *missing = json_is_string(json_array_get(labels, i)) ? *missing : i;
    }
    for (size_t i = 0; i < n && *missing == n; i++) {
        const char *label = json_string_value(json_array_get(labels, i));
        size_t c = 0;

        while (c < classes->count && strcmp(classes->names[c], label) != 0) {
            c++;
        }
        classes->names[c] = label;
        classes->count += c == classes->count;
        classes->sizes[c]++;
        classes->labels[i] = c;
    }
    if (*missing == n) {
        count_subjects(classes);
    }
    return true;
}

/* ---- Canonical inputs ------------------------------------------------------------------------ */

static const struct compute_classify_method *find_method(const char *name)
{
    for (const struct compute_classify_method *m = compute_classify_methods; m->name; m++) {
        if (name && strcmp(m->name, name) == 0) {
            return m;
        }
    }
    return NULL;
}

/* One name or an array of different ones; canonical: the array. */
static void read_methods(struct process_inputs *inputs)
{
    const json_t *value = json_object_get(inputs->given, "method");
    json_t *list = json_array(), *given;

    if (!value) {
        given = json_pack("[s]", compute_classify_methods[0].name);
    } else {
        given = json_is_array(value) ? json_deep_copy(value) : json_pack("[O]", value);
    }
    for (size_t i = 0; i < json_array_size(given); i++) {
        const char *name = json_string_value(json_array_get(given, i));
        bool again = false;

        for (size_t j = 0; name && j < json_array_size(list); j++) {
            again = again || strcmp(json_string_value(json_array_get(list, j)), name) == 0;
        }
        if (!find_method(name) || again) {
            problem_add(inputs->list, "/inputs/method",
                        again ? "names a method twice"
                              : "must be srnf-gauss, srnf-nn, srm-gauss, srm-nn, harmonic-nn, "
                                "icp-nn or spharm-pdm, or a list of them");
            break;
        }
        (void)json_array_append_new(list, json_string(name));
    }
    if (json_array_size(given) == 0) {
        problem_add(inputs->list, "/inputs/method", "names no method");
    }
    json_decref(given);
    (void)json_object_set_new(inputs->canonical, "method", list);
}

/* "auto" or a number; 0 for auto. */
static long read_components(struct process_inputs *inputs)
{
    const json_t *value = json_object_get(inputs->given, "components");
    const char *text = json_string_value(value);
    double number = json_number_value(value);

    if (!value || (text && strcmp(text, "auto") == 0)) {
        (void)json_object_set_new(inputs->canonical, "components", json_string("auto"));
        return 0;
    }
    if (!json_is_number(value) || floor(number) != number ||
        !(number >= 1.0 && number <= PROCESS_CLASSIFY_COMPONENTS_MAX)) {
        problem_add(inputs->list, "/inputs/components", "must be \"auto\" or a number from 1 to %d",
                    PROCESS_CLASSIFY_COMPONENTS_MAX);
        return 0;
    }
    (void)json_object_set_new(inputs->canonical, "components", json_integer((json_int_t)number));
    return (long)number;
}

/* Whether the folds have training subjects enough. */
static void check_classes(struct process_inputs *inputs, long components, bool with_size, bool own)
{
    const json_t *cohort = json_object_get(inputs->canonical, "cohort");
    struct classes classes;
    size_t missing, features = (components ? (size_t)components : 1) + with_size, freedom;
    size_t smallest;

    if (!classes_find(cohort, &classes, &missing)) {
        problem_add(inputs->list, "/inputs/cohort", "is too large for the memory there is");
    } else if (missing < classes.n) {
        problem_add(inputs->list, "/inputs/cohort", "member %zu has no label", missing);
    } else if (classes.count < 2) {
        problem_add(inputs->list, "/inputs/cohort",
                    "has one label only: there must be two or more");
    } else {
        smallest = 0;
        for (size_t c = 1; c < classes.count; c++) {
            smallest = classes.n_of[c] < classes.n_of[smallest] ? c : smallest;
        }
        freedom = own ? classes.n_of[smallest] - 2 : classes.determined;
        if (classes.n_of[smallest] < 3) {
            problem_add(inputs->list, "/inputs/cohort",
                        "has %zu subjects (%zu members) with the label %.60s; each label needs 3",
                        classes.n_of[smallest], classes.sizes[smallest], classes.names[smallest]);
        } else if (features > freedom) {
            problem_add(inputs->list, components ? "/inputs/components" : "/inputs/covariance",
                        "asks for a covariance of %zu features, size counted; the training "
                        "subjects of a fold determine one of %zu",
                        features, freedom);
        }
    }
    classes_clear(&classes);
}

/* Members belong to the cohort here, which is the one way to name them. */
static void move_surfaces(json_t *canonical)
{
    json_t *surfaces = json_object_get(canonical, "surfaces");

    if (surfaces) {
        (void)json_object_set(json_object_get(canonical, "cohort"), "surfaces", surfaces);
        (void)json_object_del(canonical, "surfaces");
    }
}

json_t *classify_canonicalise(struct api_call *call, const json_t *given, struct problem_list *list)
{
    struct process_inputs inputs;
    const json_t *cohort;
    long components, degree = PROCESS_DEGREE_DEFAULT;
    bool own, with_size, permuted;
    size_t n = 0;

    if (!inputs_open(&inputs, call, given, list, names)) {
        return NULL;
    }
    cohort = json_object_get(given, "cohort");
    if (!cohort || json_is_null(cohort)) {
        problem_add(list, "/inputs/cohort", "is required: the name of a cohort");
    }
    read_methods(&inputs);
    components = read_components(&inputs);
    own = strcmp(inputs_choice(&inputs, "covariance", covariances), "class") == 0;
    (void)inputs_choice(&inputs, "validation", validations);
    with_size = strcmp(inputs_choice(&inputs, "scale", scales), "shape-and-size") == 0;
    (void)inputs_real(&inputs, "sizeWeight", 0.0, PROCESS_SIZE_WEIGHT_MAX, 1.0);
    permuted = inputs_integer(&inputs, "permutations", 0, PROCESS_PERMUTATIONS_MAX, 0) > 0;
    (void)inputs_integer(&inputs, "seed", 0, PROCESS_SEED_MAX, 0);
    (void)inputs_choice(&inputs, "refit", refits);
    (void)inputs_boolean(&inputs, "commonPose", false);
    if (!list->errors) {
        n = inputs_group(&inputs, &degree);
    }
    degree = inputs_integer(&inputs, "lmax", SRNF_DEGREE_MIN, SRNF_DEGREE_MAX, degree);
    move_surfaces(inputs.canonical);
    if (n) {
        inputs_check_memory(&inputs, n, degree, COPIES);
        check_classes(&inputs, components, with_size, own);
        if (permuted && !list->errors) {
            cohort = json_object_get(inputs.canonical, "cohort");
            (void)group_check_labels(&inputs, json_object_get(cohort, "subjects"),
                                     json_object_get(cohort, "labels"), WHY_NOT_PERMUTED);
        }
    }
    return inputs_close(&inputs);
}

/* ---- Result ---------------------------------------------------------------------------------- */

/* What each fold fits again, and what folds have in common. */
static void set_refitted(json_t *document, const struct compute_classify_method *method, bool fold)
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
                            const struct classes *classes, json_t *subject)
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
                           const struct compute_classify_method *method,
                           const struct classes *classes, const json_t *subjects, bool fold)
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
    document =
        json_pack("{s:f, s:I, s:[f, f], s:f, s:o, s:o, s:o, s:o}", "accuracy", r->accuracy,
                  "correct", (json_int_t)r->correct, "confidenceInterval", r->interval[0],
                  r->interval[1], "effectiveCount", r->effective, "confusion", confusion,
                  "perSubject", per_subject, "components", components, "covariance", covariance);
    permutation_set_p(document, "pValue", r->p_value, &r->test);
    set_refitted(document, method, fold);
    return document;
}

static json_t *results_json(struct jobs_run *run, const json_t *inputs,
                            const struct compute_classify_inputs *typed,
                            const struct classes *classes, const char *const *ids,
                            const struct srnf_classification *results,
                            const struct srnf_folds_typicality *typicality)
{
    const char *method_names[COMPUTE_CLASSIFY_METHODS] = {NULL};
    json_t *document = json_object(), *methods = json_object(), *order = json_array();
    const json_t *cohort = json_object_get(inputs, "cohort");
    json_t *subjects = group_subjects(run, json_object_get(cohort, "surfaces"),
                                      json_object_get(cohort, "subjects"));

    for (size_t m = 0; m < typed->n_methods; m++) {
        method_names[m] = typed->methods[m]->name;
        (void)json_object_set_new(methods, method_names[m],
                                  method_json(&results[m], &typicality[m], typed->methods[m],
                                              classes, subjects,
                                              typed->comparison.refit == SRNF_REFIT_FOLD));
    }
    for (size_t c = 0; c < classes->count; c++) {
        (void)json_array_append_new(order, json_string(classes->names[c]));
    }
    (void)json_object_set_new(document, "methods", methods);
    (void)json_object_set_new(document, "members", json_integer((json_int_t)classes->n));
    (void)json_object_set_new(document, "subjects", json_integer((json_int_t)classes->n_subjects));
    (void)json_object_set_new(document, "chance", json_real(1.0 / (double)classes->count));
    (void)json_object_set_new(document, "majorityRate", json_real(results[0].majority));
    permutation_set_test(document, &results[0].test);
    permutation_warn(warnings_of(document), &results[0].test, "No p-value of this result can be");
    routes_set_bridged(document, typed->group->n, ids, typed->group->bridged);
    group_warn_duplicates(run, document, json_object_get(cohort, "surfaces"), cohort,
                          (const char(*)[STORE_ID_MAX])typed->group->contents);
    (void)json_object_set_new(document, "classes", order);
    (void)json_object_set_new(document, "lmax", json_integer((json_int_t)typed->group->degree));
    (void)json_object_set_new(document, "registration",
                              registration_json(&typed->comparison.registration));
    warnings_put(document, handedness_of_names(run, json_object_get(cohort, "surfaces"), cohort));
    typicality_warn_members(warnings_of(document), typed->n_methods, typicality, method_names,
                            subjects);
    json_decref(subjects);
    return document;
}

/* ---- Running --------------------------------------------------------------------------------- */

static bool is_choice(const json_t *inputs, const char *name, const char *choice)
{
    const char *text = json_string_value(json_object_get(inputs, name));

    return text && strcmp(text, choice) == 0;
}

/* All but group, scales and labels. methods: [COMPUTE_CLASSIFY_METHODS]. */
static void typed_inputs(const json_t *inputs, const struct compute_classify_method **methods,
                         struct compute_classify_inputs *typed)
{
    const json_t *list = json_object_get(inputs, "method");
    struct srnf_folds_options *comparison = &typed->comparison;
    struct srnf_classify_options *classifier = &typed->classifier;
    size_t components = (size_t)json_integer_value(json_object_get(inputs, "components"));

    *comparison = srnf_folds_options_defaults();
    *classifier = srnf_classify_options_defaults();
    comparison->registration =
        registration_defaults(json_is_true(json_object_get(inputs, "commonPose")));
    comparison->refit = is_choice(inputs, "refit", "shared") ? SRNF_REFIT_SHARED : SRNF_REFIT_FOLD;
    comparison->max_components = components > COMPONENTS_KEPT ? components : COMPONENTS_KEPT;
    classifier->components = components;
    classifier->covariance = is_choice(inputs, "covariance", "pooled")  ? SRNF_COVARIANCE_POOLED
                             : is_choice(inputs, "covariance", "class") ? SRNF_COVARIANCE_CLASS
                                                                        : SRNF_COVARIANCE_AUTO;
    classifier->size_weight = json_number_value(json_object_get(inputs, "sizeWeight"));
    classifier->permutations = (size_t)json_integer_value(json_object_get(inputs, "permutations"));
    classifier->seed = (uint64_t)json_integer_value(json_object_get(inputs, "seed"));
    for (size_t m = 0; m < json_array_size(list) && m < COMPUTE_CLASSIFY_METHODS; m++) {
        methods[m] = find_method(json_string_value(json_array_get(list, m)));
    }
    typed->n_methods = json_array_size(list);
    typed->methods = methods;
}

/* What the members and classes are doubted for, those apart that classify tells of by itself; false
   with the problem set. */
static bool warn_members(struct jobs_run *run, const json_t *cohort,
                         const struct compute_classify_inputs *typed, const struct classes *classes,
                         json_t *document, struct jobs_result *result)
{
    const struct group_doubts doubts = {.surfaces = json_object_get(cohort, "surfaces"),
                                        .cohort = cohort,
                                        .group = typed->group,
                                        .pairs = typed->pairs,
                                        .classes = classes->labels,
                                        .n_classes = classes->count,
                                        .names = classes->names,
                                        .rotates = !typed->comparison.registration.common_pose,
                                        .mirrors = true};

    return group_doubts_warn(run, &doubts, document, result);
}

/* What multiplies each member back to its size; srnf_free. */
static double *find_scales(struct jobs_run *run, const char *const *ids,
                           const struct compute_group *group)
{
    double *found = srnf_alloc(group->n, sizeof *found);

    for (size_t i = 0; found && i < group->n; i++) {
        found[i] = process_scale(run, ids[i], group->scales[i]);
    }
    return found;
}

void classify_run(struct jobs_run *run, void *api, const char *text, struct jobs_result *result)
{
    json_t *inputs = process_parse(text, result);
    const json_t *cohort = json_object_get(inputs, "cohort");
    struct compute_classify_inputs typed = {0};
    const struct compute_classify_method *methods[COMPUTE_CLASSIFY_METHODS] = {NULL};
    struct srnf_classification results[COMPUTE_CLASSIFY_METHODS] = {{0}};
    struct srnf_folds_typicality typicality[COMPUTE_CLASSIFY_METHODS] = {{0}};
    struct compute_group group = {0};
    struct classes classes = {0};
    const char **ids = NULL;
    const struct compute_mirrored mirrored = group_mirrored(cohort);
    struct compute_origin *origins = NULL;
    double *found = NULL, *pairs = NULL;
    json_t *document = NULL;
    bool with_size, ready;
    size_t n, missing;

    (void)api;
    if (!inputs) {
        return;
    }
    typed_inputs(inputs, methods, &typed);
    with_size = is_choice(inputs, "scale", "shape-and-size");
    ids = group_ids(json_object_get(cohort, "surfaces"), &n);
    origins =
        ids ? routes_bridges(run, json_is_true(json_object_get(inputs, "mixedRoutes")), n, ids)
            : NULL;
    if (!origins || !classes_find(cohort, &classes, &missing)) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "reading the inputs");
        goto out;
    }
    if (compute_group_load(run, n, ids, &mirrored, origins,
                           (size_t)json_integer_value(json_object_get(inputs, "lmax")), SHARE,
                           &group, result)) {
        goto out;
    }
    found = with_size ? find_scales(run, ids, &group) : NULL;
    pairs = srnf_alloc(n, n * sizeof(double));
    ready = pairs && (!with_size || found);
    jobs_run_phase(run, 100.0);
    typed.group = &group;
    typed.pairs = pairs;
    typed.scales = found;
    typed.labels = classes.labels;
    typed.n_classes = classes.count;
    typed.comparison.subjects = classes.subjects;
    if (!ready) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "reading the sizes");
    } else if (compute_classify(run, &typed, results, typicality, result) == 0) {
        document = results_json(run, inputs, &typed, &classes, ids, results, typicality);
        if (warn_members(run, cohort, &typed, &classes, document, result)) {
            process_finish(run, document, inputs, result);
        } else {
            json_decref(document);
        }
    }
out:
    srnf_free(pairs);
    for (size_t m = 0; m < COMPUTE_CLASSIFY_METHODS; m++) {
        srnf_classification_clear(&results[m]);
        srnf_folds_typicality_clear(&typicality[m]);
    }
    compute_group_clear(&group);
    classes_clear(&classes);
    srnf_free(origins);
    srnf_free(found);
    srnf_free(ids);
    json_decref(inputs);
}
