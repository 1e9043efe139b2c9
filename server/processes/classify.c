/*
 * classify.c - the process classify: each member of a labelled cohort classified by those of other
 * subjects, by one method or several.
 *
 * Labels and subjects are those of the cohort's members, as they were when the job was made;
 * classes are in the order in which their labels first appear. What the training subjects of a fold
 * cannot determine is refused before a job is made. Subjects whose members have different labels,
 * as at end diastole and end systole, are left out as a whole like all others; but they cannot
 * exchange their labels, so that permutations are refused.
 *
 * Each metric compares once, whatever asks for it. What the comparisons register is kept for a
 * later attempt at the same job.
 */
#include "processes/classify.h"

#include <string.h>

#include "compute/searches.h"
#include "compute/seconds.h"
#include "toolkit/covariates.h"
#include "toolkit/registration_options.h"
#include "toolkit/routes.h"
#include "toolkit/seconds.h"

/* Fields that are held for each surface: registrations of all, and of the folds that run. */
#define COPIES 12
#define SUBJECTS_MIN 3     /* of each label */
#define COMPONENTS_KEPT 20 /* of which auto chooses */
#define SHARE 20.0         /* percent of the job that encoding its meshes takes */

#define WHY_NOT_PERMUTED                                                                      \
    "A permutation test exchanges the labels of whole subjects, which is not possible here. " \
    "Take permutations 0 (leaving whole subjects out is right all the same), or one member "  \
    "of each subject. Changes within subjects are tested by change."

/* ---- Inputs and outputs ---------------------------------------------------------------------- */

/* In the order of enum srnf_covariance and enum srnf_refit. */
static const char *const covariances[] = {"auto", "pooled", "class", NULL};
static const char *const refits[] = {"fold", "shared", NULL};
static const char *const validations[] = {"loo", NULL};
static const char *const scales[] = {"shape", "shape-and-size", NULL};

