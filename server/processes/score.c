/*
 * score.c - the process score: how odd a surface is beside the members of a model, as a whole and
 * at each point, and beside what a linear model of covariates expects of it.
 *
 * The members are the norm, each by what it has in the model of the others; nothing is compared
 * with how the model fits those that it was made of (srnf/norms.h).
 */
#include "processes/score.h"

#include "compute/seconds.h"
#include "toolkit/handedness.h"
#include "toolkit/projected.h"
#include "toolkit/registration_options.h"
#include "toolkit/seconds.h"

#define INVERSIONS 60.0 /* of members, whose number the inputs do not say */

static const struct process_input inputs[] = {
    MODEL_INPUT(score),
    SUBJECT_INPUTS(score),
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

#define RANK_TEXT                                                                              \
    "{value, percentile (0 to 100: the share of the model's subjects below, each left out in " \
    "turn, the surface counted among them), interval (as percentileInterval), asOdd "          \
    "(subjects with a value as large), pValue (1 + asOdd over 1 + subjects)}"

static const struct process_output outputs[] = {
    {"percentile", OUTPUT_NUMBER,
     "How odd the surface is as a whole, 0 to 100: uniform for another one of the group. Of the "
     "larger of the ranks that mahalanobis and residual have."},
    {"percentileInterval", OUTPUT_NUMBERS,
     "95 %, of the percentile among all others, judged by this model: it counts that the subjects "
     "are few, not that mean and components are estimated from them."},
    {"pValue", OUTPUT_NUMBER,
     "(1 + asOdd) / (1 + subjects): below a in a share of a of those who belong to the group."},
    {"asOdd", OUTPUT_NUMBER, "Subjects that are as odd, each left out in turn."},
    {"subjects", OUTPUT_INTEGER,
     "That the surface was compared with: of a member of the model all others."},
    {"mahalanobis", OUTPUT_NUMBER,
     "Root of the sum of squared scores over their variances, of the first components. With a "
     "formula over the root of (1 + h) / (1 + 1 / members) as well, h the leverage of the "
     "surface's covariates: what is expected far from those of the members is known less well. "
     "Distance and residual are not so divided. Of a member "
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
     "keeps a part of its components. Of a model of several structures each entry of parts has one "
     "of its own, as well as largestZ, and this is null."},
    SUBJECT_OUTPUTS,
    {"calibration", OUTPUT_OBJECT_OR_NULL,
     "Percentiles of subjects that models of four fifths of the others have not seen: subjects; "
     "and for residual, mahalanobis and overall {percentiles, distance, pValue}, Kolmogorov's "
     "distance from uniform ones and its p. Null where it was not asked for, there are fewer than "
     "10 subjects or more than 150, or the model keeps a part of its components."},
    {"typicality", OUTPUT_OBJECT_OR_NULL,
     "As in project; null with a formula. Its percentiles are shares of the subjects as models of "
     "the others, without the surface, measure them. Those of ranks are of models that hold the "
     "surface, which counts as one of them: with few subjects they differ."},
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

/* What the core is asked; the model's arrays are borrowed. */
static struct srnf_norm_model norm_of(const struct score *asked, const struct compute_model *model,
                                      const struct model_members *members, bool complete)
{
    return (struct srnf_norm_model){
        .pca = &model->pca,
        .mean = model->mean.coefficients,
        .mean_q = model->stored.arrays[STORE_MODEL_MEAN_Q],
        .subjects = members->subjects,
        .complete = complete,
        .columns = asked->expected.given ? asked->expected.design.design.columns : 0,
        .values = asked->expected.design.values,
    };
}

/* What a run needs all along. */
struct scoring {
    struct jobs_run *run;
    const struct score *asked;
    const struct compute_model *model;
    const struct model_members *members;
    const struct compute_projection *projection;
    const struct srnf_sht *sht;
    struct srnf_stack stack;
    struct srnf_norm_options options;
    bool complete;
    struct jobs_result *result;
};

/* The map of one part, as it lies beside its mean. */
static int map_part(const struct scoring *s, size_t p, struct srnf_score *found)
{
    size_t count = 3 * s->stack.own->n_theta * s->stack.own->n_phi;
    struct compute_model part;
    struct srnf_norm_model norm;
    struct srnf_error error = {0};
    double *q = srnf_alloc(count, sizeof(double));
    int status;

    if (!q) {
        return compute_fail(s->result, SRNF_ENOMEM, NULL, "comparing a part");
    }
    status = compute_model_part(s->run, s->model, p, &part, s->result);
    if (status == 0) {
        norm = norm_of(s->asked, &part, s->members, true);
        srnf_stack_take(&s->stack, p, s->projection->q, q);
        status =
            srnf_norm_map(s->sht, &norm, q, &s->options, jobs_run_context(s->run), found, &error);
        compute_model_clear(&part);
        status = status ? compute_fail(s->result, status, &error, "comparing a part") : 0;
    }
    srnf_free(q);
    return status;
}

static int compare(struct scoring *s, struct score_found *found)
{
    const struct compute_model *model = s->model;
    const struct srnf_calibration calibration = {model->pca.n,
                                                 model->stored.arrays[STORE_MODEL_CALIBRATION]};
    struct srnf_norm_model norm = norm_of(s->asked, model, s->members, s->complete);
    struct srnf_error error = {0};
    bool several = json_is_object(s->asked->subject.parts);
    bool map = s->asked->map && s->complete;
    int status;

    norm.grid = several ? &s->stack.grid : NULL;
    norm.calibration = calibration.values ? &calibration : NULL;
    s->options.at = s->asked->expected.design.at;
    s->options.member = s->projection->member;
    s->options.check = s->asked->calibration;
    s->options.map = map && !several;
    status = srnf_score(s->sht, &norm, s->projection->q, &s->options, jobs_run_context(s->run),
                        &found->whole, &error);
    if (status) {
        return compute_fail(s->result, status, &error, "comparing with the model's members");
    }
    for (size_t p = 0; p < model->joint.n_parts && map && several && status == 0; p++) {
        status = map_part(s, p, &found->maps[p]);
    }
    return status;
}

static int compute(struct scoring *s, struct score_found *found)
{
    int status = compute_model_transform(s->run, s->model, &s->sht, s->result);

    s->options = srnf_norm_options_defaults();
    s->complete = is_complete(s->model);
    status = status ? status : compute_model_stack(s->model, s->sht, &s->stack, s->result);
    status = status ? status : compare(s, found);
    srnf_stack_clear(&s->stack);
    jobs_transform_release(jobs_run_jobs(s->run), s->sht);
    return status;
}

static void clear_found(struct score_found *found)
{
    srnf_score_clear(&found->whole);
    for (size_t p = 0; p < SRNF_PARTS_MAX; p++) {
        srnf_score_clear(&found->maps[p]);
    }
}

static json_t *run_score(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct score *asked = typed;
    struct projected projected;
    struct score_found found = {.whole = {0}};
    struct scoring scoring = {.run = run,
                              .asked = asked,
                              .model = &projected.model,
                              .members = &projected.members,
                              .projection = &projected.projection,
                              .result = result};
    json_t *document = NULL;

    if (projected_make(run, asked->model, &asked->subject, &projected, result) == 0 &&
        compute(&scoring, &found) == 0 &&
        projected_try_mirrored(run, asked->handedness, &projected, result) == 0) {
        document = score_document(
            run, asked, &projected.model, &projected.projection, projected.registration,
            handedness_of_projection(run, asked->subject.surface, projected.made, &projected.trial),
            &found, result);
    }
    clear_found(&found);
    projected_clear(&projected);
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
    .description = "How odd a surface, or the structures of a subject, are beside the members of a "
                   "model, each of which is left out "
                   "in turn: percentiles, a map in standard deviations, and whether percentiles "
                   "are what they say. Covariates may tell what is expected of it.",
    .methods = "A surface was compared with the members of a model, each left out in turn, so that "
               "percentiles are those of shapes that the model has not seen; the map is in "
               "standard deviations, its p corrected for all points",
    .table = &table,
    .seconds = seconds,
};
