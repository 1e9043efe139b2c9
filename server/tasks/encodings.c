/*
 * encodings.c - the kind "encodings": surfaces of some prepared meshes (srnf_encode).
 *
 *   inputs   "srnfencd", version and number of meshes, then for each mesh the numbers of enum
 *            field in their order
 *   contents for each mesh its coordinates, double[n_vertices][3], and faces, uint32[n_faces][3];
 *            after it, where it is laid on a sphere that is given, the sphere in the same way
 *   result   for each mesh a status and the numbers of enum found, a sentence, and the
 *            coefficients; or, where the status is an error, the element and a sentence
 *
 * That a mesh cannot be encoded is a result: it is so anywhere, and what is to become of it is up
 * to the job. Memory and cancellation are no results.
 */
#include "tasks/encodings.h"
#include "tasks/internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MAGIC "srnfencd"
#define MAGIC_SIZE 8
#define VERSION 1
#define PREFIX ((size_t)MAGIC_SIZE + 16) /* before the first mesh */
#define AGREEMENT 1e-9 /* relative: figures of one surface differ by rounding alone */

/* Of a mesh. Numbers from FIELD_REALS on are doubles. */
enum field {
    FIELD_DEGREE,
    FIELD_PARAMETERIZATION,
    FIELD_CENTER_GIVEN,
    FIELD_UNIT_AREA,
    FIELD_SPHERE, /* 1: the next content is one */
    FIELD_KERNEL, /* 1: the star that follows is the kernel's */
    FIELD_STAR,   /* its value */
    FIELD_VERTICES,
    FIELD_FACES,
    FIELD_SPHERE_VERTICES,
    FIELD_SPHERE_FACES,
    FIELD_REALS,
    FIELD_CENTER = FIELD_REALS, /* three */
    FIELD_SMOOTHING = FIELD_CENTER + 3,
    FIELD_STAR_CENTER, /* three */
    FIELD_STAR_MARGIN = FIELD_STAR_CENTER + 3,
    FIELD_STAR_VIOLATING,
    FIELD_CENTROID, /* three; of the report, like the next two */
    FIELD_VOLUME = FIELD_CENTROID + 3,
    FIELD_AREA,
    FIELDS
};
#define HEAD (8 * (size_t)FIELDS)

/* ---- Inputs as bytes ------------------------------------------------------------------------- */

static void write_mesh(unsigned char *head, const struct tasks_encoding *e)
{
    const struct srnf_encode_options *o = &e->options;
    const uint64_t numbers[FIELD_REALS] = {[FIELD_DEGREE] = o->degree,
                                           [FIELD_PARAMETERIZATION] = (uint64_t)o->parameterization,
                                           [FIELD_CENTER_GIVEN] = o->center_given,
                                           [FIELD_UNIT_AREA] = o->unit_area,
                                           [FIELD_SPHERE] = e->has_sphere,
                                           [FIELD_KERNEL] = e->kernel_known,
                                           [FIELD_STAR] = e->kernel.value,
                                           [FIELD_VERTICES] = e->n_vertices[0],
                                           [FIELD_FACES] = e->n_faces[0],
                                           [FIELD_SPHERE_VERTICES] = e->n_vertices[1],
                                           [FIELD_SPHERE_FACES] = e->n_faces[1]};

    for (size_t i = 0; i < FIELD_REALS; i++) {
        tasks_put(head + 8 * i, numbers[i]);
    }
    tasks_put_point(head + 8 * FIELD_CENTER, o->center);
    tasks_put_double(head + 8 * FIELD_SMOOTHING, o->smoothing);
    tasks_put_point(head + 8 * FIELD_STAR_CENTER, e->kernel.center);
    tasks_put_double(head + 8 * FIELD_STAR_MARGIN, e->kernel.margin);
    tasks_put_double(head + 8 * FIELD_STAR_VIOLATING, e->kernel.violating_area_fraction);
    tasks_put_point(head + 8 * FIELD_CENTROID, e->centroid);
    tasks_put_double(head + 8 * FIELD_VOLUME, e->volume);
    tasks_put_double(head + 8 * FIELD_AREA, e->area);
}