#define AT(member) offsetof(struct classify, member)
static const struct process_input inputs[] = {
    GROUP_MEMBERS_INPUTS(classify, "Name of a cohort whose members have labels, each of them "
                                   "members of three subjects at least."),
    {"method", INPUT_OWN, AT(methods),
     "One method or several. gauss: a normal distribution for each class on principal components; "
     "nn: nearest neighbour, by SRNFs, square-root maps, surfaces as parameterized, closest "
     "points, or points that the first-order ellipsoids make correspond.",
     .own = &classify_method_own},
    {"components", INPUT_OWN, AT(components),
     "Of the Gaussians; auto: chosen inside each fold, of 20 at most.",
     .own = &classify_components_own},
    {"covariance", INPUT_CHOICE, AT(covariance),
     "One for all classes, or one for each; auto: chosen inside each fold.",
     .choices = covariances},
    {"validation", INPUT_CHOICE, AT(validation),
     "Leave-one-out: every fold leaves out all members of a subject.", .choices = validations},
    {"scale", INPUT_CHOICE, AT(scale), "Whether the log of the size counts beside shape.",
     .choices = scales},
    {"covariates", INPUT_OWN, AT(covariates),
     "Numbers of the members that count beside shape, by their names.", .own = &covariates_names},
    {"sizeWeight", INPUT_REAL, AT(size_weight),
     "Of size, and of each covariate, in distances; at 1 it weighs as much as shape. Gaussians "
     "need none.",
     .highest = PROCESS_SIZE_WEIGHT_MAX, .fallback = 1},
    {"permutations", INPUT_INTEGER, AT(permutations),
     "Of the labels of whole subjects, for the p-value; 0: none. Refused where labels differ "
     "within a subject.",
     .highest = PROCESS_PERMUTATIONS_MAX},
    {"seed", INPUT_INTEGER, AT(seed), "Of the permutations.", .highest = PROCESS_SEED_MAX},
    {"refit", INPUT_CHOICE, AT(refit),
     "fold: each fold registers all to what its own training subjects give; shared: all are "
     "registered once, to what all of them give, which is faster and lets the shape of the one "
     "left out, not its label, into the registrations.",
     .choices = refits},
    {"commonPose", INPUT_BOOLEAN, AT(common_pose),
     "The surfaces share a pose: no registration rotates.", .fallback = 0},
    {"lmax", INPUT_INTEGER, AT(lmax),
     "Degree of the comparison; the surfaces are cut or filled up to it. Default: the largest of "
     "theirs. 15 is enough for most.",
     .lowest = SRNF_DEGREE_MIN, .highest = SRNF_DEGREE_MAX, .derived = true},
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"methods", OUTPUT_OBJECT,
     "By name: accuracy; correct; confidenceInterval (Wilson, 95 %, with effectiveCount members, n "
     "p (1 - p) over the variance of p, the larger of that between subjects, Rao and Scott 1992, "
     "and that of 100 relabellings, as members that are left out of each other are right or wrong "
     "together); balancedAccuracy, the mean share of each class that is told, and auc of each "
     "class against the rest, {value, interval} likewise; confusion (rows: "
     "labels, columns: predictions, in the order of classes); perSubject, of each member "
     "[{subject, label, predicted, logLikelihoods or nearestDistances, of each class; typicality, "
     "{value, limit, percentile, percentileInterval} of its residual, distance and mahalanobis in "
     "the fold that left it out, or of its nearest distance, among those of the members of other "
     "subjects: beyond a limit it is unlike every class; a limit is null where the others are too "
     "few, or too unlike "
     "each other, to set one}]; components and covariance of each fold, or null; pValue, (1 + b) / "
     "(1 + m) with b of m relabellings of whole subjects at least as good, pValueIsFloor (the "
     "smallest that the test can give) and pValueInterval (Wilson's 95 % interval of the p that "
     "all relabellings would give; the point itself where exact), or null; refitted inside each "
     "fold, and shared between folds."},
    {"comparisons", OUTPUT_OBJECTS,
     "Of each pair of methods, by the same folds: [{first, second, onlyFirst and onlySecond "
     "(members "
     "that only one of them gets right), pValue}], McNemar's exact test that both are right "
     "equally "
     "often, which flips the signs of whole subjects."},
    {"features", OUTPUT_STRINGS, "The numbers beside shape: size, and covariates."},
    {"members", OUTPUT_INTEGER, "Of the cohort."},
    {"subjects", OUTPUT_INTEGER, "Members without a subject are subjects of their own."},
    {"chance", OUTPUT_NUMBER,
     "1 / number of classes: what the Gaussians, which take classes for equally likely, get right "
     "by chance."},
    {"majorityRate", OUTPUT_NUMBER,
     "Share of the largest class: what always naming it gets right. An accuracy is to be compared "
     "with the larger of this and chance."},
    {"permutations", OUTPUT_INTEGER,
     "Relabellings that the observed labels were compared with; 0: none."},
    {"relabellings", OUTPUT_NUMBER_OR_NULL,
     "Different ones that whole subjects can have, the observed among them; null: no test, or "
     "beyond all numbers."},
    {"exact", "\"type\":[\"boolean\",\"null\"]",
     "Whether all of them were taken, each once, since there were no more than asked for; null: no "
     "test."},
    {"classes", "\"type\":\"array\",\"items\":{" OUTPUT_STRING "}",
     "The labels, in the order in which they first appear."},
    {"lmax", OUTPUT_INTEGER, "Degree of the comparison."},
    BRIDGED_GROUP_OUTPUTS,
    {"registration", OUTPUT_OBJECT,
     "Of the methods that register: degree, penalty and all other options."},
    {NULL, NULL, NULL},
};

/* ---- What holds between inputs --------------------------------------------------------------- */

static void check_folds(struct process_inputs *given, const struct classify_classes *classes)
{
    long components = (long)json_integer_value(json_object_get(given->canonical, "components"));
    size_t numbers = inputs_chose(given->canonical, "scale", "shape-and-size") +
                     json_array_size(json_object_get(given->canonical, "covariates"));
    size_t features = (components ? (size_t)components : 1) + numbers;
    size_t freedom;

    if (!classify_check_count(given, numbers)) {
        return;
    }
    freedom = inputs_chose(given->canonical, "covariance", "class")
                  ? classes->subjects[classes->smallest] - 2
                  : classes->determined;
    if (features > freedom) {
        problem_add(given->list, components ? "/inputs/components" : "/inputs/covariance",
                    "asks for a covariance of %zu features, size and covariates counted; the "
                    "training subjects of a fold determine one of %zu",
                    features, freedom);
    }
}

