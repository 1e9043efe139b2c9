/*
 * transport.c - the process transport: a vector at one surface carried to another.
 *
 * `from`, with the vector at it, is registered to `to`, and before that the surface that the vector
 * is toward to `from`: the answer lies in the pose and parameterization of `to`, which stays as it
 * is. Where nothing is registered the vector in the space of SRNFs is the same before and after.
 *
 * The vector comes out twice: as the motion of the points of `to` (coefficients), which is its
 * nearest expression there, and as the field (srnf) that is carried on without loss.
 */
#include "toolkit/seconds.h"
#include "toolkit/velocity.h"

struct transport {
    char from[STORE_ID_MAX], to[STORE_ID_MAX];
    struct velocity vector;
    bool registered, common_pose;
    int method;
};

static const struct process_input inputs[] = {
    {"from", INPUT_SURFACE, offsetof(struct transport, from),
     "Surface that the vector is at; a mesh is encoded with the default options.",
     .required = true},
    {"to", INPUT_SURFACE, offsetof(struct transport, to),
     "Surface that it is carried to; a mesh is encoded with the default options.",
     .required = true},
    {"vector", INPUT_OWN, offsetof(struct transport, vector), "A vector at from." VELOCITY_TEXT,
     .required = true, .own = &velocity_own},
    DEFORMATION_INPUTS(transport,
                       "Register the surface that the vector is toward to from, and "
                       "from with the vector to to",
                       "they are"),
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"vector", OUTPUT_OBJECT,
     "The vector at to: coefficients {lmax, x, y, z}, the motion of its points that comes nearest, "
     "and srnf {lmax, nTheta, nPhi, q}, the field itself, which parallel transport leaves "
     "unchanged (pullback: that of the motion). Either may be sent as an input."},
    {"surface", OUTPUT_OBJECT,
     "Record of the surface that the vector leads to from to in one unit of time."},
    {"norm", OUTPUT_NUMBER, "Of the vector in the space of SRNFs."},
    {"residual", OUTPUT_NUMBER,
     "Norm of the part that no motion of to gives; of pullback, of a field that no motion of from "
     "gives, which stays behind."},
    {"iterations", OUTPUT_INTEGER, "Of conjugate gradients."},
    {"energy", OUTPUT_NUMBER,
     "Squared distance of the SRNF of the surface from the end of the line."},
    {"relativeEnergy", OUTPUT_NUMBER, "The same divided by the squared norm of that end."},
    {"transforms", OUTPUT_NUMBER, "Cost in gradient transforms."},
    {"pullback", OUTPUT_OBJECT_OR_NULL,
     "Of method pullback, null otherwise: toward, the geodesic that the vector was taken from, or "
     "null; path, that from from to to; shot, the path to the surface. Each " PATH_TEXT
     ". normFrom, norm: of the vector before and after. converged: all of them."},
    {"registration", OUTPUT_OBJECT, "toward and from. Each as" REGISTRATION_FIGURES_TEXT},
    {NULL, NULL, NULL},
};

/* {"coefficients": {lmax, x, y, z}, "srnf": {lmax, nTheta, nPhi, q}}: each may be sent back. */
static json_t *vector_json(const struct srnf_sht *sht, const struct srnf_deform_transport *moved)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    json_int_t degree = (json_int_t)srnf_sht_degree(sht);
    size_t count = srnf_coefficient_count((size_t)degree);
    size_t nodes = grid->n_theta * grid->n_phi, shape[3] = {grid->n_theta, grid->n_phi, 3};
    const double *w = moved->tangent.coefficients;
    double *q = srnf_alloc(nodes, 3 * sizeof(double));
    json_t *vector;

    if (!q) {
        return NULL;
    }
    field_interleave(nodes, moved->velocity, q);
    vector = json_pack("{s:{s:I, s:o, s:o, s:o}, s:{s:I, s:I, s:I, s:o}}", "coefficients", "lmax",
                       degree, "x", json_vector(w, count), "y", json_vector(w + count, count), "z",
                       json_vector(w + 2 * count, count), "srnf", "lmax", degree, "nTheta",
                       (json_int_t)shape[0], "nPhi", (json_int_t)shape[1], "q",
                       json_nested(q, 3, shape));
    srnf_free(q);
    return vector;
}

