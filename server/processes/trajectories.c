/*
 * trajectories.c - the process trajectories: how surfaces change with time within subjects, how
 * that depends on covariates of the subjects, and the surfaces that it predicts.
 *
 * All members are registered to their mean once; lines of subjects and the model of their slopes
 * are srnf/trajectories.h.
 */
#include "processes/trajectories.h"

#include <math.h>
#include <string.h>

#include "toolkit/seconds.h"

#define BOOTSTRAPS_MIN 100
#define BOOTSTRAPS_MAX 10000
#define BOOTSTRAPS_DEFAULT 1000
#define COPIES 20       /* fields of each surface: those of the mean, of members and of subjects */
#define SHARE_MEAN 40.0 /* percent of the job that the mean is */

static const char *const scales[] = {"shape-and-size", "shape", NULL};

static const struct process_input inputs[] = {
    {"cohort", INPUT_OWN, offsetof(struct trajectories, model.group),
     "A cohort whose members have a subject and a time, two times at least of each subject.",
     .required = true, .own = &trajectories_cohort},
    {"mixedRoutes", INPUT_BOOLEAN, offsetof(struct trajectories, model.group.mixed_routes),
     GROUP_MIXED_ROUTES_TEXT, .fallback = 0},
    {"formula", INPUT_OWN, offsetof(struct trajectories, model.design),
     "What slopes depend on: shape ~ group + age, as in regress. A covariate of a subject is the "
     "mean of its members'. null: on nothing.",
     .own = &trajectories_formula},
    {"at", INPUT_OWN, offsetof(struct trajectories, model.design),
     "Where surfaces are predicted: [{time, covariate: value}]. Covariates that are left out are "
     "at their mean, or at their first level.",
     .own = &regress_at},
    {"scale", INPUT_CHOICE, offsetof(struct trajectories, scale),
     "shape-and-size: surfaces as large as they are; shape: those of a subject brought to one "
     "area, at their mean size.",
     .choices = scales},
    {"permutations", INPUT_INTEGER, offsetof(struct trajectories, model.permutations),
     "Flips of the signs of whole subjects' slopes, and for each term of the residuals of whole "
     "subjects. No p can be below 1 / (permutations + 1).",
     .lowest = 1, .highest = PROCESS_PERMUTATIONS_MAX, .fallback = PROCESS_PERMUTATIONS_DEFAULT},
    {"bootstraps", INPUT_INTEGER, offsetof(struct trajectories, model.bootstraps),
     "Samples of subjects for intervals and confidence regions.", .lowest = BOOTSTRAPS_MIN,
     .highest = BOOTSTRAPS_MAX, .fallback = BOOTSTRAPS_DEFAULT},
    {"seed", INPUT_INTEGER, offsetof(struct trajectories, model.seed), "Of both.",
     .highest = PROCESS_SEED_MAX},
    {"fields", INPUT_BOOLEAN, offsetof(struct trajectories, model.fields),
     "Put the slope of each subject along the normal, on the grid, into perSubject, and the fields "
     "of the coefficients, q [nTheta][nPhi][3], into coefficients.",
     .fallback = 0},
    MEAN_INPUTS(regress, NULL),
    MEAN_SRNF_METHOD(regress, "srnf: of the space of SRNFs, in which lines are straight.", NULL),
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"slope", OUTPUT_OBJECT,
     "The mean slope of all subjects: {rate, variation, individual and share, each {value, "
     "interval}; distance, distanceInterval (as in compare-groups), pValue, pValueIsFloor, "
     "pValueInterval, permutations, relabellings, exact, leastSignificance, leastFdr, "
     "largestEffect (as in change: too large by what noise adds), largestConfidence}. rate: root "
     "of the "
     "mean square over the surface of the mean displacement per unit of time; variation: standard "
     "deviation of the subjects' slopes about it, with what each is measured wrongly by; "
     "individual: that of the subjects themselves at the time of reference, no rate; share: of the "
     "mean in the squares of all slopes, in L2 of SRNFs. 95 %. pValue: by "
     "flips of the signs of whole subjects' slopes."},
    {"reference", OUTPUT_NUMBER, "Time of reference, the mean of the subjects' mean times."},
    {"weighted", OUTPUT_BOOLEAN,
     "Whether slopes weigh by how well each is known; false where all are known alike, or where "
     "no subject has more than two visits to tell it."},
    {"within", OUTPUT_NUMBER_OR_NULL,
     "Variance of a visit about the line of its subject, as residualVariance. null: two visits of "
     "each subject."},
    {"between", OUTPUT_NUMBER,
     "Variance of slopes about the model beyond what within makes of them, by Paule and Mandel "
     "(1982): a slope of visits close together counts little. 0 only where slopes differ less than "
     "within makes them; with two visits of each subject all of their variance."},
    {"withinInterval", "\"type\":[\"array\",\"null\"],\"items\":{" OUTPUT_NUMBER "}",
     "95 % of within, from the directions that visits scatter in and from how subjects differ; "
     "null with fewer than three degrees of freedom (visits beyond the second of each subject)."},
    {"betweenInterval", OUTPUT_NUMBERS_OR_NULLS,
     "95 % of between, by the profile of Paule and Mandel's sum (Viechtbauer 2007) with what "
     "within is uncertain by; from 0 on where it need not be there. [null, null]: all slopes are "
     "the same."},
    {"perSubject", OUTPUT_OBJECTS,
     "[{subject, visits, times (first and last), weight (of its slope, 1 on average), length "
     "(root of the mean square of its displacement per unit of time), along (its part along what "
     "the other subjects predict for "
     "it), speed (that over the length of the prediction: 1 as fast as the others), "
     "speedPercentile and speedPercentileInterval, deviation (of its slope from the prediction), "
     "oddness (the same in L2 of "
     "SRNFs, in standard deviations), percentile and percentileInterval (of oddness), distance (in "
     "L2 of SRNFs), field}]. "
     "Percentiles, 0 to 100, are those among the other subjects, each of which is judged without "
     "itself as well; their intervals (95 %) count that the others are few, not "
     "that the prediction is estimated from them."},
    {"formula", "\"type\":[\"string\",\"null\"]", "As given."},
    {"terms", OUTPUT_OBJECTS, "Of the formula, about slopes: as in regress."},
    {"model", OUTPUT_OBJECT_OR_NULL, "The same of all terms together; null without a formula."},
    {"pairwise", OUTPUT_OBJECTS, "As in regress."},
    {"coefficients", OUTPUT_OBJECTS,
     "As in regress, of slopes: displacements per unit of time. Intercept is the slope where all "
     "columns are 0."},
    {"predictions", OUTPUT_OBJECTS,
     "[{at, surface, relativeEnergy, leverage, largestConfidence}], as in regress. The surface has "
     "the maps standardError and confidence of where it is, and slope (along the normal per unit "
     "of time), slopeError and slopeConfidence of the slope at these covariates."},
    {"residualVariance", OUTPUT_NUMBER,
     "Of slopes about the model: squared L2 norm of SRNFs, by its degrees of freedom."},
    {"residualVarianceInterval", OUTPUT_NUMBERS_OR_NULLS, "As in regress."},
    {"variance", OUTPUT_NUMBER, "Of slopes about their mean."},
    {"varianceInterval", OUTPUT_NUMBERS_OR_NULLS, "As in regress."},
    {"residualDegreesOfFreedom", OUTPUT_INTEGER, "Subjects less coefficients."},
    {"members", OUTPUT_INTEGER, "Of the cohort."},
    {"subjects", OUTPUT_INTEGER, "What is compared: each has a slope."},
    {"permutations", OUTPUT_INTEGER, "Of each term: as in compare-groups."},
    {"relabellings", OUTPUT_NUMBER_OR_NULL, "As in compare-groups."},
    {"exact", "\"type\":[\"boolean\",\"null\"]", "As in compare-groups."},
    {"bootstraps", OUTPUT_INTEGER, "Samples that were drawn."},
    {"surface", OUTPUT_OBJECT,
     "The mean of all surfaces, with the maps effect (length of the mean displacement per unit of "
     "time), normalEffect (outward positive), standardError and confidence (half the width of a "
     "95 % region for normalEffect that holds at all points together), in the units of the input, "
     "and significance, fdr, pointwiseP and statistic (Hotelling's T2)."},
    MEAN_MEMBERS_OUTPUTS,
    {NULL, NULL, NULL},
};