int tasks_encodings_write(size_t n, const struct tasks_encoding *encodings,
                          struct tasks_bytes *inputs)
{
    *inputs = (struct tasks_bytes){.bytes = NULL};
    if (n == 0 || n > TASKS_ENCODINGS_MAX) {
        return SRNF_ELIMIT;
    }
    inputs->size = PREFIX + n * HEAD;
    inputs->bytes = malloc(inputs->size);
    if (!inputs->bytes) {
        return SRNF_ENOMEM;
    }
    memcpy(inputs->bytes, MAGIC, MAGIC_SIZE);
    tasks_put(inputs->bytes + MAGIC_SIZE, VERSION);
    tasks_put(inputs->bytes + MAGIC_SIZE + 8, n);
    for (size_t i = 0; i < n; i++) {
        write_mesh(inputs->bytes + PREFIX + i * HEAD, &encodings[i]);
    }
    return SRNF_OK;
}

static size_t number(const unsigned char *head, enum field field)
{
    return (size_t)tasks_get(head + 8 * (size_t)field);
}

static bool read_mesh(const unsigned char *head, struct tasks_encoding *e)
{
    struct srnf_encode_options *o = &e->options;

    *e = (struct tasks_encoding){
        .has_sphere = number(head, FIELD_SPHERE) == 1,
        .kernel_known = number(head, FIELD_KERNEL) == 1,
        .kernel.value = number(head, FIELD_STAR) == 1,
        .n_vertices = {number(head, FIELD_VERTICES), number(head, FIELD_SPHERE_VERTICES)},
        .n_faces = {number(head, FIELD_FACES), number(head, FIELD_SPHERE_FACES)}};
    for (enum field i = FIELD_CENTER_GIVEN; i <= FIELD_STAR; i++) {
        if (number(head, i) > 1) {
            return false;
        }
    }
    for (enum field i = FIELD_VERTICES; i <= FIELD_SPHERE_FACES; i++) {
        if (number(head, i) > UINT32_MAX) {
            return false;
        }
    }
    if (number(head, FIELD_DEGREE) > TASKS_DEGREE_MAX ||
        number(head, FIELD_PARAMETERIZATION) > SRNF_PARAMETERIZATION_GIVEN) {
        return false;
    }
    o->degree = number(head, FIELD_DEGREE);
    o->parameterization = (enum srnf_parameterization)number(head, FIELD_PARAMETERIZATION);
    o->center_given = number(head, FIELD_CENTER_GIVEN) == 1;
    o->unit_area = number(head, FIELD_UNIT_AREA) == 1;
    tasks_get_point(head + 8 * FIELD_CENTER, o->center);
    o->smoothing = tasks_get_double(head + 8 * FIELD_SMOOTHING);
    tasks_get_point(head + 8 * FIELD_STAR_CENTER, e->kernel.center);
    e->kernel.margin = tasks_get_double(head + 8 * FIELD_STAR_MARGIN);
    e->kernel.violating_area_fraction = tasks_get_double(head + 8 * FIELD_STAR_VIOLATING);
    tasks_get_point(head + 8 * FIELD_CENTROID, e->centroid);
    e->volume = tasks_get_double(head + 8 * FIELD_VOLUME);
    e->area = tasks_get_double(head + 8 * FIELD_AREA);
    return true;
}

/* How many meshes; 0: these are no such inputs. */
static size_t count_meshes(const unsigned char *inputs, size_t size)
{
    size_t n = size >= PREFIX ? (size_t)tasks_get(inputs + MAGIC_SIZE + 8) : 0;

    return size >= PREFIX && memcmp(inputs, MAGIC, MAGIC_SIZE) == 0 &&
                   tasks_get(inputs + MAGIC_SIZE) == VERSION && n <= TASKS_ENCODINGS_MAX &&
                   size == PREFIX + n * HEAD
               ? n
               : 0;
}

/* ---- Meshes as bytes ------------------------------------------------------------------------- */

size_t tasks_mesh_size(const struct srnf_mesh *mesh)
{
    return 24 * mesh->n_vertices + 12 * mesh->n_faces;
}

