/*
 * compare_groups.c - the process compare-groups: do the two groups of a labelled cohort differ, and
 * where?
 *
 * The canonical cohort holds all that the computation needs of it, as it is now: the surfaces, the
 * two labels in the order of their spelling with the group of each member, and the values of the
 * covariates that are regressed out. The map is stored with the mean surface, whose id it is part
 * of. Subjects, not members, are what is counted and compared (srnf_compare_groups).
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/warnings.h"
#include "toolkit/covariates.h"
#include "toolkit/mean.h"
#include "toolkit/permutation_test.h"
#include "toolkit/seconds.h"
#include "toolkit/typicality.h"
#include "store/surface.h"

/* The cohort with what is compared of it. */
struct compared {
    struct group_input group;
    int *which; /* [n] group of each member, 0 or 1 */
    size_t n_covariates;
    double *covariates; /* [n][n_covariates] */
};

struct compare {
    struct compared cohort;
    struct mean_input mean;
    long permutations, seed;
    json_t *covariates; /* names */
};

static bool type_cohort(const json_t *value, void *member)
{
    struct compared *compared = member;
    const json_t *group = json_object_get(value, "group");
    const json_t *columns = json_object_get(value, "covariates");
    size_t n = json_array_size(group), m = json_array_size(columns);

    compared->n_covariates = m;
    compared->which = srnf_alloc(n ? n : 1, sizeof *compared->which);
    compared->covariates = srnf_alloc(n * m > 0 ? n * m : 1, sizeof *compared->covariates);
    if (!compared->which || !compared->covariates || !group_type_members(value, &compared->group) ||
        compared->group.n != n) {
        return false;
    }
    for (size_t i = 0; i < n; i++) {
        compared->which[i] = (int)json_integer_value(json_array_get(group, i));
        for (size_t j = 0; j < m; j++) {
            compared->covariates[i * m + j] =
                json_number_value(json_array_get(json_array_get(columns, j), i));
        }
    }
    return true;
}

static void clear_cohort(void *member)
{
    struct compared *compared = member;

    group_input_clear(&compared->group);
    srnf_free(compared->which);
    srnf_free(compared->covariates);
}

static const struct input_own cohort_input = {
    .schema = GROUP_MEMBERS_SCHEMA,
    .refers = true,
    .read = group_read_members,
    .type = type_cohort,
    .clear = clear_cohort,
};

