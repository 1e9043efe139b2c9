/*
 * compare_groups.c - the process compare-groups over HTTP: canonical inputs and result document.
 *
 * The canonical cohort holds all that the computation needs of it, as it is now: the surfaces, the
 * two labels in the order of their spelling with the group of each member, and the values of the
 * covariates that are regressed out. The map is stored with the mean surface, whose id it is part
 * of. Subjects, not members, are what is counted and compared (srnf_compare_groups).
 */
#include <stdlib.h>
#include <string.h>

#include "api/cohorts.h"
#include "toolkit/handedness.h"
#include "toolkit/permutation_test.h"
#include "toolkit/covariates.h"
#include "processes/mean.h"
#include "toolkit/typicality.h"
#include "api/warnings.h"
#include "compute/quality.h"

static const char *const names[] = {"cohort",        "covariates", "permutations", "seed",
                                    "register",      "commonPose", "tolerance",    "method",
                                    "maxIterations", "lmax",       "mixedRoutes",  NULL};

#define COPIES 8 /* fields of each surface: those of the mean, averages, residuals, displacements */

/* The constant, the group, and what a covariance of displacements in space needs. */
#define SUBJECTS_MIN(covariates) ((covariates) + 5)

#define WHY_NOT_COMPARED                                                                          \
    "compare-groups compares groups of different subjects: members of one subject are averaged, " \
    "and whole subjects exchange their labels. Take members of one label of each subject. A "     \
    "comparison of pairs within subjects, change, is planned and not there yet."

#define MAPS_TOLD 3 /* of the maps, in the document; all of them ride along in meshes */

/* ---- Canonical inputs ------------------------------------------------------------------------ */

/* The two labels, in the order of strcmp; false with a problem noted. */
static bool find_labels(struct process_inputs *inputs, const json_t *members, const char *labels[2])
{
    size_t found = 0;

    for (size_t i = 0; i < json_array_size(members); i++) {
        const char *label = json_string_value(json_object_get(json_array_get(members, i), "label"));
        bool known = false;

        if (!label) {
            problem_add(inputs->list, "/inputs/cohort", "member %zu has no label", i);
            return false;
        }
        for (size_t k = 0; k < found; k++) {
            known = known || strcmp(label, labels[k]) == 0;
        }
        if (!known && found == 2) {
            problem_add(inputs->list, "/inputs/cohort",
                        "has more than two labels: \"%.60s\", \"%.60s\", \"%.60s\"", labels[0],
                        labels[1], label);
            return false;
        }
        if (!known) {
            labels[found++] = label;
        }
    }
    if (found < 2) {
        problem_add(inputs->list, "/inputs/cohort", "has one label only: \"%.60s\"",
                    found ? labels[0] : "");
        return false;
    }
    if (strcmp(labels[0], labels[1]) > 0) {
        const char *swap = labels[0];
        labels[0] = labels[1];
        labels[1] = swap;
    }
    return true;
}

/* labels, and the group of each member; each must have two subjects at least. */
static bool set_groups(struct process_inputs *inputs, const json_t *members, json_t *cohort)
{
    const char *labels[2] = {NULL, NULL};
    json_t *group = json_array();
    size_t count[2] = {0, 0}, members_of[2] = {0, 0}, n = json_array_size(members), subjects, most;
    size_t *numbers;

    if (!find_labels(inputs, members, labels)) {
        json_decref(group);
        return false;
    }
    for (size_t i = 0; i < json_array_size(members); i++) {
        const json_t *label = json_object_get(json_array_get(members, i), "label");
        int which = strcmp(json_string_value(label), labels[1]) == 0;

        members_of[which]++;
        (void)json_array_append_new(group, json_integer(which));
    }
    numbers = group_subject_numbers(json_object_get(cohort, "subjects"), n, &subjects, &most);
    for (size_t i = 0; numbers && i < n; i++) {
        if (numbers[i] == i) { /* the first of its subject, whose members have one label */
            count[json_integer_value(json_array_get(group, i))]++;
        }
    }
    srnf_free(numbers);
    (void)json_object_set_new(cohort, "groups", json_pack("[s, s]", labels[0], labels[1]));
    (void)json_object_set_new(cohort, "group", group);
    (void)json_object_set_new(cohort, "sizes",
                              json_pack("{s:[I, I], s:[I, I]}", "members",
                                        (json_int_t)members_of[0], (json_int_t)members_of[1],
                                        "subjects", (json_int_t)count[0], (json_int_t)count[1]));
    if (!group_check_labels(inputs, json_object_get(cohort, "subjects"),
                            json_object_get(cohort, "labels"), WHY_NOT_COMPARED)) {
        return false;
    }
    if (count[0] < 2 || count[1] < 2) {
        problem_add(
            inputs->list, "/inputs/cohort",
            "has %zu subjects of label \"%.60s\" and %zu of \"%.60s\"; each group needs two",
            count[0], labels[0], count[1], labels[1]);
        return false;
    }
    return true;
}

