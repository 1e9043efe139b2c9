/*
 * imports.c - POST /v1/imports: a whole study in one request.
 *
 * Each file is read as if it had been sent by itself to POST /v1/meshes, with the same checks and
 * the same id. Large ones then lie on the disk under temporary names, small ones in memory, and the
 * table is matched with them. Only then all meshes and the cohort are stored, in one transaction
 * (store/batch.h): all or, where anything was refused, nothing; with partial=true what was not
 * refused. What makes an archive unreadable as a whole refuses it as a whole.
 *
 * Runs on the threads for uploads and is charged as an upload is: what is read, what waits for the
 * transaction, and some KiB for the row and the answer of each file (imports_files.c).
 */
#include "api/imports.h"

#include <stdlib.h>
#include <string.h>

#include "api/auth.h"
#include "api/json_memory.h"
#include "api/respond.h"
#include "api/routes.h"
#include "compute/prepared.h"
#include "store/batch.h"
#include "store/cohort.h"
#include "store/holdings.h"

/* What the query asks for; false when a problem was answered. */
static bool read_query(struct import *import)
{
    struct problem_list list = {.errors = NULL};
    char text[STORE_COHORT_NAME_MAX];
    bool refused;

    if (query_get(import->call, "cohort", text, sizeof text, &refused)) {
        memcpy(import->cohort, text, sizeof text);
        if (!cohort_name_valid(text)) {
            problem_add(&list, "/cohort",
                        "must be 1 to 100 letters, digits, dots, hyphens or underscores, and not . "
                        "or ..");
        }
    }
    if (!refused && query_get(import->call, "partial", text, sizeof text, &refused)) {
        import->partial = strcmp(text, "true") == 0;
        if (!import->partial && strcmp(text, "false") != 0) {
            problem_add(&list, "/partial", "must be true or false");
        }
    }
    if (!refused && list.errors) {
        (void)problem_respond_list(import->call, "invalid-input", &list);
        return false;
    }
    return !refused;
}

/* How much the owner may still take. */
static bool read_room(struct import *import)
{
    struct api_call *call = import->call;
    int64_t held, most = call_owner(call).bytes_max;
    int status = store_owner_bytes(call->api->config.store, call_owner(call).name, &held, NULL);

    import->room = most > 0 ? (most > held ? most - held : 0) : -1;
    if (status != STORE_OK) {
        (void)problem_respond_store(call, status, NULL, "looking at the quota");
    }
    return status == STORE_OK;
}

/* Now that the meshes are stored. */
static void keep_prepared(struct import *import)
{
    struct api *api = import->call->api;

    for (size_t i = 0; i < import->n_prepared; i++) {
        compute_prepared_keep(api->config.jobs, api->config.store, call_owner(import->call).name,
                              import->prepared[i].id, &import->prepared[i].mesh);
    }
}

/* Stores what was taken, and answers. */
static void commit(struct import *import, struct cohort_text *members)
{
    struct store_cohort cohort = {.view = call_view(import->call),
                                  .bytes_max = call_owner(import->call).bytes_max};
    const struct api_caller *caller = &import->call->request->caller;
    bool created = false, named = import->cohort[0] != '\0';
    size_t missing = 0, failed = 0;
    int status = STORE_OK;

    memcpy(cohort.name, import->cohort, sizeof cohort.name);
    memcpy(cohort.owner, import->call->request->caller.name, sizeof cohort.owner);
    if (named) {
        status = cohort_text_finish(members, &cohort)
                     ? store_batch_add_cohort(import->batch, &cohort, &created, &missing)
                     : STORE_NOMEM;
    }
    if (status == STORE_OK) {
        status =
            store_batch_commit(import->batch, caller->restricted ? caller->name : NULL, &failed);
    }
    if (status == STORE_OK) {
        keep_prepared(import);
        import_respond_taken(import, named ? &cohort : NULL, created);
    } else if (named) {
        cohort_respond_refused(import->call, &cohort, status, missing);
    } else {
        (void)problem_respond_store(import->call, status, NULL, "keeping the meshes");
    }
    store_batch_destroy(import->batch);
    import->batch = NULL;
    store_cohort_clear(&cohort);
}

static bool has_volume(const struct import *import)
{
    size_t n = 0;

    for (size_t i = 0; i < import->n_files; i++) {
        n += import->files[i].volume && !import->files[i].refused;
    }
    return n > 0;
}

/* All files are there: matches them, and decides. */
static void finish(struct import *import)
{
    struct cohort_text members = {.text = NULL};
    bool full, only_volumes;

    if (import->table_path && !import->cohort[0]) {
        (void)problem_respond(import->call, "invalid-input",
                              "/cohort: a table tells of the members of a cohort; name it by "
                              "?cohort=, or leave %.200s out.",
                              import->table_path);
        return;
    }
    if (!import->manifest) {
        import_match(import, &members);
    } else if (!import_study_members(import, &members)) {
        cohort_text_clear(&members);
        return;
    }
    full = members.count <= COHORT_MEMBERS_MAX;
    only_volumes = members.count == 0 && !import->cohort[0] && has_volume(import);
    if (json_memory_failed() || members.failed) {
        import_answer_memory(import);
    } else if (!full) {
        (void)problem_respond(import->call, "limit-exceeded",
                              "The import has %zu meshes; a cohort has at most %d members.",
                              members.count, COHORT_MEMBERS_MAX);
    } else if (import->n_refused > 0 &&
               (!import->partial || (members.count == 0 && !only_volumes) || import->manifest)) {
        import_respond_refused(import);
    } else if (members.count == 0 && !import->manifest && !only_volumes) {
        (void)problem_respond(import->call, "unparsable-archive",
                              import->cohort[0] ? "There is no mesh in the body, and a cohort has "
                                                  "at least one."
                                                : "There is no mesh in the body, and no volume.");
    } else {
        commit(import, &members);
    }
    cohort_text_clear(&members);
}

static void clear(struct import *import)
{
    store_batch_destroy(import->batch);
    for (size_t i = 0; i < import->n_files; i++) {
        free(import->files[i].path);
        free(import->files[i].flaw);
        json_decref(import->files[i].answer);
        srnf_free(import->files[i].bytes);
    }
    for (size_t i = 0; i < import->n_prepared; i++) {
        compute_prepared_clear(&import->prepared[i].mesh);
    }
    free(import->prepared);
    free(import->files);
    free(import->table_path);
    study_table_clear(&import->table);
    json_decref(import->refused);
    json_decref(import->labels);
    json_decref(import->manifest);
    json_decref(import->by_path);
    json_decref(import->surfaces);
    json_decref(import->seen);
    json_decref(import->made);
    jobs_memory_discharge(jobs_memory_current(), import->charged);
}

void imports_create(struct api_call *call)
{
    struct import import = {.call = call,
                            .unpack_left = import_growth(call),
                            .batch = store_batch_create(call->api->config.store),
                            .refused = json_array()};

    if (!import.batch || !import.refused) {
        import_answer_memory(&import);
    } else if (read_query(&import) && read_room(&import)) {
        import_read_body(&import);
        if (!import.answered) {
            finish(&import);
        }
    }
    clear(&import);
}
