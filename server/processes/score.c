/*
 * score.c - the process score: how odd a surface is beside the members of a model, as a whole and
 * at each point, and beside what a linear model of covariates expects of it.
 *
 * The members are the norm, each by what it has in the model of the others; nothing is compared
 * with how the model fits those that it was made of (srnf/norms.h).
 */
#include "processes/score.h"

#include "api/models.h"
#include "compute/seconds.h"
#include "toolkit/handedness.h"
#include "toolkit/model_members.h"
#include "toolkit/registration_options.h"
#include "toolkit/seconds.h"

#define INVERSIONS 60.0 /* of members, whose number the inputs do not say */

static const struct process_input inputs[] = {
    MODEL_INPUT(score),
    {"surface", INPUT_SURFACE, offsetof(struct score, surface),
     "The surface; registered to the mean as those of the model were. A mesh is encoded with the "
     "default options.",
     .required = true},
    {"formula", INPUT_OWN, offsetof(struct score, expected),
     "shape ~ terms, as in regress, of the covariates that the cohort of the model has now: the "
     "surface is compared with what is expected of its covariates. null: with the mean.",
     .own = &score_formula},
    {"covariates", INPUT_OWN, offsetof(struct score, expected),
     "Those of the surface, all that the formula names: {covariate: value}.",
     .own = &score_covariates},
    {"map", INPUT_BOOLEAN, offsetof(struct score, map),
     "Whether to make the map, which inverts all members.", .fallback = 1},
    {"calibration", INPUT_BOOLEAN, offsetof(struct score, calibration),
     "Whether to try the percentiles on members that models of the others have not seen.",
     .fallback = 1},
    HANDEDNESS_INPUT(score, "the mirror image of the surface as well, and to warn where it"),
    {.name = NULL},
};

#define RANK_TEXT                                                                                \
    "{value, percentile (0 to 100: the share of the model's subjects below, each left out in "   \
    "turn, the surface counted among them), interval (95 %, of the percentile that endlessly "   \
    "many subjects would give), asOdd (subjects with a value as large), pValue (1 + asOdd over " \
    "1 + subjects)}"

static const struct process_output outputs[] = {
    {"percentile", OUTPUT_NUMBER,
     "How odd the surface is as a whole, 0 to 100: uniform for another one of the group. Of the "
     "larger of the ranks that mahalanobis and residual have."},
    {"percentileInterval", OUTPUT_NUMBERS, "95 %: the subjects are few."},
    {"pValue", OUTPUT_NUMBER,
     "(1 + asOdd) / (1 + subjects): below a in a share of a of those who belong to the group."},
    {"asOdd", OUTPUT_NUMBER, "Subjects that are as odd, each left out in turn."},
    {"subjects", OUTPUT_INTEGER,
     "That the surface was compared with: of a member of the model all others."},
    {"mahalanobis", OUTPUT_NUMBER,
     "Root of the sum of squared scores over their variances, of the first components. Of a member "
     "of the model, as the next two, when its subject is left out."},
    {"residual", OUTPUT_NUMBER, "Norm of what no deviation of the members represents."},
    {"distance", OUTPUT_NUMBER, "From what is expected, the mean SRNF or a prediction."},
    {"components", OUTPUT_INTEGER, "That mahalanobis counts."},
    {"ranks", OUTPUT_OBJECT,
     "Of mahalanobis, residual and distance, and with a map of largestZ, the largest |z| anywhere, "
     "each " RANK_TEXT "."},
    {"zMap", OUTPUT_OBJECT_OR_NULL,
     "The surface as it lies beside the mean, in the parameterization of that, with the maps "
     "deviation (along the mean's outward normal, from what is expected), spread (the standard "
     "deviation of such deviations in members that are left out), zScore (their ratio) and "
     "significance "
     "((1 + subjects whose |z| is as large anywhere) / (1 + subjects)). Lengths are in the units "
     "of the input, at the mean size of the members. Null where it was not asked for, or the model "
     "keeps a part of its components."},
    {"calibration", OUTPUT_OBJECT_OR_NULL,
     "Percentiles of subjects that models of four fifths of the others have not seen: subjects; "
     "and for residual, mahalanobis and overall {percentiles, distance, pValue}, Kolmogorov's "
     "distance from uniform ones and its p. Null where it was not asked for, there are fewer than "
     "10 subjects or more than 150, or the model keeps a part of its components."},
    {"typicality", OUTPUT_OBJECT_OR_NULL, "As in project; null with a formula."},
    {"trainingSubject", OUTPUT_BOOLEAN,
     "Whether the surface is a member of the model: then its subject is left out."},
    {"at", OUTPUT_OBJECT_OR_NULL, "The covariates that the formula took; null without one."},
    REGISTRATION_OUTPUT,
    {NULL, NULL, NULL},
};

