/*
 * transfer.c - the process transfer: a surface deformed as another one was.
 *
 * The deformed surface is registered to its source, then the source, and the deformed one with it,
 * to the target: the answer keeps the pose and the parameterization of the target.
 *
 * Records know sizes by their scale, or, of surfaces encoded with scale none, by the coefficients
 * and a scale of 1. With size ratio shapes are compared at unit area, and the answer has the size
 * of the target times the ratio of deformed to source: in its scale or in its coefficients, as the
 * target has its size, so that it compares with surfaces of that kind. With size absolute the three
 * are taken in the units that their scales lead back to, which must be the same.
 */
#include "toolkit/seconds.h"
#include "toolkit/velocity.h"

struct transfer {
    char source[STORE_ID_MAX], deformed[STORE_ID_MAX], target[STORE_ID_MAX];
    int size; /* enum srnf_transfer_size */
    bool registered, common_pose;
    int method;
};

/* In the order of enum srnf_transfer_size. */
static const char *const sizes[] = {"ratio", "absolute", NULL};

static const struct process_input inputs[] = {
    {"source", INPUT_SURFACE, offsetof(struct transfer, source),
     "Surface before its deformation; a mesh is encoded with the default options.",
     .required = true},
    {"deformed", INPUT_SURFACE, offsetof(struct transfer, deformed),
     "The same after it; a mesh is encoded with the default options.", .required = true},
    {"target", INPUT_SURFACE, offsetof(struct transfer, target),
     "Surface to deform in the same way; a mesh is encoded with the default options.",
     .required = true},
    {"size", INPUT_CHOICE, offsetof(struct transfer, size),
     "ratio: shapes are compared at unit area, and the size of the target changes in the ratio of "
     "deformed to source; absolute: all three in the units that their scales lead back to, which "
     "must be the same.",
     .choices = sizes},
    DEFORMATION_INPUTS(transfer,
                       "Register the deformed surface to its source, and both to the target",
                       "they are"),
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"surface", OUTPUT_OBJECT,
     "Record of the target deformed, in its own pose and parameterization; with size ratio its "
     "scale is that of the target times sizeRatio, or, of a target in its own size (encoded with "
     "scale none), its coefficients have that size and its scale stays 1."},
    {"sizeRatio", OUTPUT_NUMBER, "Square root of the area of deformed over that of source."},
    {"energy", OUTPUT_NUMBER,
     "Squared distance of the surface's SRNF from Q(target) + Q(deformed) - Q(source)."},
    {"relativeEnergy", OUTPUT_NUMBER, "The same divided by the squared norm of that."},
    {"transforms", OUTPUT_NUMBER, "Cost in gradient transforms."},
    {"pullback", OUTPUT_OBJECT_OR_NULL,
     "Of method pullback, null otherwise: segments of each path; deformation and distance, lengths "
     "of the geodesics from source to deformed and to target; normFrom, norm: of the velocity "
     "before and after transport; converged."},
    {"registration", OUTPUT_OBJECT, "deformed and source. Each as" REGISTRATION_FIGURES_TEXT},
    {NULL, NULL, NULL},
};

/* What the transfer came to in the pulled-back metric. */
static json_t *pullback_json(const struct srnf_deform_paths *paths)
{
    return json_pack("{s:I, s:o, s:o, s:o, s:o, s:b}", "segments", (json_int_t)SRNF_DEFORM_SEGMENTS,
                     "deformation", json_finite(paths->deformation), "distance",
                     json_finite(paths->distance), "normFrom", json_finite(paths->norm_from),
                     "norm", json_finite(paths->norm), "converged", paths->converged);
}

static json_t *document_of(const struct deformation *deformation,
                           const struct srnf_deform_transfer *moved, json_t *surface)
{
    const struct srnf_transferred *transferred = &moved->transferred;
    const struct srnf_register_options *options = &deformation->registration;
    json_t *document =
        json_pack("{s:o, s:o, s:o, s:o, s:o, s:o, s:{s:o, s:o}}", "surface", surface, "sizeRatio",
                  json_finite(transferred->size_ratio), "energy", json_finite(transferred->energy),
                  "relativeEnergy", json_finite(transferred->relative_energy), "transforms",
                  json_finite(transferred->transforms), "pullback",
                  deformation->options.pullback ? pullback_json(&moved->paths) : json_null(),
                  "registration", "deformed", alignment_json(&moved->deformed, options), "source",
                  alignment_json(&moved->source, options));

    registration_warn(document, &moved->deformed, "deformed onto source");
    registration_warn(document, &moved->source, "source onto target");
    return document;
}

static json_t *run_transfer(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct transfer *transfer = typed;
    const char *ids[3] = {transfer->source, transfer->deformed, transfer->target};
    struct deformation deformation;
    struct srnf_deform_transfer moved = {.step = NULL};
    struct srnf_error error = {0};
    json_t *document = NULL, *surface;
    double scales[3];
    int status;

    if (deformation_open(run, 3, ids, NULL, transfer->registered, transfer->common_pose,
                         (enum deformation_method)transfer->method, &deformation, result)) {
        goto out;
    }
    for (size_t i = 0; i < 3; i++) {
        scales[i] = process_scale(run, ids[i], deformation.group.scales[i]);
    }
    status = srnf_deform_transfer(deformation.sht, deformation.surfaces, scales,
                                  (enum srnf_transfer_size)transfer->size, &deformation.options,
                                  jobs_run_context(run), &moved, &error);
    if (status) {
        (void)compute_fail(result, status, &error, moved.step);
        goto out;
    }
    surface = keep_reached(run, "transfer", "transferred", deformation.group.degree,
                           moved.transferred.coefficients, moved.scale, &moved.measures,
                           transfer->target, result);
    document = surface ? document_of(&deformation, &moved, surface) : NULL;
    document =
        deformation_warn_pose(run, &deformation, 0, 1, "source and deformed", document, result);
    document =
        deformation_warn_pose(run, &deformation, 0, 2, "source and target", document, result);
out:
    srnf_deform_transfer_clear(&moved);
    deformation_close(&deformation);
    return document;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct transfer),
    .check = registration_one_spelling,
    .run = run_transfer,
};

const struct api_process transfer_process = {
    .id = "transfer",
    .title = "Transfer of a deformation",
    .description = "A surface deformed as another one was, its size included.",
    .table = &table,
    .seconds = transfer_seconds,
};