static void complete(struct process_inputs *given)
{
    mean_complete(given, COPIES);
    if (!given->list->errors) {
        trajectories_describe(given);
    }
}

/* What lengths of each member are multiplied by, relative to the scale of all. */
static int find_sizes(struct jobs_run *run, const struct trajectories *asked,
                      const struct group_mean *mean, const struct srnf_grid *grid, double *sizes)
{
    const struct group_input *members = &asked->model.group;
    const struct compute_mean_outputs *made = &mean->outputs;
    size_t n = members->n, field = 3 * made->n_theta * made->n_phi;
    double scale = mean_scale(run, mean);
    double *lengths = srnf_alloc(n, sizeof *lengths);

    for (size_t i = 0; lengths && i < n; i++) {
        const double *q = made->mean.registered_q + i * field;

        sizes[i] = process_scale(run, members->ids[i], made->group.scales[i]) / scale;
        lengths[i] = sizes[i] * sqrt(srnf_inner_product(grid, q, q));
    }
    for (size_t i = 0; lengths && asked->scale == 1 && i < n; i++) {
        double sum = 0.0, count = 0.0;

        for (size_t j = 0; j < n; j++) {
            bool own = members->subjects[j] == members->subjects[i];

            sum += own ? lengths[j] : 0.0;
            count += own ? 1.0 : 0.0;
        }
        sizes[i] *= sum / count / lengths[i];
    }
    srnf_free(lengths);
    return lengths ? SRNF_OK : SRNF_ENOMEM;
}

