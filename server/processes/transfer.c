/*
 * transfer.c - the process transfer over HTTP: canonical inputs and result document.
 *
 * The deformed surface is registered to its source, then the source, and the deformed one with it,
 * to the target: the answer keeps the pose and the parameterisation of the target.
 *
 * Records know sizes by their scale. With size ratio the answer's shape is made at unit area, and
 * its scale is that of the target times the ratio of deformed to source; with size absolute the
 * three are taken in the units that their scales lead back to, which must be the same.
 */
#include "toolkit/velocity.h"
#include "toolkit/registration_report.h"

#include <string.h>

static const char *const names[] = {"source",   "deformed",   "target", "size",
                                    "register", "commonPose", "method", NULL};
static const char *const surfaces[] = {"source", "deformed", "target"};
/* In the order of enum srnf_transfer_size. */
static const char *const sizes[] = {"ratio", "absolute", NULL};

json_t *transfer_canonicalise(struct api_call *call, const json_t *given, struct problem_list *list)
{
    struct process_inputs inputs;
    long degree;

    if (!inputs_open(&inputs, call, given, list, names)) {
        return NULL;
    }
    inputs_alignment(&inputs);
    (void)inputs_choice(&inputs, "size", sizes);
    for (size_t i = 0; i < 3; i++) {
        (void)inputs_surface(&inputs, surfaces[i], &degree);
    }
    return inputs_close(&inputs);
}

/* What the transfer came to in the pulled-back metric; null for the other method. */
static json_t *pullback_document(const struct compute_pullback *pullback)
{
    if (!pullback->asked) {
        return json_null();
    }
    return json_pack("{s:I, s:o, s:o, s:o, s:o, s:b}", "segments",
                     (json_int_t)COMPUTE_PULLBACK_SEGMENTS, "deformation",
                     json_finite(pullback->deformation), "distance",
                     json_finite(pullback->distance), "normFrom", json_finite(pullback->norm_from),
                     "norm", json_finite(pullback->norm), "converged", pullback->converged);
}

static json_t *result_document(const struct compute_transfer_outputs *outputs,
                               const struct srnf_register_options *options, json_t *surface)
{
    const struct srnf_transferred *transferred = &outputs->transferred;

    json_t *document = json_pack(
        "{s:o, s:o, s:o, s:o, s:o, s:o, s:{s:o, s:o}}", "surface", surface, "sizeRatio",
        json_finite(transferred->size_ratio), "energy", json_finite(transferred->energy),
        "relativeEnergy", json_finite(transferred->relative_energy), "transforms",
        json_finite(transferred->transforms), "pullback", pullback_document(&outputs->pullback),
        "registration", "deformed", alignment_json(&outputs->deformed, options), "source",
        alignment_json(&outputs->source, options));

    registration_warn(document, &outputs->deformed, "deformed onto source");
    registration_warn(document, &outputs->source, "source onto target");
    return document;
}

void transfer_run(struct jobs_run *run, void *api, const char *text, struct jobs_result *result)
{
    json_t *inputs = process_parse(text, result), *surface;
    const char *size = json_string_value(json_object_get(inputs, "size"));
    struct srnf_register_options options;
    struct compute_transfer_inputs typed = {.size = SRNF_TRANSFER_RATIO};
    struct compute_transfer_outputs outputs = {.scale = 1.0};
    const char *ids[3];

    (void)api;
    if (!inputs) {
        return;
    }
    for (size_t i = 0; i < 3; i++) {
        ids[i] = json_string_value(json_object_get(inputs, surfaces[i]));
        typed.scales[i] = strncmp(ids[i], "surf-", 5) == 0 ? process_scale(run, ids[i], 0.0) : 0.0;
    }
    typed.source = ids[0];
    typed.deformed = ids[1];
    typed.target = ids[2];
    typed.registration = alignment_read(inputs, &options);
    typed.pullback = alignment_pullback(inputs);
    if (size && strcmp(size, sizes[SRNF_TRANSFER_ABSOLUTE]) == 0) {
        typed.size = SRNF_TRANSFER_ABSOLUTE;
    }
    if (compute_transfer(run, &typed, &outputs, result) == 0) {
        surface = keep_reached(run, "transfer", "transferred", outputs.stage.group.degree,
                               outputs.transferred.coefficients, outputs.scale, &outputs.measures,
                               typed.target, result);
        if (surface) {
            process_finish(run, result_document(&outputs, &options, surface), inputs, result);
        }
    }
    compute_transfer_clear(&outputs);
    json_decref(inputs);
}