/* The surface reached: its scale goes as that between from and the surface toward. */
static json_t *keep_surface(struct jobs_run *run, const struct transport *transport,
                            const struct compute_group *group,
                            const struct srnf_deform_transport *moved, struct jobs_result *result)
{
    double scale = process_scale(run, transport->to, group->scales[1]);

    if (transport->vector.toward[0]) {
        scale *= process_scale(run, transport->vector.toward, group->scales[2]) /
                 process_scale(run, transport->from, group->scales[0]);
    }
    return keep_reached(run, "transport", "transported", group->degree, moved->shot.coefficients,
                        scale, &moved->measures, transport->to, result);
}

/* The paths in the pulled-back metric. */
static json_t *pullback_json(const struct srnf_deform_paths *paths)
{
    return json_pack("{s:o, s:o, s:o, s:o, s:o, s:b}", "toward", path_json(&paths->toward), "path",
                     path_json(&paths->along), "shot", path_json(&paths->shots[0]), "normFrom",
                     json_finite(paths->norm_from), "norm", json_finite(paths->norm), "converged",
                     paths->converged);
}

static json_t *document_of(const struct deformation *deformation,
                           const struct srnf_deform_transport *moved, json_t *surface)
{
    const struct srnf_tangent *tangent = &moved->tangent;
    const struct srnf_register_options *options = &deformation->registration;
    json_t *document = json_pack(
        "{s:o, s:o, s:o, s:o, s:I, s:o, s:o, s:o, s:o, s:{s:o, s:o}}", "vector",
        vector_json(deformation->sht, moved), "surface", surface, "norm",
        json_finite(tangent->norm), "residual", json_finite(tangent->residual), "iterations",
        (json_int_t)tangent->iterations, "energy", json_finite(moved->shot.energy[0]),
        "relativeEnergy", json_finite(moved->shot.relative_energy[0]), "transforms",
        json_finite(tangent->transforms + moved->shot.transforms), "pullback",
        deformation->options.pullback ? pullback_json(&moved->paths) : json_null(), "registration",
        "toward", alignment_json(&moved->toward, options), "from",
        alignment_json(&moved->from, options));

    registration_warn(document, &moved->toward, "the surface toward onto from");
    registration_warn(document, &moved->from, "from onto to");
    return document;
}

static json_t *run_transport(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct transport *transport = typed;
    const char *ids[3] = {transport->from, transport->to, transport->vector.toward};
    struct deformation deformation;
    struct srnf_deform_transport moved = {.step = NULL};
    struct srnf_error error = {0};
    json_t *document = NULL, *surface;
    int status;

    if (deformation_open(run, ids[2][0] ? 3 : 2, ids, &transport->vector, transport->registered,
                         transport->common_pose, (enum deformation_method)transport->method,
                         &deformation, result)) {
        goto out;
    }
    status = srnf_deform_transport(deformation.sht, deformation.surfaces[0],
                                   deformation.surfaces[1], &deformation.velocity,
                                   &deformation.options, jobs_run_context(run), &moved, &error);
    if (status) {
        (void)compute_fail(result, status, &error, moved.step);
        goto out;
    }
    surface = keep_surface(run, transport, &deformation.group, &moved, result);
    document = surface ? document_of(&deformation, &moved, surface) : NULL;
    document = deformation_warn_pose(run, &deformation, 0, 1, "from and to", document, result);
    if (ids[2][0]) {
        document = deformation_warn_pose(run, &deformation, 0, 2, "from and what vector is toward",
                                         document, result);
    }
out:
    srnf_deform_transport_clear(&moved);
    deformation_close(&deformation);
    return document;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct transport),
    .check = registration_one_spelling,
    .run = run_transport,
};

const struct api_process transport_process = {
    .id = "transport",
    .title = "Parallel transport of a vector",
    .description =
        "A vector at one surface carried to another, and the surface that it leads to from there.",
    .table = &table,
    .seconds = transport_seconds,
};