void tasks_put_mesh(unsigned char *bytes, const struct srnf_mesh *mesh)
{
    tasks_put_doubles(bytes, mesh->vertices, 3 * mesh->n_vertices);
    bytes += 24 * mesh->n_vertices;
    for (size_t i = 0; i < 3 * mesh->n_faces; i++) {
        for (unsigned k = 0; k < 4; k++) {
            bytes[4 * i + k] = (unsigned char)(mesh->faces[i] >> (8 * k));
        }
    }
}

/* The mesh of a content: srnf_mesh_clear, in any case. */
static int get_mesh(const struct tasks_content *content, size_t n_vertices, size_t n_faces,
                    struct srnf_mesh *mesh)
{
    const unsigned char *bytes = content->bytes;
    bool good = true;

    *mesh = (struct srnf_mesh){.n_vertices = n_vertices, .n_faces = n_faces};
    if (content->size != tasks_mesh_size(mesh) || n_vertices == 0 || n_faces == 0) {
        return SRNF_EINVAL;
    }
    mesh->vertices = srnf_alloc(3 * n_vertices, sizeof(double));
    mesh->faces = srnf_alloc(3 * n_faces, sizeof *mesh->faces);
    if (!mesh->vertices || !mesh->faces) {
        return SRNF_ENOMEM;
    }
    good = tasks_get_doubles(bytes, 3 * n_vertices, mesh->vertices);
    bytes += 24 * n_vertices;
    for (size_t i = 0; i < 3 * n_faces && good; i++) {
        for (unsigned k = 0; k < 4; k++) {
            mesh->faces[i] |= (uint32_t)bytes[4 * i + k] << (8 * k);
        }
        good = mesh->faces[i] < n_vertices;
    }
    return good ? SRNF_OK : SRNF_EINVAL;
}

/* ---- Whether results can be true ------------------------------------------------------------- */

static bool is_near(double a, double b)
{
    return isfinite(b) && fabs(a - b) <= AGREEMENT * fabs(b);
}

/* Whether the figures of a surface agree with each other and with the mesh: its area is one where
   that was asked for, its scale is positive, or one, and the ratios are those of area and
   volume. */
static bool agrees(const unsigned char *head, const struct srnf_encoded *e)
{
    double area = tasks_get_double(head + 8 * FIELD_AREA), square = e->scale * e->scale;
    double volume = tasks_get_double(head + 8 * FIELD_VOLUME);
    bool scaled = number(head, FIELD_UNIT_AREA) != 0;

    return e->measures.area > 0.0 && e->scale > 0.0 &&
           is_near(scaled ? e->measures.area : e->scale, 1.0) &&
           is_near(e->area_ratio * area, e->measures.area * square) &&
           is_near(e->volume_ratio * volume, e->measures.volume * square * e->scale);
}

/* What measures surfaces of one degree. */
struct gauge {
    struct srnf_sht *sht;
    void *workspace;
};

static void clear_gauge(struct gauge *gauge)
{
    srnf_sht_destroy(gauge->sht);
    srnf_free(gauge->workspace);
    *gauge = (struct gauge){.sht = NULL};
}

static bool prepare_gauge(struct gauge *gauge, size_t degree)
{
    if (gauge->sht && srnf_sht_degree(gauge->sht) == degree) {
        return true;
    }
    clear_gauge(gauge);
    if (srnf_sht_create(&gauge->sht, degree, SRNF_GRID_GAUSS_LEGENDRE, 0, 0)) {
        return false;
    }
    gauge->workspace = srnf_alloc(1, srnf_surface_workspace_size(gauge->sht));
    return gauge->workspace != NULL;
}

/* Whether area, volume and centroid are those of the coefficients. */
static bool is_measured(struct gauge *gauge, const struct srnf_encoded *e)
{
    struct srnf_surface_measures own;
    bool good = prepare_gauge(gauge, e->degree);

    if (good) {
        double length;

        srnf_surface_measure(gauge->sht, e->coefficients, &own, gauge->workspace);
        length = sqrt(own.area);
        good = is_near(e->measures.area, own.area) &&
               fabs(e->measures.volume - own.volume) <= AGREEMENT * own.area * length;
        for (size_t k = 0; k < 3; k++) {
            good = good && fabs(e->measures.centroid[k] - own.centroid[k]) <= AGREEMENT * length;
        }
    }
    return good;
}

