/*
 * encode_cohort.c - encode of a cohort: all its meshes in one job.
 *
 * Members are encoded in portions, several at a time, and after each portion its surfaces are kept
 * and its rows go into the checkpoint: a later attempt goes on behind them. A member that cannot be
 * encoded has a problem in its row. What would stop the others too, such as a full disk, fails the
 * job; so does a cohort of which nothing is left.
 */
#include "processes/encode.h"

#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/cohorts.h"
#include "compute/encode_ahead.h"
#include "jobs/tasks.h"
#include "store/cohort.h"
#include "store/mesh.h"
#include "store/surface.h"
#include "toolkit/group.h"

#define PORTION ((size_t)16)       /* members between two looks at the checkpoint */
#define PORTION_MOST ((size_t)256) /* the same where workers encode them */
#define CHECKPOINT_SECONDS 1.0     /* between two checkpoints at least */
#define CHECKPOINT_COST 50.0       /* and in times what writing one took */

/* ---- The input ------------------------------------------------------------------------------- */

/* Meshes are work. One that is gone, or cannot be analysed, is told in its row. */
static bool note_member(struct process_inputs *inputs, const char *id)
{
    struct store_mesh mesh = {.name = NULL};

    if (!id || !compute_is_mesh(id)) {
        return false;
    }
    inputs->call->work.meshes++;
    if (store_mesh_get(inputs->call->api->config.store, id, &mesh) == STORE_OK) {
        inputs->call->work.faces += mesh.faces;
    }
    store_mesh_clear(&mesh);
    return true;
}

static void read_members(struct process_inputs *inputs, const struct process_input *input,
                         const struct store_cohort *cohort)
{
    json_t *members = cohort_members(cohort), *ids = json_array(), *labels = json_array();
    json_t *subjects = json_array(), *mirrored = json_array();
    bool any = false;

    for (size_t i = 0; i < json_array_size(members); i++) {
        const json_t *member = json_array_get(members, i);

        any = note_member(inputs, json_string_value(json_object_get(member, "id"))) || any;
        (void)json_array_append(ids, json_object_get(member, "id"));
        (void)json_array_append(labels, json_object_get(member, "label"));
        (void)json_array_append(subjects, json_object_get(member, "subject"));
        (void)json_array_append(mirrored, json_object_get(member, "mirror"));
    }
    if (!any) {
        problem_add(inputs->list, "/inputs/cohort", "has no mesh among its members");
    }
    (void)json_object_set_new(inputs->canonical, input->name,
                              json_pack("{s:s, s:o, s:o, s:o, s:o}", "name", cohort->name,
                                        "members", ids, "labels", labels, "subjects", subjects,
                                        "mirrored", mirrored));
    json_decref(members);
}

static void read_cohort(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *value = json_object_get(inputs->given, input->name);
    struct store_cohort cohort = {.record = NULL};

    if (!value || json_is_null(value)) {
        (void)json_object_set_new(inputs->canonical, input->name, json_null());
    } else if (group_find_cohort(inputs, value, &cohort)) {
        if (cohort.n_members > ENCODE_MEMBERS_MAX) {
            problem_add(inputs->list, "/inputs/cohort",
                        "has %zu members; one job encodes at most %d of them", cohort.n_members,
                        ENCODE_MEMBERS_MAX);
        } else {
            read_members(inputs, input, &cohort);
        }
    }
    store_cohort_clear(&cohort);
}

static bool type_cohort(const json_t *value, void *member)
{
    struct encode_cohort *cohort = member;

    if (json_is_null(value)) {
        return true;
    }
    cohort->cohort = json_deep_copy(value);
    cohort->n = json_array_size(json_object_get(cohort->cohort, "members"));
    return cohort->n > 0;
}

static void clear_cohort(void *member)
{
    struct encode_cohort *cohort = member;

    json_decref(cohort->cohort);
    *cohort = (struct encode_cohort){.n = 0};
}

const struct input_own encode_cohort = {
    .schema =
        "\"type\":[\"string\",\"null\"],\"pattern\":\"" COHORT_NAME_PATTERN "\",\"default\":null",
    .read = read_cohort,
    .type = type_cohort,
    .clear = clear_cohort,
    .refers = true,
};

/* ---- Members --------------------------------------------------------------------------------- */

struct slot {
    const char *id;
    bool encodes; /* a surface among the members is taken as it is */
    struct compute_encode_inputs of;
    struct compute_doubt doubt;
    struct srnf_encoded encoded;
    struct jobs_result result;
    int status;
};

struct portion {
    struct jobs_run *run;
    struct srnf_context context; /* the run's, without its progress: that is the cohort's */
    size_t first, n, members;
    struct slot slots[PORTION_MOST];
    atomic_size_t done;
};

