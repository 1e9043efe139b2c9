/*
 * formula_scan.h - what the files that read formulas share: the place in the text, words, and
 * factors.
 */
#ifndef SRNFD_TOOLKIT_FORMULA_SCAN_H
#define SRNFD_TOOLKIT_FORMULA_SCAN_H

#include "toolkit/formula.h"

#define FORMULA_POWER_MAX 9 /* one digit */

struct formula_parser {
    const char *start, *at; /* the text, and what is next */
    struct formula *formula;
    char *problem; /* [FORMULA_PROBLEM_MAX] the first one */
    int depth;     /* of brackets */
    int calls;     /* functions of functions */
    bool failed;
};

/* Notes a problem unless there is one. */
void formula_fail(struct formula_parser *p, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
/* Notes what is next where something else was expected. */
void formula_fail_here(struct formula_parser *p, const char *expected);
/* Over white space. */
void formula_skip(struct formula_parser *p);
/* Takes what, if it is next. */
bool formula_take(struct formula_parser *p, const char *what);
/* Whether a name may have this byte, as its first or a later one. */
bool formula_is_name(char c, bool first);
/* Up to the closing quote; the opening one was taken. A backslash before a quote or a backslash is
   left out, as in Python, but not between `..`. False with a problem. */
bool formula_take_quoted(struct formula_parser *p, char quote, char name[FORMULA_NAME_MAX]);
/* A name; false, and nothing taken, where none is next. */
bool formula_take_word(struct formula_parser *p, char name[FORMULA_NAME_MAX]);
/* "text" or 'text'. */
bool formula_take_text(struct formula_parser *p, char text[FORMULA_NAME_MAX]);
/* A number without quotes, as levels of numbers are spelled. */
bool formula_take_number(struct formula_parser *p, char text[FORMULA_NAME_MAX]);

/* The name of a covariate: a word, `..`, Q("..") or Q('..'). False with a problem. */
bool formula_take_name(struct formula_parser *p, char name[FORMULA_NAME_MAX]);
/* The rest of a function's call, after its opening bracket; adds it to what the factor has. */
void formula_read_call(struct formula_parser *p, const char *word, struct formula_factor *factor);
/* The bit of a factor, known or new; spells it. */
uint32_t formula_intern(struct formula_parser *p, struct formula_factor *factor);

#endif
