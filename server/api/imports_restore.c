/*
 * imports_restore.c - surfaces and models of an export, each held against its record in the
 * manifest.
 *
 * Nothing in it is believed that can be computed: surfaces and models must have the id that follows
 * from their content, so that nobody can put other content under an id.
 */
#include "api/imports.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/archive.h"
#include "api/auth.h"
#include "api/json_memory.h"
#include "api/model_parts.h"
#include "api/npy.h"
#include "api/study.h"
#include "api/surfaces.h"
#include "store/batch.h"
#include "store/digest.h"
#include "store/holdings.h"
#include "store/model.h"
#include "store/surface.h"

#define DEGREE_MAX 1000                            /* of a surface: more than any has */
#define ROWS_MAX (SRNF_PARTS_MAX * DEGREE_MAX + 1) /* of a model: those of all parts */

/* ---- Arrays ---------------------------------------------------------------------------------- */

/* What a member of a .npz holds; name borrowed. */
struct wanted {
    const char *name;
    size_t count; /* that it must have */
    double **values;
};

/* Of fields, surfaces and scores: squares of such sizes, and sums of those, are doubles still. */
#define LARGEST 1e120

static bool all_within(size_t n, const double *values, double least, double largest)
{
    bool good = true;

    for (size_t i = 0; i < n; i++) {
        good = good && values[i] >= least && values[i] <= largest;
    }
    return good;
}

static void take_array(const struct archive_file *file, const struct wanted *wanted, size_t n)
{
    struct npy_array array;
    char message[120];

    for (size_t i = 0; i < n; i++) {
        if (strcmp(file->path, wanted[i].name) == 0 && !*wanted[i].values &&
            npy_read(file->bytes, file->size, wanted[i].count, &array, message, sizeof message) ==
                0) {
            if (array.count == wanted[i].count) {
                *wanted[i].values = array.values;
                array.values = NULL;
            }
            npy_clear(&array);
        }
    }
}

/* Reads those arrays that a .npz has. */
static void read_npz(const struct import_given *given, const struct wanted *wanted, size_t n)
{
    size_t left = given->size; /* arrays are not packed */
    const struct archive_limits limits = {.file = given->size, .left = &left};
    enum archive_status status;
    struct archive_file file;
    struct archive_reader *reader =
        archive_open(given->bytes, given->size, &limits, &status, &file);

    while (reader && (status = archive_next(reader, &file)) == ARCHIVE_FILE) {
        take_array(&file, wanted, n);
        srnf_free(file.bytes);
    }
    archive_close(reader);
}

bool import_whole(const json_t *record, const char *name, int64_t least, int64_t most,
                  int64_t *value)
{
    const json_t *number = json_object_get(record, name);

    *value = json_integer_value(number);
    return json_is_integer(number) && *value >= least && *value <= most;
}

char *import_text(const json_t *record, const char *name)
{
    const char *text = json_string_value(json_object_get(record, name));

    return text ? strdup(text) : NULL;
}

bool import_unchanged(const json_t *wanted, const void *bytes, size_t size)
{
    char digest[65];

    store_sha256_hex(digest, bytes, size);
    return !wanted || (json_is_string(wanted) && strcmp(json_string_value(wanted), digest) == 0);
}

/* ---- Surfaces and models --------------------------------------------------------------------- */

/* Whether the mesh that the record names is all that it was made of. */
static bool is_alone(const char *text)
{
    json_t *record = json_loads(text, 0, NULL);
    const char *process =
        json_string_value(json_object_get(json_object_get(record, "source"), "process"));
    bool alone = process && strcmp(process, "encode") == 0;

    json_decref(record);
    return alone;
}

static bool read_maps(const json_t *record, struct store_surface *surface)
{
    const json_t *names = json_object_get(record, "maps");
    size_t n = json_array_size(names);

    surface->maps.count = n;
    if (n == 0) {
        return true;
    }
    for (size_t i = 0; i < n && n <= STORE_MAPS_MAX; i++) {
        const char *name = json_string_value(json_array_get(names, i));

        if (!name || strlen(name) >= STORE_MAP_NAME_MAX || strchr(name, ',')) {
            return false;
        }
        (void)snprintf(surface->maps.names[i], STORE_MAP_NAME_MAX, "%s", name);
    }
    return n <= STORE_MAPS_MAX &&
           import_whole(record, "nTheta", 1, DEGREE_MAX, &surface->maps.n_theta) &&
           import_whole(record, "nPhi", 1, 2 * DEGREE_MAX, &surface->maps.n_phi);
}

