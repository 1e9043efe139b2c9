/*
 * encode.c - reads a stored mesh again and encodes it.
 *
 * The mesh is parsed and prepared afresh: the store keeps the original bytes only, and reading
 * 6,000 faces takes a few milliseconds. Parsing was found possible at the upload, so a failure
 * here means other limits or damage, and is reported like any other. What is repaired in a mesh is
 * repaired in its sphere too, so that the two still correspond. Every encoding is judged, whoever
 * wants it (core/surface/judge.c): one that has become another shape fails the job, a poor one
 * becomes a doubt of the run, which its results tell (process_finish), or of the caller.
 */
#include "compute/encode.h"

#include <stdio.h>
#include <stdlib.h>

#include "compute/compute.h"

/* A stored mesh, read, and mirrored if asked for; to be cleared when this returns 0. */
static int load(struct jobs_run *run, const char *id, bool mirror, struct srnf_mesh *mesh,
                struct jobs_result *result)
{
    struct store *store = jobs_run_store(run);
    struct store_mesh row = {0};
    struct srnf_error error = {0};
    unsigned char *bytes = NULL;
    size_t size = 0;
    int status = store_mesh_get(store, id, &row);

    if (status == 0) {
        status = store_mesh_content(store, id, &bytes, &size);
    }
    if (status) {
        status = compute_fail_store(result, status, id);
        goto out;
    }
    status = srnf_mesh_read(bytes, size, srnf_mesh_format_from_name(row.format), NULL, mesh, NULL,
                            &error);
    if (status == 0 && mirror) {
        srnf_mesh_mirror(mesh);
    }
    if (status < 0) {
        srnf_mesh_clear(mesh);
        status = compute_fail(result, status, &error, id);
    }
out:
    free(bytes);
    store_mesh_clear(&row);
    return status;
}

int compute_mesh_load(struct jobs_run *run, const char *id, bool mirror, struct srnf_mesh *mesh,
                      struct srnf_mesh_report *report, struct jobs_result *result)
{
    int status = load(run, id, mirror, mesh, result);

    if (status == 0) {
        status = srnf_mesh_prepare(mesh, true, report);
        if (status < 0) {
            srnf_mesh_clear(mesh);
            status = compute_fail(result, status, NULL, id);
        }
    }
    return status;
}

/* The mesh, and the sphere if there is one, prepared; to be cleared whatever this returns. */
static int load_prepared(struct jobs_run *run, const struct compute_encode_inputs *inputs,
                         struct srnf_mesh *mesh, struct srnf_mesh *sphere,
                         struct srnf_mesh_report *report, struct jobs_result *result)
{
    int status = load(run, inputs->mesh, inputs->mirror, mesh, result);

    if (status == 0 && inputs->sphere[0]) {
        status = load(run, inputs->sphere, inputs->mirror, sphere, result);
    }
    if (status) {
        return status;
    }
    status = inputs->sphere[0] ? srnf_mesh_prepare_pair(mesh, sphere, report)
                               : srnf_mesh_prepare(mesh, true, report);
    return status < 0 ? compute_fail(result, status, NULL, inputs->mesh) : 0;
}

/* Is the surface still the mesh? If not the job fails; if just about, the run has a doubt. */
static int judge(struct jobs_run *run, const struct compute_encode_inputs *inputs,
                 const struct srnf_mesh_report *report, const struct srnf_encoded *encoded,
                 struct jobs_result *result)
{
    struct jobs_doubt doubt = {.degree = encoded->degree, .coarseness = report->coarseness};
    const struct srnf_judgement *j = &doubt.judgement;

    (void)snprintf(doubt.mesh, sizeof doubt.mesh, "%s", inputs->mesh);
    switch (srnf_encode_judge(encoded, report, inputs->options.smoothing > 0.0, &doubt.judgement)) {
    case SRNF_FAITHFUL:
        if (!(report->coarseness >= JOBS_COARSE)) {
            return 0;
        }
        /* fall through */
    case SRNF_POOR:
        if (inputs->aside) {
            *inputs->aside = (struct compute_doubt){.any = true, .doubt = doubt};
            return 0;
        }
        return jobs_run_doubt(run, &doubt)
                   ? 0
                   : compute_fail(result, SRNF_ENOMEM, NULL, "noting a doubt");
    case SRNF_UNFAITHFUL:
        break;
    }
    result->problem_code = "encoding-unfaithful";
    (void)snprintf(result->problem_detail, sizeof result->problem_detail,
                   "%s: the surface of degree %zu by the route %s is another shape than the mesh: "
                   "%.3g %% of the diagonal apart (root mean square), %.3g times its volume, %.3g "
                   "times its area, map energy %.3g (4 is least). Try a higher degree, another "
                   "parameterization, or the mesh remeshed.",
                   inputs->mesh, encoded->degree, srnf_parameterization_name(encoded->route),
                   100.0 * j->fit, j->volume, j->area, j->energy);
    return SRNF_ENUMERIC;
}

int compute_encode(struct jobs_run *run, const struct srnf_context *context,
                   const struct compute_encode_inputs *inputs, struct srnf_encoded *encoded,
                   struct jobs_result *result)
{
    struct srnf_encode_options options = inputs->options;
    struct srnf_mesh mesh = {0}, sphere = {0};
    struct srnf_mesh_report report;
    struct srnf_error error = {0};
    int status = load_prepared(run, inputs, &mesh, &sphere, &report, result);

    options.sphere = inputs->sphere[0] ? &sphere : NULL;
    if (inputs->mirror) {
        options.center[0] = 0.0 - options.center[0];
    }
    if (status == 0) {
        status = srnf_encode(&mesh, &report, &options, context, encoded, &error);
        status = status < 0 ? compute_fail(result, status, &error, inputs->mesh) : 0;
        if (status == 0) {
            status = judge(run, inputs, &report, encoded, result);
            if (status) {
                srnf_free(encoded->coefficients);
                *encoded = (struct srnf_encoded){0};
            }
        }
    }
    if (status == 0 && inputs->mirror) {
        encoded->origin[0] = 0.0 - encoded->origin[0];
        encoded->star.center[0] = 0.0 - encoded->star.center[0];
    }
    srnf_mesh_clear(&sphere);
    srnf_mesh_clear(&mesh);
    return status;
}