static const struct process_input inputs[] = {
    {"cohort", INPUT_OWN, offsetof(struct compare, cohort),
     "A cohort whose members have two labels, the same for all members of a subject.",
     .required = true, .own = &cohort_input},
    {"mixedRoutes", INPUT_BOOLEAN, offsetof(struct compare, cohort.group.mixed_routes),
     GROUP_MIXED_ROUTES_TEXT, .fallback = 0},
    {"covariates", INPUT_OWN, offsetof(struct compare, covariates),
     "Names of covariates of the members, numbers or true and false, whose linear effect is taken "
     "out.",
     .own = &covariates_names},
    {"permutations", INPUT_INTEGER, offsetof(struct compare, permutations),
     "Of the labels of whole subjects. No p can be below 1 / (permutations + 1).", .lowest = 1,
     .highest = PROCESS_PERMUTATIONS_MAX, .fallback = PROCESS_PERMUTATIONS_DEFAULT},
    {"seed", INPUT_INTEGER, offsetof(struct compare, seed), "Of the permutations.",
     .highest = PROCESS_SEED_MAX},
    MEAN_INPUTS(compare, NULL),
    MEAN_SRNF_METHOD(compare,
                     "srnf: of the space of SRNFs, in which components are straight lines.", NULL),
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"pValue", OUTPUT_NUMBER, "Permutation p of the distance between the groups' means."},
    {"members", OUTPUT_INTEGER, "Of the cohort."},
    {"subjects", OUTPUT_INTEGER, "What is compared: the members of each are averaged."},
    {"groupSizes", OUTPUT_OBJECT, "members and subjects of each group."},
    {"pValueIsFloor", OUTPUT_BOOLEAN,
     "Whether pValue is the smallest that the test can give; that of the map may be smaller, with "
     "covariates."},
    {"pValueInterval", OUTPUT_ARRAY,
     "Wilson's 95 % interval of the p that all relabellings would give; the point itself where "
     "exact."},
    {"leastSignificanceIsFloor", OUTPUT_BOOLEAN, "As of pValue."},
    {"leastSignificanceInterval", OUTPUT_ARRAY, "As of pValue."},
    {"distance", OUTPUT_NUMBER,
     "That distance, in the L2 norm of SRNFs, without the covariates' part."},
    {"leastSignificance", OUTPUT_NUMBER,
     "Least value of significance on the map: p of the hypothesis that the groups differ nowhere."},
    {"leastFdr", OUTPUT_NUMBER,
     "Least value of fdr on the map: the false discovery rate of the node with the clearest "
     "difference."},
    {"largestEffect", OUTPUT_NUMBER,
     "Largest value of effect on the map: how far the groups' mean surfaces are apart at a node, "
     "in the coordinates of the mean surface as stored."},
    {"groups", OUTPUT_ARRAY, "The two labels; effects go from the first to the second."},
    {"permutations", OUTPUT_INTEGER,
     "Relabellings that the observed labels were compared with; 0: none."},
    {"relabellings", OUTPUT_NUMBER_OR_NULL,
     "Different ones that whole subjects can have, the observed among them: those give some "
     "subject another group or other covariates; null: no test, or beyond all numbers."},
    {"exact", "\"type\":[\"boolean\",\"null\"]",
     "Whether all of them were taken, each once, since there were no more than asked for: p is "
     "then that of all, not estimated; null: no test."},
    {"level", "\"enum\":[\"exact\",\"asymptotic\"]",
     "exact: labels of subjects can be exchanged, so that where groups do not differ p is at most "
     "a with a probability of at most a. asymptotic: covariates are regressed out (Freedman and "
     "Lane 1983), with which that holds in the limit of many subjects only, even if all "
     "relabellings were taken."},
    {"regressedOut", OUTPUT_ARRAY, "Names of the covariates."},
    {"map", OUTPUT_OBJECT,
     "On the nTheta x nPhi Gauss-Legendre grid, row by row. significance: permutation p of the "
     "local difference (Hotelling's T2 of the displacements), corrected for all points by the "
     "largest statistic; fdr: least false discovery rate, by area, at which the point is reported; "
     "effect: length of the mean displacement, for surfaces of area 1."},
    {"surface", OUTPUT_OBJECT,
     "Record of the mean surface; its meshes carry significance, fdr, effect, normalEffect "
     "(outward positive), pointwiseP and statistic at every vertex."},
    MEAN_MEMBERS_OUTPUTS,
    {NULL, NULL, NULL},
};

#define COPIES 8 /* fields of each surface: those of the mean, averages, residuals, displacements */
#define SHARE_MEAN 40.0 /* percent of the job that the mean is */
/* The constant, the group, and what a covariance of displacements in space needs. */
#define SUBJECTS_MIN(covariates) ((covariates) + 5)

#define WHY_NOT_COMPARED                                                                          \
    "compare-groups compares groups of different subjects: members of one subject are averaged, " \
    "and whole subjects exchange their labels. Take members of one label of each subject. A "     \
    "comparison of pairs within subjects, change, is planned and not there yet."

#define MAPS_TOLD 3 /* of the maps, in the document; all of them ride along in meshes */

/* ---- Inputs ---------------------------------------------------------------------------------- */

