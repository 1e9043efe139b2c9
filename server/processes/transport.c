/*
 * transport.c - the process transport over HTTP: canonical inputs and result document.
 *
 * `from`, with the vector at it, is registered to `to`, and before that the surface that the vector
 * is toward to `from`: the answer lies in the pose and parameterisation of `to`, which stays as it
 * is. Where nothing is registered the vector in the space of SRNFs is the same before and after.
 *
 * The vector comes out twice: as the motion of the points of `to` (coefficients), which is its
 * nearest expression there, and as the field (srnf) that is carried on without loss.
 */
#include "toolkit/velocity.h"
#include "toolkit/registration_report.h"

static const char *const names[] = {"from",       "to",     "vector", "register",
                                    "commonPose", "method", NULL};

json_t *transport_canonicalise(struct api_call *call, const json_t *given,
                               struct problem_list *list)
{
    struct process_inputs inputs;
    long from = PROCESS_DEGREE_DEFAULT, to = PROCESS_DEGREE_DEFAULT;

    if (!inputs_open(&inputs, call, given, list, names)) {
        return NULL;
    }
    inputs_alignment(&inputs);
    (void)inputs_surface(&inputs, "from", &from);
    (void)inputs_surface(&inputs, "to", &to);
    if (!inputs.answered) {
        inputs_velocity(&inputs, "vector", from > to ? from : to);
    }
    return inputs_close(&inputs);
}

/* {"coefficients": {lmax, x, y, z}, "srnf": {lmax, nTheta, nPhi, q}}: each may be sent back. */
static json_t *vector_json(const struct compute_transport_outputs *outputs)
{
    const struct compute_stage *stage = &outputs->stage;
    const struct srnf_grid *grid = srnf_sht_grid(stage->sht);
    size_t count = srnf_coefficient_count(stage->group.degree);
    size_t nodes = grid->n_theta * grid->n_phi, shape[3] = {grid->n_theta, grid->n_phi, 3};
    const double *w = outputs->tangent.coefficients;
    double *q = srnf_alloc(nodes, 3 * sizeof(double));
    json_t *vector;

    if (!q) {
        return NULL;
    }
    field_interleave(nodes, stage->velocity, q);
    vector =
        json_pack("{s:{s:I, s:o, s:o, s:o}, s:{s:I, s:I, s:I, s:o}}", "coefficients", "lmax",
                  (json_int_t)stage->group.degree, "x", json_vector(w, count), "y",
                  json_vector(w + count, count), "z", json_vector(w + 2 * count, count), "srnf",
                  "lmax", (json_int_t)stage->group.degree, "nTheta", (json_int_t)shape[0], "nPhi",
                  (json_int_t)shape[1], "q", json_nested(q, 3, shape));
    srnf_free(q);
    return vector;
}

/* The surface reached: its scale goes as that between from and the surface toward. */
static json_t *keep_surface(struct jobs_run *run, const struct compute_transport_inputs *typed,
                            const struct compute_transport_outputs *outputs,
                            struct jobs_result *result)
{
    const struct compute_group *group = &outputs->stage.group;
    double scale = process_scale(run, typed->to, group->scales[1]);

    if (typed->vector.toward) {
        scale *= process_scale(run, typed->vector.toward, group->scales[2]) /
                 process_scale(run, typed->from, group->scales[0]);
    }
    return keep_reached(run, "transport", "transported", group->degree, outputs->shot.coefficients,
                        scale, &outputs->measures, typed->to, result);
}

/* The paths in the pulled-back metric; null for the other method. */
static json_t *pullback_document(const struct compute_pullback *pullback)
{
    if (!pullback->asked) {
        return json_null();
    }
    return json_pack(
        "{s:o, s:o, s:o, s:o, s:o, s:b}", "toward", pullback_leg_json(&pullback->toward), "path",
        pullback_leg_json(&pullback->along), "shot", pullback_leg_json(&pullback->shots[0]),
        "normFrom", json_finite(pullback->norm_from), "norm", json_finite(pullback->norm),
        "converged", pullback->converged);
}

static json_t *result_document(const struct compute_transport_outputs *outputs,
                               const struct srnf_register_options *options, json_t *surface)
{
    const struct srnf_tangent *tangent = &outputs->tangent;

    json_t *document = json_pack(
        "{s:o, s:o, s:o, s:o, s:I, s:o, s:o, s:o, s:o, s:{s:o, s:o}}", "vector",
        vector_json(outputs), "surface", surface, "norm", json_finite(tangent->norm), "residual",
        json_finite(tangent->residual), "iterations", (json_int_t)tangent->iterations, "energy",
        json_finite(outputs->shot.energy[0]), "relativeEnergy",
        json_finite(outputs->shot.relative_energy[0]), "transforms",
        json_finite(tangent->transforms + outputs->shot.transforms), "pullback",
        pullback_document(&outputs->pullback), "registration", "toward",
        alignment_json(&outputs->toward, options), "from", alignment_json(&outputs->from, options));

    registration_warn(document, &outputs->toward, "the surface toward onto from");
    registration_warn(document, &outputs->from, "from onto to");
    return document;
}

void transport_run(struct jobs_run *run, void *api, const char *text, struct jobs_result *result)
{
    json_t *inputs = process_parse(text, result), *surface, *echoed;
    struct srnf_register_options options;
    struct compute_transport_inputs typed = {.from = NULL};
    struct compute_transport_outputs outputs = {.measures = {.area = 0.0}};
    double *numbers = NULL;

    (void)api;
    if (!inputs) {
        return;
    }
    typed.from = json_string_value(json_object_get(inputs, "from"));
    typed.to = json_string_value(json_object_get(inputs, "to"));
    typed.registration = alignment_read(inputs, &options);
    typed.pullback = alignment_pullback(inputs);
    if (!velocity_read(json_object_get(inputs, "vector"), &typed.vector, &numbers, result) ||
        compute_transport(run, &typed, &outputs, result)) {
        goto out;
    }
    surface = keep_surface(run, &typed, &outputs, result);
    if (surface) {
        echoed = velocity_inputs_for_results(inputs, "vector");
        process_finish(run, result_document(&outputs, &options, surface), echoed, result);
        json_decref(echoed);
    }
out:
    compute_transport_clear(&outputs);
    srnf_free(numbers);
    json_decref(inputs);
}