/* Names of the covariates, and their values into the cohort. */
static void read_covariates(struct process_inputs *inputs, const json_t *members, json_t *cohort)
{
    const json_t *given = json_object_get(inputs->given, "covariates");
    json_t *chosen = json_array(), *values = json_array();
    char pointer[64];

    if (given && !json_is_array(given)) {
        problem_add(inputs->list, "/inputs/covariates", "must be an array of names");
    }
    if (json_array_size(given) > COHORT_COVARIATES_MAX) {
        problem_add(inputs->list, "/inputs/covariates", "has %zu names; at most %d are taken",
                    json_array_size(given), COHORT_COVARIATES_MAX);
        given = NULL;
    }
    for (size_t i = 0; i < json_array_size(given); i++) {
        const char *name = json_string_value(json_array_get(given, i));
        json_t *one = NULL;

        (void)snprintf(pointer, sizeof pointer, "/inputs/covariates/%zu", i);
        if (!name) {
            problem_add(inputs->list, pointer, "must be the name of a covariate");
        } else if (members) {
            one = covariate_values(inputs, members, name, pointer);
        }
        if (one) {
            (void)json_array_append_new(chosen, json_string(name));
            (void)json_array_append_new(values, one);
        }
    }
    covariates_check(inputs, chosen, values);
    (void)json_object_set_new(inputs->canonical, "covariates", chosen);
    (void)json_object_set_new(cohort, "covariates", values);
}

/* What the comparison needs beside the surfaces, into the canonical cohort. */
static void describe_cohort(struct process_inputs *inputs, size_t n)
{
    json_t *cohort = json_object_get(inputs->canonical, "cohort");
    const char *name = json_string_value(json_object_get(cohort, "name"));
    char owner[STORE_OWNER_MAX];
    struct store_cohort stored = {.record = NULL};
    json_t *members = NULL;

    if (!cohort_owner(inputs->call, name, true, owner)) {
        inputs->answered = true;
        return;
    }
    if (store_cohort_get_as(inputs->call->api->config.store, owner, name, &stored) == 0) {
        members = cohort_members(&stored);
    }
    if (json_array_size(members) != n) { /* replaced since it was read, a moment ago */
        problem_add(inputs->list, "/inputs/cohort", "has changed while it was read: send it again");
    } else if (set_groups(inputs, members, cohort)) {
        const json_t *sizes = json_object_get(json_object_get(cohort, "sizes"), "subjects");
        size_t covariates, subjects = 0;

        for (size_t i = 0; i < json_array_size(sizes); i++) {
            subjects += (size_t)json_integer_value(json_array_get(sizes, i));
        }
        read_covariates(inputs, members, cohort);
        covariates = json_array_size(json_object_get(inputs->canonical, "covariates"));
        if (subjects < SUBJECTS_MIN(covariates)) {
            char with[48] = "a comparison";

            if (covariates > 0) {
                (void)snprintf(with, sizeof with, "%zu covariate%s", covariates,
                               covariates == 1 ? "" : "s");
            }
            problem_add(inputs->list, "/inputs/cohort",
                        "has %zu subjects, too few for %s: %zu are needed", subjects, with,
                        SUBJECTS_MIN(covariates));
        }
    }
    json_decref(members);
    store_cohort_clear(&stored);
}

json_t *compare_canonicalise(struct api_call *call, const json_t *given, struct problem_list *list)
{
    struct process_inputs inputs;
    long degree = PROCESS_DEGREE_DEFAULT;
    size_t n = 0;

    if (!inputs_open(&inputs, call, given, list, names)) {
        return NULL;
    }
    (void)inputs_integer(&inputs, "permutations", 1, PROCESS_PERMUTATIONS_MAX,
                         PROCESS_PERMUTATIONS_DEFAULT);
    (void)inputs_integer(&inputs, "seed", 0, PROCESS_SEED_MAX, 0);
    inputs_mean_options(&inputs);
    if (!json_is_string(json_object_get(given, "cohort"))) {
        problem_add(list, "/inputs/cohort", "is required: the name of a cohort of two labels");
    } else if (!list->errors) {
        n = inputs_group(&inputs, &degree);
    }
    inputs_mean_degree(&inputs, n, degree, COPIES);
    if (n && !list->errors) {
        describe_cohort(&inputs, n);
        (void)json_object_set(json_object_get(inputs.canonical, "cohort"), "surfaces",
                              json_object_get(inputs.canonical, "surfaces"));
    }
    (void)json_object_del(inputs.canonical, "surfaces");
    return inputs_close(&inputs);
}

