/*
 * register.h - what the files of one registration share: register.c checks and drives,
 * register_pair.c searches, in both directions where it is symmetric, register_report.c tells what
 * was found.
 */
#ifndef SRNF_REGISTRATION_REGISTER_H
#define SRNF_REGISTRATION_REGISTER_H

#include "landmarks.h"

/* What one call works on. */
struct call {
    const struct srnf_sht *sht;
    const struct srnf_register_options *options;
    const struct srnf_context *context;
    struct landmark_search *landmarks; /* from the template to the moving surface, or NULL */
    const struct subject *subjects[2]; /* of the template and of the moving surface, or NULL */
    struct tabulated_tools *tools;
    bool own_tools;
    size_t degree, count, n; /* count = 3 (L+1)^2, n = grid points */
    double *q1, *q2;         /* [3][n] of the template and of the moving surface as given */
    void *workspace;
};

/* Registration with q_template as the template's field, from nothing (chain NULL) or from a chain.
   surface: of the template, or NULL. */
SRNF_CHECKED int register_one_way(const struct call *call, const double *q_template,
                                  const double *surface, const double *moving,
                                  const struct srnf_warp *chain, struct search_result *result);
/* The same for both directions; the answer does not depend on which surface is the template. gap:
   of the two objectives, relative to the larger. */
SRNF_CHECKED int register_both_ways(const struct call *call, const double *template_surface,
                                    const double *moving, struct search_result *result,
                                    double *gap);
/* That gap of two objectives: 1 where one alone is infinite, NaN where both are. */
double register_gap(double a, double b);

/* What is told of it, from exact values on the template's grid. Takes the chain out of found. */
SRNF_CHECKED int register_report(const struct call *call, const double *moving,
                                 struct search_result *found, struct srnf_registration *r);

#endif