static void complete(struct process_inputs *given)
{
    const json_t *cohort = json_object_get(given->canonical, "cohort");
    long degree = inputs_integer(given, "lmax", SRNF_DEGREE_MIN, SRNF_DEGREE_MAX, given->degree);

    inputs_check_memory(given, json_array_size(json_object_get(cohort, "surfaces")), degree, COPIES,
                        0.0);
    classify_classes_check(given, cohort, SUBJECTS_MIN, check_folds);
    if (!given->list->errors) {
        classify_set_covariates(given);
    }
    if (json_integer_value(json_object_get(given->canonical, "permutations")) > 0 &&
        !given->list->errors) {
        (void)group_check_labels(given, json_object_get(cohort, "subjects"),
                                 json_object_get(cohort, "labels"), WHY_NOT_PERMUTED);
    }
}

static double seconds(const struct api_work *work, const json_t *canonical)
{
    double n = (double)(work->surfaces + work->meshes);
    double degree = json_number_value(json_object_get(canonical, "lmax"));
    double permutations = json_number_value(json_object_get(canonical, "permutations"));
    double sum = seconds_of_group(work, true);
    const json_t *name;
    size_t i;

    json_array_foreach(json_object_get(canonical, "method"), i, name)
    {
        const struct srnf_method *method = classify_method_find(json_string_value(name));

        sum += seconds_of_folds(method->metric, n, degree) +
               seconds_of_label_permutations(method->gauss, n, 2.0,
                                             permutations + (double)SRNF_RELABELLINGS);
    }
    return sum;
}

/* ---- Running --------------------------------------------------------------------------------- */

/* What is asked of the core, but for what is loaded. */
static struct srnf_methods_inputs asked_of(const struct classify *classify)
{
    struct srnf_methods_inputs asked = {.n = classify->group.n,
                                        .comparison = srnf_folds_options_defaults(),
                                        .classifier = srnf_classify_options_defaults(),
                                        .alpha = SRNF_TYPICAL_ALPHA_GROUP};
    size_t components = (size_t)classify->components;

    asked.n_methods = classify->methods.n;
    asked.methods = classify->methods.list;
    asked.comparison.registration = registration_defaults(classify->common_pose);
    asked.comparison.refit = (enum srnf_refit)classify->refit;
    asked.comparison.max_components = components > COMPONENTS_KEPT ? components : COMPONENTS_KEPT;
    asked.comparison.subjects = classify->group.subjects;
    asked.classifier.components = components;
    asked.classifier.covariance = (enum srnf_covariance)classify->covariance;
    asked.classifier.size_weight = classify->size_weight;
    asked.classifier.permutations = (size_t)classify->permutations;
    asked.classifier.seed = (uint64_t)classify->seed;
    return asked;
}

/* The methods with what they are expected to take. */
static void set_costs(const struct classify_answer *answer, size_t n, double permutations,
                      struct srnf_method *list)
{
    double members = (double)answer->group.n;

    for (size_t m = 0; m < n; m++) {
        list[m].comparison_cost =
            seconds_of_folds(list[m].metric, members, (double)answer->group.degree);
        list[m].classifier_cost =
            seconds_of_label_permutations(list[m].gauss, members, (double)answer->classes.count,
                                          permutations + (double)SRNF_RELABELLINGS);
    }
}

/* The covariates, [n][n_features]. */
static bool load_features(const struct classify *classify, struct classify_answer *answer)
{
    const json_t *values = json_object_get(classify->group.cohort, "values");
    size_t n = classify->group.n, count = json_array_size(values);

    answer->features = srnf_alloc(n * count + 1, sizeof(double));
    for (size_t k = 0; answer->features && k < n * count; k++) {
        answer->features[k] =
            json_number_value(json_array_get(json_array_get(values, k % count), k / count));
    }
    answer->asked.classifier.features = answer->features;
    answer->asked.classifier.n_features = count;
    return answer->features != NULL;
}

/* Loads the members, and finds their classes and, where they are asked for, their sizes. */
static int load(struct jobs_run *run, const struct classify *classify,
                struct classify_answer *answer, struct jobs_result *result)
{
    const struct group_input *group = &classify->group;
    struct compute_origin *origins = routes_bridges(run, group->mixed_routes, group->n, group->ids);
    bool with_size = classify->scale != 0;
    size_t missing;
    int status;

