/*
 * report.h - the report of `make paper`: one HTML file that needs nothing else, neither a network
 * nor another file. Pictures are PNG in data URIs, charts are SVG in the text.
 *
 * Every function ends the program when memory or the disk is short: half a report is none.
 */
#ifndef TESTS_PAPER_REPORT_H
#define TESTS_PAPER_REPORT_H

#include <stdbool.h>
#include <stddef.h>

struct report;

/* Writes to a temporary file beside path; report_close gives it its name. */
struct report *report_open(const char *path, const char *title);
void report_close(struct report *report);

/* A heading with an anchor; `source` tells which figure or table of the paper it answers. */
void report_section(struct report *report, const char *title, const char *source);
__attribute__((format(printf, 2, 3))) void report_paragraph(struct report *report,
                                                            const char *format, ...);

/* A table: a row of headings, rows of cells. Cells are text; numbers are set by their caller. */
void report_table_open(struct report *report, const char *caption, size_t columns,
                       const char *const *headings);
__attribute__((format(printf, 2, 3))) void report_cell(struct report *report, const char *format,
                                                       ...);
void report_table_close(struct report *report);

/* A row of pictures under one caption. */
void report_row_open(struct report *report, const char *caption);
__attribute__((format(printf, 4, 5))) void report_picture(struct report *report,
                                                          const unsigned char *png, size_t size,
                                                          const char *format, ...);
void report_row_close(struct report *report);

/* One line of a chart. */
struct report_line {
    const char *name;
    size_t count;
    const double *x, *y;
    const double *error; /* standard errors as bars, or NULL */
};
/* A line chart; logarithmic: y > 0, others are left out. */
void report_chart(struct report *report, const char *caption, const char *x_title,
                  const char *y_title, bool logarithmic, size_t count,
                  const struct report_line *lines);

#endif
