/*
 * predict.c - the process predict: what a classifier that train kept makes of other surfaces, with
 * calibrated probabilities, and whether they are like those that it was trained on.
 *
 * Nothing is fitted: a surface is registered to the template alone, and what it gets does not
 * depend on the others it is asked with.
 */
#include "processes/predict.h"

#include <math.h>
#include <string.h>

#include "compute/seconds.h"
#include "text.h"
#include "toolkit/assessment.h"
#include "toolkit/handedness.h"
#include "toolkit/model.h"
#include "toolkit/registration_options.h"
#include "toolkit/routes.h"
#include "toolkit/seconds.h"

#define COPIES 4
#define PRIOR_LEAST 1e-6 /* of a class that is possible at all */
#define PRIORS_SUM 1e-6  /* that the sum may differ from 1 */

/* ---- Inputs and outputs ---------------------------------------------------------------------- */

/* null, or an object of numbers; that they are of the model's classes is seen to by complete. */
static void read_priors(struct process_inputs *given, const struct process_input *input)
{
    json_t *value = json_object_get(given->given, input->name);
    json_t *canonical, *number;
    const char *name;
    double sum = 0.0;

    if (!value || json_is_null(value)) {
        (void)json_object_set_new(given->canonical, input->name, json_null());
        return;
    }
    canonical = json_object();
    json_object_foreach(value, name, number)
    {
        double prior = json_number_value(number);

        if (!json_is_number(number) || !(prior >= PRIOR_LEAST && prior <= 1.0)) {
            problem_add(given->list, "/inputs/priors", "of %.60s must be a number from %g to 1",
                        name, PRIOR_LEAST);
            json_decref(canonical);
            return;
        }
        sum += prior;
        (void)json_object_set_new(canonical, name, json_real(prior));
    }
    if (!json_is_object(value)) {
        problem_add(given->list, "/inputs/priors",
                    "must be null or an object with a number for each class, with the sum 1");
        json_decref(canonical);
        return;
    }
    if (!(fabs(sum - 1.0) <= PRIORS_SUM)) {
        problem_add(given->list, "/inputs/priors",
                    "must have the sum 1, and have %.10g: divide each by that", sum);
        json_decref(canonical);
        return;
    }
    (void)json_object_set_new(given->canonical, input->name, canonical);
}

static bool type_priors(const json_t *value, void *member)
{
    *(json_t **)member = json_deep_copy(value);
    return *(json_t **)member != NULL;
}

static void clear_priors(void *member)
{
    json_decref(*(json_t **)member);
    *(json_t **)member = NULL;
}

static const struct input_own priors_own = {
    .schema = "\"type\":[\"object\",\"null\"],\"additionalProperties\":{\"type\":\"number\","
              "\"minimum\":1e-6,\"maximum\":1},\"default\":null",
    .read = read_priors,
    .type = type_priors,
    .clear = clear_priors,
};

