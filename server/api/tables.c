/*
 * tables.c - choosing between JSON, CSV and .npy, and writing CSV.
 *
 * CSV follows RFC 4180: lines end with CR LF, a field that holds a quote, a comma or an end of
 * line stands in quotes with its quotes doubled. Numbers have 15 digits where these read back as
 * the same doubles, or else 16 or 17, which always do. The daemon never sets a
 * locale, so that the decimal sign is a point.
 */
#include "api/tables.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "api/npy.h"
#include "api/respond.h"
#include "store/job.h"

#define NUMBER_MAX 32

static const char *const types[] = {"application/json", CSV_CONTENT_TYPE, NPY_CONTENT_TYPE, NULL};
static const char *const names[] = {"json", "csv", "npy"};

const char *table_form_name(enum table_form form)
{
    return names[form];
}

bool table_choose(struct api_call *call, enum table_form *form)
{
    struct problem_list problems = {.errors = NULL};
    bool refused = false;
    char text[16];
    int best;

    *form = TABLE_JSON;
    if (query_get(call, "format", text, sizeof text, &refused)) {
        for (int i = TABLE_JSON; i <= TABLE_NPY; i++) {
            if (strcmp(text, names[i]) == 0) {
                *form = (enum table_form)i;
                return true;
            }
        }
        problem_add(&problems, "/format", "format must be json, csv or npy");
        (void)problem_respond_list(call, "invalid-input", &problems);
        return false;
    }
    if (refused) {
        return false;
    }
    best = accept_best(call->request, types);
    if (best < 0) {
        (void)problem_respond(call, "not-acceptable", "This is served as %s, %s and %s.", types[0],
                              types[1], types[2]);
        return false;
    }
    *form = (enum table_form)best;
    return true;
}

void csv_text(FILE *out, bool first, const char *text)
{
    if (!first) {
        (void)fputc(',', out);
    }
    if (!text || !text[strcspn(text, "\",\r\n")]) {
        (void)fputs(text ? text : "", out);
        return;
    }
    (void)fputc('"', out);
    for (; *text; text++) {
        if (*text == '"') {
            (void)fputc('"', out);
        }
        (void)fputc(*text, out);
    }
    (void)fputc('"', out);
}

void csv_number(FILE *out, bool first, double value)
{
    if (!first) {
        (void)fputc(',', out);
    }
    /* What is not finite is an empty field, as it is null in JSON. */
    if (isfinite(value)) {
        char text[NUMBER_MAX];
        int digits = 15;

        do {
            (void)snprintf(text, sizeof text, "%.*g", digits, value);
        } while (digits++ < 17 && strtod(text, NULL) != value);
        (void)fputs(text, out);
    }
}

void csv_end_line(FILE *out)
{
    (void)fputs("\r\n", out);
}

void csv_member_heads(FILE *out)
{
    csv_text(out, true, "label");
    csv_text(out, false, "subject");
    csv_text(out, false, "id");
}

void csv_member(FILE *out, const json_t *labels, const json_t *subjects, const json_t *ids,
                size_t i)
{
    const json_t *const fields[] = {labels, subjects, ids};

    for (size_t k = 0; k < 3; k++) {
        const char *text = json_string_value(json_array_get(fields[k], i));

        csv_text(out, k == 0, text ? text : "");
    }
}

bool table_open(struct api_call *call, struct table_text *text)
{
    *text = (struct table_text){NULL, NULL, 0};
    text->out = open_memstream(&text->bytes, &text->size);
    if (!text->out) {
        (void)problem_respond(call, "out-of-memory", "The table does not fit into memory now.");
    }
    return text->out != NULL;
}

static void name_file(struct api_call *call, const char *name, const char *extension)
{
    (void)api_response_header(call->response, "Content-Disposition",
                              "attachment; filename=\"%s.%s\"", name, extension);
}

void table_respond_csv(struct api_call *call, struct table_text *text, const char *name)
{
    bool failed = ferror(text->out) != 0;

    failed = fclose(text->out) != 0 || failed || !text->bytes;
    if (failed) {
        free(text->bytes);
        (void)problem_respond(call, "out-of-memory", "The table does not fit into memory now.");
        return;
    }
    name_file(call, name, "csv");
    respond_bytes(call, 200, CSV_CONTENT_TYPE "; charset=utf-8; header=present",
                  (unsigned char *)text->bytes, text->size);
}

void table_respond_npy(struct api_call *call, const double *values, size_t n_dimensions,
                       const size_t *shape, const char *name)
{
    unsigned char *bytes;
    size_t size;

    if (npy_write(values, n_dimensions, shape, &bytes, &size)) {
        (void)problem_respond(call, "out-of-memory", "The array does not fit into memory now.");
        return;
    }
    name_file(call, name, "npy");
    respond_bytes(call, 200, NPY_CONTENT_TYPE, bytes, size);
}

bool table_rows_fit(const json_t *results, const char *member, size_t n, size_t k,
                    char why[API_WHY_MAX])
{
    const json_t *rows = json_object_get(results, member), *row, *value;
    size_t i, j;

    if (!json_is_array(rows) || json_array_size(rows) != n) {
        (void)snprintf(why, API_WHY_MAX, "%.40s has %zu rows for %zu labels", member,
                       json_array_size(rows), n);
        return false;
    }
    json_array_foreach(rows, i, row)
    {
        if (!json_is_array(row) || json_array_size(row) != k) {
            (void)snprintf(why, API_WHY_MAX, "row %zu of %.40s has %zu numbers instead of %zu",
                           i + 1, member, json_array_size(row), k);
            return false;
        }
        json_array_foreach(row, j, value)
        {
            if (!json_is_number(value)) {
                (void)snprintf(why, API_WHY_MAX, "%.40s has in row %zu, column %zu no number",
                               member, i + 1, j + 1);
                return false;
            }
        }
    }
    return true;
}

json_t *table_results(struct api_call *call, const struct store_job *job, const char *suffix,
                      char name[TABLE_NAME_MAX])
{
    const struct api_process *process = api_process_find(call->api, job->process);
    char why[API_WHY_MAX] = "this is no JSON";
    json_t *document;
    char *text = NULL;
    size_t size = 0;
    int status = store_job_results(call->api->config.store, job->id, &text, &size);

    if (status) {
        (void)problem_respond_store(call, status, "no-such-job", job->id);
        return NULL;
    }
    document = json_loadb(text, size, 0, NULL);
    free(text);
    if (!document || (process && process->table_fits && !process->table_fits(document, why))) {
        (void)problem_respond(call, "data-damaged",
                              "The stored results are not what the process writes: %s.", why);
        json_decref(document);
        return NULL;
    }
    (void)snprintf(name, TABLE_NAME_MAX, "%s-%s", job->id, suffix);
    return document;
}