static void encode_one(void *argument, size_t index)
{
    struct portion *portion = argument;
    struct slot *slot = &portion->slots[index];
    const struct srnf_context *context = jobs_run_context(portion->run);
    size_t done;

    if (context->canceled(context->user)) {
        slot->status = SRNF_ECANCELED;
        return;
    }
    if (slot->encodes) {
        slot->status = compute_encode(portion->run, &portion->context, &slot->of, &slot->encoded,
                                      &slot->result);
    }
    done = portion->first + atomic_fetch_add(&portion->done, 1) + 1;
    context->progress(context->user, (double)done / (double)portion->members,
                      "encoding the members");
}

/* Whether a problem is that of the member alone. */
static bool is_of_member(const struct jobs_result *result)
{
    static const char *const all[] = {"out-of-memory", "internal-error", "storage-full",
                                      "storage-unavailable", "storage-quota-exceeded"};

    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++) {
        if (!result->problem_code || strcmp(result->problem_code, all[i]) == 0) {
            return false;
        }
    }
    return true;
}

static json_t *copy_or_null(const json_t *record, const char *name)
{
    json_t *value = json_object_get(record, name);

    return value ? json_incref(value) : json_null();
}

/* What the row says of its surface; record NULL: there is none. */
static void describe_surface(json_t *row, const json_t *record)
{
    static const char *const members[] = {"lmax",   "route",    "scale", "area",
                                          "volume", "mirrored", "fit"};

    (void)json_object_set_new(row, "surface", copy_or_null(record, "id"));
    for (size_t i = 0; i < sizeof members / sizeof members[0]; i++) {
        (void)json_object_set_new(row, members[i], copy_or_null(record, members[i]));
    }
}

static json_t *row_of(const struct encoding *encoding, const struct slot *slot, size_t index)
{
    const json_t *cohort = encoding->cohort.cohort;
    json_t *label = json_array_get(json_object_get(cohort, "labels"), index);
    json_t *subject = json_array_get(json_object_get(cohort, "subjects"), index);

    return json_pack("{s:I, s:s, s:O?, s:O?, s:b, s:n}", "member", (json_int_t)index, "id",
                     slot->id, "label", label, "subject", subject, "encoded", slot->encodes,
                     "problem");
}

/* The record of a surface among the members (new reference), or NULL with the problem of the slot.
 */
static json_t *stored_record(struct jobs_run *run, struct slot *slot)
{
    struct store_surface surface = {.name = NULL};
    json_t *record = NULL;
    int status =
        store_surface_get_as(jobs_run_store(run), jobs_run_owner(run), slot->id, false, &surface);

    if (status == STORE_OK) {
        record = surface_record(&surface);
    } else {
        (void)compute_fail_store(&slot->result, status, slot->id);
    }
    store_surface_clear(&surface);
    return record;
}

/* The row of a member that was encoded or not; NULL with the problem of the job, or cancelled. */
static json_t *finish_member(struct jobs_run *run, const struct encoding *encoding,
                             struct slot *slot, size_t index, struct jobs_result *result)
{
    json_t *warnings = json_array(), *record = NULL, *row;

    if (slot->doubt.any) {
        json_decref(warnings);
        warnings = process_doubt(&slot->doubt.doubt);
    }
    if (!slot->encodes) {
        record = stored_record(run, slot);
    } else if (slot->status == 0) {
        record = encode_keep_surface(run, &slot->of, &slot->encoded, json_incref(warnings),
                                     &slot->result);
    }
    if (!record && !is_of_member(&slot->result)) {
        *result = slot->result;
        json_decref(warnings);
        return NULL;
    }
    row = row_of(encoding, slot, index);
    describe_surface(row, record);
    if (!record) {
        (void)json_object_set_new(row, "problem",
                                  json_pack("{s:s, s:s}", "code", slot->result.problem_code,
                                            "detail", slot->result.problem_detail));
    }
    (void)json_object_set_new(row, "warnings", warnings);
    json_decref(record);
    return row;
}

static void prepare_slot(const struct encoding *encoding, size_t index, struct slot *slot)
{
    const json_t *cohort = encoding->cohort.cohort;
    const char *id = json_string_value(json_array_get(json_object_get(cohort, "members"), index));
    bool mirror = json_is_true(json_array_get(json_object_get(cohort, "mirrored"), index));

    *slot = (struct slot){.id = id ? id : ""};
    slot->encodes = compute_is_mesh(slot->id);
    slot->of =
        encode_inputs_of(encoding, slot->encodes ? slot->id : "", encoding->mirror != mirror);
    slot->of.aside = &slot->doubt;
}

/* Those that workers encode, where there are any. */
static int encode_ahead(struct portion *portion, struct compute_ahead *ahead,
                        struct jobs_result *result)
{
    struct compute_encode_inputs *inputs[PORTION_MOST];
    double all = (double)portion->members;