static double seconds(const struct api_work *work, const json_t *canonical)
{
    bool map = json_is_true(json_object_get(canonical, "map"));

    return project_seconds(work, canonical) +
           (map ? INVERSIONS * seconds_of_inversion((double)work->degree) : 0.0);
}

/* Whether the components of the model hold all variance of its members. */
static bool is_complete(const struct compute_model *model)
{
    json_t *record = json_loads(model->stored.record ? model->stored.record : "{}", 0, NULL);
    double total = json_number_value(json_object_get(record, "totalVariance"));
    bool complete = false;

    (void)srnf_pca_kept_variance(&model->pca, total, &complete);
    json_decref(record);
    return complete && total > 0.0;
}

static int compute(struct jobs_run *run, const struct score *asked,
                   const struct compute_model *model, const struct model_members *members,
                   const struct compute_projection *projection, struct srnf_score *found,
                   struct jobs_result *result)
{
    const struct store_model *stored = &model->stored;
    const struct srnf_calibration calibration = {model->pca.n,
                                                 stored->arrays[STORE_MODEL_CALIBRATION]};
    const struct srnf_norm_model norm = {
        .pca = &model->pca,
        .mean = model->mean.coefficients,
        .mean_q = stored->arrays[STORE_MODEL_MEAN_Q],
        .subjects = members->subjects,
        .calibration = calibration.values ? &calibration : NULL,
        .complete = is_complete(model),
        .columns = asked->expected.given ? asked->expected.design.design.columns : 0,
        .values = asked->expected.design.values,
    };
    struct srnf_norm_options options = srnf_norm_options_defaults();
    const struct srnf_sht *sht = NULL;
    struct srnf_error error = {0};
    int status =
        jobs_transform_acquire(jobs_run_jobs(run), (size_t)stored->lmax, SRNF_GRID_GAUSS_LEGENDRE,
                               (size_t)stored->n_theta, (size_t)stored->n_phi, &sht);

    if (status) {
        return compute_fail(result, status, NULL, "preparing the harmonic transform");
    }
    options.at = asked->expected.design.at;
    options.member = projection->member;
    options.map = asked->map && norm.complete;
    options.check = asked->calibration;
    status = srnf_score(sht, &norm, projection->q, &options, jobs_run_context(run), found, &error);
    jobs_transform_release(jobs_run_jobs(run), sht);
    return status ? compute_fail(result, status, &error, "comparing with the model's members") : 0;
}

static json_t *run_score(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct score *asked = typed;
    const struct srnf_register_options *registration = NULL;
    struct srnf_register_options options;
    struct compute_model model = {0};
    struct compute_projection projection = {0};
    struct model_members members = {0};
    struct srnf_score found = {0};
    struct compute_mirror_trial trial = {.distance = 0.0};
    json_t *made = NULL, *document = NULL;

    if (compute_model_load(run, asked->model, &model, result)) {
        goto out;
    }
    made = model_made_from(&model.stored);
    if (registration_read(json_object_get(made, "registration"), &options)) {
        registration = &options;
    }
    if (model_members_read(made, model.pca.n, &members)) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "reading the model");
        goto out;
    }
    if (compute_project(run, &model, asked->surface, registration, &members.view, &projection,
                        result) == 0 &&
        compute(run, asked, &model, &members, &projection, &found, result) == 0 &&
        (asked->handedness == HANDEDNESS_IGNORE || projection.training_subject ||
         compute_project_mirrored(run, &model, asked->surface, registration, &projection, &trial,
                                  result) == 0)) {
        document = score_document(run, asked, &model, &projection, registration,
                                  handedness_of_projection(run, asked->surface, made, &trial),
                                  &found, result);
    }
out:
    srnf_score_clear(&found);
    compute_projection_clear(&projection);
    model_members_clear(&members);
    json_decref(made);
    compute_model_clear(&model);
    return document;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct score),
    .complete = score_describe,
    .run = run_score,
};

const struct api_process score_process = {
    .id = "score",
    .title = "A surface beside the norm",
    .description = "How odd a surface is beside the members of a model, each of which is left out "
                   "in turn: percentiles, a map in standard deviations, and whether percentiles "
                   "are what they say. Covariates may tell what is expected of it.",
    .methods = "A surface was compared with the members of a model, each left out in turn, so that "
               "percentiles are those of shapes that the model has not seen; the map is in "
               "standard deviations, its p corrected for all points",
    .table = &table,
    .seconds = seconds,
};