/* Whether all is there, and the id is that of content and place, or of the content as ids were in
   archives of older versions. */
static bool check_surface(const struct store_surface *surface, const char *wanted)
{
    char id[STORE_ID_MAX];

    if (!surface->coefficients || !surface->record || !surface->name ||
        (surface->maps.count && !surface->maps.values)) {
        return false;
    }
    surface_record_id(surface, false, id);
    if (strcmp(id, wanted) != 0) {
        surface_record_id(surface, true, id);
    }
    return strcmp(id, wanted) == 0;
}

bool import_restore_surface(struct import *import, const json_t *record, const char *id,
                            const struct import_given *given, int *status)
{
    struct store_surface surface = {.owner = call_owner(import->call),
                                    .name = import_text(record, "name"),
                                    .record = import_text(record, "record")};
    bool good =
        import_whole(record, "lmax", 0, DEGREE_MAX, &surface.lmax) && read_maps(record, &surface) &&
        surface.record &&
        import_unchanged(json_object_get(record, "sha256"), surface.record, strlen(surface.record));

    import->edited = !good;
    if (good) {
        surface.coefficient_count = 3 * (size_t)(surface.lmax + 1) * (size_t)(surface.lmax + 1);
        const struct wanted wanted[2] = {
            {"coefficients.npy", surface.coefficient_count, &surface.coefficients},
            {"maps.npy", surface.maps.count ? store_maps_values(&surface.maps) : 0,
             &surface.maps.values}};

        read_npz(given, wanted, surface.maps.count ? 2 : 1);
        good = check_surface(&surface, id) &&
               all_within(surface.coefficient_count, surface.coefficients, -LARGEST, LARGEST);
    }
    if (good) {
        (void)snprintf(surface.id, sizeof surface.id, "%s", id);
        surface.alone = is_alone(surface.record);
        *status = store_batch_add_surface(import->batch, &surface);
    } else {
        surface.maps.count = surface.maps.values ? surface.maps.count : 0;
        store_surface_clear(&surface);
    }
    return good;
}

/* What of the record is part of the id: all but the job. NULL: the record is no object. */
static char *identity_of(const char *text)
{
    json_t *record = json_loads(text, 0, NULL);
    char *identity;

    (void)json_object_del(json_object_get(record, "madeFrom"), "job");
    identity =
        json_is_object(record)
            ? json_memory_dumps(record, JSON_COMPACT | JSON_SORT_KEYS | JSON_REAL_PRECISION(17))
            : NULL;
    json_decref(record);
    return identity;
}

/* The degree of a surface that is listed, and so comes or nothing is kept, or is the caller's
   already: what only others have is not there, STORE_NOT_FOUND. */
static int degree_of(const struct import *import, const char *id, int64_t *degree)
{
    const json_t *listed = json_object_get(import->surfaces, id);
    const char *owner = call_owner(import->call).name;
    struct store *store = import->call->api->config.store;
    struct store_surface surface;
    int status = listed ? STORE_OK : store_owner_has(store, owner, id);

    *degree = json_integer_value(listed);
    if (!listed && status == STORE_OK) {
        status = store_surface_get_as(store, owner, id, false, &surface);
        *degree = surface.lmax;
        store_surface_clear(&surface);
    }
    return status;
}

/* Whether the model may stand on all surfaces that it names, and they are of its degree. */
static bool has_surfaces(struct import *import, const struct store_model *model,
                         const struct compute_joint *joint, int *status)
{
    json_t *record = json_loads(model->record, 0, NULL);
    bool good = true;

    for (size_t i = 0; i < 2 * joint->n_parts && good && *status == STORE_OK; i++) {
        const char *id = i % 2 ? model_template(record, i / 2) : joint->means[i / 2];
        int64_t degree = model->lmax;

        *status = id ? degree_of(import, id, &degree) : STORE_OK;
        import->lacking = *status == STORE_NOT_FOUND;
        import->edited = degree != model->lmax;
        good = !import->lacking && !import->edited;
        *status = import->lacking ? STORE_OK : *status;
    }
    json_decref(record);
    return good;
}

