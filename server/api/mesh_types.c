/*
 * mesh_types.c - the media types of mesh formats.
 */
#include "api/handler.h"
#include "api/meshes.h"
#include "api/respond.h"

#include <stdio.h>
#include <string.h>

/* How each format is served, and the media types that say a body is in it. */
static const struct {
    const char *format, *media_type, *accepted;
} formats[] = {
    {"ply", "model/ply", "model/ply,application/ply,application/x-ply,model/x-ply"},
    {"obj", "model/obj", "model/obj,application/x-obj,text/x-obj"},
    {"off", "model/off", "model/off,application/x-off"},
    {"stl", "model/stl",
     "model/stl,application/sla,application/vnd.ms-pki.stl,model/x.stl-ascii,"
     "model/x.stl-binary"},
    {"vtk", "application/x-vtk", "application/x-vtk,model/vtk"},
    {"gii", "application/x-gifti+xml", "application/x-gifti+xml,model/gifti"},
    {"freesurfer", "application/x-freesurfer-surface", "application/x-freesurfer-surface"},
    {"glb", "model/gltf-binary", "model/gltf-binary"},
    {"gltf", "model/gltf+json", "model/gltf+json"},
    {"vtp", "application/x-vtp", "application/x-vtp,model/vtp"},
    {"mz3", "application/x-mz3", "application/x-mz3"},
    {"gmsh", "application/x-gmsh", "application/x-gmsh"},
    {"freesurfer-ascii", "text/plain", ""},
    {"byu", "text/plain", ""},
    {"mni-obj", "application/octet-stream", ""},
    {"brainvisa", "application/octet-stream", ""},
};

/* Types that say nothing about the format: it is told from the bytes. curl --data-binary sends the
   third. */
static const char sniffed[] = "application/octet-stream,text/plain,application/"
                              "x-www-form-urlencoded,application/xml,text/xml,"
                              "application/gzip,application/x-gzip,model/mesh";

const char *mesh_media_type(const char *format)
{
    for (size_t i = 0; i < sizeof formats / sizeof formats[0]; i++) {
        if (strcmp(formats[i].format, format) == 0) {
            return formats[i].media_type;
        }
    }
    return "application/octet-stream";
}

void mesh_formats_named(char text[MESH_FORMATS_TEXT])
{
    const size_t count = sizeof formats / sizeof formats[0];
    size_t at = 0;

    for (size_t i = 0; i < count && at < MESH_FORMATS_TEXT; i++) {
        const char *before = i == 0 ? "" : i + 1 < count ? ", " : " or ";

        at +=
            (size_t)snprintf(text + at, MESH_FORMATS_TEXT - at, "%s%s", before, formats[i].format);
    }
}

/* NULL where the media type names none. */
static const char *format_of(const char *type)
{
    for (size_t i = 0; i < sizeof formats / sizeof formats[0]; i++) {
        if (list_has(formats[i].accepted, type)) {
            return formats[i].format;
        }
    }
    return NULL;
}

static bool type_copy(char type[96], const char *value, size_t length)
{
    if (length >= 96) {
        return false;
    }
    memcpy(type, value, length);
    type[length] = '\0';
    return true;
}

bool mesh_type_known(const char *value, size_t length)
{
    char type[96];

    return type_copy(type, value, length) && (list_has(sniffed, type) || format_of(type));
}

const char *mesh_type_format(const char *value, size_t length)
{
    char type[96];

    return type_copy(type, value, length) ? format_of(type) : NULL;
}