static const struct process_input inputs[] = {
    {"model", INPUT_MODEL, offsetof(struct predict, model),
     "A classifier, made by train or train-parts.", .required = true, .model_kind = "classifier"},
    {"surfaces", INPUT_OWN, offsetof(struct predict, group),
     "The surfaces, one at least, or cohort, or of a classifier of several structures parts, "
     "instead. Meshes are encoded with the default options, "
     "and at the degree of the classifier where it was trained on surfaces.",
     .own = &predict_surfaces, .lowest = 1},
    {"cohort", INPUT_OWN, offsetof(struct predict, group),
     "Name of a cohort, instead of surfaces. Where its members have labels of the classifier's "
     "classes, predictions are compared with them. For a classifier of several structures its "
     "members have a subject and, as a covariate, the name of their part, as for train-parts.",
     .own = &predict_cohort, .lowest = 1},
    {"parts", INPUT_OWN, offsetof(struct predict, group),
     "For a classifier of several structures: {name: surface}, one for each of its parts, or a "
     "list of these, one for each subject. Each surface is registered to the template of its part.",
     .own = &predict_parts},
    {"by", INPUT_OWN, offsetof(struct predict, group),
     "Of a classifier of several structures: the covariate of the cohort that names the part. "
     "null: part.",
     .own = &predict_by},
    {"mixedRoutes", INPUT_BOOLEAN, offsetof(struct predict, group.mixed_routes),
     GROUP_MIXED_ROUTES_TEXT, .fallback = 0},
    {"priors", INPUT_OWN, offsetof(struct predict, priors),
     "How likely each class is before a surface is seen, by name, with the sum 1: where the "
     "surfaces come from. null: those of the classifier.",
     .own = &priors_own},
    {"covariates", INPUT_OWN, offsetof(struct predict, covariates),
     "Of surfaces or parts, for a classifier that takes covariates: an object of these for each, "
     "in their order. Those of a cohort are its members'.",
     .own = &predict_covariates},
    HANDEDNESS_INPUT(predict, "the mirror images of the surfaces as well, and to warn where one"),
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"predictions", OUTPUT_OBJECTS,
     "Of each surface, or subject of several structures: surface, its id, or null; subject, of the "
     "cohort's member, or its name, or that of its first part; parts, null or for each part "
     "[{name, "
     "surface, distance, residual}], weighted, whose squares add up to those of the subject; "
     "position, the same {distance, residual} of the relative positions, or null; label, the "
     "class of the largest probability; probabilities, calibrated, of each class; logLikelihoods "
     "or nearestDistances, the evidence that they come from; numbers, those beside shape that "
     "counted, by name, size as a length, or null; truth, the label in the cohort, or "
     "null; trainingSubject, whether the classifier was trained on it; typicality, {value, limit, "
     "percentile, percentileInterval} of residual (what the components cannot represent), distance "
     "(from the mean), "
     "mahalanobis and nearest (distance from the nearest training member), each among the "
     "leave-one-out values of the training members: a member is beyond a limit once in 200, and "
     "percentileInterval (Wilson, 95 %) is that of the share of all others who would be below, "
     "judged by this model: it counts that the subjects are few, not that mean and components are "
     "estimated from them; and "
     "warnings."},
    {"classes", OUTPUT_STRINGS, "Of the classifier, in its order."},
    {"priors", OUTPUT_OBJECT, "That the probabilities rest on, by class."},
    {"method", OUTPUT_STRING, "srnf-gauss or srnf-nn."},
    {"assessment", OUTPUT_OBJECT_OR_NULL,
     "Of the surfaces with a truth among the classes that it was not trained on, not on one part "
     "of them either, where there are some of each class: " ASSESSMENT_TEXT "."},
    BRIDGED_GROUP_OUTPUTS,
    REGISTRATION_OUTPUT,
    {NULL, NULL, NULL},
};

/* ---- What holds between inputs --------------------------------------------------------------- */

/* The priors must be of the model's classes, all of them. */
static void check_priors(struct process_inputs *given, const struct store_model *model)
{
    const json_t *priors = json_object_get(given->canonical, "priors");
    json_t *record = json_loads(model->record ? model->record : "{}", 0, NULL);
    const json_t *classes = json_object_get(json_object_get(record, "classifier"), "classes");
    const json_t *name;
    size_t i, found = 0;

    json_array_foreach(classes, i, name)
    {
        const char *text = json_string_value(name);

        if (text && json_object_get(priors, text)) {
            found++;
        } else if (text) {
            problem_add(given->list, "/inputs/priors", "has no number for the class %.60s", text);
        }
    }
    if (found == json_array_size(classes) && found < json_object_size(priors)) {
        problem_add(given->list, "/inputs/priors",
                    "has %zu class%s; the classifier has %zu of them", json_object_size(priors),
                    json_object_size(priors) == 1 ? "" : "es", found);
    }
    json_decref(record);
}

static void complete(struct process_inputs *given)
{
    const char *id = json_string_value(json_object_get(given->canonical, "model"));
    struct store_model model = {.record = NULL};

    if (id &&
        store_model_get_as(given->call->api->config.store, given->call->request->caller.name, id, 0,
                           &model) == 0 &&
        predict_check_parts(given, &model)) {
        const json_t *surfaces = json_object_get(given->canonical, "surfaces");

        inputs_check_memory(given, json_array_size(surfaces), (long)model.lmax, COPIES, 0.0);
        if (json_is_object(json_object_get(given->canonical, "priors"))) {
            check_priors(given, &model);
        }
        predict_check_covariates(given, &model);
    }
    store_model_clear(&model);
}

static double seconds(const struct api_work *work, const json_t *canonical)
{
    double n = (double)json_array_size(json_object_get(canonical, "surfaces"));

    return seconds_of_group(work, false) + 2.0 * n * seconds_of_registration((double)work->degree);
}

/* ---- Running --------------------------------------------------------------------------------- */

const enum srnf_trait predict_traits[PREDICT_TRAITS] = {SRNF_TRAIT_RESIDUAL, SRNF_TRAIT_DISTANCE,
                                                        SRNF_TRAIT_MAHALANOBIS, SRNF_TRAIT_NEAREST};