    for (size_t i = 0; i < portion->n; i++) {
        inputs[i] = portion->slots[i].encodes ? &portion->slots[i].of : NULL;
    }
    return compute_encode_ahead(portion->run, portion->n, inputs, (double)portion->first / all,
                                (double)(portion->first + portion->n) / all, ahead, result);
}

/* Encodes the members of a portion and adds their rows. False with the problem set, or cancelled.
 */
static bool run_portion(struct portion *portion, const struct encoding *encoding, json_t *rows,
                        struct jobs_result *result)
{
    const struct srnf_context *context = jobs_run_context(portion->run);
    struct compute_ahead ahead;
    bool good = true;

    for (size_t i = 0; i < portion->n; i++) {
        prepare_slot(encoding, portion->first + i, &portion->slots[i]);
    }
    if (encode_ahead(portion, &ahead, result)) {
        compute_ahead_clear(&ahead);
        return false;
    }
    atomic_store(&portion->done, 0);
    context->parallel_for(context->user, portion->n, encode_one, portion);
    compute_ahead_clear(&ahead);
    good = !context->canceled(context->user);
    for (size_t i = 0; i < portion->n; i++) {
        struct slot *slot = &portion->slots[i];
        json_t *row =
            good ? finish_member(portion->run, encoding, slot, portion->first + i, result) : NULL;

        good = row && json_array_append_new(rows, row) == 0;
        srnf_free(slot->encoded.coefficients);
    }
    return good;
}

/* ---- Checkpoints ----------------------------------------------------------------------------- */

/* Whether what the row says is there still. */
static bool is_row_sound(struct jobs_run *run, const json_t *row)
{
    const char *id = json_string_value(json_object_get(row, "surface"));
    struct store_surface surface = {.name = NULL};
    bool sound = json_is_object(row);

    if (id) {
        sound = store_surface_get_as(jobs_run_store(run), jobs_run_owner(run), id, false,
                                     &surface) == STORE_OK;
    }
    store_surface_clear(&surface);
    return sound;
}

/* The rows that an earlier attempt of the job has left (new reference). */
static json_t *recall_rows(struct jobs_run *run, size_t members)
{
    unsigned char *bytes = NULL;
    json_t *rows = NULL;
    size_t size = 0, sound = 0;

    if (jobs_run_checkpoint_load(run, &bytes, &size) == STORE_OK) {
        rows = json_memory_load((const char *)bytes, size, 0, NULL, NULL);
    }
    free(bytes);
    if (!json_is_array(rows) || json_array_size(rows) > members) {
        json_decref(rows);
        return json_array();
    }
    while (sound < json_array_size(rows) && is_row_sound(run, json_array_get(rows, sound))) {
        sound++;
    }
    while (json_array_size(rows) > sound) {
        (void)json_array_remove(rows, json_array_size(rows) - 1);
    }
    return rows;
}

/* When the checkpoint was written, and what that took. */
struct pace {
    double last, took;
};

static void save_rows(struct jobs_run *run, const json_t *rows, struct pace *pace)
{
    const struct srnf_context *context = jobs_run_context(run);
    double now = context->seconds(context->user);
    char *text;

    if (now - pace->last < CHECKPOINT_SECONDS || now - pace->last < CHECKPOINT_COST * pace->took) {
        return;
    }
    text = json_memory_dumps(rows, JSON_COMPACT | JSON_REAL_PRECISION(17));
    if (text) {
        (void)jobs_run_checkpoint_save(run, text, strlen(text));
    }
    free(text);
    pace->last = context->seconds(context->user);
    pace->took = pace->last - now;
}

/* ---- Running --------------------------------------------------------------------------------- */

json_t *encode_run_cohort(struct jobs_run *run, const struct encoding *encoding,
                          struct jobs_result *result)
{
    const struct srnf_context *context = jobs_run_context(run);
    struct portion *portion = srnf_alloc(1, sizeof *portion);
    json_t *rows = recall_rows(run, encoding->cohort.n), *document = NULL;
    struct pace pace = {context->seconds(context->user), 0.0};
    size_t most = jobs_offers_tasks(jobs_run_jobs(run)) ? PORTION_MOST : PORTION;
    bool good = portion != NULL;

    if (!portion) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "encoding the members");
    } else {
        *portion = (struct portion){.run = run, .context = *context, .members = encoding->cohort.n};
        portion->context.progress = NULL;
    }
    while (good && json_array_size(rows) < encoding->cohort.n) {
        portion->first = json_array_size(rows);
        portion->n = encoding->cohort.n - portion->first;
        portion->n = portion->n < most ? portion->n : most;
        good = run_portion(portion, encoding, rows, result);
        if (good) {
            save_rows(run, rows, &pace);
        }
    }
    if (good) {
        document = encode_rows_document(encoding, rows, result);
    }
    json_decref(rows);
    srnf_free(portion);
    return document;
}
