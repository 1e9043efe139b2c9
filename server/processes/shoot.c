/*
 * shoot.c - the process shoot over HTTP: canonical inputs and result document.
 *
 * The surface that a velocity is toward is registered to the surface shot from, unless register is
 * false; at t = 1 the path is at it, as it is registered. Its scale goes geometrically: that of the
 * surface at 0, that of the other at 1, positive at any time. A velocity given by numbers leaves
 * the scale as it is.
 */
#include <math.h>
#include <stdio.h>

#include "toolkit/velocity.h"
#include "toolkit/registration_report.h"

static const char *const names[] = {"surface",    "velocity", "times", "register",
                                    "commonPose", "method",   NULL};

json_t *shoot_canonicalise(struct api_call *call, const json_t *given, struct problem_list *list)
{
    static const double fallback[] = {0.0, 0.25, 0.5, 0.75, 1.0};
    struct process_inputs inputs;
    long degree = PROCESS_DEGREE_DEFAULT;

    if (!inputs_open(&inputs, call, given, list, names)) {
        return NULL;
    }
    inputs_numbers(&inputs, "times", PROCESS_TIMES_MAX, PROCESS_TIME_MAX,
                   sizeof fallback / sizeof fallback[0], fallback);
    inputs_alignment(&inputs);
    (void)inputs_surface(&inputs, "surface", &degree);
    if (!inputs.answered) {
        inputs_velocity(&inputs, "velocity", degree);
    }
    return inputs_close(&inputs);
}

static json_t *keep_surfaces(struct jobs_run *run, const struct compute_shoot_inputs *typed,
                             const struct compute_shoot_outputs *outputs,
                             struct jobs_result *result)
{
    const struct compute_group *group = &outputs->stage.group;
    size_t count = 3 * srnf_coefficient_count(group->degree);
    double start = process_scale(run, typed->surface, group->scales[0]), growth = 1.0;
    json_t *records = json_array(), *record;
    char name[64];

    if (typed->velocity.toward) {
        growth = process_scale(run, typed->velocity.toward, group->scales[1]) / start;
    }
    for (size_t i = 0; i < outputs->shot.n; i++) {
        (void)snprintf(name, sizeof name, "shot, t = %.4g", typed->times[i]);
        record = keep_reached(
            run, "shoot", name, group->degree, outputs->shot.coefficients + i * count,
            start * pow(growth, typed->times[i]), &outputs->measures[i], typed->surface, result);
        if (!record) {
            json_decref(records);
            return NULL;
        }
        (void)json_array_append_new(records, record);
    }
    return records;
}

static json_t *result_document(const struct compute_shoot_outputs *outputs,
                               const struct srnf_register_options *options, const double *times,
                               json_t *surfaces)
{
    const struct srnf_shot *shot = &outputs->shot;
    const struct compute_pullback *pullback = &outputs->pullback;
    json_t *document =
        json_pack("{s:o, s:o, s:o, s:o, s:o, s:o}", "surfaces", surfaces, "times",
                  json_vector(times, shot->n), "energies", json_vector(shot->energy, shot->n),
                  "relativeEnergies", json_vector(shot->relative_energy, shot->n), "transforms",
                  json_finite(shot->transforms), "registration",
                  alignment_json(&outputs->registration, options));

    (void)json_object_set_new(
        document, "pullback",
        pullback->asked
            ? json_pack("{s:o, s:o, s:b}", "toward", pullback_leg_json(&pullback->toward), "shots",
                        pullback_shots_json(pullback), "converged", pullback->converged)
            : json_null());
    registration_warn(document, &outputs->registration, "the surface toward onto surface");
    return document;
}

void shoot_run(struct jobs_run *run, void *api, const char *text, struct jobs_result *result)
{
    json_t *inputs = process_parse(text, result), *surfaces, *echoed;
    const json_t *given = json_object_get(inputs, "times");
    struct srnf_register_options options;
    struct compute_shoot_inputs typed = {.n = json_array_size(given)};
    struct compute_shoot_outputs outputs = {.measures = NULL};
    double times[PROCESS_TIMES_MAX] = {0.0}, *numbers = NULL;

    (void)api;
    if (!inputs) {
        return;
    }
    for (size_t i = 0; i < typed.n; i++) {
        times[i] = json_number_value(json_array_get(given, i));
    }
    typed.times = times;
    typed.surface = json_string_value(json_object_get(inputs, "surface"));
    typed.registration = alignment_read(inputs, &options);
    typed.pullback = alignment_pullback(inputs);
    if (!velocity_read(json_object_get(inputs, "velocity"), &typed.velocity, &numbers, result) ||
        compute_shoot(run, &typed, &outputs, result)) {
        goto out;
    }
    surfaces = keep_surfaces(run, &typed, &outputs, result);
    if (surfaces) {
        echoed = velocity_inputs_for_results(inputs, "velocity");
        process_finish(run, result_document(&outputs, &options, times, surfaces), echoed, result);
        json_decref(echoed);
    }
out:
    compute_shoot_clear(&outputs);
    srnf_free(numbers);
    json_decref(inputs);
}
