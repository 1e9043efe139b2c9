/*
 * classify_table.c - the members of a finished classification as CSV: a line for each method and
 * member, with what it is, what it was taken for, and the evidence for each class.
 */
#include "processes/classify.h"

#include <stdio.h>
#include <stdlib.h>

#include "api/tables.h"

static const char *const evidence[] = {"logLikelihoods", "nearestDistances"};
static const char *const evidence_heads[] = {"logLikelihood", "nearestDistance"};

static void write_heads(FILE *out, const json_t *classes)
{
    static const char *const heads[] = {"method", "member", "subject", "id", "label", "predicted"};
    const char *text;
    char head[160];

    for (size_t i = 0; i < sizeof heads / sizeof heads[0]; i++) {
        csv_text(out, i == 0, heads[i]);
    }
    for (size_t k = 0; k < 2; k++) {
        for (size_t c = 0; c < json_array_size(classes); c++) {
            text = json_string_value(json_array_get(classes, c));
            (void)snprintf(head, sizeof head, "%s %.120s", evidence_heads[k], text ? text : "");
            csv_text(out, false, head);
        }
    }
    csv_end_line(out);
}

static void write_text(FILE *out, const json_t *value)
{
    csv_text(out, false, json_is_string(value) ? json_string_value(value) : "");
}

/* A member without a subject has its name in the results: here its number tells it from others. */
static void write_member(FILE *out, const char *method, const json_t *cohort, const json_t *classes,
                         const json_t *member, size_t i)
{
    csv_text(out, true, method);
    csv_number(out, false, (double)(i + 1));
    write_text(out, json_array_get(json_object_get(cohort, "subjects"), i));
    write_text(out, json_array_get(json_object_get(cohort, "surfaces"), i));
    write_text(out, json_object_get(member, "label"));
    write_text(out, json_object_get(member, "predicted"));
    for (size_t k = 0; k < 2; k++) {
        const json_t *values = json_object_get(member, evidence[k]);

        for (size_t c = 0; c < json_array_size(classes); c++) {
            const char *name = json_string_value(json_array_get(classes, c));
            const json_t *value = name ? json_object_get(values, name) : NULL;

            if (json_is_number(value)) {
                csv_number(out, false, json_number_value(value));
            } else {
                csv_text(out, false, "");
            }
        }
    }
    csv_end_line(out);
}

static void write_all(FILE *out, json_t *document)
{
    const json_t *classes = json_object_get(document, "classes");
    const json_t *cohort = json_object_get(json_object_get(document, "inputs"), "cohort");
    const char *method;
    json_t *found;

    write_heads(out, classes);
    json_object_foreach(json_object_get(document, "methods"), method, found)
    {
        const json_t *members = json_object_get(found, "perSubject");

        for (size_t i = 0; i < json_array_size(members); i++) {
            write_member(out, method, cohort, classes, json_array_get(members, i), i);
        }
    }
}

bool classify_table_fits(const json_t *results, char why[API_WHY_MAX])
{
    json_t *found, *methods = json_object_get(results, "methods");
    const char *method;

    (void)snprintf(why, API_WHY_MAX, "it has no array of classes, or no object of methods");
    if (!json_is_array(json_object_get(results, "classes")) || !json_is_object(methods)) {
        return false;
    }
    json_object_foreach(methods, method, found)
    {
        if (!json_is_array(json_object_get(found, "perSubject"))) {
            (void)snprintf(why, API_WHY_MAX, "method %.60s has no array perSubject", method);
            return false;
        }
    }
    return true;
}

void classify_respond_table(struct api_call *call, const struct store_job *job, int form)
{
    char name[TABLE_NAME_MAX];
    struct table_text text;
    json_t *document;

    if (form == TABLE_NPY) {
        (void)problem_respond(call, "not-acceptable",
                              "The results of classify are served as application/json and "
                              "text/csv.");
        return;
    }
    document = table_results(call, job, "classify", name);
    if (document && table_open(call, &text)) {
        write_all(text.out, document);
        table_respond_csv(call, &text, name);
    }
    json_decref(document);
}
