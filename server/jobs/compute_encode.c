/*
 * compute_encode.c - reads a stored mesh again and encodes it.
 *
 * The mesh is parsed and prepared afresh: the store keeps the original bytes only, and reading
 * 6,000 faces takes a few milliseconds. Parsing was found possible at the upload, so a failure
 * here means other limits or damage, and is reported like any other. Vertices are merged where
 * the format has none to share (STL).
 */
#include "jobs/compute_encode.h"

#include <stdlib.h>

#include "jobs/compute.h"

int compute_mesh_load(struct jobs_run *run, const char *id, bool mirror, struct srnf_mesh *mesh,
                      struct srnf_mesh_report *report, struct jobs_result *result)
{
    struct store *store = jobs_run_store(run);
    struct store_mesh row = {0};
    struct srnf_error error = {0};
    enum srnf_mesh_format format;
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
    format = srnf_mesh_format_from_name(row.format);
    status = srnf_mesh_read(bytes, size, format, NULL, mesh, NULL, &error);
    if (status == 0) {
        if (mirror) {
            srnf_mesh_mirror(mesh);
        }
        status = srnf_mesh_prepare(mesh, format == SRNF_MESH_STL, report);
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

int compute_encode(struct jobs_run *run, const struct srnf_context *context,
                   const struct compute_encode_inputs *inputs, struct srnf_encoded *encoded,
                   struct jobs_result *result)
{
    struct srnf_encode_options options = inputs->options;
    struct srnf_mesh mesh = {0}, sphere = {0};
    struct srnf_mesh_report report, of_sphere;
    struct srnf_error error = {0};
    int status = compute_mesh_load(run, inputs->mesh, inputs->mirror, &mesh, &report, result);

    if (status) {
        return status;
    }
    if (inputs->sphere[0]) {
        status =
            compute_mesh_load(run, inputs->sphere, inputs->mirror, &sphere, &of_sphere, result);
        options.sphere = &sphere;
    }
    if (inputs->mirror) {
        options.center[0] = 0.0 - options.center[0];
    }
    if (status == 0) {
        status = srnf_encode(&mesh, &report, &options, context, encoded, &error);
        status = status < 0 ? compute_fail(result, status, &error, inputs->mesh) : 0;
    }
    if (status == 0 && inputs->mirror) {
        encoded->origin[0] = 0.0 - encoded->origin[0];
        encoded->star.center[0] = 0.0 - encoded->star.center[0];
    }
    srnf_mesh_clear(&sphere);
    srnf_mesh_clear(&mesh);
    return status;
}
