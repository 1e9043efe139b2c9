/*
 * report.h - what the files of the process report share (report.c).
 */
#ifndef SRNFD_PROCESSES_REPORT_H
#define SRNFD_PROCESSES_REPORT_H

#include <stdio.h>

#include "api/handler.h"
#include "api/respond.h"
#include "toolkit/table.h"

#define REPORT_JOBS_MAX 20
#define REPORT_MODES_MAX 10
#define REPORT_RESOLUTION_MIN 8
#define REPORT_RESOLUTION_DEFAULT 24
#define REPORT_RESOLUTION_MAX 64
#define REPORT_SHAPES_MIB 16 /* of shapes; others are named only */
#define REPORT_SHAPES_MAX ((size_t)REPORT_SHAPES_MIB << 20)
#define REPORT_ROWS_MAX 500 /* of a table */
#define REPORT_COLUMNS_MAX 16

struct report_jobs {
    size_t n;
    char ids[REPORT_JOBS_MAX][STORE_ID_MAX];
};

struct report {
    struct report_jobs jobs;
    char title[NAME_SIZE];
    long modes, resolution;
};

/* ---- Inputs (report_inputs.c) ---------------------------------------------------------------- */

extern const struct input_own report_jobs_own, report_cohort_own, report_title_own;
/* The title where none was given: the name of the only job, or of the cohort. */
void report_complete(struct process_inputs *given);

/* ---- A page (report_page.c) ------------------------------------------------------------------ */

/* A report while it is written: its body, the shapes and views that the body refers to by their
   numbers, and the results that charts are drawn from. */
struct report_page {
    struct jobs_run *run;
    const struct report *asked;
    struct jobs_result *result;
    FILE *body, *shapes, *views, *sections;
    char *texts[4]; /* of these, in their order */
    size_t sizes[4];
    const json_t *results; /* of the section that is written */
    size_t n_shapes, n_views, n_sections;
    size_t n_omitted;        /* shapes for which there was no room */
    struct srnf_mesh sphere; /* that surfaces are triangulated over */
};

/* False without memory; to be cleared in any case. */
bool report_page_open(struct report_page *page, struct jobs_run *run, const struct report *asked,
                      struct jobs_result *result);
void report_page_clear(struct report_page *page);
/* The page as one document (malloc), or NULL with the problem set. Nothing can be written after. */
char *report_page_close(struct report_page *page, size_t *size);

/* Why shapes are missing and what helps, as sentences. */
void report_omitted(const struct report_page *page, char *text, size_t size);

/* Text with all that has a meaning in HTML escaped, and without control characters. */
void report_text(FILE *out, const char *text);
/* A scalar as text: numbers with six digits. */
void report_scalar(FILE *out, const json_t *value);
/* A document as JSON that can stand in a script element: without < and >. */
bool report_json(FILE *out, const json_t *document);

/* ---- Words of results (report_terms.c) ------------------------------------------------------- */

/* What people call a member: "95 % interval" of confidenceInterval; of one without a name of its
   own "max iterations" of maxIterations. */
void report_words(FILE *out, const char *name);
/* Whether a member says something to a reader: not what the head of a section tells in words, nor
   what only a program needs. */
bool report_is_told(const char *name, const json_t *value);
/* A member of an object as text, if it fits into a cell (report_is_cell): lists of two numbers that
   are an interval as one, and a p that is the least possible with its sign. */
bool report_is_cell(const json_t *value);
void report_put_cell(FILE *out, const json_t *object, const char *name);

/* ---- Methods (report_methods.c) -------------------------------------------------------------- */

/* Methods while they are written: paragraphs for a paper, and rows of what repeats the jobs. */
struct report_methods {
    FILE *words, *details;
    char *texts[2]; /* of these, in their order */
    size_t sizes[2];
    char build[512];        /* of the last row */
    char cohort[NAME_SIZE]; /* of the last paragraph, and how many shapes it had */
    size_t shapes;
    bool srnfs; /* whether a job compared shapes by them */
};

/* False without memory; to be closed in any case. */
bool report_methods_open(struct report_methods *methods);
/* The job that is told of. */
struct report_job {
    const char *id, *process;
    int64_t finished_ms;
};
/* What a job did. process: NULL, of an older version. */
void report_methods_add(struct report_methods *methods, const struct report_job *job,
                        const json_t *results, const struct api_process *process);
/* Writes them, unless out is NULL. False without memory. */
bool report_methods_close(struct report_methods *methods, FILE *out);

/* What the inputs and the results of a job say that was done, as sentences that each begin with a
   space (report_facts.c). */
void report_facts(FILE *out, const json_t *results);
/* Whether a job compared shapes by square-root normal fields, and whether it had the choice to warp
   them: not where surfaces were turned alone. */
bool report_uses_srnfs(const json_t *results);
bool report_warps(const json_t *results);

/* ---- Tables (report_tables.c) ---------------------------------------------------------------- */

/* The members of an object that are cells, a row each. */
void report_figures(FILE *out, const json_t *object);
/* Lists that go with the labels of an object, such as the group and the distance of each member. */
void report_beside(FILE *out, const json_t *object);
/* A matrix of an object, named by what the result calls its rows. */
void report_matrix(const struct report_page *page, const json_t *object, const char *name,
                   const json_t *matrix);

/* ---- Its parts ------------------------------------------------------------------------------- */

/* The members of a result, whatever its process: tables, figures of shapes (report_values.c). False
   with the problem set, or where the run is canceled. */
bool report_members(struct report_page *page, const json_t *object, int depth);

/* Figures of a surface, of several along a path, and of a model's mean and modes, by the records of
   a result (report_shapes.c). As report_members. */
bool report_surface(struct report_page *page, const json_t *record);
bool report_path(struct report_page *page, const json_t *records);
bool report_model(struct report_page *page, const json_t *record);

/* The shape of a surface: its number, or that there is none, which is counted where it is for the
   size, or that it failed, with the problem set or the run canceled. */
#define REPORT_NONE (-1)
#define REPORT_FAILED (-2)
long report_shape(struct report_page *page, const json_t *record);
/* Begins a figure of a view, up to its caption, and takes the reference to the view. kind: a class
   of the element, or empty. False without memory, with the problem set. */
bool report_figure(struct report_page *page, json_t *view, const char *kind);
/* Names what has no shape to show. */
void report_not_shown(struct report_page *page, const char *name);

/* Lists that are seen as a whole (report_rows.c). report_rows: as report_members. */
bool report_is_rows(const json_t *list);
bool report_rows(struct report_page *page, const char *name, const json_t *list);
/* What registrations left at landmarks, of a pair or of a group whose members have these labels. */
bool report_is_landmarks(const char *name, const json_t *value);
void report_landmarks(FILE *out, const json_t *landmarks, const json_t *labels);
/* The analysis of variance of sides that were measured repeatedly, of so many subjects. */
bool report_is_replicates(const char *name, const json_t *value);
void report_replicates(FILE *out, const json_t *replicates, size_t subjects);
bool report_is_neighbours(const json_t *object);
void report_neighbours(FILE *out, const json_t *object);
/* The faces that all shapes share: numbers of 16 bits, in base64. */
void report_faces(FILE *out, const struct srnf_mesh *sphere);

#endif