static int fit(struct jobs_run *run, const struct trajectories *asked,
               const struct group_mean *mean, const struct srnf_sht *sht,
               struct srnf_trajectories *found, struct srnf_error *error)
{
    const struct regress *model = &asked->model;
    const struct srnf_trajectories_options options = {
        .permutations = (size_t)model->permutations,
        .bootstraps = (size_t)model->bootstraps,
        .seed = (uint64_t)model->seed,
    };
    double *sizes = srnf_alloc(model->group.n, sizeof *sizes);
    const struct srnf_visits visits = {
        .n = model->group.n,
        .mean = mean->outputs.mean.coefficients,
        .q = mean->outputs.mean.registered_q,
        .sizes = sizes,
        .times = asked->times,
        .subjects = model->group.subjects,
        .at_times = asked->at_times,
        .near = mean_surfaces(mean),
    };
    int status = sizes ? find_sizes(run, asked, mean, srnf_sht_grid(sht), sizes) : SRNF_ENOMEM;

    status = status ? status
                    : srnf_fit_trajectories(sht, &visits, &model->design.design, &options,
                                            jobs_run_context(run), found, error);
    srnf_free(sizes);
    return status;
}

static int compute(struct jobs_run *run, const struct trajectories *asked, struct group_mean *mean,
                   struct srnf_trajectories *found, struct jobs_result *result)
{
    const struct compute_mean_inputs more = {.share = SHARE_MEAN};
    const struct srnf_sht *sht = NULL;
    struct srnf_error error = {0};
    int status =
        group_mean_compute(run, &asked->model.group, &asked->model.mean, more, mean, result);

    if (status) {
        return status;
    }
    jobs_run_phase(run, 100.0);
    status = jobs_transform_acquire(jobs_run_jobs(run), mean->outputs.group.degree,
                                    SRNF_GRID_GAUSS_LEGENDRE, mean->outputs.n_theta,
                                    mean->outputs.n_phi, &sht);
    if (status) {
        return compute_fail(result, status, NULL, "preparing the harmonic transform");
    }
    status = fit(run, asked, mean, sht, found, &error);
    jobs_transform_release(jobs_run_jobs(run), sht);
    return status ? compute_fail(result, status, &error, "fitting the trajectories") : 0;
}

static json_t *run_trajectories(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct trajectories *asked = typed;
    struct group_mean mean;
    struct srnf_trajectories found = {0};
    json_t *document = NULL;

    if (compute(run, asked, &mean, &found, result) == 0) {
        document = trajectories_document(run, asked, &mean, &found, result);
    }
    srnf_trajectories_clear(&found);
    group_mean_clear(&mean);
    return document;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct trajectories),
    .complete = complete,
    .run = run_trajectories,
};

const struct api_process trajectories_process = {
    .id = "trajectories",
    .title = "Trajectories of subjects over time",
    .description = "How surfaces change with time within subjects: the mean slope with a test by "
                   "sign flips and a map, how slopes depend on groups and covariates, surfaces "
                   "predicted at given times, and each subject beside the others.",
    .methods =
        "[All shapes were registered elastically to their mean. ]A line was fitted to the "
        "square-root normal fields (SRNFs) of each subject's "
        "visits by least squares, and its slope regressed on the subjects' covariates, "
        "weighted by how well each slope is known (two-stage least squares; the variance of "
        "slopes by the method of Paule and Mandel); the mean slope "
        "was tested by sign flips of whole subjects, terms by permutation of residuals "
        "under the reduced model (Freedman and Lane), maps controlled by the maximum "
        "statistic and by the false discovery rate; intervals of shares of terms are by "
        "wild bootstrap of residuals, that of the mean slope from the distribution of its norm, "
        "those of variances from that of sums of squares, weighted ones for slopes (the "
        "Q-profile method of Viechtbauer)",
    .table = &table,
    .seconds = regress_seconds,
};
