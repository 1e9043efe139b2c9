/*
 * imports_study.c - an import of what an export wrote: the same ids, and jobs that answer from the
 * cache.
 *
 * The manifest is taken first and says what each file is. Meshes and volumes are read as uploads
 * are; the others by imports_restore.c and imports_jobs.c.
 */
#include "api/imports.h"

#include <stdlib.h>
#include <string.h>

#include "api/auth.h"
#include "api/json_memory.h"
#include "api/labels.h"
#include "api/study.h"
#include "store/batch.h"
#include "store/cohort.h"
#include "store/holdings.h"

#define MANIFEST_MAX ((size_t)64 << 20)
#define SOURCE_MAX 4096 /* bytes of what made a mesh */

static const char *const kinds[] = {"volumes", "meshes", "surfaces", "models", "jobs"};

/* Files by their paths: kind and record; and of surfaces, by their ids, the degrees. */
static void index_files(struct import *import)
{
    const char *path;

    import->by_path = json_object();
    import->surfaces = json_object();
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        const json_t *all = json_object_get(import->manifest, kinds[i]);

        for (size_t k = 0; k < json_array_size(all); k++) {
            json_t *one = json_array_get(all, k);

            path = json_string_value(json_object_get(one, "file"));
            if (path) {
                (void)json_object_set_new(one, "kind", json_string(kinds[i]));
                (void)json_object_set(import->by_path, path, one);
            }
            if (kinds[i][0] == 's' && json_is_string(json_object_get(one, "id"))) {
                (void)json_object_set(import->surfaces,
                                      json_string_value(json_object_get(one, "id")),
                                      json_object_get(one, "lmax"));
            }
        }
    }
}

/* Whether what lists files is lists, and digests are in an object; otherwise answered: a mistake
   must not look like an empty one. */
static bool are_lists(struct import *import)
{
    const json_t *files = json_object_get(import->manifest, "files");

    if (files && !json_is_object(files)) {
        (void)problem_respond(import->call, "unparsable-archive",
                              STUDY_MANIFEST ": /files must be an object.");
        import->answered = true;
        return false;
    }
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        const json_t *all = json_object_get(import->manifest, kinds[i]);

        if (all && !json_is_array(all)) {
            (void)problem_respond(import->call, "unparsable-archive",
                                  STUDY_MANIFEST ": /%s must be an array.", kinds[i]);
            import->answered = true;
            return false;
        }
    }
    return true;
}

bool import_take_manifest(struct import *import, const struct import_given *given)
{
    const char *format;
    json_error_t error;
    bool over;

    if (strcmp(given->path, STUDY_MANIFEST) != 0 || import->manifest) {
        return false;
    }
    if (import->n_files > 0 || import->table_path) {
        (void)problem_respond(import->call, "unparsable-archive",
                              STUDY_MANIFEST " says what the files of an export are, and others "
                                             "came before it: send the export by itself.");
        import->answered = true;
        return true;
    }
    import->manifest =
        json_memory_load((const char *)given->bytes, given->size, MANIFEST_MAX * 4, &over, &error);
    format = json_string_value(json_object_get(import->manifest, "format"));
    if (!format || strcmp(format, STUDY_FORMAT) != 0 ||
        json_integer_value(json_object_get(import->manifest, "version")) != STUDY_VERSION) {
        (void)problem_respond(
            import->call, json_memory_failed() ? "out-of-memory" : "unparsable-archive",
            STUDY_MANIFEST " is not one of an export of version %d.", STUDY_VERSION);
        import->answered = true;
        return true;
    }
    import->seen = json_object();
    import->made = json_object();
    if (are_lists(import)) {
        index_files(import);
    }
    return true;
}

/* Whether this is what a service tells of a mesh that a job made, or "": nothing proves it, so it
   must at least have the form. */
static bool is_source(const struct import *import, const char *text)
{
    static const char *const names[] = {"job", "mesh", "surface", "volume"};
    json_t *source = strlen(text) <= SOURCE_MAX ? json_loads(text, 0, NULL) : NULL;
    const char *process = json_string_value(json_object_get(source, "process"));
    bool good = !*text || (process && api_process_find(import->call->api, process));

    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        const json_t *one = json_object_get(source, names[i]);

        good = good && (!one || json_is_null(one) || json_is_string(one));
    }
    json_decref(source);
    return good;
}