static void answer_clear(struct predict_answer *answer)
{
    srnf_free(answer->priors);
    srnf_free(answer->numbers);
    srnf_free(answer->positions);
    srnf_free(answer->predictions);
    srnf_free(answer->evidence);
    srnf_free(answer->probabilities);
    srnf_free(answer->predicted);
    srnf_free(answer->trained);
    srnf_free(answer->known);
    srnf_free(answer->traits);
    srnf_free(answer->nearest);
    compute_group_clear(&answer->group);
}

static bool answer_open(struct predict_answer *answer, size_t n, size_t classes)
{
    answer->n = n;
    answer->priors = srnf_alloc(classes, sizeof(double));
    answer->predictions = srnf_alloc(n, sizeof *answer->predictions);
    answer->evidence = srnf_alloc(n, classes * sizeof(double));
    answer->probabilities = srnf_alloc(n, classes * sizeof(double));
    answer->predicted = srnf_alloc(n, sizeof *answer->predicted);
    answer->trained = srnf_alloc(n, sizeof *answer->trained);
    answer->known = srnf_alloc(n, sizeof *answer->known);
    answer->traits = srnf_alloc(n, PREDICT_TRAITS * sizeof *answer->traits);
    answer->nearest = srnf_alloc(n, 2 * sizeof(double));
    answer->mirrored = answer->nearest ? answer->nearest + n : NULL;
    return answer->nearest && answer->priors && answer->predictions && answer->evidence &&
           answer->probabilities && answer->predicted && answer->trained && answer->known &&
           answer->traits;
}

/* Each value of surface i among those of the training members; of one of them its own, as it is
   where it is left out. */
static int judge(const struct kept *kept, size_t i, size_t member, struct predict_answer *answer)
{
    const struct srnf_class_prediction *p = &answer->predictions[i];
    const double own[PREDICT_TRAITS] = {p->residual, p->distance, p->mahalanobis, p->nearest};
    const double *loo = kept->model.stored.arrays[STORE_MODEL_CALIBRATION];
    size_t n = kept->model.pca.n;
    int status = 0;

    for (size_t t = 0; t < PREDICT_TRAITS && status == 0; t++) {
        enum srnf_trait trait = predict_traits[t];
        const double *values =
            trait == SRNF_TRAIT_NEAREST ? kept->nearest : loo + (size_t)trait * n;

        status = srnf_typicality_of(trait, n, values, kept->weights,
                                    member < n ? values[member] : own[t], SRNF_TYPICAL_ALPHA,
                                    &answer->traits[i * PREDICT_TRAITS + t]);
    }
    /* A value that is no number is refused: the surface is beyond double precision. */
    return status == SRNF_EINVAL ? SRNF_ENUMERIC : status;
}

/* Of the training members, part after part where they are of several structures. */
static const json_t *contents_of(const struct kept *kept)
{
    const json_t *shapes = json_object_get(kept->made, "shapes");

    return shapes ? shapes : json_object_get(kept->made, "contents");
}

size_t predict_known_parts(const struct kept *kept, const struct predict_answer *answer, size_t i,
                           size_t *first)
{
    const json_t *contents = contents_of(kept);
    size_t n = kept->model.pca.n, n_parts = kept->model.joint.n_parts, count = 0;

    *first = n_parts;
    for (size_t part = 0; part < n_parts; part++) {
        const char *own = answer->group.contents[part * answer->n + i];
        size_t m = 0;

        while (m < n) {
            const char *one = json_string_value(json_array_get(contents, part * n + m));

            if (one && strcmp(one, own) == 0) {
                break;
            }
            m++;
        }
        if (m < n && count++ == 0) {
            *first = part;
        }
    }
    return count;
}

size_t predict_member(const struct kept *kept, const struct predict_answer *answer, size_t i)
{
    const json_t *contents = contents_of(kept);
    size_t n = kept->model.pca.n, n_parts = kept->model.joint.n_parts, member = 0, part = 0;

    while (member < n && part < n_parts) {
        const char *own = json_string_value(json_array_get(contents, part * n + member));
        bool same = own && strcmp(own, answer->group.contents[part * answer->n + i]) == 0;

        member += !same;
        part = same ? part + 1 : 0;
    }
    return member;
}

static int finish(const struct kept *kept, struct predict_answer *answer,
                  struct jobs_result *result)
{
    size_t k = kept->classes;
    int status = 0;

    for (size_t i = 0; i < answer->n && status == 0; i++) {
        size_t member = predict_member(kept, answer, i), first;

        answer->trained[i] = member < kept->model.pca.n;
        answer->known[i] = predict_known_parts(kept, answer, i, &first);
        answer->predicted[i] =
            srnf_platt_choose(k, answer->probabilities + i * k, answer->evidence + i * k);
        status = judge(kept, i, member, answer);
    }
    return status ? compute_fail(result, status, NULL, "comparing with the training members") : 0;
}