/* The two labels, in the order of strcmp; false with a problem noted. */
static bool find_labels(struct process_inputs *given, const json_t *members, const char *labels[2])
{
    size_t found = 0;

    for (size_t i = 0; i < json_array_size(members); i++) {
        const char *label = json_string_value(json_object_get(json_array_get(members, i), "label"));
        bool known = false;

        if (!label) {
            problem_add(given->list, "/inputs/cohort", "member %zu has no label", i);
            return false;
        }
        for (size_t k = 0; k < found; k++) {
            known = known || strcmp(label, labels[k]) == 0;
        }
        if (!known && found == 2) {
            problem_add(given->list, "/inputs/cohort",
                        "has more than two labels: \"%.60s\", \"%.60s\", \"%.60s\"", labels[0],
                        labels[1], label);
            return false;
        }
        if (!known) {
            labels[found++] = label;
        }
    }
    if (found < 2) {
        problem_add(given->list, "/inputs/cohort", "has one label only: \"%.60s\"",
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
static bool set_groups(struct process_inputs *given, const json_t *members, json_t *cohort)
{
    const char *labels[2] = {NULL, NULL};
    json_t *group = json_array();
    size_t count[2] = {0, 0}, members_of[2] = {0, 0}, n = json_array_size(members), subjects, most;
    size_t *numbers;

    if (!find_labels(given, members, labels)) {
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
    if (!group_check_labels(given, json_object_get(cohort, "subjects"),
                            json_object_get(cohort, "labels"), WHY_NOT_COMPARED)) {
        return false;
    }
    if (count[0] < 2 || count[1] < 2) {
        problem_add(
            given->list, "/inputs/cohort",
            "has %zu subjects of label \"%.60s\" and %zu of \"%.60s\"; each group needs two",
            count[0], labels[0], count[1], labels[1]);
        return false;
    }
    return true;
}

/* Values of the covariates into the cohort. */
static void set_covariates(struct process_inputs *given, const json_t *members, json_t *cohort)
{
    const json_t *names = json_object_get(given->canonical, "covariates");
    json_t *values = covariate_values(given, members, names);

    if (json_array_size(values) == json_array_size(names)) {
        covariates_check(given, names, values);
    }
    (void)json_object_set_new(cohort, "covariates", values);
}

static void check_subjects(struct process_inputs *given, const json_t *cohort)
{
    const json_t *sizes = json_object_get(json_object_get(cohort, "sizes"), "subjects");
    size_t covariates = json_array_size(json_object_get(given->canonical, "covariates"));
    size_t subjects = 0;
    char with[48] = "a comparison";

    for (size_t i = 0; i < json_array_size(sizes); i++) {
        subjects += (size_t)json_integer_value(json_array_get(sizes, i));
    }
    if (covariates > 0) {
        (void)snprintf(with, sizeof with, "%zu covariate%s", covariates,
                       covariates == 1 ? "" : "s");
    }
    if (subjects < SUBJECTS_MIN(covariates)) {
        problem_add(given->list, "/inputs/cohort",
                    "has %zu subjects, too few for %s: %zu are needed", subjects, with,
                    SUBJECTS_MIN(covariates));
    }
}

/* What the comparison needs beside the surfaces, into the canonical cohort. */
static void describe_cohort(struct process_inputs *given)
{
    json_t *cohort = json_object_get(given->canonical, "cohort"), *members;
    size_t n = json_array_size(json_object_get(cohort, "surfaces"));

    members = group_stored_members(given);
    if (given->answered) {
        return;
    }
    if (json_array_size(members) != n) { /* replaced since it was read, a moment ago */
        problem_add(given->list, "/inputs/cohort", "has changed while it was read: send it again");
    } else if (set_groups(given, members, cohort)) {
        set_covariates(given, members, cohort);
        check_subjects(given, cohort);
    }
    json_decref(members);
}

static void complete(struct process_inputs *given)
{
    mean_complete(given, COPIES);
    if (!given->list->errors) {
        describe_cohort(given);
    }
}

/* ---- Running --------------------------------------------------------------------------------- */

static int compare(struct jobs_run *run, const struct compare *asked, struct group_mean *mean,
                   struct srnf_comparison *comparison, struct jobs_result *result)
{
    const struct compared *cohort = &asked->cohort;
    const struct compute_mean_inputs more = {.share = SHARE_MEAN};
    struct srnf_compare_options options = srnf_compare_options_defaults();
    const struct compute_mean_outputs *found = &mean->outputs;
    const struct srnf_sht *sht = NULL;
    struct srnf_error error = {0};
    int status = group_mean_compute(run, &cohort->group, &asked->mean, more, mean, result);

    if (status) {
        return status;
    }
    jobs_run_phase(run, 100.0);
    options.permutations = (size_t)asked->permutations;
    options.seed = (uint64_t)asked->seed;
    options.subjects = cohort->group.subjects;
    status = jobs_transform_acquire(jobs_run_jobs(run), found->group.degree,
                                    SRNF_GRID_GAUSS_LEGENDRE, found->n_theta, found->n_phi, &sht);
    if (status) {
        return compute_fail(result, status, NULL, "preparing the harmonic transform");
    }
    status =
        srnf_compare_groups(sht, found->mean.n, found->mean.coefficients, found->mean.registered_q,
                            cohort->which, cohort->n_covariates, cohort->covariates, &options,
                            jobs_run_context(run), comparison, &error);
    jobs_transform_release(jobs_run_jobs(run), sht);
    return status ? compute_fail(result, status, &error, "comparing the groups") : 0;
}

/* ---- Results --------------------------------------------------------------------------------- */

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

static json_t *comparison_json(const struct compare *asked, const struct compute_mean_outputs *mean,
                               const struct srnf_comparison *comparison,
                               const struct store_maps *maps)
{
    const json_t *cohort = asked->cohort.group.cohort;
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
    (void)json_object_set(document, "regressedOut", asked->covariates);
    (void)json_object_set_new(document, "map", map_json(maps));
    return document;
}

/* Adds what the members and the two groups are doubted for; takes the document over and returns it,
   or NULL with the problem set. */
static json_t *warn(struct jobs_run *run, const struct compare *asked,
                    const struct group_mean *mean, json_t *document, struct jobs_result *result)
{
    const struct compared *cohort = &asked->cohort;
    const json_t *groups = json_object_get(cohort->group.cohort, "groups");
    const char *titles[2] = {json_string_value(json_array_get(groups, 0)),
                             json_string_value(json_array_get(groups, 1))};
    size_t n = cohort->group.n, *classes = srnf_alloc(n, sizeof *classes);
    const struct group_doubts doubts = {.classes = classes, .n_classes = 2, .names = titles};

    mean_warn_members(run, mean, document);
    typicality_warn_poses(warnings_of(document), &mean->outputs, cohort->group.subjects, NULL);
    covariates_warn(warnings_of(document), asked->covariates, n, cohort->group.subjects,
                    cohort->which, cohort->covariates);
    for (size_t i = 0; classes && i < n; i++) {
        classes[i] = (size_t)cohort->which[i];
    }
    if (classes) {
        document = mean_warn(run, mean, doubts, document, result);
    } else {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "comparing the members");
        json_decref(document);
        document = NULL;
    }
    srnf_free(classes);
    return document;
}

static json_t *run_compare(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct compare *asked = typed;
    struct group_mean mean;
    struct srnf_comparison comparison = {0};
    struct store_maps maps = {0};
    json_t *document = NULL, *surface = NULL;

    if (compare(run, asked, &mean, &comparison, result)) {
        goto out;
    }
    maps = make_maps(&mean.outputs, &comparison);
    if (maps.count) {
        surface = mean_keep_surface(run, "compare-groups", "mean with the map of a comparison",
                                    &mean, &maps, result);
    } else {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "keeping the map");
    }
    if (surface) {
        document = comparison_json(asked, &mean.outputs, &comparison, &maps);
        (void)json_object_set_new(document, "surface", surface);
        mean_set_members(document, &mean);
        document = warn(run, asked, &mean, document, result);
    }
out:
    store_maps_clear(&maps);
    srnf_comparison_clear(&comparison);
    group_mean_clear(&mean);
    return document;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct compare),
    .complete = complete,
    .run = run_compare,
};

const struct api_process compare_process = {
    .id = "compare-groups",
    .title = "Comparison of two groups",
    .description = "A permutation test of the difference between the means of two groups, and a "
                   "map of where they differ, corrected for multiple comparisons, with covariates "
                   "regressed out.",
    .table = &table,
    .seconds = compare_seconds,
};
