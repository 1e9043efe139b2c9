/*
 * encode_rows.c - what encode of a cohort answers: the rows of its members as JSON and CSV.
 */
#include "processes/encode.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/tables.h"
#include "api/warnings.h"

/* ---- JSON ---------------------------------------------------------------------------- */

/* The first problem of all, where no surface came of any mesh. */
static void fail_all(const json_t *rows, struct jobs_result *result)
{
    for (size_t i = 0; i < json_array_size(rows) && !result->problem_code; i++) {
        const json_t *problem = json_object_get(json_array_get(rows, i), "problem");
        const char *code = json_string_value(json_object_get(problem, "code"));
        const char *detail = json_string_value(json_object_get(problem, "detail"));

        if (code) {
            result->problem_code = problem_static_code(code);
            (void)snprintf(result->problem_detail, sizeof result->problem_detail,
                           "Of the %zu members none could be encoded. The first: %.300s",
                           json_array_size(rows), detail ? detail : "");
        }
    }
}

json_t *encode_rows_document(const struct encoding *encoding, json_t *rows,
                             struct jobs_result *result)
{
    json_t *document = json_object();
    size_t encoded = 0, failed = 0;

    for (size_t i = 0; i < json_array_size(rows); i++) {
        const json_t *row = json_array_get(rows, i);
        bool problem = !json_is_null(json_object_get(row, "problem"));

        failed += problem;
        encoded += !problem && json_is_true(json_object_get(row, "encoded"));
        warnings_merge(warnings_of(document), json_object_get(row, "warnings"));
    }
    if (encoded == 0) {
        fail_all(rows, result);
        json_decref(document);
        return NULL;
    }
    (void)json_object_set(document, "cohort", json_object_get(encoding->cohort.cohort, "name"));
    (void)json_object_set_new(document, "encoded", json_integer((json_int_t)encoded));
    (void)json_object_set_new(document, "failed", json_integer((json_int_t)failed));
    (void)json_object_set(document, "rows", rows);
    return document;
}

/* ---- CSV ------------------------------------------------------------------------------------- */

static void write_number(FILE *out, const json_t *value)
{
    if (json_is_number(value)) {
        csv_number(out, false, json_number_value(value));
    } else {
        csv_text(out, false, "");
    }
}

static void write_text(FILE *out, const json_t *value)
{
    const char *text = json_string_value(value);

    csv_text(out, false, text ? text : "");
}

static void write_row(FILE *out, const json_t *row)
{
    const json_t *fit = json_object_get(row, "fit"), *problem = json_object_get(row, "problem");
    static const char *const texts[] = {"id", "label", "subject", "surface", "route"};
    static const char *const numbers[] = {"lmax", "scale", "area", "volume"};

    csv_number(out, true, json_number_value(json_object_get(row, "member")));
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        write_text(out, json_object_get(row, texts[i]));
    }
    csv_text(out, false, json_is_true(json_object_get(row, "mirrored")) ? "true" : "false");
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
        write_number(out, json_object_get(row, numbers[i]));
    }
    write_number(out, json_object_get(fit, "rms"));
    write_number(out, json_object_get(fit, "max"));
    write_text(out, json_object_get(problem, "code"));
    write_text(out, json_object_get(problem, "detail"));
    csv_end_line(out);
}

bool encode_table_fits(const json_t *results, char why[API_WHY_MAX])
{
    const json_t *row, *rows = json_object_get(results, "rows");
    size_t i;

    (void)snprintf(why, API_WHY_MAX, "rows is no array");
    if (rows && !json_is_array(rows)) {
        return false;
    }
    json_array_foreach(rows, i, row)
    {
        if (!json_is_object(row)) {
            (void)snprintf(why, API_WHY_MAX, "row %zu of rows is no object", i + 1);
            return false;
        }
    }
    return true;
}

void encode_respond_table(struct api_call *call, const struct store_job *job, int form)
{
    static const char *const head[] = {"member", "id",       "label",  "subject", "surface",
                                       "route",  "mirrored", "lmax",   "scale",   "area",
                                       "volume", "fitRms",   "fitMax", "problem", "detail"};
    char name[TABLE_NAME_MAX];
    json_t *document = table_results(call, job, "encodings", name);
    const json_t *rows = json_object_get(document, "rows");
    struct table_text text;

    if (!document) {
        return;
    }
    if (!json_is_array(rows) || form != TABLE_CSV) {
        (void)problem_respond(call, "not-acceptable",
                              "The results of encode are served as application/json, those of a "
                              "cohort as text/csv too.");
    } else if (table_open(call, &text)) {
        for (size_t i = 0; i < sizeof head / sizeof head[0]; i++) {
            csv_text(text.out, i == 0, head[i]);
        }
        csv_end_line(text.out);
        for (size_t i = 0; i < json_array_size(rows); i++) {
            write_row(text.out, json_array_get(rows, i));
        }
        table_respond_csv(call, &text, name);
    }
    json_decref(document);
}
