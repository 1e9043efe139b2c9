/*
 * section_transfer.c - Fig. 8 of the paper: the deformation of one left ventricle from end diastole
 * to end systole carried to another, against that subject's true end systole.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "paper/paper.h"
#include "paper/report_internal.h"
#include "support/compare.h"
#include "support/transfers.h"

#define DEGREE 15
#define SHOWN 3 /* pairs in pictures */

struct pairs {
    const struct transfers *t;
    size_t count;
    struct transfers_error (*errors)[TRANSFERS_WAYS]; /* [count] */
};

static void pair_of(const struct transfers *t, size_t index, size_t *from, size_t *to)
{
    *from = index / (t->n - 1);
    *to = index % (t->n - 1);
    *to += *to >= *from;
}

static void measure_pair(void *argument, size_t index)
{
    struct pairs *pairs = argument;
    double *guess = srnf_alloc(pairs->t->count, sizeof(double));
    size_t from;
    size_t to;

    report_must(guess != NULL, "out of memory");
    pair_of(pairs->t, index, &from, &to);
    for (int way = 0; way < TRANSFERS_WAYS; way++) {
        (void)transfers_guess(pairs->t, from, to, (enum transfers_way)way, guess);
        pairs->errors[index][way] = transfers_measure(pairs->t, to, (enum transfers_way)way, guess);
    }
    srnf_free(guess);
}

static void tell_way(struct report *report, const struct pairs *pairs, int way)
{
    struct transfers_error mean = {0.0, 0.0, 0.0};
    double worst = 0.0;
    size_t closer = 0;

    for (size_t i = 0; i < pairs->count; i++) {
        const struct transfers_error *error = &pairs->errors[i][way];

        mean.points += error->points / (double)pairs->count;
        mean.surface += error->surface / (double)pairs->count;
        mean.srnf += error->srnf / (double)pairs->count;
        worst = compare_max(worst, error->surface);
        closer += error->surface < pairs->errors[i][TRANSFERS_DISPLACEMENT].surface;
    }
    report_cell(report, "%s", transfers_names[way]);
    if (isfinite(mean.points)) {
        report_cell(report, "%.2f", mean.points);
    } else {
        report_cell(report, "-");
    }
    report_cell(report, "%.2f", mean.surface);
    report_cell(report, "%.2f", worst);
    if (isfinite(mean.srnf)) {
        report_cell(report, "%.3f", mean.srnf);
    } else {
        report_cell(report, "-");
    }
    report_cell(report, "%zu of %zu", closer, pairs->count);
}

static void show_pair(struct paper *paper, const struct transfers *t, size_t from, size_t to)
{
    static const char *const captions[] = {"source, diastole", "source, systole",
                                           "target, diastole", "target, true systole",
                                           "vertices",         "transfer"};
    double *guesses = srnf_alloc(2 * t->count, sizeof(double));
    const double *row[6] = {t->subjects[from].diastole,
                            t->subjects[from].systole,
                            t->subjects[to].diastole,
                            t->subjects[to].systole,
                            guesses,
                            guesses + t->count};
    struct picture_view view = picture_view_of(t->degree, t->subjects[to].diastole);
    char caption[200];

    report_must(guesses != NULL, "out of memory");
    (void)transfers_guess(t, from, to, TRANSFERS_DISPLACEMENT, guesses);
    (void)transfers_guess(t, from, to, TRANSFERS_SRNF_RATIO, guesses + t->count);
    (void)snprintf(caption, sizeof caption, "%s to %s; colour: distance to the true end systole",
                   t->subjects[from].name, t->subjects[to].name);
    paper_row(paper, caption, &view, t->degree, 6, row, t->subjects[to].systole, captions);
    srnf_free(guesses);
}

void paper_transfer(struct paper *paper)
{
    static const char *const headings[] = {
        "way",       "points, mm",     "surfaces, mm",
        "worst, mm", "SRNF, relative", "closer than the vertices' displacement"};
    struct transfers t;
    struct pairs pairs;
    double ratio[2] = {0.0, 0.0};

    report_section(paper->report, "Deformation transfer between ventricles",
                   "Fig. 8: end diastole to end systole of one subject, applied to another");
    if (!transfers_open(&t, PAPER_DATA, DEGREE)) {
        report_paragraph(paper->report, "Left out: the pairs of ventricles are not there.");
        return;
    }
    pairs = (struct pairs){&t, t.n * (t.n - 1), calloc(t.n * (t.n - 1), sizeof *pairs.errors)};
    report_must(pairs.errors != NULL, "out of memory");
    paper->context.parallel_for(NULL, pairs.count, measure_pair, &pairs);
    report_table_open(paper->report,
                      "Distance to the true end systole, all ordered pairs of ten subjects",
                      sizeof headings / sizeof headings[0], headings);
    for (int way = 0; way < TRANSFERS_WAYS; way++) {
        tell_way(paper->report, &pairs, way);
    }
    report_table_close(paper->report);
    for (size_t i = 0; i < pairs.count; i++) {
        ratio[0] += pairs.errors[i][TRANSFERS_SRNF_RATIO].surface;
        ratio[1] += pairs.errors[i][TRANSFERS_DISPLACEMENT].surface;
    }
    report_paragraph(paper->report,
                     "Between surfaces the transfer of SRNFs ends at %.3f times the distance that "
                     "adding the displacement of the vertices leaves: %s. Most of either error is "
                     "that subjects contract differently.",
                     ratio[0] / ratio[1],
                     ratio[0] < ratio[1] ? "it comes closer" : "it does not come closer");
    for (size_t i = 0; i < SHOWN && i + 1 < t.n; i++) {
        show_pair(paper, &t, i, i + 1);
    }
    free(pairs.errors);
    transfers_close(&t);
}
