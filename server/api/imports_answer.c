/*
 * imports_answer.c - what an import is answered with: what was taken, in detail and in figures,
 * what was not, and what in the table looks mistaken.
 */
#include "api/imports.h"

#include <stdio.h>
#include <string.h>

#include "api/respond.h"
#include "api/warnings.h"
#include "store/cohort.h"
#include "text.h"

#define PASSED_SHOWN ((size_t)100) /* files that a warning has in its figures */
#define PASSED_NAMED ((size_t)5)   /* and in its sentence */
#define FLAWED_SHOWN ((size_t)100)
#define FLAWED_NAMED ((size_t)3)

/* Nothing is kept: says why. */
void import_respond_refused(struct import *import)
{
    const json_t *first = json_array_get(import->refused, 0);
    const char *file = json_string_value(json_object_get(first, "file"));
    const char *detail = json_string_value(json_object_get(first, "detail"));
    bool one = import->n_refused == 1;
    size_t length = detail ? strlen(detail) : 0;
    bool asks = length > 0 && length < 250 && detail[length - 1] == '?';
    char text[600];

    length -= length > 0 && detail[length - 1] == '.'; /* the detail of a problem is a sentence */
    (void)snprintf(text, sizeof text,
                   "%zu of what came %s refused, and nothing was kept. The first, %.150s: %.*s%s "
                   "%s %s%s.",
                   import->n_refused, one ? "was" : "were", file ? file : "",
                   length < 250 ? (int)length : 250, detail ? detail : "", asks ? "" : ".",
                   import->manifest ? "Export" : "Correct",
                   import->manifest ? "the study again"
                   : one            ? "it"
                                    : "them",
                   import->partial ? "" : ", or send ?partial=true to keep the rest");
    (void)problem_respond_with(import->call, "import-refused", text, "refused",
                               json_incref(import->refused));
}

/* What was taken, in figures. */
static json_t *summary_of(const struct import *import, const struct store_cohort *cohort)
{
    size_t meshes = 0, volumes = 0, fresh = 0, poor = 0;
    json_t *summary = json_object();

    for (size_t i = 0; i < import->n_files; i++) {
        const struct import_file *file = &import->files[i];

        if (!file->refused) {
            meshes += !file->volume;
            volumes += file->volume;
            fresh += json_is_true(json_object_get(file->answer, "new"));
            poor += json_is_false(json_object_get(file->answer, "analysable"));
        }
    }
    (void)json_object_set_new(summary, "meshes", json_integer((json_int_t)meshes));
    (void)json_object_set_new(summary, "volumes", json_integer((json_int_t)volumes));
    (void)json_object_set_new(summary, "new", json_integer((json_int_t)fresh));
    (void)json_object_set_new(summary, "notAnalysable", json_integer((json_int_t)poor));
    (void)json_object_set_new(summary, "members",
                              json_integer(cohort ? (json_int_t)cohort->n_members : 0));
    if (import->table_path) {
        (void)json_object_set_new(summary, "labels",
                                  import->labels ? json_incref(import->labels) : json_object());
        (void)json_object_set_new(summary, "columns", study_table_columns(&import->table));
    }
    return summary;
}

/* What the reports of meshes have of transforms. */
static void warn_untransformed(const struct import *import, json_t *warnings)
{
    const char *first = NULL;
    size_t count = 0;

    for (size_t i = 0; i < import->n_files; i++) {
        const struct import_file *file = &import->files[i];

        if (!file->refused && file->untransformed) {
            first = first ? first : file->id;
            count++;
        }
    }
    if (count > 0) {
        warning_untransformed(warnings, first, count);
    }
}

/* Meshes that no analysis takes as they are. */
static void warn_flawed(const struct import *import, json_t *warnings)
{
    json_t *files = json_array();
    char named[FLAWED_NAMED * 270] = "";
    size_t count = 0, length = 0;

    for (size_t i = 0; i < import->n_files; i++) {
        const struct import_file *file = &import->files[i];
        bool flawed = json_is_false(json_object_get(file->answer, "analysable"));

        if (!file->refused && flawed && ++count <= FLAWED_SHOWN) {
            (void)json_array_append_new(
                files, json_pack("{s:O, s:O, s:O}", "file", json_object_get(file->answer, "file"),
                                 "id", json_object_get(file->answer, "id"), "problem",
                                 json_object_get(file->answer, "problem")));
            if (count <= FLAWED_NAMED) {
                (void)snprintf(named + length, sizeof named - length, "%s%.60s: %.200s",
                               length ? "; " : "", file->base, file->flaw ? file->flaw : "");
                text_trim_cut(named);
                length = strlen(named);
            }
        }
    }
    if (count > 0) {
        warning_add(warnings, "not-analysable",
                    json_pack("{s:I, s:O}", "count", (json_int_t)count, "files", files),
                    "%zu of the meshes cannot be analysed, and a job that takes one is refused: "
                    "%s%s.",
                    count, named, count > FLAWED_NAMED ? "; and others" : "");
    }
    json_decref(files);
}

