/*
 * lines.h - ellipsoids with noise of the subject and of the visit that grow with time, some groups
 * and subjects faster than others, all parameterized alike: for the tests of trajectories.
 */
#ifndef TESTS_STATS_LINES_H
#define TESTS_STATS_LINES_H

#include "group.h"
#include "srnf/trajectories.h"

#define LINES_DEGREE 4
#define LINES_NOISE ((size_t)16) /* coefficients of each coordinate that have some */
#define LINES_PER_SUBJECT ((size_t)4)

struct lines {
    struct group g; /* subject after subject */
    size_t n, members, size;
    double brief; /* positive: the first subject has two visits, this far apart */
    double *mean, *q, *sizes, *times, *columns, at[4], at_times[4];
    size_t *subjects;
    struct srnf_nested nested;
    struct srnf_visits visits;
    struct srnf_regress_design design; /* none of its columns are in use: see lines_group */
};

struct lines_plan {
    size_t n;
    bool unequal;  /* 2 to 4 visits at irregular times, or 3 at 0, 1 and 2 */
    double growth; /* of the z axis per unit of time */
    double more;   /* the same, of every second subject beside that */
    double spread; /* standard deviation of the subjects' own growth */
    double noise;  /* of a visit: .01 is that of visits.h */
    uint64_t seed;
};

/* The design of two groups: every second subject, with predictions at both and two times. */
static inline void lines_group(struct lines *l)
{
    l->nested = (struct srnf_nested){0, 1, NULL, l->columns};
    l->design = (struct srnf_regress_design){1, l->columns, 1, &l->nested, 4, l->at};
}

static inline size_t lines_visits(const struct lines_plan *plan, size_t subject)
{
    return plan->unequal ? 2 + subject % 3 : 3;
}

static inline double lines_time(const struct lines_plan *plan, size_t subject, size_t visit)
{
    double shift = 0.1 * (double)(subject % 5);

    return plan->unequal ? shift + (double)visit * (0.4 + 0.3 * (double)(subject % 4))
                         : (double)visit;
}

static inline void lines_fill(struct lines *l, const struct lines_plan *plan)
{
    struct test_random random = test_random_seed(plan->seed);
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(l->g.sht));
    size_t at = 0;

    assert_non_null(workspace);
    for (size_t i = 0; i < plan->n; i++) {
        double own[3 * LINES_NOISE];
        double growth =
            plan->growth + (i % 2 ? plan->more : 0.0) + plan->spread * test_random_normal(&random);

        test_random_normals(&random, 3 * LINES_NOISE, own);
        bool brief = i == 0 && l->brief > 0.0;
        size_t visits = brief ? 2 : lines_visits(plan, i);

        test_random_normals(&random, 3 * LINES_NOISE, own);
        for (size_t visit = 0; visit < visits; visit++, at++) {
            double *f = l->g.f[at];
            double noise[3 * LINES_NOISE];

            test_random_normals(&random, 3 * LINES_NOISE, noise);
            l->times[at] = brief ? (double)visit * l->brief : lines_time(plan, i, visit);
            l->subjects[at] = at - visit;
            l->columns[at] = (double)(i % 2);
            l->sizes[at] = 1.0;
            f[3] = 2.4;
            f[l->g.each + 1] = 2.0;
            f[2 * l->g.each + 2] = 1.6 + growth * (l->times[at] - 1.0);
            for (size_t k = 0; k < 3 * LINES_NOISE; k++) {
                f[k / LINES_NOISE * l->g.each + k % LINES_NOISE] +=
                    0.03 * own[k] + plan->noise * noise[k];
            }
            srnf_field(l->g.sht, f, l->q + at * l->size, workspace);
        }
    }
    for (size_t k = 0; k < l->g.count * l->members; k++) {
        l->mean[k % l->g.count] += l->g.f[k / l->g.count][k % l->g.count] / (double)l->members;
    }
    srnf_free(workspace);
}

/* brief: of struct lines. */
static inline void lines_open_brief(struct lines *l, const struct lines_plan *plan, double brief)
{
    size_t members = 0;

    for (size_t i = 0; i < plan->n; i++) {
        members += brief > 0.0 && i == 0 ? 2 : lines_visits(plan, i);
    }
    *l = (struct lines){.n = plan->n,
                        .members = members,
                        .brief = brief,
                        .at = {0.0, 0.0, 1.0, 1.0},
                        .at_times = {0.0, 2.0, 0.0, 2.0}};
    group_open(&l->g, LINES_DEGREE, members);
    l->size = 3 * l->g.points;
    l->mean = shapes_doubles(l->g.count);
    l->q = shapes_doubles(members * l->size);
    l->sizes = shapes_doubles(members);
    l->times = shapes_doubles(members);
    l->columns = shapes_doubles(members);
    l->subjects = srnf_alloc(members, sizeof *l->subjects);
    assert_non_null(l->subjects);
    lines_fill(l, plan);
    l->visits = (struct srnf_visits){.n = members,
                                     .mean = l->mean,
                                     .q = l->q,
                                     .sizes = l->sizes,
                                     .times = l->times,
                                     .subjects = l->subjects,
                                     .at_times = l->at_times};
}

static inline void lines_open(struct lines *l, const struct lines_plan *plan)
{
    lines_open_brief(l, plan, 0.0);
}

static inline void lines_close(struct lines *l)
{
    srnf_free(l->mean);
    srnf_free(l->q);
    srnf_free(l->sizes);
    srnf_free(l->times);
    srnf_free(l->columns);
    srnf_free(l->subjects);
    group_close(&l->g);
}

static inline int lines_fit(const struct lines *l, size_t permutations, uint64_t seed,
                            const struct srnf_context *context, struct srnf_trajectories *out)
{
    struct srnf_trajectories_options options = srnf_trajectories_options_defaults();

    options.permutations = permutations;
    options.bootstraps = 200;
    options.seed = seed;
    return srnf_fit_trajectories(l->g.sht, &l->visits, &l->design, &options, context, out, NULL);
}

#endif
