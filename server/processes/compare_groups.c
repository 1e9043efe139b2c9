/*
 * compare_groups.c - the process compare-groups: do the two groups of a labelled cohort differ, and
 * where?
 *
 * The canonical cohort holds all that the computation needs of it, as it is now: the surfaces, the
 * two labels in the order of their spelling with the group of each member, and the values of the
 * covariates that are regressed out. The map is stored with the mean surface, whose id it is part
 * of. Subjects, not members, are what is counted and compared (srnf_compare_groups).
 */
#include "processes/compare_groups.h"

#include "toolkit/covariates.h"
#include "toolkit/seconds.h"

static const struct process_input inputs[] = {
    {"cohort", INPUT_OWN, offsetof(struct compare, cohort),
     "A cohort whose members have two labels, the same for all members of a subject.",
     .required = true, .own = &compare_groups_cohort},
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
    {"pValue", OUTPUT_NUMBER,
     "Permutation p of the distance between the groups' means, over how far subjects are from "
     "them (F)."},
    {"members", OUTPUT_INTEGER, "Of the cohort."},
    {"subjects", OUTPUT_INTEGER, "What is compared: the members of each are averaged."},
    {"groupSizes", OUTPUT_OBJECT, "members and subjects of each group."},
    {"pValueIsFloor", OUTPUT_BOOLEAN, "Whether pValue is the smallest that the test can give."},
    {"pValueInterval", OUTPUT_NUMBERS_OR_NULLS,
     "Wilson's 95 % interval of the p that all relabellings would give; the point itself where "
     "exact."},
    {"leastSignificanceIsFloor", OUTPUT_BOOLEAN, "As of pValue."},
    {"leastSignificanceInterval", OUTPUT_NUMBERS_OR_NULLS, "As of pValue."},
    {"distance", OUTPUT_NUMBER,
     "That distance, in the L2 norm of SRNFs, without the covariates' part."},
    {"distanceInterval", OUTPUT_NUMBERS_OR_NULLS,
     "95 %, of the distance between the means of all who could be sampled: noise makes distances "
     "larger, and is taken out. It may begin at 0 beside a small pValue, as it is the more "
     "cautious: it is of the population, with 2.5 % at each end and the doubt in how much subjects "
     "vary, while pValue asks of these subjects whether their labels could be exchanged. "
     "[null, null]: fewer than 3 effective degrees of freedom, of which "
     "there are about as many as the smaller group has; or the groups' means are the same, or the "
     "subjects of each group, as of surfaces that are given twice."},
    {"spreads", OUTPUT_NUMBERS,
     "How far subjects scatter about the mean of their group, of both groups in the order of "
     "groups: the root of the sum of squared distances over the degrees of freedom, n - 1 less "
     "what covariates take, in the L2 norm of SRNFs, without the covariates' part."},
    {"leastSignificance", OUTPUT_NUMBER,
     "Least value of significance on the map: p of the hypothesis that the groups differ nowhere."},
    {"leastFdr", OUTPUT_NUMBER,
     "Least value of fdr on the map: the false discovery rate of the node with the clearest "
     "difference."},
    {"largestEffect", OUTPUT_NUMBER,
     "Largest value of effect on the map: how far the groups' mean surfaces are apart at a node, "
     "in the coordinates of the mean surface as stored. The largest of many lengths, to each of "
     "which noise adds: larger than the largest true one, most so in small groups, and without an "
     "interval. Read it as a figure of the map; distance says how far the groups are apart."},
    {"groups", OUTPUT_STRINGS, "The two labels; effects go from the first to the second."},
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
    {"regressedOut", OUTPUT_STRINGS, "Names of the covariates."},
    {"map", OUTPUT_OBJECT,
     "On the nTheta x nPhi Gauss-Legendre grid, row by row. significance: permutation p of the "
     "local difference (Hotelling's T2 of the displacements), corrected for all points by the "
     "largest statistic; fdr: least false discovery rate, by area, at which the point is reported; "
     "effect: length of the mean displacement, for surfaces of area 1; pointwiseP: permutation p "
     "of the point alone, uncorrected."},
    {"surface", OUTPUT_OBJECT,
     "Record of the mean surface; its meshes carry significance, fdr, effect and normalEffect "
     "(outward positive), both for surfaces of area 1, pointwiseP and statistic at every vertex."},
    MEAN_MEMBERS_OUTPUTS,
    {NULL, NULL, NULL},
};

#define COPIES 8 /* fields of each surface: those of the mean, averages, residuals, displacements */
#define SHARE_MEAN 40.0 /* percent of the job that the mean is */

static void complete(struct process_inputs *given)
{
    mean_complete(given, COPIES);
    if (!given->list->errors) {
        compare_groups_describe(given);
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
    options.surfaces = mean_surfaces(mean);
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
    maps = compare_groups_maps(&mean.outputs, &comparison);
    if (maps.count) {
        surface = mean_keep_surface(run, "compare-groups", "mean with the map of a comparison",
                                    &mean, &maps, result);
    } else {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "keeping the map");
    }
    if (surface) {
        document = compare_groups_document(asked, &mean.outputs, &comparison, &maps);
        (void)json_object_set_new(document, "surface", surface);
        mean_set_members(document, &mean);
        document = compare_groups_warn(run, asked, &mean, document, result);
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
    .methods = "[All shapes were registered elastically to their mean. ]The means of two groups of "
               "shapes were compared in the space of square-root normal "
               "fields (SRNFs) by a permutation test of their distance; p at each point of the map "
               "is corrected for all points by the maximum statistic; the interval of the distance "
               "is from the distribution of its norm",
    .table = &table,
    .seconds = compare_seconds,
};