    if (!origins ||
        !classify_classes_find(group->cohort, group->subjects, &answer->classes, &missing)) {
        srnf_free(origins);
        return compute_fail(result, SRNF_ENOMEM, NULL, "reading the inputs");
    }
    status = compute_group_load(run, group->n, group->ids, &group->mirrored, origins, 0,
                                (size_t)classify->lmax, SHARE, &answer->group, result);
    srnf_free(origins);
    if (status) {
        return status;
    }
    jobs_run_phase(run, 100.0);
    answer->scales = with_size ? srnf_alloc(group->n, sizeof(double)) : NULL;
    answer->pairs = srnf_alloc(group->n, group->n * sizeof(double));
    if (!answer->pairs || (with_size && !answer->scales)) {
        return compute_fail(result, SRNF_ENOMEM, NULL, "reading the sizes");
    }
    for (size_t i = 0; with_size && i < group->n; i++) {
        answer->scales[i] = process_scale(run, group->ids[i], answer->group.scales[i]);
    }
    return load_features(classify, answer)
               ? 0
               : compute_fail(result, SRNF_ENOMEM, NULL, "reading the covariates");
}

static int compute(struct jobs_run *run, const struct classify *classify,
                   struct classify_answer *answer, struct jobs_result *result)
{
    struct srnf_method costed[CLASSIFY_METHODS];
    struct srnf_methods_inputs asked;
    struct jobs *jobs = jobs_run_jobs(run);
    const struct srnf_sht *sht = NULL;
    struct srnf_error error = {0};
    const char *step = "preparing the classification";
    int status;

    memcpy(costed, classify->methods.list, sizeof costed);
    set_costs(answer, classify->methods.n, (double)classify->permutations, costed);
    asked = answer->asked;
    asked.methods = costed;
    asked.surfaces = answer->group.surfaces;
    asked.scales = answer->scales;
    asked.labels = answer->classes.labels;
    asked.n_classes = answer->classes.count;
    status =
        jobs_transform_acquire(jobs, answer->group.degree, SRNF_GRID_GAUSS_LEGENDRE, 0, 0, &sht);
    if (status) {
        return compute_fail(result, status, NULL, step);
    }
    jobs_run_keep_parts(run);
    compute_searches_spread(run);
    status = srnf_classify_by_methods(sht, &asked, jobs_run_context(run), answer->results,
                                      answer->typicality, answer->pairs, &step, &error);
    jobs_transform_release(jobs, sht);
    status = status ? compute_fail(result, status, &error, step) : 0;
    if (status == SRNF_ENUMERIC) {
        const struct classify_constants constants = {.covariates = classify->covariates,
                                                     .n = classify->group.n,
                                                     .numbers = answer->features,
                                                     .labels = answer->classes.labels,
                                                     .subjects = classify->group.subjects};

        classify_name_constant(&constants, &error, result);
    }
    return status;
}

static json_t *run_classify(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct classify *classify = typed;
    struct classify_answer answer = {.asked = asked_of(classify)};
    json_t *document = NULL;

    if (load(run, classify, &answer, result) == 0 && compute(run, classify, &answer, result) == 0) {
        document = classify_document(run, classify, &answer, result);
    }
    for (size_t m = 0; m < CLASSIFY_METHODS; m++) {
        srnf_classification_clear(&answer.results[m]);
        srnf_folds_typicality_clear(&answer.typicality[m]);
    }
    srnf_free(answer.pairs);
    srnf_free(answer.scales);
    srnf_free(answer.features);
    classify_classes_clear(&answer.classes);
    compute_group_clear(&answer.group);
    return document;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct classify),
    .complete = complete,
    .run = run_classify,
};

const struct api_process classify_process = {
    .id = "classify",
    .title = "Classification of a labelled cohort",
    .description =
        "Each member classified by those of other subjects, by one method or several; how often "
        "that is right, and how often by chance.",
    .methods =
        "Labels were predicted by leave-one-out over subjects; accuracies have Wilson intervals of "
        "95 %, with the design effect of 100 relabellings",
    .table = &table,
    .seconds = seconds,
    .respond_table = classify_respond_table,
    .table_fits = classify_table_fits,
};
