/*
 * prepared.c - meshes are parsed, welded, repaired and measured once, and their kernels solved: at
 * the upload, whose result is kept for the jobs after it (store/prepared.c).
 *
 * A mirrored mesh and a mesh with a sphere are prepared otherwise: they are kept by themselves, at
 * first need. So is what was evicted, damaged or left by another build. The name covers the owner,
 * so that nobody learns from a fast answer what others have, and the numeric build.
 *
 * What is kept is the struct head of this build, and for mesh and sphere the coordinates and the
 * indices. Coordinates are in single precision where all of them fit into it, as those of most
 * files do: the mesh has the same bits in any case.
 *
 * Parsing was found possible at the upload, so a failure here means other limits or damage, and is
 * reported like any other.
 */
#include "compute/prepared.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "compute/compute.h"
#include "store/mesh.h"
#include "store/prepared.h"

#define MESHES ((size_t)2) /* the mesh and its sphere */

struct head {
    struct srnf_mesh_report report;
    struct srnf_star kernel;
    bool kernel_known, untransformed;
    bool single[MESHES];
    size_t n_vertices[MESHES], n_faces[MESHES];
};

void compute_prepared_clear(struct compute_prepared *prepared)
{
    srnf_mesh_clear(&prepared->mesh);
    srnf_mesh_clear(&prepared->sphere);
    *prepared = (struct compute_prepared){.kernel_known = false};
}

int compute_prepare(struct compute_prepared *prepared, const struct srnf_context *context,
                    int *kernel_status)
{
    bool pair = prepared->sphere.n_vertices > 0;
    int status = pair ? srnf_mesh_prepare_pair_within(&prepared->mesh, &prepared->sphere, context,
                                                      &prepared->report)
                      : srnf_mesh_prepare_within(&prepared->mesh, true, context, &prepared->report);

    *kernel_status = SRNF_OK;
    prepared->kernel_known = false;
    if (status == SRNF_OK && prepared->report.n_problems == 0) {
        *kernel_status = srnf_star_kernel_within(&prepared->mesh, context, &prepared->kernel);
        prepared->kernel_known = *kernel_status == SRNF_OK;
    }
    return status;
}

/* ---- Writing --------------------------------------------------------------------------------- */

/* The coordinates in single precision, srnf_free; NULL where they do not fit, or without memory. */
static float *in_single(const struct srnf_mesh *mesh)
{
    size_t n = 3 * mesh->n_vertices;
    float *single;

    for (size_t i = 0; i < n; i++) {
        if ((double)(float)mesh->vertices[i] != mesh->vertices[i]) {
            return NULL;
        }
    }
    single = n ? srnf_alloc(n, sizeof *single) : NULL;
    for (size_t i = 0; single && i < n; i++) {
        single[i] = (float)mesh->vertices[i];
    }
    return single;
}

/* The key's last part; false without memory. */
static bool write_made(struct jobs *jobs, const char *owner, bool mirror, char **made)
{
    return asprintf(made, "%s\n%s\n%d", owner, jobs_numeric_build(jobs), mirror) >= 0;
}

static void keep(struct store *store, const struct store_prepared_key *key,
                 const struct compute_prepared *prepared)
{
    const struct srnf_mesh *meshes[MESHES] = {&prepared->mesh, &prepared->sphere};
    struct store_part parts[1 + 2 * MESHES];
    float *single[MESHES];
    struct head *head = calloc(1, sizeof *head);

    if (!head) {
        return;
    }
    head->report = prepared->report;
    head->untransformed = prepared->untransformed;
    head->kernel_known = prepared->kernel_known;
    if (prepared->kernel_known) {
        head->kernel = prepared->kernel;
    }
    parts[0] = (struct store_part){head, sizeof *head};
    for (size_t k = 0; k < MESHES; k++) {
        const struct srnf_mesh *mesh = meshes[k];

        single[k] = in_single(mesh);
        head->single[k] = single[k] != NULL;
        head->n_vertices[k] = mesh->n_vertices;
        head->n_faces[k] = mesh->n_faces;
        parts[1 + 2 * k] = (struct store_part){
            single[k] ? (const void *)single[k] : (const void *)mesh->vertices,
            3 * mesh->n_vertices * (single[k] ? sizeof(float) : sizeof(double))};
        parts[2 + 2 * k] =
            (struct store_part){mesh->faces, 3 * mesh->n_faces * sizeof *mesh->faces};
    }
    (void)store_prepared_put(store, key, parts, sizeof parts / sizeof parts[0]);
    for (size_t k = 0; k < MESHES; k++) {
        srnf_free(single[k]);
    }
    free(head);
}

