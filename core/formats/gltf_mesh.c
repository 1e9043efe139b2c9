/*
 * gltf_mesh.c - meshes and primitives of a glTF document (see gltf.h).
 *
 * Each is read once, whatever the number of nodes that show it, and what shows nothing is left out:
 * so the vertices and triangles that are shown, which the limits bound, bound the time. Source:
 * Khronos Group, "glTF 2.0 Specification", 3.7.2.
 */
#include "gltf.h"

/* What changes the shape and is not read. */
static int check_primitive(struct gltf *gltf, uint32_t primitive)
{
    const struct json *json = &gltf->json;
    uint32_t extensions = json_member(json, primitive, "extensions");
    const char *what = NULL;

    if (json_member(json, extensions, "KHR_draco_mesh_compression") != JSON_NONE) {
        what = "it is compressed by Draco; export it without compression";
    } else if (json_length(json, json_member(json, primitive, "targets")) > 0) {
        what = "it has morph targets; apply the shape and export it without them";
    }
    return what ? srnf_fail(gltf->reader->error, SRNF_EFORMAT, -1, "glTF primitive: %s", what)
                : SRNF_OK;
}

/* Triangles of so many corners. */
static size_t count_triangles(size_t mode, size_t corners)
{
    return mode == GLTF_MODE_TRIANGLES ? corners / 3 : corners - (corners < 2 ? corners : 2);
}

/* What the primitive shows; *shown is false where that is nothing. */
static int read_primitive(struct gltf *gltf, uint32_t entry, struct gltf_primitive *primitive,
                          bool *shown)
{
    const struct json *json = &gltf->json;
    struct mesh_reader *reader = gltf->reader;
    uint32_t position = json_member(json, json_member(json, entry, "attributes"), "POSITION");
    uint32_t indices = json_member(json, entry, "indices");
    size_t number = 0;
    int status = check_primitive(gltf, entry);

    *shown = false;
    *primitive = (struct gltf_primitive){.mode = GLTF_MODE_TRIANGLES};
    if (status != SRNF_OK) {
        return status;
    }
    if (!json_count(json, json_member(json, entry, "mode"), &primitive->mode) ||
        !json_count(json, position, &number)) {
        return srnf_fail(reader->error, SRNF_EPARSE, -1,
                         "glTF primitive: its mode or its positions are no number");
    }
    if (primitive->mode < GLTF_MODE_TRIANGLES || primitive->mode > GLTF_MODE_FAN ||
        position == JSON_NONE) {
        return SRNF_OK; /* points or lines */
    }
    status = gltf_accessor_of(gltf, number, "VEC3", &primitive->positions);
    if (status == SRNF_OK && indices != JSON_NONE) {
        primitive->indexed = true;
        status = json_count(json, indices, &number)
                     ? gltf_accessor_of(gltf, number, "SCALAR", &primitive->indices)
                     : srnf_fail(reader->error, SRNF_EPARSE, -1,
                                 "glTF primitive: its indices are no number");
    }
    primitive->triangles =
        count_triangles(primitive->mode,
                        primitive->indexed ? primitive->indices.count : primitive->positions.count);
    *shown = primitive->positions.count > 0 || primitive->triangles > 0;
    return status;
}

/* Reads the primitives of a mesh; without room for them, counts those that show something. */
static int read_primitives(struct gltf *gltf, uint32_t primitives, struct gltf_mesh *mesh)
{
    const struct json *json = &gltf->json;
    int status = SRNF_OK;

    mesh->n = 0;
    for (uint32_t at = json_first(json, primitives); at != JSON_NONE && status == SRNF_OK;
         at = json_next(json, primitives, at)) {
        struct gltf_primitive primitive;
        bool shown;

        status = read_primitive(gltf, at, &primitive, &shown);
        if (status == SRNF_OK && shown) {
            if (mesh->primitives) {
                mesh->primitives[mesh->n] = primitive;
            }
            mesh->n++;
        }
        status = status == SRNF_OK ? mesh_step(gltf->reader) : status;
    }
    return status;
}

int gltf_mesh_of(struct gltf *gltf, size_t number, const struct gltf_mesh **mesh)
{
    struct mesh_reader *reader = gltf->reader;
    uint32_t entry = gltf_entry(gltf, GLTF_MESHES, number);
    uint32_t primitives = json_member(&gltf->json, entry, "primitives");
    struct gltf_mesh *found;
    int status = SRNF_OK;

    if (entry == JSON_NONE) {
        return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)number, "glTF: there is no mesh %zu",
                         number);
    }
    if (!gltf->meshes) {
        gltf->meshes = mesh_alloc(reader, gltf->tables[GLTF_MESHES].n, sizeof *gltf->meshes);
        if (!gltf->meshes) {
            return reader->status;
        }
    }
    found = &gltf->meshes[number];
    if (!found->known) {
        status = read_primitives(gltf, primitives, found);
        if (status == SRNF_OK && found->n > 0) {
            found->room = found->n;
            found->primitives = mesh_alloc(reader, found->room, sizeof *found->primitives);
            status = found->primitives ? read_primitives(gltf, primitives, found) : reader->status;
        }
        found->known = status == SRNF_OK;
    }
    *mesh = found;
    return status;
}

void gltf_meshes_close(struct gltf *gltf)
{
    size_t n = gltf->tables[GLTF_MESHES].n;

    for (size_t i = 0; gltf->meshes && i < n; i++) {
        mesh_release(gltf->reader, gltf->meshes[i].primitives, gltf->meshes[i].room,
                     sizeof *gltf->meshes[i].primitives);
    }
    mesh_release(gltf->reader, gltf->meshes, n, sizeof *gltf->meshes);
}
