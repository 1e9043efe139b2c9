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

static int encode_bytes(struct jobs_run *run, const struct compute_encode_inputs *inputs,
                        const unsigned char *bytes, size_t size, enum srnf_mesh_format format,
                        struct srnf_encoded *encoded, struct jobs_result *result)
{
    const struct srnf_context *context = jobs_run_context(run);
    struct srnf_mesh mesh = {0};
    struct srnf_mesh_report report;
    struct srnf_error error = {0};
    int status = srnf_mesh_read(bytes, size, format, NULL, &mesh, NULL, &error);

    if (status) {
        return compute_fail(result, status, &error, inputs->mesh);
    }
    status = srnf_mesh_prepare(&mesh, format == SRNF_MESH_STL, &report);
    if (status == 0) {
        status = srnf_encode(&mesh, &report, &inputs->options, context, encoded, &error);
    }
    srnf_mesh_clear(&mesh);
    return status < 0 ? compute_fail(result, status, &error, inputs->mesh) : 0;
}

int compute_encode(struct jobs_run *run, const struct compute_encode_inputs *inputs,
                   struct srnf_encoded *encoded, struct jobs_result *result)
{
    struct store *store = jobs_run_store(run);
    struct store_mesh mesh = {0};
    unsigned char *bytes = NULL;
    size_t size = 0;
    int status = store_mesh_get(store, inputs->mesh, &mesh);

    if (status == 0) {
        status = store_mesh_content(store, inputs->mesh, &bytes, &size);
    }
    if (status) {
        status = compute_fail_store(result, status, inputs->mesh);
        goto out;
    }
    status = encode_bytes(run, inputs, bytes, size, srnf_mesh_format_from_name(mesh.format),
                          encoded, result);
out:
    free(bytes);
    store_mesh_clear(&mesh);
    return status;
}
