/*
 * regress.c - the process regress: a linear model of shape by a formula over the covariates of a
 * cohort, with permutation tests and maps of its terms, and predicted surfaces.
 *
 * The members are registered to their mean once. The canonical cohort holds the design that formula
 * and covariates make, as they are now (toolkit/design.h). Every coefficient has the mean surface
 * with its own maps.
 */
#include "processes/regress.h"

#include "toolkit/seconds.h"

#define BOOTSTRAPS_MIN 100
#define BOOTSTRAPS_MAX 10000
#define BOOTSTRAPS_DEFAULT 1000

static const struct process_input inputs[] = {
    {"cohort", INPUT_OWN, offsetof(struct regress, group),
     "A cohort whose members have the covariates of the formula.", .required = true,
     .own = &regress_cohort},
    {"mixedRoutes", INPUT_BOOLEAN, offsetof(struct regress, group.mixed_routes),
     GROUP_MIXED_ROUTES_TEXT, .fallback = 0},
    {"formula", INPUT_OWN, offsetof(struct regress, design),
     "shape ~ terms, in the notation of R and patsy: a + b, a:b, a * b, a / b, (a + b)^2, - a; "
     "log(a) (log2, log10, log1p, exp, sqrt), I(a^2), center(a), scale(a), standardize(a), C(a), "
     "C(a, Treatment(\"level\")), "
     "Q(\"a name\") or Q('a name'). Names are covariates of the members, or else label, group (the "
     "label), "
     "time and side. Texts, true and false are categorical, against their first level.",
     .required = true, .own = &regress_formula},
    {"at", INPUT_OWN, offsetof(struct regress, design),
     "Where surfaces are predicted: [{covariate: value}]. What is left out is at its mean, or at "
     "its first level.",
     .own = &regress_at},
    {"permutations", INPUT_INTEGER, offsetof(struct regress, permutations),
     "Of the residuals of whole subjects, for each test. No p can be below 1 / (permutations + 1).",
     .lowest = 1, .highest = PROCESS_PERMUTATIONS_MAX, .fallback = PROCESS_PERMUTATIONS_DEFAULT},
    {"bootstraps", INPUT_INTEGER, offsetof(struct regress, bootstraps),
     "Samples of the residuals for intervals and confidence regions.", .lowest = BOOTSTRAPS_MIN,
     .highest = BOOTSTRAPS_MAX, .fallback = BOOTSTRAPS_DEFAULT},
    {"seed", INPUT_INTEGER, offsetof(struct regress, seed), "Of both.",
     .highest = PROCESS_SEED_MAX},
    {"fields", INPUT_BOOLEAN, offsetof(struct regress, fields),
     "Put the fields of the coefficients, q [nTheta][nPhi][3], into the result.", .fallback = 0},
    MEAN_INPUTS(regress, NULL),
    MEAN_SRNF_METHOD(regress, "srnf: of the space of SRNFs, in which models are linear.", NULL),
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"formula", OUTPUT_STRING, "As given."},
    {"terms", OUTPUT_OBJECTS,
     "[{name, columns, degreesOfFreedom, residualDegreesOfFreedom, f (squares of the term by the "
     "former over squares of the residuals by the latter), pValue, pValueIsFloor, "
     "pValueInterval, level (exact or asymptotic, as in compare-groups), r2 and r2Interval (share "
     "of all squares about the mean, too large by what noise explains; 95 %, by wild bootstrap, "
     "without that, and more cautious than pValue: see distanceInterval of compare-groups; [null, "
     "null]: "
     "the model leaves nothing, as where subjects are given twice), partialR2 "
     "and partialR2Interval (share of the squares of the term and of the "
     "residuals together: what the other terms leave), leastSignificance, "
     "leastFdr, map}]. A term is tested beside all terms that do "
     "not contain it, by residuals permuted under the model without it (Freedman and Lane 1983). "
     "map: significance (corrected for all points by the largest statistic), fdr, pointwiseP (of "
     "the point alone, uncorrected) and statistic (Hotelling and Lawley's trace) on the nTheta x "
     "nPhi Gauss-Legendre grid."},
    {"model", OUTPUT_OBJECT, "The same of all terms together."},
    {"pairwise", OUTPUT_OBJECTS,
     "[{term, levels, pValue, pValueInterval, correctedP (Holm, of the pairs of the term), r2, "
     "r2Interval, leastSignificance}] of categorical terms of 3 to 6 levels."},
    {"coefficients", OUTPUT_OBJECTS,
     "[{name, term, norm (of the field, in L2), normInterval (95 %, free of what noise adds to a "
     "norm, and more cautious than pValue, as r2Interval; [null, null]: fewer than 3 effective "
     "degrees of freedom, or subjects that "
     "are the same), largestEffect (a "
     "maximum, larger than the true one, as noise adds to it: no "
     "estimate with an interval), surface, q}]: the mean surface "
     "with the maps effect, normalEffect (outward positive) and standardError of the displacement "
     "that a unit of the column means, in the units of the input, and significance, fdr, "
     "pointwiseP and statistic of its term. The constant has no surface."},
    {"predictions", OUTPUT_OBJECTS,
     "[{at, surface, relativeEnergy (what of the predicted SRNF is lost by being a surface's), "
     "leverage (squared standard error of the predicted SRNF over residualVariance), "
     "largestConfidence}]. The surface has the maps standardError and confidence: half "
     "the width of a 95 % region along the normal that holds at all points together, in the units "
     "of the input."},
    {"residualVariance", OUTPUT_NUMBER, "Squared L2 norm of SRNFs, by its degrees of freedom."},
    {"residualVarianceInterval", OUTPUT_NUMBERS_OR_NULLS,
     "95 %; [null, null]: the subjects are too few, or the same."},
    {"variance", OUTPUT_NUMBER, "Of the subjects about their mean."},
    {"varianceInterval", OUTPUT_NUMBERS_OR_NULLS, "As of residualVariance."},
    {"residualDegreesOfFreedom", OUTPUT_INTEGER, "Subjects less coefficients."},
    {"members", OUTPUT_INTEGER, "Of the cohort."},
    {"subjects", OUTPUT_INTEGER, "What is compared: the members of each are averaged."},
    {"permutations", OUTPUT_INTEGER, "As in compare-groups, of each test."},
    {"relabellings", OUTPUT_NUMBER_OR_NULL, "As in compare-groups."},
    {"exact", "\"type\":[\"boolean\",\"null\"]", "As in compare-groups."},
    {"bootstraps", OUTPUT_INTEGER, "Samples that were drawn."},
    {"surface", OUTPUT_OBJECT, "Record of the mean surface."},
    MEAN_MEMBERS_OUTPUTS,
    {NULL, NULL, NULL},
};