/* Whether all processes that read what models are made of could use this one. */
static bool fits_processes(struct import *import, const struct store_model *model)
{
    const struct api_process *const *rows = import->call->api->config.processes->rows;
    bool good = true;

    for (; *rows; rows++) {
        good = good && (!(*rows)->model_fits || (*rows)->model_fits(model, import->why));
    }
    return good;
}

/* Whether each part has a name of its own, by which it is asked for. */
static bool names_differ(struct import *import, const struct store_model *model)
{
    json_t *names = model_part_names(model);
    bool good = true;

    for (size_t i = 0; i < json_array_size(names) && good; i++) {
        const char *name = json_string_value(json_array_get(names, i));

        good = !name || model_name_find(names, name) == i;
        if (!good) {
            (void)snprintf(import->why, API_WHY_MAX, "two of its parts are called \"%.60s\"", name);
        }
    }
    json_decref(names);
    return good;
}

/* Whether the arrays hold numbers that can be computed with, and the record fits them. */
static bool is_usable(const struct store_model *model, struct compute_joint *joint)
{
    static const double ends[STORE_MODEL_ARRAYS][2] = {
        [STORE_MODEL_MEAN_Q] = {-LARGEST, LARGEST},
        [STORE_MODEL_MODES] = {-LARGEST, LARGEST},
        [STORE_MODEL_EIGENVALUES] = {0.0, LARGEST * LARGEST},
        [STORE_MODEL_SCORES] = {-LARGEST, LARGEST},
        [STORE_MODEL_CALIBRATION] = {0.0, LARGEST},
    };
    bool good = true;

    for (size_t i = 0; i < STORE_MODEL_ARRAYS; i++) {
        good = good &&
               (!model->arrays[i] || all_within(store_model_count(model, (enum store_model_array)i),
                                                model->arrays[i], ends[i][0], ends[i][1]));
    }
    return good && model_joint(model, joint);
}

bool import_restore_model(struct import *import, const json_t *record, const char *id,
                          const struct import_given *given, int *status)
{
    struct store_model model = {.owner = call_owner(import->call),
                                .record = import_text(record, "record")};
    const char *mean = json_string_value(json_object_get(record, "mean"));
    bool good = mean && strlen(mean) < sizeof model.mean && model.record &&
                import_whole(record, "lmax", 0, DEGREE_MAX, &model.lmax) &&
                import_whole(record, "nTheta", 1, ROWS_MAX, &model.n_theta) &&
                import_whole(record, "nPhi", 1, 2 * DEGREE_MAX, &model.n_phi) &&
                import_whole(record, "subjects", 1, 100000, &model.subjects) &&
                import_whole(record, "components", 1, 100000, &model.components);
    struct wanted wanted[STORE_MODEL_ARRAYS];
    char *identity = good ? identity_of(model.record) : NULL;
    struct compute_joint joint;

    good = identity != NULL;

    import->edited = !good;
    if (good) {
        (void)snprintf(model.mean, sizeof model.mean, "%s", mean);
        for (size_t i = 0; i < STORE_MODEL_ARRAYS; i++) {
            wanted[i] = (struct wanted){study_array_file(i),
                                        store_model_count(&model, (enum store_model_array)i),
                                        &model.arrays[i]};
        }
        read_npz(given, wanted, STORE_MODEL_ARRAYS);
        for (size_t i = 0; i < STORE_MODEL_CALIBRATION; i++) {
            good = good && model.arrays[i];
        }
    }
    good = good && is_usable(&model, &joint);
    if (good) {
        good = names_differ(import, &model) && fits_processes(import, &model);
        import->edited = !good;
    }
    good = good && has_surfaces(import, &model, &joint, status);
    if (good && *status == STORE_OK) {
        model.identity = identity;
        *status = store_batch_add_model(import->batch, &model, id);
        good = *status != STORE_CORRUPT;
    } else {
        store_model_clear(&model);
    }
    free(identity);
    return good;
}