void compute_prepared_keep(struct jobs *jobs, struct store *store, const char *owner,
                           const char *mesh, const struct compute_prepared *prepared)
{
    struct store_prepared_key key = {.mesh = mesh, .sphere = ""};
    char *made;

    if (prepared->report.n_problems == 0 && write_made(jobs, owner ? owner : "", false, &made)) {
        key.made = made;
        keep(store, &key, prepared);
        free(made);
    }
}

/* ---- Reading --------------------------------------------------------------------------------- */

/* What is left of a value that is read. */
struct rest {
    const unsigned char *bytes;
    size_t size;
};

/* NULL where there is less. */
static const void *take(struct rest *rest, size_t count, size_t size)
{
    const unsigned char *bytes = rest->bytes;

    if (size == 0 || count > rest->size / size) {
        return NULL;
    }
    rest->bytes += count * size;
    rest->size -= count * size;
    return bytes;
}

/* An array of the core with these bytes, or *status. */
static void *copy(const void *bytes, size_t count, size_t size, int *status)
{
    void *array = bytes ? srnf_alloc(count, size) : NULL;

    if (!array) {
        *status = bytes ? SRNF_ENOMEM : SRNF_EFORMAT;
    } else if (count > 0) {
        memcpy(array, bytes, count * size);
    }
    return array;
}

static int read_mesh(struct rest *rest, const struct head *head, size_t which,
                     struct srnf_mesh *mesh)
{
    size_t n = 3 * head->n_vertices[which], corners = 3 * head->n_faces[which];
    const unsigned char *single;
    int status = SRNF_OK;

    *mesh =
        (struct srnf_mesh){.n_vertices = head->n_vertices[which], .n_faces = head->n_faces[which]};
    if (head->single[which]) {
        single = take(rest, n, sizeof(float));
        mesh->vertices = single ? srnf_alloc(n, sizeof(double)) : NULL;
        status = !single ? SRNF_EFORMAT : mesh->vertices ? SRNF_OK : SRNF_ENOMEM;
        for (size_t i = 0; status == SRNF_OK && i < n; i++) {
            float value;

            memcpy(&value, single + i * sizeof value, sizeof value);
            mesh->vertices[i] = (double)value;
        }
    } else {
        mesh->vertices = copy(take(rest, n, sizeof(double)), n, sizeof(double), &status);
    }
    if (status == SRNF_OK) {
        mesh->faces =
            copy(take(rest, corners, sizeof(uint32_t)), corners, sizeof(uint32_t), &status);
    }
    for (size_t c = 0; status == SRNF_OK && c < corners; c++) {
        status = mesh->faces[c] < mesh->n_vertices ? SRNF_OK : SRNF_EFORMAT;
    }
    return status;
}

/* SRNF_EFORMAT: the value is none. */
static int read_value(const unsigned char *value, size_t size, struct compute_prepared *prepared)
{
    struct rest rest = {value, size};
    const void *bytes = take(&rest, 1, sizeof(struct head));
    struct head *head = malloc(sizeof *head);
    int status = !head ? SRNF_ENOMEM : bytes ? SRNF_OK : SRNF_EFORMAT;

    if (status == SRNF_OK) {
        memcpy(head, bytes, sizeof *head);
        prepared->report = head->report;
        prepared->kernel = head->kernel;
        prepared->kernel_known = head->kernel_known;
        prepared->untransformed = head->untransformed;
        status = read_mesh(&rest, head, 0, &prepared->mesh);
    }
    if (status == SRNF_OK && head->n_vertices[1] > 0) {
        status = read_mesh(&rest, head, 1, &prepared->sphere);
    }
    if (status == SRNF_OK && rest.size > 0) {
        status = SRNF_EFORMAT;
    }
    if (status != SRNF_OK) {
        compute_prepared_clear(prepared);
    }
    free(head);
    return status;
}

/* SRNF_EFORMAT: none is kept. */
static int recall(struct store *store, const struct store_prepared_key *key,
                  struct compute_prepared *prepared)
{
    unsigned char *value;
    size_t size;
    int status = SRNF_EFORMAT;

    if (store_prepared_get(store, key, &value, &size) == STORE_OK) {
        status = read_value(value, size, prepared);
        free(value);
    }
    return status;
}

