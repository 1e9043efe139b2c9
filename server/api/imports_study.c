/*
 * imports_study.c - an import of what an export wrote: the same ids, and jobs that answer from the
 * cache.
 *
 * The manifest comes first and says what each file is. Nothing in it is believed that can be
 * computed: meshes are read as uploads are, and surfaces and models must have the id that follows
 * from their content, so that nobody can put other content under an id. Results of jobs cannot be
 * checked without computing them again: they become answers for their owner alone.
 */
#include "api/imports.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "api/archive.h"
#include "api/auth.h"
#include "api/json_memory.h"
#include "api/labels.h"
#include "api/npy.h"
#include "api/study.h"
#include "api/surfaces.h"
#include "jobs/submit.h"
#include "store/batch.h"
#include "store/cohort.h"
#include "store/digest.h"
#include "store/job.h"
#include "store/mesh.h"
#include "store/model.h"
#include "store/surface.h"

#define MANIFEST_MAX ((size_t)64 << 20)
#define DEGREE_MAX 1000 /* of a surface: more than any has */

static const char *const kinds[] = {"volumes", "meshes", "surfaces", "models", "jobs"};

/* Files by their paths: kind and record. */
static void index_files(struct import *import)
{
    const char *path;

    import->by_path = json_object();
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        const json_t *all = json_object_get(import->manifest, kinds[i]);

        for (size_t k = 0; k < json_array_size(all); k++) {
            json_t *one = json_array_get(all, k);

            path = json_string_value(json_object_get(one, "file"));
            if (path) {
                (void)json_object_set_new(one, "kind", json_string(kinds[i]));
                (void)json_object_set(import->by_path, path, one);
            }
        }
    }
}

bool import_take_manifest(struct import *import, const struct import_given *given)
{
    json_error_t error;
    bool over;

    if (strcmp(given->path, STUDY_MANIFEST) != 0 || import->n_files > 0 || import->manifest) {
        return false;
    }
    import->manifest =
        json_memory_load((const char *)given->bytes, given->size, MANIFEST_MAX * 4, &over, &error);
    if (!json_is_object(import->manifest) ||
        json_integer_value(json_object_get(import->manifest, "version")) != STUDY_VERSION) {
        (void)problem_respond(
            import->call, json_memory_failed() ? "out-of-memory" : "unparsable-archive",
            STUDY_MANIFEST " is not one of an export of version %d.", STUDY_VERSION);
        import->answered = true;
        return true;
    }
    import->seen = json_object();
    index_files(import);
    return true;
}

/* ---- Arrays ---------------------------------------------------------------------------------- */

/* What a member of a .npz holds; name borrowed. */
struct wanted {
    const char *name;
    size_t count; /* that it must have */
    double **values;
};

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

static bool whole(const json_t *record, const char *name, int64_t least, int64_t most,
                  int64_t *value)
{
    const json_t *number = json_object_get(record, name);

    *value = json_integer_value(number);
    return json_is_integer(number) && *value >= least && *value <= most;
}

static char *text_of(const json_t *record, const char *name)
{
    const char *text = json_string_value(json_object_get(record, name));

    return text ? strdup(text) : NULL;
}

/* Whether the bytes have the digest of the manifest, which finds damage and edits but no forger;
   archives of older versions have none. */
