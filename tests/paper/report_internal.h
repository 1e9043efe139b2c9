/*
 * report_internal.h - what the files of the report share.
 */
#ifndef TESTS_PAPER_REPORT_INTERNAL_H
#define TESTS_PAPER_REPORT_INTERNAL_H

#include "paper/report.h"

#include <stdio.h>

struct report {
    FILE *out;
    char path[500], temporary[520];
    size_t sections, columns, cell;
};

/* Ends the program with a sentence unless good. */
void report_must(bool good, const char *what);
/* Text that has no meaning to HTML. */
void report_escape(struct report *report, const char *text);

#endif