/* Texts that came with the meshes. */
static void warn_passed(const struct import *import, json_t *warnings)
{
    json_t *files = json_array();
    char named[PASSED_NAMED * 70] = "";
    size_t count = 0, length = 0;

    for (size_t i = 0; i < import->n_files; i++) {
        const struct import_file *file = &import->files[i];

        if (file->passed && ++count <= PASSED_SHOWN) {
            bool readable = delimited_utf8(file->path, strlen(file->path));

            (void)json_array_append_new(files, json_string(readable ? file->path : "?"));
            if (count <= PASSED_NAMED && readable) {
                (void)snprintf(named + length, sizeof named - length, "%s%.60s", length ? ", " : "",
                               file->base);
                text_trim_cut(named);
                length = strlen(named);
            }
        }
    }
    if (count > 0) {
        warning_add(warnings, "files-passed-over",
                    json_pack("{s:I, s:O}", "count", (json_int_t)count, "files", files),
                    "%zu of the files %s no mesh, no volume and no table by name and content, and "
                    "%s passed over: %s%s.",
                    count, count == 1 ? "is" : "are", count == 1 ? "was" : "were", named,
                    count > PASSED_NAMED ? " and others" : "");
    }
    json_decref(files);
}

/* Of an export: whether the file of this path is one that was made of the others, and did not come
   as it was written. */
static bool is_amiss(const struct import *import, const char *path)
{
    return !json_object_get(import->by_path, path) &&
           !json_is_true(json_object_get(import->made, path));
}

static void warn_made(const struct import *import, json_t *warnings)
{
    json_t *digests = json_object_get(import->manifest, "files"), *files = json_array(), *digest;
    size_t count = 0, missing = 0, length = 0;
    char named[PASSED_NAMED * 70] = "";
    const char *path;

    json_object_foreach(digests, path, digest)
    {
        if (!is_amiss(import, path)) {
            continue;
        }
        missing += !json_object_get(import->made, path);
        if (++count <= PASSED_SHOWN) {
            (void)json_array_append_new(files, json_string(path));
        }
        if (count <= PASSED_NAMED) {
            (void)snprintf(named + length, sizeof named - length, "%s%.60s", length ? ", " : "",
                           path);
            text_trim_cut(named);
            length = strlen(named);
        }
    }
    if (count > 0) {
        warning_add(warnings, "files-passed-over",
                    json_pack("{s:I, s:I, s:I, s:O}", "count", (json_int_t)count, "changed",
                              (json_int_t)(count - missing), "missing", (json_int_t)missing,
                              "files", files),
                    "%zu of the files that were made of the study %s not as the export wrote them, "
                    "%zu changed and %zu missing: %s%s. The study was restored without; do not "
                    "read them from this archive.",
                    count, count == 1 ? "is" : "are", count - missing, missing, named,
                    count > PASSED_NAMED ? " and others" : "");
    }
    json_decref(files);
}

void import_respond_taken(struct import *import, const struct store_cohort *cohort, bool created)
{
    json_t *answer = json_object(), *meshes = json_array(), *volumes = json_array();
    json_t *warnings = json_array();

    created = created || import->fresh;
    for (size_t i = 0; i < import->n_files; i++) {
        const struct import_file *file = &import->files[i];

        if (!file->refused) {
            created = created || json_is_true(json_object_get(file->answer, "new"));
            (void)json_array_append(file->volume ? volumes : meshes, file->answer);
        }
    }
    if (import->table_path) {
        study_table_warn(&import->table, warnings);
    }
    warn_flawed(import, warnings);
    warn_untransformed(import, warnings);
    warn_passed(import, warnings);
    warn_made(import, warnings);
    (void)json_object_set_new(answer, "meshes", meshes);
    (void)json_object_set_new(answer, "volumes", volumes);
    (void)json_object_set_new(answer, "cohort",
                              cohort ? cohort_summary(import->call, cohort) : json_null());
    (void)json_object_set_new(answer, "summary", summary_of(import, cohort));
    (void)json_object_set_new(answer, "warnings", warnings);
    if (import->manifest) {
        (void)json_object_set_new(answer, "restored",
                                  json_pack("{s:I, s:I, s:I}", "surfaces",
                                            (json_int_t)import->n_restored[0], "models",
                                            (json_int_t)import->n_restored[1], "jobs",
                                            (json_int_t)import->n_restored[2]));
    }
    (void)json_object_set(answer, "refused", import->refused);
    (void)json_object_set_new(answer, "refusedCount", json_integer((json_int_t)import->n_refused));
    if (cohort) {
        (void)api_response_header(import->call->response, "Location", "/v1/cohorts/%s",
                                  cohort->name);
    }
    respond_json(import->call, created ? 201 : 200, answer);
}
