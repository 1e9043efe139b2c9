/*
 * bridge.c - what stands between two routes is the mesh, which both encode.
 *
 * Members of a group by star are replaced by the encodings of their meshes by area: one encoding
 * for each, after which the group has one route, and is compared as any other.
 *
 * A pair keeps its surfaces. With f the surface of one end by its own route and a that by area, f =
 * a o c where c goes from the sphere of the one to that of the other, through the mesh. From a_0 =
 * O a_1 o h, which the registration of the two area encodings finds, f_0 = O f_1 o (c_1^-1 o h o
 * c_0).
 *
 * Asked for both ways, both are measured and the lower distance counts, so that it is the same
 * whichever surface is the template. Where the warp that is put together folds, or its series
 * cannot be made, the surfaces are searched as any others.
 */
#include "compute/bridge.h"

#include <string.h>

#include "compute/encode.h"
#include "compute/prepared.h"

/* The series of a warp between routes has the degree of the surfaces, and this at least: a higher
   one follows the faces of the mesh, which the surfaces do not (bench_routes). */
#define WARP_DEGREE_MIN ((size_t)31)

struct end {
    const struct compute_origin *origin;
    const double *area;         /* by area, at the degree of the pair */
    double *encoded;            /* owned; NULL where the surface itself is by area */
    struct srnf_warp out, in;   /* c: own sphere to that of area, and back; empty for area */
    struct compute_doubt doubt; /* of encoded */
};

struct bridge {
    struct jobs_run *run;
    const struct srnf_sht *sht;
    const double *surfaces[2];
    const struct srnf_register_options *options;
    struct end ends[2];
    struct jobs_result *result;
};

/* Whether compute_register_pair bridges them. */
static bool are_bridgeable(const struct compute_origin *a, const struct compute_origin *b)
{
    return a->mesh[0] && b->mesh[0] && a->route != b->route && !a->mirrored && !b->mirrored;
}

/* ---- Encoding again -------------------------------------------------------------------------- */

/* The mesh of the origin by area. A doubt goes aside, with the name of what the encoding is for. */
static int encode_again(struct jobs_run *run, const struct srnf_context *context,
                        const struct compute_origin *origin, size_t degree,
                        struct srnf_encoded *encoded, struct compute_doubt *aside,
                        struct jobs_result *result)
{
    struct compute_encode_inputs inputs = {
        .options = srnf_encode_options_defaults(), .mirror = origin->mirrored, .aside = aside};
    int status;

    memcpy(inputs.mesh, origin->mesh, sizeof inputs.mesh);
    inputs.options.degree = degree;
    inputs.options.parameterization = SRNF_PARAMETERIZATION_AREA;
    inputs.options.smoothing = origin->smoothing;
    inputs.options.unit_area = origin->unit_area;
    aside->any = false;
    status = compute_encode(run, context, &inputs, encoded, result);
    memcpy(aside->doubt.surface, origin->surface, sizeof aside->doubt.surface);
    return status;
}

_Static_assert((int)STORE_NOT_FOUND < (int)SRNF_EIO, "an int tells either status");

/* Whether a failure says that the mesh leads nowhere, and not that the job cannot go on: the mesh
   is gone, or the core cannot make this of it. */
static bool leads_nowhere(int status)
{
    return status == STORE_NOT_FOUND ||
           (status < SRNF_OK && status >= SRNF_EIO && status != SRNF_ECANCELED &&
            status != SRNF_ENOMEM && status != SRNF_EIO);
}

static int note(struct jobs_run *run, const struct compute_doubt *aside, struct jobs_result *result)
{
    return !aside->any || jobs_run_doubt(run, &aside->doubt)
               ? SRNF_OK
               : compute_fail(result, SRNF_ENOMEM, NULL, "noting a doubt");
}

