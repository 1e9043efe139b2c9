/*
 * report_methods.c - what was done: a paragraph of each job to paste into a paper, and a table of
 * what repeats it, the options, the job and the build.
 */
#include <stdlib.h>
#include <string.h>

#include "processes/report.h"

#define SENTENCE_MAX 1024
#define LABELS_TOLD 8
#define LIST_TOLD 12 /* elements of an option */

/* What a process says of itself. Words in square brackets are of a registration. warps: whether
   there is a choice to register. */
static void put_sentence(FILE *out, const char *text, bool warps, bool registered)
{
    char kept[SENTENCE_MAX];
    bool inside = false, depends = false;
    size_t n = 0;

    for (; *text && n + 1 < sizeof kept; text++) {
        if (*text == '[' || *text == ']') {
            inside = *text == '[';
            depends = true;
        } else if ((warps && registered) || !inside) {
            kept[n++] = *text;
        }
    }
    kept[n] = '\0';
    report_text(out, kept);
    if (depends && warps && !registered) {
        (void)fputs(". Shapes were not registered, but compared as they are parameterized", out);
    }
    (void)fputs(".", out);
}

/* How often each text of an array is in it, in the order of the first; NULL without memory. */
static json_t *counts_of(const json_t *texts)
{
    json_t *counts = json_object();
    const json_t *one;
    size_t i;

    json_array_foreach(texts, i, one)
    {
        const char *text = json_string_value(one);

        if (text) {
            json_int_t n = json_integer_value(json_object_get(counts, text));

            (void)json_object_set_new(counts, text, json_integer(n + 1));
        }
    }
    return counts;
}

static void put_labels(FILE *out, const json_t *labels)
{
    json_t *counts = counts_of(labels), *count;
    size_t n = json_object_size(counts);
    const char *label, *before = " (";

    if (n > 0 && n <= LABELS_TOLD) {
        json_object_foreach(counts, label, count)
        {
            (void)fprintf(out, "%s%lld of label ", before, (long long)json_integer_value(count));
            report_text(out, label);
            before = ", ";
        }
        (void)fputs(")", out);
    }
    json_decref(counts);
}

/* How many shapes there were, of which labels and of how many subjects: once, where jobs of one
   cohort follow each other. */
static void put_group(struct report_methods *methods, const json_t *given)
{
    FILE *out = methods->words;
    const json_t *cohort = json_object_get(given, "cohort");
    const json_t *own = json_object_get(cohort, "surfaces");
    const json_t *surfaces = own ? own : json_object_get(given, "surfaces");
    const char *name = json_string_value(json_object_get(cohort, "name"));
    json_t *subjects = counts_of(json_object_get(cohort, "subjects"));
    size_t n = json_array_size(surfaces), people = json_object_size(subjects);

    if (n > 1 && !(name && methods->shapes == n && strcmp(methods->cohort, name) == 0)) {
        (void)fprintf(out, " There were %zu shapes", n);
        put_labels(out, json_object_get(cohort, "labels"));
        if (people > 0 && people != n) {
            (void)fprintf(out, " of %zu subjects", people);
        }
        (void)fputs(name ? ", of the cohort " : "", out);
        report_text(out, name ? name : "");
        (void)fputs(".", out);
    }
    methods->shapes = n;
    (void)snprintf(methods->cohort, sizeof methods->cohort, "%s", name ? name : "");
    json_decref(subjects);
}

static void put_option(FILE *out, const char *name, const json_t *value, const char **before)
{
    size_t n = json_array_size(value), i;
    const json_t *one;

    if (json_is_null(value) || json_is_object(value) || n > LIST_TOLD ||
        (json_is_array(value) && (n == 0 || json_is_object(json_array_get(value, 0))))) {
        return;
    }
    (void)fputs(*before, out);
    *before = ", ";
    report_text(out, name);
    (void)fputs(" = ", out);
    if (!json_is_array(value)) {
        report_scalar(out, value);
    }
    json_array_foreach(value, i, one)
    {
        (void)fputs(i ? " " : "", out);
        report_scalar(out, one);
    }
}

/* A row of what repeats the job. */
static void put_row(struct report_methods *methods, const struct report_job *job,
                    const json_t *results)
{
    const char *build = json_string_value(json_object_get(results, "numericBuild"));
    json_t *finished = json_time(job->finished_ms), *value;
    const char *before = "", *name;
    FILE *out = methods->details;

    (void)fputs("<tr><td>", out);
    report_text(out, job->process);
    (void)fprintf(out, "</td><td>%s</td><td>%.10s</td><td>", job->id,
                  json_is_string(finished) ? json_string_value(finished) : "");
    json_object_foreach(json_object_get(results, "inputs"), name, value)
    {
        put_option(out, name, value, &before);
    }
    (void)fputs("</td><td>", out);
    build = build ? build : "unknown";
    report_text(out, strcmp(build, methods->build) == 0 ? "the same" : build);
    (void)snprintf(methods->build, sizeof methods->build, "%s", build);
    (void)fputs("</td></tr>", out);
    json_decref(finished);
}

bool report_methods_open(struct report_methods *methods)
{
    memset(methods, 0, sizeof *methods);
    methods->words = open_memstream(&methods->texts[0], &methods->sizes[0]);
    methods->details = open_memstream(&methods->texts[1], &methods->sizes[1]);
    return methods->words && methods->details;
}

void report_methods_add(struct report_methods *methods, const struct report_job *job,
                        const json_t *results, const struct api_process *process)
{
    const json_t *given = json_object_get(results, "inputs");
    FILE *out = methods->words;

    (void)fputs("<p>", out);
    if (process && process->methods) {
        put_sentence(out, process->methods, report_warps(results),
                     !json_is_false(json_object_get(given, "register")));
    } else {
        report_text(out, process ? process->description : job->process);
    }
    put_group(methods, given);
    report_facts(out, results);
    (void)fputs("</p>", out);
    methods->srnfs = methods->srnfs || report_uses_srnfs(results);
    put_row(methods, job, results);
}

bool report_methods_close(struct report_methods *methods, FILE *out)
{
    bool whole = methods->words && methods->details;

    whole = methods->words && fclose(methods->words) == 0 && whole;
    whole = methods->details && fclose(methods->details) == 0 && whole;
    if (whole && out) {
        (void)fprintf(out,
                      "<section class=\"methods\"><h2>Methods</h2><p>Shapes were analysed with "
                      "srnfd " SRNF_VERSION ".%s</p>",
                      methods->srnfs
                          ? " Square-root normal fields (SRNFs) are those of Xie, Jermyn, Kurtek "
                            "and Srivastava, Numerical Inversion of SRNFs for Efficient Elastic "
                            "Shape Analysis of Star-Shaped Objects, ECCV 2014."
                          : "");
        (void)fwrite(methods->texts[0], 1, methods->sizes[0], out);
        (void)fputs("<h3>Options and versions</h3><table><thead><tr><th scope=\"col\">process</th>"
                    "<th scope=\"col\">job</th><th scope=\"col\">ended</th><th scope=\"col\">"
                    "options</th><th scope=\"col\">numeric build</th></tr></thead><tbody>",
                    out);
        (void)fwrite(methods->texts[1], 1, methods->sizes[1], out);
        (void)fputs("</tbody></table></section>", out);
    }
    free(methods->texts[0]);
    free(methods->texts[1]);
    return whole;
}
