/*
 * trajectories_lines.c - the line of each subject through its surfaces, by least squares: formulae
 * in trajectories.c.
 */
#include "trajectories.h"

#include <math.h>

struct lines {
    struct trajectory_run *run;
    const double *vectors; /* [members][3][P] displacements times the roots of the areas */
    double *middle;        /* [n] mean time of each subject */
};

/* A line through the data of a subject, each times its size: double[3][P] each. */
static void fit(const struct lines *lines, size_t subject, const double *data, double *slope,
                double *level)
{
    const struct trajectory_run *run = lines->run;
    const struct subjects *s = &run->subjects;
    size_t size = 3 * run->points;
    double shift = run->out->reference - lines->middle[subject];

    for (size_t m = s->start[subject]; m < s->start[subject + 1]; m++) {
        size_t i = s->members[m];
        double scale = run->visits->sizes[i];
        double along =
            scale * (trajectory_time(run, i) - lines->middle[subject]) / run->spread[subject];
        double part = scale / (double)s->size[subject] + along * shift;

        for (size_t k = 0; k < size; k++) {
            slope[k] += along * data[i * size + k];
            level[k] += part * data[i * size + k];
        }
    }
}

/* The squares of SRNFs about the line. */
static double squares_left(const struct lines *lines, size_t subject, const double *slope,
                           const double *level)
{
    const struct trajectory_run *run = lines->run;
    const struct srnf_grid *grid = srnf_sht_grid(run->sht);
    const struct subjects *s = &run->subjects;
    size_t points = run->points;
    double sum = 0.0;

    for (size_t m = s->start[subject]; m < s->start[subject + 1]; m++) {
        size_t i = s->members[m];
        double time = trajectory_time(run, i) - run->out->reference;
        const double *q = run->visits->q + i * 3 * points;

        for (size_t k = 0; k < 3 * points; k++) {
            double off = run->visits->sizes[i] * q[k] - level[k] - time * slope[k];

            sum += grid->weight[k % points / grid->n_phi] * off * off;
        }
    }
    return sum;
}

static int fit_body(void *argument, size_t subject, const struct srnf_context *context,
                    struct srnf_error *error)
{
    const struct lines *lines = argument;
    const struct trajectory_run *run = lines->run;
    size_t at = subject * 3 * run->points;

    (void)context;
    (void)error;
    fit(lines, subject, run->visits->q, run->slope_q + at, run->level_q + at);
    fit(lines, subject, lines->vectors, run->slope_v + at, run->level_v + at);
    run->left[subject] = run->subjects.size[subject] > 2
                             ? squares_left(lines, subject, run->slope_q + at, run->level_q + at)
                             : 0.0;
    return SRNF_OK;
}

/* Times of each subject, and the time of reference. */
static void read_times(struct lines *lines)
{
    struct trajectory_run *run = lines->run;
    const struct subjects *s = &run->subjects;
    const double *times = run->visits->times;

    for (size_t k = 0; k < run->n; k++) {
        struct srnf_subject_trajectory *subject = &run->out->subject[k];

        subject->visits = s->size[k];
        subject->first = subject->last = times[s->members[s->start[k]]];
        for (size_t m = s->start[k]; m < s->start[k + 1]; m++) {
            size_t member = s->members[m];

            lines->middle[k] += trajectory_time(run, member) / (double)s->size[k];
            subject->first = fmin(subject->first, times[member]);
            subject->last = fmax(subject->last, times[member]);
        }
        for (size_t m = s->start[k]; m < s->start[k + 1]; m++) {
            double off = trajectory_time(run, s->members[m]) - lines->middle[k];

            run->spread[k] += off * off;
        }
        run->out->reference += lines->middle[k] / (double)run->n;
        run->out->freedom += s->size[k] - 2;
    }
}

int trajectory_lines(struct trajectory_run *run, const struct srnf_context *context,
                     struct srnf_error *error)
{
    const struct srnf_visits *visits = run->visits;
    struct stats_embedding embedding = {0};
    struct lines lines = {.run = run};
    size_t all;
    double *vectors = NULL;
    int status = stats_embedding_create(run->sht, visits->mean, &embedding);

    if (status == SRNF_OK && !__builtin_mul_overflow(visits->n, 3 * run->points, &all)) {
        vectors = srnf_alloc(all, sizeof(double));
    }
    lines.vectors = vectors;
    lines.middle = srnf_alloc(run->n, sizeof(double));
    status = status || (vectors && lines.middle) ? status : SRNF_ENOMEM;
    if (status == SRNF_OK) {
        status = stats_embed_fields(
            &embedding, visits->mean, visits->near, visits->n, visits->q, context,
            (struct stats_progress){0.0, 1.0, "inverting the members"}, vectors, error);
    }
    if (status == SRNF_OK) {
        read_times(&lines);
        status = stats_run(context, run->n, fit_body, &lines,
                           (struct stats_progress){1.0, 1.0, NULL}, error);
    }
    stats_embedding_clear(&embedding);
    srnf_free(vectors);
    srnf_free(lines.middle);
    return status;
}
