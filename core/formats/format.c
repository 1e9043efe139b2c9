/*
 * format.c - the table of mesh formats, and the functions of srnf.h that walk it: names,
 * sniffing, reading, writing.
 *
 * Sniffing asks each row in order, and the order is the rule: formats with a magic word come
 * first, STL (known by its size when it is binary) and OBJ (known only by the look of its lines)
 * last. What is no mesh but is often sent by mistake (a web page, an archive) is named in the error
 * instead of guessed at (strangers.c).
 */
#include "formats.h"
#include "pack.h"
#include "polygon.h"

#include <math.h>
#include <string.h>

#define ALIASES_MAX 6
#define FIELD_NAME_MAX 64
#define TEXT_MAX 400
#define PACKED_PROBE ((size_t)1 << 16)

static const struct format {
    enum srnf_mesh_format format;
    const char *name;
    const char *aliases[ALIASES_MAX];
    mesh_sniff_function *sniff;
    mesh_read_function *read;   /* NULL: written only */
    mesh_write_function *write; /* NULL: read only */
} formats[] = {
    {SRNF_MESH_PLY, "ply", {"model/ply"}, mesh_sniff_ply, mesh_read_ply, mesh_write_ply},
    {SRNF_MESH_VTK, "vtk", {"model/vtk"}, mesh_sniff_vtk, mesh_read_vtk, mesh_write_vtk},
    {SRNF_MESH_GIFTI,
     "gii",
     {"gifti", "surf.gii", "gii.gz64", "model/gifti"},
     mesh_sniff_gifti,
     mesh_read_gifti,
     mesh_write_gifti},
    {SRNF_MESH_FREESURFER,
     "freesurfer",
     {"fs", "fsurf", "model/freesurfer"},
     mesh_sniff_freesurfer,
     mesh_read_freesurfer,
     NULL},
    {SRNF_MESH_MZ3, "mz3", {"model/mz3"}, mesh_sniff_mz3, mesh_read_mz3, NULL},
    {SRNF_MESH_FREESURFER_ASCII,
     "freesurfer-ascii",
     {"asc", "fsascii"},
     mesh_sniff_fsascii,
     mesh_read_fsascii,
     NULL},
    {SRNF_MESH_GMSH, "gmsh", {"msh", "model/gmsh"}, mesh_sniff_gmsh, mesh_read_gmsh, NULL},
    {SRNF_MESH_BRAINVISA, "brainvisa", {"mesh"}, mesh_sniff_brainvisa, mesh_read_brainvisa, NULL},
    {SRNF_MESH_MNI_OBJ, "mni-obj", {"mniobj"}, mesh_sniff_mniobj, mesh_read_mniobj, NULL},
    {SRNF_MESH_OFF, "off", {"coff", "noff", "model/off"}, mesh_sniff_off, mesh_read_off, NULL},
    {SRNF_MESH_STL,
     "stl",
     {"model/stl", "model/x.stl-binary", "model/x.stl-ascii", "application/sla"},
     mesh_sniff_stl,
     mesh_read_stl,
     mesh_write_stl},
    {SRNF_MESH_OBJ,
     "obj",
     {"wavefront", "model/obj"},
     mesh_sniff_obj,
     mesh_read_obj,
     mesh_write_obj},
    {SRNF_MESH_GLB, "glb", {"model/gltf-binary"}, mesh_sniff_glb, mesh_read_glb, mesh_write_glb},
    {SRNF_MESH_BYU, "byu", {"g"}, mesh_sniff_byu, mesh_read_byu, NULL},
    {SRNF_MESH_GLTF, "gltf", {"model/gltf+json"}, mesh_sniff_gltf, mesh_read_gltf, NULL},
    {SRNF_MESH_VTP, "vtp", {"model/vtp"}, mesh_sniff_vtp, mesh_read_vtp, mesh_write_vtp},
};
#define FORMAT_COUNT (sizeof formats / sizeof formats[0])

struct srnf_mesh_limits srnf_mesh_limits_defaults(void)
{
    struct srnf_mesh_limits limits = {
        .max_vertices = 4000000,
        .max_faces = 8000000,
        .max_memory = (size_t)1 << 30,
    };

    return limits;
}

static const struct format *find_format(enum srnf_mesh_format format)
{
    for (size_t i = 0; i < FORMAT_COUNT; i++) {
        if (formats[i].format == format) {
            return &formats[i];
        }
    }
    return NULL;
}

const char *srnf_mesh_format_name(enum srnf_mesh_format format)
{
    const struct format *row = find_format(format);

    return row ? row->name : "unknown";
}

enum srnf_mesh_format srnf_mesh_format_from_name(const char *name)
{
    struct token token;