/* ---- Making ---------------------------------------------------------------------------------- */

/* *untransformed: as in struct compute_prepared. */
static int read_stored(struct jobs_run *run, const char *id, struct srnf_mesh *mesh,
                       bool *untransformed, struct jobs_result *result)
{
    struct srnf_mesh_read_info info = {0};
    struct store *store = jobs_run_store(run);
    struct srnf_mesh_limits limits = srnf_mesh_limits_defaults();
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
    limits.context = jobs_run_context(run);
    status = srnf_mesh_read(bytes, size, srnf_mesh_format_from_name(row.format), &limits, mesh,
                            &info, &error);
    *untransformed = status >= 0 && info.transform_ignored;
    if (status < 0) {
        srnf_mesh_clear(mesh);
        status = compute_fail(result, status, &error, id);
    }
out:
    free(bytes);
    store_mesh_clear(&row);
    return status;
}

int compute_mesh_read(struct jobs_run *run, const char *id, struct srnf_mesh *mesh,
                      struct jobs_result *result)
{
    struct jobs_doubt doubt = {.untransformed = false};
    int status = read_stored(run, id, mesh, &doubt.untransformed, result);

    if (status == 0 && doubt.untransformed) {
        (void)snprintf(doubt.mesh, sizeof doubt.mesh, "%s", id);
        if (!jobs_run_doubt(run, &doubt)) {
            srnf_mesh_clear(mesh);
            status = compute_fail(result, SRNF_ENOMEM, NULL, "noting a doubt");
        }
    }
    return status;
}

/* What was uploaded, read, and mirrored if asked for. */
static int load(struct jobs_run *run, const char *id, bool mirror, struct srnf_mesh *mesh,
                bool *untransformed, struct jobs_result *result)
{
    int status = read_stored(run, id, mesh, untransformed, result);

    if (status == 0 && mirror) {
        srnf_mesh_mirror(mesh);
    }
    return status;
}

static int make(struct jobs_run *run, const struct store_prepared_key *key, bool mirror,
                struct compute_prepared *prepared, struct jobs_result *result)
{
    bool of_sphere; /* where a sphere lies, and how large it is, says nothing */
    int kernel_status,
        status = load(run, key->mesh, mirror, &prepared->mesh, &prepared->untransformed, result);

    if (status == 0 && key->sphere[0]) {
        status = load(run, key->sphere, mirror, &prepared->sphere, &of_sphere, result);
    }
    if (status == 0) {
        status = compute_prepare(prepared, jobs_run_context(run), &kernel_status);
        status = status < 0 ? compute_fail(result, status, NULL, key->mesh) : 0;
    }
    if (status) {
        compute_prepared_clear(prepared);
    } else if (kernel_status != SRNF_ECANCELED && kernel_status != SRNF_ENOMEM) {
        keep(jobs_run_store(run), key, prepared);
    }
    return status;
}

/* Whether the store has the meshes still: a status with the problem in result if not. */
static int find(struct jobs_run *run, const struct store_prepared_key *key,
                struct jobs_result *result)
{
    const char *ids[MESHES] = {key->mesh, key->sphere};

    for (size_t k = 0; k < MESHES && ids[k][0]; k++) {
        struct store_mesh row = {.name = NULL};
        int status = store_mesh_get(jobs_run_store(run), ids[k], &row);

        store_mesh_clear(&row);
        if (status) {
            return compute_fail_store(result, status, ids[k]);
        }
    }
    return 0;
}

int compute_prepared_load(struct jobs_run *run, const char *mesh, const char *sphere, bool mirror,
                          struct compute_prepared *prepared, struct jobs_result *result)
{
    struct store_prepared_key key = {.mesh = mesh, .sphere = sphere};
    char *made = NULL;
    int status = find(run, &key, result);

    *prepared = (struct compute_prepared){.kernel_known = false};
    if (status) {
        return status;
    }
    if (!write_made(jobs_run_jobs(run), jobs_run_owner(run), mirror, &made)) {
        return compute_fail(result, SRNF_ENOMEM, NULL, mesh);
    }
    key.made = made;
    status = recall(jobs_run_store(run), &key, prepared);
    jobs_run_count_mesh(run, status == SRNF_OK);
    if (status == SRNF_EFORMAT) {
        status = make(run, &key, mirror, prepared, result);
    } else if (status) {
        status = compute_fail(result, status, NULL, mesh);
    }
    free(made);
    return status;
}