#define COPIES \
    10 /* fields of each surface: those of the mean, averages, displacements, residuals */
#define SHARE_MEAN 40.0 /* percent of the job that the mean is */

static void complete(struct process_inputs *given)
{
    mean_complete(given, COPIES);
    if (!given->list->errors) {
        regress_describe(given);
    }
}

static int compute(struct jobs_run *run, const struct regress *asked, struct group_mean *mean,
                   struct srnf_regression *found, struct jobs_result *result)
{
    const struct compute_mean_inputs more = {.share = SHARE_MEAN};
    const struct compute_mean_outputs *made = &mean->outputs;
    struct srnf_regress_options options = srnf_regress_options_defaults();
    const struct srnf_sht *sht = NULL;
    struct srnf_error error = {0};
    int status = group_mean_compute(run, &asked->group, &asked->mean, more, mean, result);

    if (status) {
        return status;
    }
    jobs_run_phase(run, 100.0);
    options.permutations = (size_t)asked->permutations;
    options.bootstraps = (size_t)asked->bootstraps;
    options.seed = (uint64_t)asked->seed;
    options.subjects = asked->group.subjects;
    options.surfaces = mean_surfaces(mean);
    status = jobs_transform_acquire(jobs_run_jobs(run), made->group.degree,
                                    SRNF_GRID_GAUSS_LEGENDRE, made->n_theta, made->n_phi, &sht);
    if (status) {
        return compute_fail(result, status, NULL, "preparing the harmonic transform");
    }
    status = srnf_regress(sht, made->mean.n, made->mean.coefficients, made->mean.registered_q,
                          &asked->design.design, &options, jobs_run_context(run), found, &error);
    jobs_transform_release(jobs_run_jobs(run), sht);
    return status ? compute_fail(result, status, &error, "fitting the model") : 0;
}

static json_t *run_regress(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    static const struct regress_more more = {.process = "regress", .title = "mean of a regression"};
    const struct regress *asked = typed;
    struct group_mean mean;
    struct srnf_regression found = {0};
    json_t *document = NULL;

    if (compute(run, asked, &mean, &found, result) == 0) {
        document = regress_document(run, asked, &mean, &found, &more, result);
    }
    srnf_regression_clear(&found);
    group_mean_clear(&mean);
    return document;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct regress),
    .complete = complete,
    .run = run_regress,
};

const struct api_process regress_process = {
    .id = "regress",
    .title = "Linear model of shape",
    .description = "How shape depends on covariates, by a formula: permutation tests, shares of "
                   "the variance and maps of each term, and predicted surfaces.",
    .methods =
        "[All shapes were registered elastically to their mean. ]A linear model of the square-root "
        "normal fields (SRNFs) of the shapes was fitted; terms "
        "were tested by permutation of residuals under the reduced model (Freedman and Lane), "
        "maps controlled by the maximum statistic and by the false discovery rate, and "
        "shares of the variance have intervals by wild bootstrap of residuals, norms of "
        "coefficients "
        "from their distribution",
    .table = &table,
    .seconds = regress_seconds,
};