/* Loads what is asked about, and the priors. */
static int load(struct jobs_run *run, const struct predict *predict, const struct kept *kept,
                struct predict_answer *answer, struct jobs_result *result)
{
    struct group_input group = predict->group; /* a view */
    int status;

    for (size_t c = 0; c < kept->classes; c++) {
        const json_t *prior = json_object_get(predict->priors, kept->names[c]);

        answer->priors[c] = prior ? json_number_value(prior) : kept->classifier.priors[c];
    }
    group.mesh_degree = model_mesh_degree(&kept->model.stored, kept->made);
    status = group_load(run, &group, true, (size_t)kept->model.stored.lmax, &answer->group, result);
    return status ? status : predict_place(run, &group, kept, answer, result);
}

static int compute(struct jobs_run *run, const struct predict *predict, const struct kept *kept,
                   struct predict_answer *answer, struct jobs_result *result)
{
    const struct compute_joint *joint = &kept->model.joint;
    const struct srnf_frozen frozen = {.classifier = &kept->classifier,
                                       .pca = &kept->model.pca,
                                       .n_parts = joint->n_parts,
                                       .weights = joint->weights,
                                       .position_weight = joint->position_weight,
                                       .target = kept->target,
                                       .mean_q = kept->model.stored.arrays[STORE_MODEL_MEAN_Q],
                                       .labels = kept->labels,
                                       .subjects = kept->subjects,
                                       .numbers = kept->numbers};
    const struct srnf_sht *sht = NULL;
    struct srnf_error error = {0};
    int status = load(run, predict, kept, answer, result);

    status = status ? status : compute_model_transform(run, &kept->model, &sht, result);
    if (status) {
        return status;
    }
    status =
        predict_load_numbers(run, predict, kept, sht, &answer->group, &answer->numbers, result);
    if (status) {
        jobs_transform_release(jobs_run_jobs(run), sht);
        return status;
    }
    jobs_run_phase(run, 100.0);
    status =
        srnf_predict(sht, &frozen, answer->n, answer->group.surfaces, answer->positions,
                     answer->numbers, &kept->registration, answer->priors, jobs_run_context(run),
                     answer->predictions, answer->evidence, answer->probabilities, &error);
    for (size_t i = 0; i < answer->n && status == 0; i++) {
        answer->nearest[i] = answer->mirrored[i] = answer->predictions[i].nearest;
    }
    if (status == 0 && predict->handedness == HANDEDNESS_CHECK) {
        status = predict_mirrored(run, sht, &frozen, kept, answer, &error);
    }
    jobs_transform_release(jobs_run_jobs(run), sht);
    return status ? compute_fail(result, status, &error, "asking the classifier")
                  : finish(kept, answer, result);
}

/* Those of the first structure stand for the subjects. */
static json_t *describe(struct jobs_run *run, const struct predict *predict,
                        const struct kept *kept, const struct predict_answer *answer,
                        struct jobs_result *result)
{
    struct group_input subjects = predict_subjects(&predict->group, kept->model.joint.n_parts);
    json_t *document = predict_document(run, &subjects, kept, answer, result);

    json_decref(subjects.surfaces);
    json_decref(subjects.cohort);
    return document;
}

static json_t *run_predict(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct predict *predict = typed;
    struct predict_answer answer = {.priors = NULL};
    struct kept kept;
    json_t *document = NULL;

    if (kept_load(run, predict->model, &kept, result) == 0) {
        if (!answer_open(&answer, predict->group.n / kept.model.joint.n_parts, kept.classes)) {
            (void)compute_fail(result, SRNF_ENOMEM, NULL, "reading the inputs");
        } else if (compute(run, predict, &kept, &answer, result) == 0) {
            document = describe(run, predict, &kept, &answer, result);
        }
    }
    answer_clear(&answer);
    kept_clear(&kept);
    return document;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct predict),
    .complete = complete,
    .run = run_predict,
};

const struct api_process predict_process = {
    .id = "predict",
    .title = "Prediction by a classifier",
    .description = "The class of surfaces by a classifier that is kept, with calibrated "
                   "probabilities, and whether they are like those that it was trained on.",
    .methods =
        "Labels with calibrated probabilities were predicted by a classifier that had been trained "
        "before; each shape was registered to its template alone",
    .table = &table,
    .seconds = seconds,
    .model_fits = predict_model_fits,
};
