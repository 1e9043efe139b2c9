/*
 * mesh_export.c - meshes as answers (see mesh_export.h).
 *
 * A format may have several media types. Accept is held against all of them, those that are served
 * by default first, and the answer has the one that was liked best.
 */
#include "api/mesh_export.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "api/respond.h"
#include "api/surfaces.h"
#include "compute/compute.h"

static const struct mesh_export exports[] = {
    {"ply", "model/ply"},
    {"obj", "model/obj"},
    {"stl", "model/stl"},
    {"vtk", "application/x-vtk"},
    {"vtp", "application/x-vtp"},
    {"gii", "application/x-gifti+xml"},
    {"glb", "model/gltf-binary"},
    {"positions", "application/octet-stream"},
    /* Other names of the same. */
    {"ply", "application/ply"},
    {"ply", "application/x-ply"},
    {"ply", "model/x-ply"},
    {"stl", "application/sla"},
    {"stl", "application/vnd.ms-pki.stl"},
    {"stl", "model/x.stl-binary"},
    {"vtk", "model/vtk"},
    {"vtp", "model/vtp"},
    {"gii", "model/gifti"},
};
#define EXPORTS (sizeof exports / sizeof exports[0])
#define FORMATS "ply, obj, stl, vtk, vtp, gii, glb or positions"

bool mesh_export_choose(struct api_call *call, struct mesh_export *choice)
{
    struct problem_list list = {.errors = NULL};
    const char *types[EXPORTS + 1] = {NULL};
    bool refused = false;
    char text[16];
    int best;

    if (query_get(call, "format", text, sizeof text, &refused)) {
        for (size_t i = 0; i < EXPORTS; i++) {
            if (strcmp(text, exports[i].format) == 0) {
                *choice = exports[i];
                return true;
            }
        }
        problem_add(&list, "/format", "format must be " FORMATS);
        (void)problem_respond_list(call, "invalid-input", &list);
        return false;
    }
    if (refused) {
        return false;
    }
    for (size_t i = 0; i < EXPORTS; i++) {
        types[i] = exports[i].media_type;
    }
    best = accept_best(call->request, types);
    if (best < 0) {
        (void)problem_respond(
            call, "not-acceptable",
            "This is served as %s, %s, %s, %s, %s, %s, %s and %s; ?format= (" FORMATS
            ") chooses, too.",
            types[0], types[1], types[2], types[3], types[4], types[5], types[6], types[7]);
        return false;
    }
    *choice = exports[best];
    return true;
}

size_t mesh_export_resolution(struct api_call *call, size_t degree)
{
    double harmonics = (double)srnf_coefficient_count(degree), limit;
    bool refused = false;
    struct problem_list list = {.errors = NULL};
    char text[32];
    long number = SURFACE_RESOLUTION_DEFAULT;

    /* 10 r^2 vertices times the harmonics is the work. */
    limit = floor(sqrt(SURFACE_MESH_WORK_MAX / harmonics / 10.0));
    if (limit > SURFACE_RESOLUTION_MAX) {
        limit = SURFACE_RESOLUTION_MAX;
    }
    if (query_get(call, "resolution", text, sizeof text, &refused)) {
        if (!query_whole(text, &number) || number < 1 || (double)number > limit) {
            problem_add(&list, "/resolution",
                        "resolution must be a whole number from 1 to %.0f for a surface of degree "
                        "%zu",
                        limit, degree);
            (void)problem_respond_list(call, "invalid-input", &list);
            return 0;
        }
    }
    return refused ? 0 : (size_t)number;
}

/* As bytes in the order that browsers' arrays have on all machines of today. */
static int write_positions(const struct srnf_mesh *mesh, struct srnf_buffer *out)
{
    size_t count = 3 * mesh->n_vertices;
    unsigned char *bytes = srnf_alloc(count, sizeof(float));

    for (size_t i = 0; bytes && i < count; i++) {
        float value = (float)mesh->vertices[i];
        uint32_t bits;

        memcpy(&bits, &value, sizeof bits);
        for (unsigned k = 0; k < 4; k++) {
            bytes[4 * i + k] = (unsigned char)(bits >> (8 * k));
        }
    }
    out->data = bytes;
    out->size = count * sizeof(float);
    return bytes ? 0 : SRNF_ENOMEM;
}

void mesh_export_respond(struct api_call *call, const struct mesh_export *choice, const char *id,
                         const struct srnf_mesh *mesh, const double *normals,
                         const struct srnf_mesh_field *fields, size_t n_fields,
                         const struct srnf_mesh_description *description)
{
    struct srnf_buffer buffer = {0};
    unsigned char *bytes = NULL;
    int status = strcmp(choice->format, "positions") == 0
                     ? write_positions(mesh, &buffer)
                     : srnf_mesh_write_described(mesh, srnf_mesh_format_from_name(choice->format),
                                                 normals, fields, n_fields, description, &buffer);

    /* The buffer is the core's; a response owns memory of malloc. */
    bytes = status == 0 ? malloc(buffer.size ? buffer.size : 1) : NULL;
    if (bytes) {
        memcpy(bytes, buffer.data, buffer.size);
        (void)api_response_header(call->response, "Content-Disposition",
                                  "attachment; filename=\"%s.%s\"", id, choice->format);
        respond_bytes(call, 200, choice->media_type, bytes, buffer.size);
    } else {
        status = status ? status : SRNF_ENOMEM;
        if (status == SRNF_EINVAL) {
            (void)problem_respond(call, "invalid-input",
                                  "Coordinates or values are beyond the range of %s.",
                                  choice->format);
        } else {
            (void)problem_respond(call, compute_problem_code(status), "%s.", srnf_strerror(status));
        }
    }
    srnf_buffer_clear(&buffer);
}