static bool is_unchanged(const json_t *record, const void *bytes, size_t size)
{
    const json_t *wanted = json_object_get(record, "sha256");
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
    return n <= STORE_MAPS_MAX && whole(record, "nTheta", 1, DEGREE_MAX, &surface->maps.n_theta) &&
           whole(record, "nPhi", 1, 2 * DEGREE_MAX, &surface->maps.n_phi);
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

/* False where it is not what its record says. */
static bool take_surface(struct import *import, const json_t *record, const char *id,
                         const struct import_given *given, int *status)
{
    struct store_surface surface = {.owner = call_owner(import->call),
                                    .name = text_of(record, "name"),
                                    .record = text_of(record, "record")};
    bool good = whole(record, "lmax", 0, DEGREE_MAX, &surface.lmax) &&
                read_maps(record, &surface) && surface.record &&
                is_unchanged(record, surface.record, strlen(surface.record));

    if (good) {
        surface.coefficient_count = 3 * (size_t)(surface.lmax + 1) * (size_t)(surface.lmax + 1);
        const struct wanted wanted[2] = {
            {"coefficients.npy", surface.coefficient_count, &surface.coefficients},
            {"maps.npy", surface.maps.count ? store_maps_values(&surface.maps) : 0,
             &surface.maps.values}};

        read_npz(given, wanted, surface.maps.count ? 2 : 1);
        good = check_surface(&surface, id);
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

/* What of the record is part of the id: all but the job. */
static char *identity_of(const char *text)
{
    json_t *record = json_loads(text, 0, NULL);
    char *identity;

    (void)json_object_del(json_object_get(record, "madeFrom"), "job");
    identity = json_memory_dumps(record, JSON_COMPACT | JSON_SORT_KEYS | JSON_REAL_PRECISION(17));
    json_decref(record);
    return identity;
}

static bool take_model(struct import *import, const json_t *record, const char *id,
                       const struct import_given *given, int *status)
{
    struct store_model model = {.owner = call_owner(import->call),
                                .record = text_of(record, "record")};
    const char *mean = json_string_value(json_object_get(record, "mean"));
    bool good = mean && strlen(mean) < sizeof model.mean && model.record &&
                whole(record, "lmax", 0, DEGREE_MAX, &model.lmax) &&
                whole(record, "nTheta", 1, DEGREE_MAX, &model.n_theta) &&
                whole(record, "nPhi", 1, 2 * DEGREE_MAX, &model.n_phi) &&
                whole(record, "subjects", 1, 100000, &model.subjects) &&
                whole(record, "components", 1, 100000, &model.components);
    struct wanted wanted[STORE_MODEL_ARRAYS];
    char *identity = NULL;

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
    if (good) {
        identity = identity_of(model.record);
        model.identity = identity;
        *status = store_batch_add_model(import->batch, &model, id);
        good = *status != STORE_CORRUPT;
    } else {
        store_model_clear(&model);
    }
    free(identity);
    return good;
}

/* ---- Jobs ------------------------------------------------------------------------------------ */

static bool is_job_id(const char *id)
{
    return strncmp(id, "job-", 4) == 0 && strlen(id) == 40 &&
           strspn(id + 4, "0123456789abcdef-") == 36;
}

/* Whether process, numeric build and inputs have the digest of the manifest. */
static bool is_asked_unchanged(const json_t *record, const struct store_job *job)
{
    const json_t *wanted = json_object_get(record, "askedSha256");
    char digest[65];

    study_job_digest(digest, job->process, job->numeric_build, job->inputs);
    return !wanted || (json_is_string(wanted) && strcmp(json_string_value(wanted), digest) == 0);
}

/* The tags that the manifest gives one thing, and its name where that is asked for; not given where
   they are empty. */
static void read_labels(const json_t *record, bool with_name, struct labels *labels,
                        struct problem_list *list)
{
    const char *tags = json_string_value(json_object_get(record, "tags"));
    json_t *name = with_name ? json_incref(json_object_get(record, "name")) : NULL;
    json_t *body =
        json_pack("{s:o*, s:o*}", "name", name, "tags", tags ? json_loads(tags, 0, NULL) : NULL);

    labels_read(body, labels, list);
    if (labels->tags && strcmp(labels->tags, "[]") == 0) {
        labels->change.tags = NULL;
    }
    if (!labels->name[0]) {
        labels->change.name = NULL;
    }
    json_decref(body);
}

static bool take_job(struct import *import, const json_t *record, const char *id,
                     const struct import_given *given, int *status)
{
    const struct store_owner owner = call_owner(import->call);
    struct store_job job = {.process = text_of(record, "process"),
                            .inputs = text_of(record, "inputs"),
                            .numeric_build = text_of(record, "numericBuild")};
    json_t *results = json_loadb((const char *)given->bytes, given->size, 0, NULL);
    struct problem_list list = {.errors = NULL};
    struct labels labels;
    bool good, lacking;

    read_labels(record, true, &labels, &list);
    job.name = labels.change.name ? strdup(labels.change.name) : NULL;
    job.tags = labels.change.tags ? strdup(labels.change.tags) : NULL;
    lacking = (labels.change.name && !job.name) || (labels.change.tags && !job.tags);
    good = !list.errors && is_job_id(id) && job.process && job.inputs && job.numeric_build &&
           json_is_object(results) && is_unchanged(record, given->bytes, given->size) &&
           is_asked_unchanged(record, &job) &&
           api_process_find(import->call->api, job.process) != NULL &&
           whole(record, "createdMs", 1, INT64_MAX / 2, &job.created_ms) &&
           whole(record, "startedMs", 0, INT64_MAX / 2, &job.started_ms) &&
           whole(record, "finishedMs", 1, INT64_MAX / 2, &job.finished_ms);

    json_decref(results);
    json_decref(list.errors);
    labels_clear(&labels);
    if (good) {
        (void)snprintf(job.id, sizeof job.id, "%s", id);
        (void)snprintf(job.owner, sizeof job.owner, "%s", owner.name ? owner.name : "");
        *status = jobs_digest(job.process, job.inputs, job.numeric_build, job.owner, job.digest);
        if (lacking) {
            *status = STORE_NOMEM;
        }
        if (*status == STORE_OK && !json_object_get(import->seen, job.digest)) {
            (void)json_object_set_new(import->seen, job.digest, json_true());
            *status = store_batch_add_job(import->batch, &job, (const char *)given->bytes,
                                          given->size, owner.bytes_max);
        }
    }
    store_job_clear(&job);
    return good;
}

/* ---- Files ----------------------------------------------------------------------------------- */

bool import_take_study(struct import *import, struct import_given *given)
{
    const json_t *record = json_object_get(import->by_path, given->path);
    const char *kind = json_string_value(json_object_get(record, "kind"));
    const char *id = json_string_value(json_object_get(record, "id"));
    const size_t before = store_batch_count(import->batch);
    int status = STORE_OK;
    bool good;

    if (!kind || !id || strlen(id) >= STORE_ID_MAX) {
        return true; /* made of the others, for people */
    }
    if (json_object_get(import->seen, id)) {
        return true; /* listed twice */
    }
    (void)json_object_set_new(import->seen, id, json_true());
    import->volume = strcmp(kind, "volumes") == 0;
    if (strcmp(kind, "meshes") == 0 || import->volume) {
        import->id = id;
        import->format = json_string_value(json_object_get(record, "format"));
        import->name = json_string_value(json_object_get(record, "name"));
        import->source = json_string_value(json_object_get(record, "source"));
        return false;
    }
    if (!jobs_memory_charge(jobs_memory_current(), given->size)) {
        (void)problem_respond(import->call, "out-of-memory", "The import does not fit in memory.");
        import->answered = true;
        return true;
    }
    import->charged += given->size;
    good = strcmp(kind, "surfaces") == 0 ? take_surface(import, record, id, given, &status)
           : strcmp(kind, "models") == 0 ? take_model(import, record, id, given, &status)
                                         : take_job(import, record, id, given, &status);
    if (!good) {
        import_refuse(import, given->path, "not-as-described", IMPORT_CHANGED);
    } else if (status != STORE_OK) {
        (void)problem_respond_store(import->call, status, NULL, "keeping the study");
        import->answered = true;
    } else if (store_batch_count(import->batch) > before) {
        import->n_restored[kind[0] == 's' ? 0 : kind[0] == 'm' ? 1 : 2]++;
    }
    return true;
}

/* Names what the manifest lists and no file brought. */
static void refuse_missing(struct import *import)
{
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        const json_t *all = json_object_get(import->manifest, kinds[i]);

        for (size_t k = 0; k < json_array_size(all); k++) {
            const json_t *one = json_array_get(all, k);
            const char *id = json_string_value(json_object_get(one, "id"));
            const char *path = json_string_value(json_object_get(one, "file"));

            if (!id || !json_object_get(import->seen, id)) {
                import_refuse(import,
                              path ? path
                              : id ? id
                                   : kinds[i],
                              "no-such-file",
                              STUDY_MANIFEST " lists %.60s in this file, and the archive has no "
                                             "such file of its own",
                              id ? id : "something without an id");
            }
        }
    }
}

/* Gives what came the tags that the manifest gives it, and models their names; meshes and surfaces
   came with theirs. False when a problem was answered. */
static bool add_labels(struct import *import, struct problem_list *list)
{
    int status = STORE_OK;

    for (size_t i = 0; i + 1 < sizeof kinds / sizeof kinds[0]; i++) {
        const json_t *all = json_object_get(import->manifest, kinds[i]);

        for (size_t k = 0; k < json_array_size(all) && status == STORE_OK; k++) {
            const json_t *one = json_array_get(all, k);
            struct labels labels;

            read_labels(one, strcmp(kinds[i], "models") == 0, &labels, list);
            if (labels.change.name || labels.change.tags) {
                status = store_batch_add_labels(import->batch, call_owner(import->call).name,
                                                json_string_value(json_object_get(one, "id")),
                                                &labels.change);
            }
            labels_clear(&labels);
        }
    }
    if (status != STORE_OK) {
        (void)problem_respond_store(import->call, status, NULL, "keeping the names and tags");
        import->answered = true;
    }
    return status == STORE_OK;
}

/* Whether the text is an array of something: cohort_text_next expects one. */
static bool is_members(const char *text)
{
    json_error_t error;
    bool over;
    json_t *members =
        text ? json_memory_load(text, strlen(text), MANIFEST_MAX * 4, &over, &error) : NULL;
    bool good = json_array_size(members) > 0;

    json_decref(members);
    return good;
}

/* The members that the text lists. */
static void read_members(const char *at, struct cohort_text *members, struct problem_list *list)
{
    const char *text;
    size_t length;

    while (cohort_text_next(&at, &text, &length)) {
        json_t *given = json_loadb(text, length, 0, NULL);
        json_t *member = cohort_read_member(given, "/cohort/members", list);

        cohort_text_add(members, member);
        json_decref(member);
        json_decref(given);
    }
}

bool import_study_members(struct import *import, struct cohort_text *members)
{
    const json_t *cohort = json_object_get(import->manifest, "cohort");
    const char *text = json_string_value(json_object_get(cohort, "members"));
    const char *name = json_string_value(json_object_get(cohort, "name"));
    struct problem_list list = {.errors = NULL};

    refuse_missing(import);
    if (import->n_refused == 0 && !add_labels(import, &list)) {
        json_decref(list.errors);
        return false;
    }
    if (!cohort && !list.errors) {
        import->cohort[0] = '\0';
        return true;
    }
    if (!name || !cohort_name_valid(name)) {
        problem_add(&list, "/cohort/name",
                    STUDY_MANIFEST " must name the cohort by a name that a cohort can have");
    } else if (!import->cohort[0]) {
        (void)snprintf(import->cohort, sizeof import->cohort, "%s", name);
    }
    if (is_members(text)) {
        read_members(text, members, &list);
    } else if (!json_memory_failed()) {
        problem_add(&list, "/cohort/members",
                    STUDY_MANIFEST " must have the members as the text of a JSON array that is not "
                                   "empty");
    }
    if (list.errors) {
        (void)problem_respond_list(import->call, "invalid-input", &list);
        return false;
    }
    return true;
}
