/*
 * export_files.c - the files of each record in an export: the bytes that were uploaded, arrays as
 * .npz, and what the service itself answers for it as a table or a mesh.
 */
#include "api/export_study.h"

#include <stdio.h>
#include <stdlib.h>

#include "api/models.h"
#include "api/npy.h"
#include "api/routes.h"
#include "api/surfaces.h"
#include "store/job.h"
#include "store/mesh.h"
#include "store/model.h"
#include "store/surface.h"
#include "store/volume.h"

#define PLY_RESOLUTION_LEAST ((int64_t)8)

/* What a handler of this service answers with to a GET with this query, as a file, where it has an
   answer. */
static void add_answer(struct export *export, api_handler *handler, const char *id,
                       const char *query, const char *path)
{
    const struct api_request *request = export->study.call->request;
    struct api_request one = {.method = "GET", .path = "", .caller = request->caller};
    struct api_response response = {.status = 0};
    struct api_call call = {.api = export->study.call->api,
                            .request = &one,
                            .response = &response,
                            .parameters = {id, "", "", ""}};

    one.query = query;
    handler(&call);
    if (response.status == 200 && response.body) {
        export_put(export, path, response.body, response.body_size);
    }
    api_response_clear(&response);
}

static void add_array(struct zip_writer *npz, const char *name, const double *values, size_t n,
                      const size_t *shape)
{
    unsigned char *bytes;
    size_t size;

    if (npy_write(values, n, shape, &bytes, &size) == 0) {
        zip_add(npz, name, bytes, size);
        free(bytes);
    } else {
        npz->failed = true;
    }
}

/* A .npz that is made in memory. */
struct npz {
    struct zip_writer zip;
    FILE *out;
    char *bytes;
    size_t size;
};

static bool npz_open(struct npz *npz)
{
    *npz = (struct npz){.bytes = NULL};
    npz->out = open_memstream(&npz->bytes, &npz->size);
    return npz->out && zip_open(&npz->zip, npz->out, false);
}

static void npz_add_to(struct npz *npz, struct export *export, const char *path)
{
    bool whole = npz->out && zip_close(&npz->zip);

    if (npz->out && fclose(npz->out) == 0 && whole) {
        export_put(export, path, npz->bytes, npz->size);
    } else {
        export->zip.failed = true;
    }
    free(npz->bytes);
}

/* What the mesh of a surface is asked for with: five vertices or more to the shortest wave, and no
   more than a viewer gets without asking. */
static void ply_query(int64_t degree, char *query, size_t size)
{
    int64_t resolution = degree > PLY_RESOLUTION_LEAST ? degree : PLY_RESOLUTION_LEAST;

    if (resolution > SURFACE_RESOLUTION_DEFAULT) {
        resolution = SURFACE_RESOLUTION_DEFAULT;
    }
    (void)snprintf(query, size, "format=ply&resolution=%d", (int)resolution);
}

void export_add_surface(struct export *export, const char *id, const char *path)
{
    struct store_surface surface;
    struct store_maps maps;
    struct npz npz;
    char other[STORE_ID_MAX + 32], query[64];

    if (!export_good(export, store_surface_get_as(export_store(export), export->study.owner, id,
                                                  true, &surface))) {
        return;
    }
    (void)store_surface_maps(export_store(export), id, &maps);
    if (npz_open(&npz)) {
        const size_t shape[2] = {3, (size_t)((surface.lmax + 1) * (surface.lmax + 1))};
        const size_t map_shape[3] = {maps.count, (size_t)maps.n_theta, (size_t)maps.n_phi};

        add_array(&npz.zip, "coefficients.npy", surface.coefficients, 2, shape);
        if (maps.count) {
            add_array(&npz.zip, "maps.npy", maps.values, 3, map_shape);
        }
    }
    npz_add_to(&npz, export, path);
    ply_query(surface.lmax, query, sizeof query);
    store_maps_clear(&maps);
    store_surface_clear(&surface);
    (void)snprintf(other, sizeof other, "surfaces/%s.ply", id);
    add_answer(export, surfaces_mesh, id, query, other);
}

static const char *const array_files[STORE_MODEL_ARRAYS] = {
    [STORE_MODEL_MEAN_Q] = "mean_q.npy",           [STORE_MODEL_MODES] = "modes.npy",
    [STORE_MODEL_EIGENVALUES] = "eigenvalues.npy", [STORE_MODEL_SCORES] = "scores.npy",
    [STORE_MODEL_CALIBRATION] = "calibration.npy",
};

const char *study_array_file(size_t array)
{
    return array_files[array];
}

void export_add_model(struct export *export, const char *id, const char *path)
{
    struct store_model model;
    struct npz npz;
    char other[STORE_ID_MAX + 32];

    if (!export_good(export, store_model_get_as(export_store(export), export->study.owner, id,
                                                (1u << STORE_MODEL_ARRAYS) - 1, &model))) {
        return;
    }
    if (npz_open(&npz)) {
        for (size_t i = 0; i < STORE_MODEL_ARRAYS; i++) {
            const size_t count = store_model_count(&model, (enum store_model_array)i);

            if (model.arrays[i]) {
                add_array(&npz.zip, array_files[i], model.arrays[i], 1, &count);
            }
        }
    }
    npz_add_to(&npz, export, path);
    store_model_clear(&model);
    (void)snprintf(other, sizeof other, "models/%s-scores.csv", id);
    add_answer(export, models_scores, id, "format=csv", other);
}

void export_add_mesh(struct export *export, const char *id, const char *path)
{
    unsigned char *bytes;
    size_t size;

    if (export_good(export, store_mesh_content(export_store(export), id, &bytes, &size))) {
        export_put(export, path, bytes, size);
        free(bytes);
    }
}

void export_add_volume(struct export *export, const char *id, const char *path)
{
    unsigned char *bytes;
    size_t size;

    if (export_good(export, store_volume_content(export_store(export), id, &bytes, &size))) {
        export_put(export, path, bytes, size);
        free(bytes);
    }
}

void export_add_job(struct export *export, const char *id, const char *path)
{
    char *results, other[STORE_ID_MAX + 32];
    size_t size;

    if (export_good(export, store_job_results(export_store(export), id, &results, &size))) {
        zip_add(&export->zip, path, results, size); /* its entry has the digest */
        free(results);
        (void)snprintf(other, sizeof other, "jobs/%s.csv", id);
        add_answer(export, jobs_results, id, "format=csv", other);
    }
}