    if (!name) {
        return SRNF_MESH_UNKNOWN;
    }
    token.text = (const unsigned char *)name;
    token.size = strlen(name);
    for (size_t i = 0; i < FORMAT_COUNT; i++) {
        if (token_is(token, formats[i].name)) {
            return formats[i].format;
        }
        for (size_t k = 0; k < ALIASES_MAX && formats[i].aliases[k]; k++) {
            if (token_is(token, formats[i].aliases[k])) {
                return formats[i].format;
            }
        }
    }
    return SRNF_MESH_UNKNOWN;
}

static enum srnf_mesh_format sniff(const unsigned char *bytes, size_t size)
{
    for (size_t i = 0; i < FORMAT_COUNT; i++) {
        if (formats[i].sniff && formats[i].sniff(bytes, size)) {
            return formats[i].format;
        }
    }
    return SRNF_MESH_UNKNOWN;
}

/* Of what is packed by gzip the first bytes are unpacked. Binary STL, which is known by its size,
   is known by the size that the packed file says that it has. */
static enum srnf_mesh_format sniff_packed(const unsigned char *bytes, size_t size)
{
    enum srnf_mesh_format format = SRNF_MESH_UNKNOWN;
    unsigned char *first = srnf_alloc(PACKED_PROBE, 1);
    size_t n, total = 0;

    if (first) {
        n = pack_peek(bytes, size, first, PACKED_PROBE, &total);
        format = sniff(first, n);
        if (format == SRNF_MESH_UNKNOWN && mesh_is_stl_of(first, n, total)) {
            format = SRNF_MESH_STL;
        }
    }
    srnf_free(first);
    return format;
}

enum srnf_mesh_format srnf_mesh_sniff(const void *bytes, size_t size)
{
    if (!bytes) {
        return SRNF_MESH_UNKNOWN;
    }
    return pack_is_gzip(bytes, size) ? sniff_packed(bytes, size) : sniff(bytes, size);
}

/* The row to read with, or NULL with the status and the error set. */
static const struct format *choose_format(struct mesh_reader *reader, enum srnf_mesh_format format)
{
    const struct format *row;
    const char *message = NULL, *kind;

    if (format != SRNF_MESH_UNKNOWN && !find_format(format)) {
        reader->status = srnf_fail(reader->error, SRNF_EINVAL, -1, "there is no such mesh format");
        return NULL;
    }
    if (format == SRNF_MESH_UNKNOWN) {
        format = srnf_mesh_sniff(reader->bytes, reader->size);
    }
    row = find_format(format);
    if (!row || !row->sniff || !row->sniff(reader->bytes, reader->size)) {
        message = mesh_stranger(reader->bytes, reader->size, &kind);
    }
    if (!message && !row && mesh_is_cut_stl(reader->bytes, reader->size)) {
        message =
            "the bytes are in no known mesh format; if they are binary STL, bytes are missing "
            "at the end or too many: the size does not fit the number of triangles";
    }
    if (!message && !row) {
        message = "the bytes are in no known mesh format (PLY, OBJ, OFF, STL, VTK, VTP, GIfTI, "
                  "FreeSurfer, GLB, glTF, MZ3, BYU, MNI obj, Gmsh, BrainVISA)";
    }
    if (!message && !row->read) {
        message = "this format is written, not read";
    }
    if (message) {
        reader->status = srnf_fail(reader->error, SRNF_EFORMAT, -1, "%s", message);
        return NULL;
    }
    return row;
}

static int check_not_empty(struct mesh_reader *reader)
{
    if (reader->mesh.n_vertices == 0) {
        return srnf_fail(reader->error, SRNF_EPARSE, -1, "the file has no vertices");
    }
    if (reader->mesh.n_faces == 0) {
        return srnf_fail(reader->error, SRNF_EPARSE, -1, "the file has vertices but no faces");
    }
    return SRNF_OK;
}

int srnf_mesh_read(const void *bytes, size_t size, enum srnf_mesh_format format,
                   const struct srnf_mesh_limits *limits, struct srnf_mesh *mesh,
                   struct srnf_mesh_read_info *info, struct srnf_error *error)
{
    struct mesh_reader reader;
    const struct format *row;
    int status;

    memset(&reader, 0, sizeof reader);
    memset(mesh, 0, sizeof *mesh);
    reader.bytes = bytes ? bytes : (const unsigned char *)"";
    reader.size = bytes ? size : 0;
    reader.limits = limits ? *limits : srnf_mesh_limits_defaults();
    reader.error = error;
    reader.locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    if (!reader.locale) {
        return srnf_fail(error, SRNF_ENOMEM, -1, "not enough memory");
    }
    status = pack_open(&reader);
    row = status == SRNF_OK ? choose_format(&reader, format) : NULL;
    if (status == SRNF_OK) {
        status = row ? row->read(&reader) : reader.status;
    }
    if (status == SRNF_OK) {
        status = check_not_empty(&reader);
    }
    if (status == SRNF_OK) {
        status = mesh_cut_polygons(&reader);
    }
    mesh_release(&reader, reader.polygons, reader.polygon_capacity, sizeof *reader.polygons);
    if (mesh_ask(&reader)) { /* loops that broke off have left what they made unfinished */
        status = SRNF_ECANCELED;
    }
    if (status == SRNF_OK) {
        *mesh = reader.mesh;
        if (info) {
            *info = reader.info;
            info->format = row->format;
        }
    } else {
        srnf_mesh_clear(&reader.mesh);
    }
    pack_close(&reader);
    freelocale(reader.locale);
    return status;
}