int compute_bridge_load(struct jobs_run *run, const struct srnf_context *context,
                        const struct compute_origin *origin, bool mirror,
                        struct compute_surface *surface, bool *bridged, struct jobs_result *result)
{
    struct srnf_encoded encoded = {.coefficients = NULL};
    struct compute_doubt aside;
    int status =
        compute_surface_load_within(run, context, origin->surface, mirror, 0, surface, result);

    *bridged = false;
    if (status) {
        return status;
    }
    status = encode_again(run, context, origin, surface->degree, &encoded, &aside, result);
    if (leads_nowhere(status)) {
        *result = (struct jobs_result){.results = NULL};
        return SRNF_OK;
    }
    if (status == SRNF_OK) {
        status = note(run, &aside, result);
    }
    if (status == SRNF_OK) {
        if (mirror) {
            srnf_surface_mirror(encoded.degree, encoded.coefficients);
        }
        srnf_free(surface->coefficients);
        surface->coefficients = encoded.coefficients;
        surface->scale = encoded.scale;
        memcpy(surface->origin, encoded.origin, sizeof surface->origin);
        *bridged = true;
    } else {
        srnf_free(encoded.coefficients);
        compute_surface_clear(surface);
    }
    return status;
}

/* ---- Pairs ----------------------------------------------------------------------------------- */

static void end_clear(struct end *end)
{
    srnf_free(end->encoded);
    srnf_warp_clear(&end->out);
    srnf_warp_clear(&end->in);
}

/* Both warps of an end by star. */
static int join_routes(const struct srnf_mesh *mesh, const struct srnf_mesh_report *report,
                       const struct srnf_context *context, size_t degree, struct end *end)
{
    struct srnf_encode_options star = srnf_encode_options_defaults(), area = star;
    size_t n = 3 * mesh->n_vertices;
    size_t wanted = degree < WARP_DEGREE_MIN ? WARP_DEGREE_MIN : degree;
    double *points = srnf_alloc(2 * n, sizeof(double));
    int status = points ? SRNF_OK : SRNF_ENOMEM;

    star.parameterization = SRNF_PARAMETERIZATION_STAR;
    star.center_given = true;
    memcpy(star.center, end->origin->center, sizeof star.center);
    area.parameterization = SRNF_PARAMETERIZATION_AREA;
    if (status == SRNF_OK) {
        status = srnf_encode_points(mesh, report, &star, context, points, NULL);
    }
    if (status == SRNF_OK) {
        status = srnf_encode_points(mesh, report, &area, context, points + n, NULL);
    }
    if (status == SRNF_OK) {
        status = srnf_warp_between(mesh, points, points + n, wanted, context, &end->out);
    }
    if (status == SRNF_OK) {
        status = srnf_warp_between(mesh, points + n, points, wanted, context, &end->in);
    }
    srnf_free(points);
    return status;
}

static int end_open(struct bridge *b, const struct compute_origin *origin, size_t i)
{
    const struct srnf_context *context = jobs_run_context(b->run);
    struct end *end = &b->ends[i];
    size_t degree = srnf_sht_degree(b->sht);
    struct compute_prepared prepared;
    struct srnf_encoded encoded = {0};
    int status;

    *end = (struct end){.origin = origin, .area = b->surfaces[i]};
    if (origin->route == SRNF_PARAMETERIZATION_AREA) {
        return SRNF_OK;
    }
    status = encode_again(b->run, context, origin, degree, &encoded, &end->doubt, b->result);
    if (status == SRNF_OK) {
        end->area = end->encoded = encoded.coefficients;
        status = compute_prepared_load(b->run, origin->mesh, "", false, &prepared, b->result);
    }
    if (status == SRNF_OK) {
        status = join_routes(&prepared.mesh, &prepared.report, context, degree, end);
        compute_prepared_clear(&prepared);
    }
    return status;
}