/* ---- Results --------------------------------------------------------------------------------- */

/* Typed inputs from the canonical ones; arrays to be freed with free. */
struct design {
    int *group;
    double *covariates;
    size_t *subjects; /* srnf_free */
};

static bool read_design(const json_t *cohort, struct compute_comparison_inputs *typed,
                        struct design *design)
{
    const json_t *group = json_object_get(cohort, "group");
    const json_t *columns = json_object_get(cohort, "covariates");
    size_t n = json_array_size(group), m = json_array_size(columns), count, largest;

    design->subjects =
        group_subject_numbers(json_object_get(cohort, "subjects"), n, &count, &largest);
    design->group = calloc(n ? n : 1, sizeof *design->group);
    design->covariates = calloc(n * m > 0 ? n * m : 1, sizeof *design->covariates);
    if (!design->group || !design->covariates || !design->subjects) {
        return false;
    }
    for (size_t i = 0; i < n; i++) {
        design->group[i] = (int)json_integer_value(json_array_get(group, i));
        for (size_t j = 0; j < m; j++) {
            design->covariates[i * m + j] =
                json_number_value(json_array_get(json_array_get(columns, j), i));
        }
    }
    typed->group = design->group;
    typed->covariates = design->covariates;
    typed->n_covariates = m;
    typed->options.subjects = design->subjects;
    typed->mean.subjects = design->subjects;
    return true;
}

/* The maps in one array; count 0 without memory. */
static struct store_maps make_maps(const struct compute_mean_outputs *mean,
                                   const struct srnf_comparison *comparison)
{
    static const char *const titles[] = {"significance", "fdr",        "effect",
                                         "normalEffect", "pointwiseP", "statistic"};
    const double *const values[] = {
        comparison->significance, comparison->fdr, comparison->effect,
        comparison->normal,       comparison->p,   comparison->statistic};
    struct store_maps maps = {.n_theta = (int64_t)mean->n_theta, .n_phi = (int64_t)mean->n_phi};
    size_t count = sizeof titles / sizeof titles[0], points = mean->n_theta * mean->n_phi;

    maps.values = malloc(count * points * sizeof(double));
    if (!maps.values) {
        return maps;
    }
    maps.count = count;
    for (size_t i = 0; i < count; i++) {
        (void)snprintf(maps.names[i], sizeof maps.names[i], "%s", titles[i]);
        memcpy(maps.values + i * points, values[i], points * sizeof(double));
    }
    return maps;
}

/* The ends of the maps, for those who do not draw them. */
static json_t *summary(const struct compute_mean_outputs *mean,
                       const struct srnf_comparison *comparison)
{
    size_t points = mean->n_theta * mean->n_phi;
    double least = 1.0, least_fdr = 1.0, largest = 0.0;
    struct srnf_permutation_test local = comparison->test;
    json_t *document;

    for (size_t p = 0; p < points; p++) {
        least = comparison->significance[p] < least ? comparison->significance[p] : least;
        least_fdr = comparison->fdr[p] < least_fdr ? comparison->fdr[p] : least_fdr;
        largest = comparison->effect[p] > largest ? comparison->effect[p] : largest;
    }
    document = json_pack("{s:o, s:o}", "leastFdr", json_finite(least_fdr), "largestEffect",
                         json_finite(largest));
    local.least = comparison->least_local;
    permutation_set_p(document, "leastSignificance", least, &local);
    return document;
}

static json_t *map_json(const struct store_maps *maps)
{
    size_t points = (size_t)maps->n_theta * (size_t)maps->n_phi;
    json_t *map = json_pack("{s:I, s:I}", "nTheta", (json_int_t)maps->n_theta, "nPhi",
                            (json_int_t)maps->n_phi);

    for (size_t i = 0; i < MAPS_TOLD && i < maps->count; i++) {
        (void)json_object_set_new(map, maps->names[i],
                                  json_vector(maps->values + i * points, points));
    }
    return map;
}

/* The map's p-values may be able to go lower than that of the whole surface. */
static void warn_of_floors(json_t *warnings, const struct srnf_comparison *comparison)
{
    struct srnf_permutation_test local = comparison->test;

    local.least = comparison->least_local;
    if (local.least > PERMUTATION_LEVEL) {
        permutation_warn(warnings, &local, "No p-value of this result can be");
    } else {
        permutation_warn(warnings, &comparison->test, "pValue, unlike those of the map, cannot be");
    }
}