/* ---- Writing --------------------------------------------------------------------------------- */

static bool all_finite(const double *values, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        if (!isfinite(values[i])) {
            return false;
        }
    }
    return true;
}

/* NULL, or one line that needs no quoting in any of the formats. */
static bool is_text(const char *text)
{
    size_t n = text ? strlen(text) : 0;

    for (size_t i = 0; i < n; i++) {
        if (text[i] < ' ' || text[i] > '~' || strchr("\"\\<>&", text[i])) {
            return false;
        }
    }
    return n <= TEXT_MAX;
}

static bool is_field_name(const char *name)
{
    static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_";
    static const char *const taken[] = {"x", "y", "z", "nx", "ny", "nz"};
    struct token token;

    if (!name || name[0] == '\0' || strlen(name) > FIELD_NAME_MAX ||
        strspn(name, letters) != strlen(name)) {
        return false;
    }
    token.text = (const unsigned char *)name;
    token.size = strlen(name);
    for (size_t i = 0; i < sizeof taken / sizeof taken[0]; i++) {
        if (token_is(token, taken[i])) {
            return false;
        }
    }
    return true;
}

static bool are_fields(const struct srnf_mesh_field *fields, size_t n_fields, size_t n_vertices)
{
    for (size_t i = 0; i < n_fields; i++) {
        if (!is_field_name(fields[i].name) || !all_finite(fields[i].values, n_vertices) ||
            !is_text(fields[i].unit) || !is_text(fields[i].meaning)) {
            return false;
        }
        for (size_t k = 0; k < i; k++) {
            struct token other = {(const unsigned char *)fields[k].name, strlen(fields[k].name)};

            if (token_is(other, fields[i].name)) {
                return false;
            }
        }
    }
    return true;
}

static bool is_mesh(const struct srnf_mesh *mesh)
{
    for (size_t i = 0; i < 3 * mesh->n_faces; i++) {
        if (mesh->faces[i] >= mesh->n_vertices) {
            return false;
        }
    }
    return mesh->n_vertices > 0 && mesh->n_faces > 0 && mesh->n_vertices <= INT32_MAX &&
           mesh->n_faces <= INT32_MAX && all_finite(mesh->vertices, 3 * mesh->n_vertices);
}

int mesh_print_description(const struct mesh_output *output, const char *before)
{
    const struct srnf_mesh_description *d = &output->description;
    const char *const lines[3][2] = {
        {"name", d->name}, {"space", d->space}, {"comment", d->comment}};
    int status = SRNF_OK;

    for (size_t i = 0; i < 3 && status == SRNF_OK; i++) {
        if (lines[i][1]) {
            status =
                mesh_buffer_print(output->out, "%s %s: %s\n", before, lines[i][0], lines[i][1]);
        }
    }
    return status;
}

int srnf_mesh_write(const struct srnf_mesh *mesh, enum srnf_mesh_format format,
                    const double *normals, const struct srnf_mesh_field *fields, size_t n_fields,
                    struct srnf_buffer *out)
{
    return srnf_mesh_write_described(mesh, format, normals, fields, n_fields, NULL, out);
}

int srnf_mesh_write_described(const struct srnf_mesh *mesh, enum srnf_mesh_format format,
                              const double *normals, const struct srnf_mesh_field *fields,
                              size_t n_fields, const struct srnf_mesh_description *description,
                              struct srnf_buffer *out)
{
    const struct srnf_mesh_description nothing = {NULL, NULL, NULL};
    const struct format *row = find_format(format);
    const struct mesh_output output = {
        mesh, normals, fields, n_fields, description ? *description : nothing, out};
    size_t before = out->size;
    int status;

    if (!row || !row->write || !is_mesh(mesh) || !are_fields(fields, n_fields, mesh->n_vertices) ||
        (normals && !all_finite(normals, 3 * mesh->n_vertices)) ||
        !is_text(output.description.name) || !is_text(output.description.space) ||
        !is_text(output.description.comment)) {
        return SRNF_EINVAL;
    }
    status = row->write(&output);
    if (status != SRNF_OK) {
        out->size = before;
    }
    return status;
}