/* One way: template ends[first]. */
static int carry(struct bridge *b, size_t first, struct srnf_registration *registration)
{
    struct end *fixed = &b->ends[first], *moving = &b->ends[1 - first];
    struct srnf_registration by_area = {.iterations = 0};
    struct srnf_warp chain = {0};
    bool same = strcmp(fixed->origin->mesh, moving->origin->mesh) == 0;
    int status = srnf_warp_join(&fixed->out, &chain);

    if (status == SRNF_OK && !same) {
        status = srnf_register(b->sht, fixed->area, NULL, moving->area, b->options, NULL,
                               jobs_run_context(b->run), &by_area, NULL);
    }
    if (status >= SRNF_OK) {
        status = srnf_warp_join(&by_area.warp, &chain);
    }
    if (status == SRNF_OK) {
        status = srnf_warp_join(&moving->in, &chain);
    }
    if (status == SRNF_OK) {
        status = srnf_register_known(b->sht, b->surfaces[first], b->surfaces[1 - first], b->options,
                                     &chain, jobs_run_context(b->run), registration, NULL);
    }
    if (status == SRNF_OK && !same) {
        registration->iterations = by_area.iterations;
        registration->converged = by_area.converged;
        registration->stopped = by_area.stopped;
        registration->inverse_consistency = by_area.inverse_consistency;
        registration->ambiguity_objective = by_area.ambiguity_objective;
        registration->ambiguity_angle = by_area.ambiguity_angle;
        registration->rotational_curvature = by_area.rotational_curvature;
        registration->rotations_searched = by_area.rotations_searched;
    }
    srnf_registration_clear(&by_area);
    srnf_warp_clear(&chain);
    return status;
}

/* SRNF_ENUMERIC where there is no such way. */
static int cross(struct bridge *b, const struct compute_origin *origins,
                 struct srnf_registration *registration)
{
    struct srnf_registration back = {.iterations = 0};
    int status = end_open(b, &origins[0], 0);

    if (status == SRNF_OK) {
        status = end_open(b, &origins[1], 1);
    }
    if (status == SRNF_OK) {
        status = carry(b, 0, registration);
    }
    if (status == SRNF_OK && b->options->symmetric) {
        status = carry(b, 1, &back);
    }
    if (status == SRNF_OK) {
        bool folds = !(registration->min_jacobian > 0.0) ||
                     (b->options->symmetric && !(back.min_jacobian > 0.0));

        if (b->options->symmetric && back.distance < registration->distance) {
            registration->distance = back.distance;
        }
        status = folds ? SRNF_ENUMERIC : SRNF_OK;
    }
    for (size_t i = 0; i < 2 && status == SRNF_OK; i++) {
        status = note(b->run, &b->ends[i].doubt, b->result);
    }
    srnf_registration_clear(&back);
    end_clear(&b->ends[0]);
    end_clear(&b->ends[1]);
    return status;
}

int compute_register_pair(struct jobs_run *run, const struct srnf_sht *sht, const double *fixed,
                          const double *moving, const struct compute_origin *origins,
                          const struct srnf_register_options *options,
                          struct srnf_registration *registration, bool *bridged,
                          struct jobs_result *result)
{
    struct bridge bridge = {
        .run = run, .sht = sht, .surfaces = {fixed, moving}, .options = options, .result = result};
    struct srnf_error error = {0};
    int status;

    *bridged = false;
    *registration = (struct srnf_registration){.iterations = 0};
    if (origins && options->reparameterization && are_bridgeable(&origins[0], &origins[1])) {
        status = cross(&bridge, origins, registration);
        *bridged = status == SRNF_OK;
        if (!leads_nowhere(status)) {
            return status == SRNF_ENOMEM ? compute_fail(result, status, NULL, "registering")
                                         : status;
        }
        /* The meshes do not lead from one to the other; a search does without them. */
        srnf_registration_clear(registration);
        *result = (struct jobs_result){.results = NULL};
    }
    status = srnf_register(sht, fixed, NULL, moving, options, NULL, jobs_run_context(run),
                           registration, &error);
    return status < 0 ? compute_fail(result, status, &error, "registering") : 0;
}