static void refuse_changed(struct import *import, const char *path, const char *id)
{
    if (import->lacking) {
        import_refuse(import, path, "no-such-surface", IMPORT_LACKING);
    } else if (import->why[0]) {
        import_refuse(import, import->edited ? STUDY_MANIFEST : path, "not-as-described",
                      IMPORT_UNUSABLE, id, path, import->why);
    } else if (import->edited) {
        import_refuse(import, STUDY_MANIFEST, "not-as-described", IMPORT_EDITED, id, path);
    } else {
        import_refuse(import, path, "not-as-described", IMPORT_CHANGED);
    }
}

/* Whether the file has the digest that the manifest has of it, if it has one. */
static bool is_as_written(const struct import *import, const struct import_given *given)
{
    const json_t *files = json_object_get(import->manifest, "files");

    return import_unchanged(json_object_get(files, given->path), given->bytes, given->size);
}

/* A file that was made of the others, for people, has come. */
static void note_made(struct import *import, const char *path, bool good)
{
    const json_t *files = json_object_get(import->manifest, "files");

    if (json_object_get(files, path) && !json_is_false(json_object_get(import->made, path))) {
        (void)json_object_set_new(import->made, path, json_boolean(good));
    }
}

bool import_take_study(struct import *import, struct import_given *given)
{
    const json_t *record = json_object_get(import->by_path, given->path);
    const char *kind = json_string_value(json_object_get(record, "kind"));
    const char *id = json_string_value(json_object_get(record, "id"));
    const size_t before = store_batch_count(import->batch);
    int status = STORE_OK;
    bool good = is_as_written(import, given);

    if (!kind || !id || strlen(id) >= STORE_ID_MAX) {
        note_made(import, given->path, good);
        return true;
    }
    if (good && json_object_get(import->seen, id)) {
        return true; /* listed twice */
    }
    (void)json_object_set_new(import->seen, id, json_true());
    import->edited = import->lacking = false;
    import->why[0] = '\0';
    if (!good) {
        refuse_changed(import, given->path, id);
        return true;
    }
    import->volume = strcmp(kind, "volumes") == 0;
    if (strcmp(kind, "meshes") == 0 || import->volume) {
        import->id = id;
        import->format = json_string_value(json_object_get(record, "format"));
        import->name = json_string_value(json_object_get(record, "name"));
        import->source = json_string_value(json_object_get(record, "source"));
        if (import->source && !is_source(import, import->source)) {
            import->edited = true;
            refuse_changed(import, given->path, id);
            return true;
        }
        return false;
    }
    if (!jobs_memory_charge(jobs_memory_current(), given->size)) {
        (void)problem_respond(import->call, "out-of-memory", "The import does not fit in memory.");
        import->answered = true;
        return true;
    }
    import->charged += given->size;
    good = strcmp(kind, "surfaces") == 0
               ? import_restore_surface(import, record, id, given, &status)
           : strcmp(kind, "models") == 0 ? import_restore_model(import, record, id, given, &status)
                                         : import_restore_job(import, record, id, given, &status);
    if (!good) {
        refuse_changed(import, given->path, id);
    } else if (status != STORE_OK) {
        (void)problem_respond_store(import->call, status, NULL, "keeping the study");
        import->answered = true;
    } else {
        import->fresh =
            import->fresh || (kind[0] != 'j' && store_owner_has(import->call->api->config.store,
                                                                call_owner(import->call).name,
                                                                id) == STORE_NOT_FOUND);
    }
    if (good && status == STORE_OK && store_batch_count(import->batch) > before) {
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

void import_read_labels(const json_t *record, bool with_name, struct labels *labels,
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

            import_read_labels(one, strcmp(kinds[i], "models") == 0, &labels, list);
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
    if (text && !import_unchanged(json_object_get(cohort, "sha256"), text, strlen(text))) {
        problem_add(&list, "/cohort/members",
                    STUDY_MANIFEST " does not have the members that the "
                                   "export wrote: they were changed");
    } else if (is_members(text)) {
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
