/*
 * tables.h - tables of numbers as JSON, CSV (RFC 4180) or .npy: which of them a request wants, and
 * how the last two are written.
 */
#ifndef SRNFD_API_TABLES_H
#define SRNFD_API_TABLES_H

#include <stdio.h>

#include "api/handler.h"

#define CSV_CONTENT_TYPE "text/csv"

enum table_form { TABLE_JSON, TABLE_CSV, TABLE_NPY };

/* ?format=json|csv|npy, otherwise what Accept likes best. False when a problem was answered. */
bool table_choose(struct api_call *call, enum table_form *form);
const char *table_form_name(enum table_form form);

/* One field of a line, quoted where it has to be, empty for NULL; a separator before it unless it
   is the first. */
void csv_text(FILE *out, bool first, const char *text);
void csv_number(FILE *out, bool first, double value);
void csv_end_line(FILE *out);
/* What each line on a member of a group begins with: its name, which no other has, the subject, if
   the cohort tells one, and the id of the mesh or surface. The heads of these columns, and the
   fields of member i; subjects and ids are arrays, or NULL. */
void csv_member_heads(FILE *out);
void csv_member(FILE *out, const json_t *labels, const json_t *subjects, const json_t *ids,
                size_t i);

#define TABLE_NAME_MAX (STORE_ID_MAX + 16)

/* A text under construction: table_open, lines written to ->out, table_respond_csv, which answers
   (or answers that memory is short) and frees. */
struct table_text {
    FILE *out; /* NULL: no memory */
    char *bytes;
    size_t size;
};
bool table_open(struct api_call *call, struct table_text *text);
/* name is that of the file, without its extension. */
void table_respond_csv(struct api_call *call, struct table_text *text, const char *name);
void table_respond_npy(struct api_call *call, const double *values, size_t n_dimensions,
                       const size_t *shape, const char *name);

/* Whether the member of the results has n rows of k numbers; why: as of table_fits (handler.h). */
bool table_rows_fit(const json_t *results, const char *member, size_t n, size_t k,
                    char why[API_WHY_MAX]);
/* The results of a job as a document (new reference) that fits its process's table, and what a
   table of them is called; NULL: a problem was answered. */
struct store_job; /* store/job.h */
json_t *table_results(struct api_call *call, const struct store_job *job, const char *suffix,
                      char name[TABLE_NAME_MAX]);

#endif