static json_t *comparison_json(const json_t *inputs, const struct compute_mean_outputs *mean,
                               const struct srnf_comparison *comparison,
                               const struct store_maps *maps)
{
    const json_t *cohort = json_object_get(inputs, "cohort");
    json_t *document = summary(mean, comparison);

    permutation_set_p(document, "pValue", comparison->p_value, &comparison->test);
    permutation_set_test(document, &comparison->test);
    (void)json_object_set_new(document, "level",
                              json_string(comparison->asymptotic ? "asymptotic" : "exact"));
    warn_of_floors(warnings_of(document), comparison);
    (void)json_object_set_new(document, "members", json_integer((json_int_t)comparison->n));
    (void)json_object_set_new(document, "subjects", json_integer((json_int_t)comparison->subjects));
    (void)json_object_set(document, "groupSizes", json_object_get(cohort, "sizes"));
    (void)json_object_set_new(document, "distance", json_finite(comparison->distance));
    (void)json_object_set(document, "groups", json_object_get(cohort, "groups"));
    (void)json_object_set(document, "regressedOut", json_object_get(inputs, "covariates"));
    (void)json_object_set_new(document, "map", map_json(maps));
    return document;
}

/* What the members and the two groups are doubted for; false with the problem set. */
static bool warn_members(struct jobs_run *run, const json_t *cohort,
                         const struct compute_comparison_inputs *typed,
                         const struct compute_mean_outputs *mean, json_t *document,
                         struct jobs_result *result)
{
    const json_t *groups = json_object_get(cohort, "groups");
    const char *titles[2] = {json_string_value(json_array_get(groups, 0)),
                             json_string_value(json_array_get(groups, 1))};
    size_t *classes = srnf_alloc(mean->mean.n, sizeof *classes);
    const struct group_doubts doubts = {.surfaces = json_object_get(cohort, "surfaces"),
                                        .cohort = cohort,
                                        .classes = classes,
                                        .n_classes = 2,
                                        .names = titles};
    bool good = classes != NULL;

    for (size_t i = 0; classes && i < mean->mean.n; i++) {
        classes[i] = (size_t)typed->group[i];
    }
    if (classes) {
        good = mean_warn(run, &typed->mean, mean, doubts, document, result);
    } else {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "comparing the members");
    }
    srnf_free(classes);
    return good;
}

void compare_run(struct jobs_run *run, void *api, const char *text, struct jobs_result *result)
{
    json_t *inputs = process_parse(text, result), *document, *surface = NULL;
    const json_t *cohort = json_object_get(inputs, "cohort");
    struct compute_comparison_inputs typed = {.options = srnf_compare_options_defaults()};
    struct compute_mean_outputs mean = {0};
    struct srnf_register_options registration;
    struct srnf_comparison comparison = {0};
    struct store_maps maps = {0};
    struct design design = {NULL, NULL, NULL};
    const char **ids;
    size_t n = 0;

    (void)api;
    if (!inputs) {
        return;
    }
    ids = group_ids(json_object_get(cohort, "surfaces"), &n);
    typed.options.permutations =
        (size_t)json_integer_value(json_object_get(inputs, "permutations"));
    typed.options.seed = (uint64_t)json_integer_value(json_object_get(inputs, "seed"));
    if (!mean_inputs(run, inputs, n, ids, &typed.mean, &registration, result)) {
        goto out;
    }
    if (!read_design(cohort, &typed, &design)) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "reading the inputs");
        goto out;
    }
    if (compute_comparison(run, &typed, &mean, &comparison, result)) {
        goto out;
    }
    maps = make_maps(&mean, &comparison);
    if (maps.count) {
        surface = mean_keep_surface(run, "compare-groups", "mean with the map of a comparison",
                                    &typed.mean, &mean, &maps, result);
    } else {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "keeping the map");
    }
    if (surface) {
        document = comparison_json(inputs, &mean, &comparison, &maps);
        (void)json_object_set_new(document, "surface", surface);
        mean_set_members(document, &typed.mean, &mean);
        warnings_put(document,
                     handedness_of_names(run, json_object_get(cohort, "surfaces"), cohort));
        group_warn_duplicates(run, document, json_object_get(cohort, "surfaces"), cohort,
                              (const char(*)[STORE_ID_MAX])mean.group.contents);
        typicality_warn_poses(warnings_of(document), &mean, design.subjects, NULL);
        covariates_warn(warnings_of(document), json_object_get(inputs, "covariates"), n,
                        design.subjects, design.group, design.covariates);
        if (warn_members(run, cohort, &typed, &mean, document, result)) {
            process_finish(run, document, inputs, result);
        } else {
            json_decref(document);
        }
    }
out:
    srnf_free(typed.mean.origins);
    srnf_free(design.subjects);
    store_maps_clear(&maps);
    srnf_comparison_clear(&comparison);
    compute_mean_clear(&mean);
    free(design.group);
    free(design.covariates);
    srnf_free(ids);
    json_decref(inputs);
}
