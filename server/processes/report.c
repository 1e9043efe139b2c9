/*
 * report.c - the process report: results of jobs as one file of HTML that opens offline, with
 * tables, charts, shapes that turn, and a paragraph on methods to paste into a paper.
 *
 * It knows results by their form alone (report_values.c), and of each process the sentence that its
 * file gives for a paper (struct api_process), so a new process needs nothing here. Results of jobs
 * do not change, and neither does a report of them: it is cached like any other result.
 *
 * Numbers in tables have six digits; charts are drawn in the browser from the results as they are,
 * which the file carries without long arrays.
 */
#include "processes/report.h"

#include <stdlib.h>
#include <string.h>

#include "api/respond.h"
#include "api/warnings.h"
#include "compute/seconds.h"
#include "processes/processes.h"
#include "store/job.h"

#define NUMBERS_MAX 600   /* of an array that charts are drawn from */
#define MATRIX_MAX 250000 /* of a matrix */

/* ---- Inputs and outputs ---------------------------------------------------------------------- */

static const struct process_input inputs[] = {
    {"jobs", INPUT_OWN, offsetof(struct report, jobs),
     "Jobs that ended successfully, or cohort instead. Each becomes a section, in this order.",
     .own = &report_jobs_own, .unless = "cohort"},
    {"cohort", INPUT_OWN, offsetof(struct report, jobs),
     "Name of a cohort, instead of jobs: the last of each analysis of it.",
     .own = &report_cohort_own, .unless = "jobs"},
    {"title", INPUT_OWN, offsetof(struct report, title),
     "Its heading. Default: the name of the only job or of the cohort.", .own = &report_title_own},
    {"modes", INPUT_INTEGER, offsetof(struct report, modes),
     "Of each model so many components are computed to be looked at, from -2 to 2 standard "
     "deviations.",
     .lowest = 0, .highest = REPORT_MODES_MAX, .fallback = 3},
    {"resolution", INPUT_INTEGER, offsetof(struct report, resolution),
     "Edge divisions of the icosahedron that shapes are drawn with: a shape has ten times the "
     "square of it as vertices. With the default it adds 46 kB, and 15 kB for each of its maps.",
     .lowest = REPORT_RESOLUTION_MIN, .highest = REPORT_RESOLUTION_MAX,
     .fallback = REPORT_RESOLUTION_DEFAULT},
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"html", OUTPUT_STRING ",\"contentMediaType\":\"text/html\"",
     "The report. /v1/jobs/{id}/results/html gives it as a file."},
    {"bytes", OUTPUT_INTEGER, "Of it."},
    {"shapes", OUTPUT_INTEGER, "That it carries; what its size allowed."},
    {"sections", OUTPUT_OBJECTS, "What it is of: job, process and name of each."},
    {NULL, NULL, NULL},
};

/* ---- A section ------------------------------------------------------------------------------- */

/* A job with its results. */
struct section {
    struct store_job job;
    json_t *results;
    const struct api_process *process; /* NULL: of an older version */
};

static void section_clear(struct section *section)
{
    store_job_clear(&section->job);
    json_decref(section->results);
}

static const struct api_process *find_process(const char *id)
{
    const struct api_process *const *rows = processes.rows;

    while (*rows && strcmp((*rows)->id, id) != 0) {
        rows++;
    }
    return *rows;
}

/* False with the problem set. */
static bool section_read(struct jobs_run *run, const char *id, struct section *section,
                         struct jobs_result *result)
{
    struct store *store = jobs_run_store(run);
    char *text = NULL;
    size_t size = 0;
    int status = store_job_get(store, id, &section->job);

    if (status == 0) {
        status = store_job_results(store, id, &text, &size);
    }
    if (status) {
        (void)compute_fail_store(result, status, id);
        return false;
    }
    section->process = find_process(section->job.process);
    section->results = json_memory_load(text, size, 0, NULL, NULL);
    free(text);
    if (!section->results) {
        (void)compute_fail(result, SRNF_ENOMEM, NULL, "reading the results of a job");
    }
    return section->results != NULL;
}

static const char *title_of(const struct section *section)
{
    return section->process ? section->process->title : section->job.process;
}

static const char *cohort_of(const struct section *section)
{
    const json_t *cohort = json_object_get(json_object_get(section->results, "inputs"), "cohort");
    const char *name = json_string_value(json_object_get(cohort, "name"));

    return name ? name : json_string_value(cohort);
}

static void put_warnings(FILE *out, const json_t *results)
{
    const json_t *warnings = json_object_get(results, "warnings"), *one;
    size_t i;

    if (json_array_size(warnings) == 0) {
        return;
    }
    (void)fputs("<section class=\"warning\"><h3>Reasons to doubt</h3><ul>", out);
    json_array_foreach(warnings, i, one)
    {
        (void)fputs("<li><code>", out);
        report_text(out, json_string_value(json_object_get(one, "code")));
        (void)fputs("</code> ", out);
        report_text(out, json_string_value(json_object_get(one, "detail")));
        (void)fputs("</li>", out);
    }
    (void)fputs("</ul></section>", out);
}