static bool check_encodings(const void *inputs, size_t size, const void *result, size_t result_size)
{
    const unsigned char *heads = inputs, *at = result, *end = at + result_size;
    size_t n = count_meshes(inputs, size);
    struct gauge gauge = {.sht = NULL};
    bool good = n > 0;

    for (size_t i = 0; i < n && good; i++) {
        const unsigned char *head = heads + PREFIX + i * HEAD;
        struct tasks_encoded found;

        good = encodings_read_one(&at, end, &found) == SRNF_OK &&
               (found.status < 0 ||
                (found.encoded.degree == number(head, FIELD_DEGREE) &&
                 agrees(head, &found.encoded) && is_measured(&gauge, &found.encoded)));
        srnf_free(found.encoded.coefficients);
    }
    clear_gauge(&gauge);
    return good && at == end;
}

/* ---- Computing ------------------------------------------------------------------------------- */

/* One mesh with its contents; *used: how many. */
static int encode_one(const struct tasks_encoding *asked, const struct tasks_content *contents,
                      size_t n_contents, size_t *used, const struct srnf_context *context,
                      struct tasks_bytes *result)
{
    struct srnf_mesh_report report = {.volume = asked->volume, .area = asked->area};
    struct srnf_encode_options options = asked->options;
    struct srnf_mesh meshes[2] = {{0}, {0}};
    struct srnf_encoded encoded = {0};
    struct srnf_error error = {0};
    int status = SRNF_EINVAL;

    *used = 1 + (size_t)asked->has_sphere;
    memcpy(report.centroid, asked->centroid, sizeof report.centroid);
    if (*used > n_contents) {
        return status;
    }
    for (size_t k = 0; k < *used; k++) {
        int read = get_mesh(&contents[k], asked->n_vertices[k], asked->n_faces[k], &meshes[k]);

        status = k == 0 || status == SRNF_OK ? read : status;
    }
    if (status == SRNF_OK) {
        options.sphere = asked->has_sphere ? &meshes[1] : NULL;
        options.kernel = asked->kernel_known ? &asked->kernel : NULL;
        status = srnf_encode(&meshes[0], &report, &options, context, &encoded, &error);
        if (status == SRNF_OK) {
            status = encodings_add_surface(result, &encoded);
        } else if (encodings_is_result(status)) {
            status = encodings_add_failure(result, status, &error);
        }
    }
    srnf_free(encoded.coefficients);
    srnf_mesh_clear(&meshes[0]);
    srnf_mesh_clear(&meshes[1]);
    return status;
}

static int run_encodings(const void *inputs, size_t size, const struct tasks_content *contents,
                         size_t n_contents, const struct srnf_context *context,
                         struct tasks_bytes *result, struct srnf_error *error)
{
    const unsigned char *heads = inputs;
    size_t n = count_meshes(inputs, size), used = 0, at = 0;
    int status = n > 0 ? SRNF_OK : SRNF_EINVAL;

    (void)error;
    *result = (struct tasks_bytes){.bytes = NULL};
    for (size_t i = 0; i < n && status == SRNF_OK; i++) {
        struct tasks_encoding asked;

        status = SRNF_EINVAL;
        if (read_mesh(heads + PREFIX + i * HEAD, &asked)) {
            status = encode_one(&asked, contents + at, n_contents - at, &used, context, result);
            at += status == SRNF_OK ? used : 0;
        }
    }
    if (status == SRNF_OK && at != n_contents) {
        status = SRNF_EINVAL;
    }
    if (status) {
        free(result->bytes);
        *result = (struct tasks_bytes){.bytes = NULL};
    }
    return status;
}

const struct tasks_kind tasks_encodings_kind = {
    .name = TASKS_ENCODINGS, .run = run_encodings, .check = check_encodings};