static void put_head(FILE *out, const struct section *section, size_t number)
{
    const char *name = section->job.name, *cohort = cohort_of(section);

    (void)fprintf(out, "<section id=\"section-%zu\"><h2>", number);
    report_text(out, title_of(section));
    (void)fputs("</h2><p class=\"quiet\">", out);
    if (name && name[0]) {
        report_text(out, name);
        (void)fputs(". ", out);
    }
    if (cohort) {
        (void)fputs("Cohort ", out);
        report_text(out, cohort);
        (void)fputs(". ", out);
    }
    (void)fprintf(out, "Job %s.</p>", section->job.id);
    put_warnings(out, section->results);
    (void)fprintf(out, "<div class=\"charts\" data-section=\"%zu\"></div>", number);
}

static bool is_long(const json_t *array)
{
    const json_t *first = json_array_get(array, 0);
    size_t n = json_array_size(array);

    return json_is_array(first) ? n * json_array_size(first) > MATRIX_MAX : n > NUMBERS_MAX;
}

/* Drops what no chart is drawn from: long arrays of numbers, and what is told in words. */
static void prune(json_t *value)
{
    static const char *const dropped[] = {"inputs", "warnings", "registration", "history", "map"};
    json_t *member;
    const char *name;
    void *next;
    size_t i;

    for (i = 0; json_is_object(value) && i < sizeof dropped / sizeof dropped[0]; i++) {
        (void)json_object_del(value, dropped[i]);
    }
    json_object_foreach_safe(value, next, name, member)
    {
        if (is_long(member)) {
            (void)json_object_del(value, name);
        } else {
            prune(member);
        }
    }
    json_array_foreach(value, i, member)
    {
        prune(member);
    }
}

static bool put_data(struct report_page *page, struct section *section)
{
    bool whole;

    (void)fprintf(page->sections, "%s{\"process\":\"%s\",\"results\":", page->n_sections ? "," : "",
                  section->job.process);
    prune(section->results);
    whole = report_json(page->sections, section->results);
    (void)fputs("}", page->sections);
    if (!whole) {
        (void)compute_fail(page->result, SRNF_ENOMEM, NULL, "the data of the report");
    }
    return whole;
}

/* ---- The whole ------------------------------------------------------------------------------- */

/* Writes the section, and its methods. */
static bool put_section(struct report_page *page, const char *id, struct report_methods *methods,
                        json_t *list)
{
    struct section section = {.results = NULL};
    bool good = section_read(page->run, id, &section, page->result);

    if (good) {
        put_head(page->body, &section, page->n_sections);
        page->results = section.results;
        good = report_members(page, section.results, 0);
        (void)fputs("</section>", page->body);
    }
    if (good) {
        const struct report_job job = {section.job.id, section.job.process,
                                       section.job.finished_ms};

        report_methods_add(methods, &job, section.results, section.process);
        (void)json_array_append_new(list, json_pack("{s:s, s:s, s:s}", "job", section.job.id,
                                                    "process", section.job.process, "name",
                                                    section.job.name ? section.job.name : ""));
        good = put_data(page, &section);
        page->n_sections++;
    }
    section_clear(&section);
    return good;
}

/* All sections, and the methods of all behind them. */
static bool put_sections(struct report_page *page, json_t *list)
{
    const struct report_jobs *jobs = &page->asked->jobs;
    struct report_methods methods;
    bool opened = report_methods_open(&methods), good = opened, whole;

    for (size_t i = 0; good && i < jobs->n; i++) {
        jobs_run_phase(page->run, 100.0 / (double)jobs->n);
        good = put_section(page, jobs->ids[i], &methods, list);
    }
    whole = report_methods_close(&methods, good ? page->body : NULL);
    if (!opened || (good && !whole)) {
        (void)compute_fail(page->result, SRNF_ENOMEM, NULL, "the methods of the report");
    }
    return good && whole;
}

static void warn_omitted(const struct report_page *page, json_t *document)
{
    char text[240];

    if (page->n_omitted > 0) {
        report_omitted(page, text, sizeof text);
        warning_add(warnings_of(document), "shapes-omitted",
                    json_pack("{s:I, s:I, s:i}", "omitted", (json_int_t)page->n_omitted, "shown",
                              (json_int_t)page->n_shapes, "resolution",
                              (int)page->asked->resolution),
                    "%s", text);
    }
}

static json_t *run_report(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct report *asked = typed;
    struct report_page page = {0};
    json_t *list = json_array(), *document = NULL;
    char *html = NULL;
    size_t size = 0;

    if (report_page_open(&page, run, asked, result) && put_sections(&page, list)) {
        html = report_page_close(&page, &size);
    }
    if (html) {
        document =
            json_pack("{s:o, s:I, s:I, s:O}", "html", json_stringn(html, size), "bytes",
                      (json_int_t)size, "shapes", (json_int_t)page.n_shapes, "sections", list);
        warn_omitted(&page, document);
    }
    report_page_clear(&page);
    free(html);
    json_decref(list);
    return document;
}

/* Most of it is inverting modes, where there are models. */
static double seconds(const struct api_work *work, const json_t *given)
{
    const json_t *cohort = json_object_get(given, "cohort");
    const json_t *jobs = json_object_get(json_is_object(cohort) ? cohort : given, "jobs");
    double modes = (double)json_integer_value(json_object_get(given, "modes"));

    return (double)json_array_size(jobs) * 0.2 +
           4.0 * modes * seconds_of_inversion((double)work->degree);
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct report),
    .complete = report_complete,
    .run = run_report,
};

const struct api_process report_process = {
    .id = "report",
    .title = "Report",
    .description = "Results of jobs, or of all analyses of a cohort, as one file of HTML that "
                   "opens offline: tables, charts, shapes that turn, and a paragraph on methods.",
    .table = &table,
    .seconds = seconds,
};
