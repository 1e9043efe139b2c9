/*
 * mean_visits.c - whether the surfaces of one subject lie alike, once the mean has come to rest.
 *
 * A nearly symmetric surface lies on the mean about as well in any of some ways round, and little
 * decides which. Two visits of a subject that lie differently then differ by all that is not
 * symmetric about it: a change that is none. On each other they do lie in one way only, for what
 * makes a subject itself is in both.
 *
 * So each surface of a subject is registered to that one among them which fits the mean best, as a
 * pair, and laid on the mean as that lies. Where this leads to another basin than the surface is
 * in, the same is tried with the best of those that differ as the one to lie by. All go where the
 * sum
 *
 *   sum_v [ E_v + R_v + ||q_v - mean of the q_v||^2 / N ]
 *
 * over the subject's surfaces v, of their parts of G and of their spread, is less, if they lie
 * nearer to each other there. G may rise by this, for once, and falls again by the steps that
 * follow; whether subjects lie better elsewhere (mean_anew.c) is not asked any more. Surfaces that
 * would be nearer to each other and yet do not go there are told of.
 *
 * Cost: a tournament for each surface of a subject but one, and a registration or two for each of a
 * subject whose surfaces lie differently.
 */
#include "mean.h"

#include <string.h>

#define JOINS ((size_t)2) /* at most that move subjects */
/* Times the spread of a subject's surfaces: less than that is nearer to each other. */
#define NEARER 0.7
/* Of their parts of G: a rise that the steps to the mean are trusted to take back. */
#define SLACK 0.01

/* What the surfaces of a subject add up to, both relative to N. */
struct sums {
    double shares, spread;
};

/* Surfaces of one subject. */
struct visits {
    const struct mean_run *run;
    const struct srnf_context *context;
    const size_t *members; /* [m] */
    size_t m;
    double *anchor, *field, *sum; /* [3][P] */
    struct mean_lying *found;     /* [m] where they lay */
    struct mean_lying *first;     /* [m] where the first try has put them */
    bool *differs;                /* [m] from the one that they were laid by */
};

static void close_visits(struct visits *v)
{
    for (size_t k = 0; v->found && v->first && k < v->m; k++) {
        mean_lying_clear(&v->found[k]);
        mean_lying_clear(&v->first[k]);
    }
    srnf_free(v->anchor);
    srnf_free(v->found);
    srnf_free(v->first);
    srnf_free(v->differs);
}

static int open_visits(const struct mean_run *run, size_t k, const struct srnf_context *context,
                       struct visits *v)
{
    size_t size = 3 * run->points;

    *v = (struct visits){.run = run,
                         .context = context,
                         .members = run->owners.members + run->owners.start[k],
                         .m = run->owners.size[k]};
    v->anchor = srnf_alloc(3 * size, sizeof(double));
    v->found = srnf_alloc(v->m, sizeof *v->found);
    v->first = srnf_alloc(v->m, sizeof *v->first);
    v->differs = srnf_alloc(v->m, sizeof *v->differs);
    if (!v->anchor || !v->found || !v->first || !v->differs) {
        return SRNF_ENOMEM;
    }
    v->field = v->anchor + size;
    v->sum = v->field + size;
    return SRNF_OK;
}

/* As the surfaces lie. */
static int add_up(const struct visits *v, struct sums *sums)
{
    const struct mean_run *run = v->run;
    size_t size = 3 * run->points;
    double squares = 0.0;
    int status = mean_measure(run, v->members[0], v->anchor, NULL);

    *sums = (struct sums){0};
    memset(v->sum, 0, size * sizeof(double));
    for (size_t k = 0; k < v->m && status == SRNF_OK; k++) {
        status = mean_measure(run, v->members[k], v->field, NULL);
        sums->shares += mean_share(&run->subjects[v->members[k]].at);
        for (size_t c = 0; c < size; c++) {
            v->field[c] -= v->anchor[c];
            v->sum[c] += v->field[c];
        }
        squares += srnf_inner_product(run->grid, v->field, v->field);
    }
    sums->spread =
        (squares - srnf_inner_product(run->grid, v->sum, v->sum) / (double)v->m) / run->norm2;
    return status;
}

/* The surface that fits the mean best where it lay, of all or of those that differ; m: none. */
static size_t best_of(const struct visits *v, bool all)
{
    size_t best = v->m;

    for (size_t k = 0; k < v->m; k++) {
        if ((all || v->differs[k]) &&
            (best == v->m || mean_share(&v->found[k].at) < mean_share(&v->found[best].at))) {
            best = k;
        }
    }
    return best;
}

/* All laid by one of them, as it lies; fills differs. */
static int lay_by(const struct visits *v, size_t by, struct srnf_error *error)
{
    const struct mean_run *run = v->run;
    const size_t on = v->members[by];
    struct mean_points points;
    int status = stats_fields(run->work, 1, run->surfaces + on, v->context, v->anchor, error);

    status = status ? status : mean_points_open(run, on, true, &points);
    if (status) {
        return status;
    }
    for (size_t k = 0; k < v->m && status == SRNF_OK; k++) {
        struct warp found = {.n = 0};

        v->differs[k] = false;
        if (k != by) {
            status = mean_seek(run, v->members[k], v->anchor, &points, v->context, &found,
                               &v->differs[k], error);
        }
        if (status == SRNF_OK && v->differs[k]) {
            status = mean_lying_on(run, v->members[k], on, &found);
        }
        warp_clear(&found);
    }
    mean_points_drop(&points);
    return status;
}

static int keep(const struct visits *v, struct mean_lying *where)
{
    int status = SRNF_OK;

    for (size_t k = 0; k < v->m && status == SRNF_OK; k++) {
        status = mean_lying_copy(v->run, v->members[k], &where[k]);
    }
    return status;
}

static int go_back(const struct visits *v, const struct mean_lying *where)
{
    int status = SRNF_OK;

    for (size_t k = 0; k < v->m && status == SRNF_OK; k++) {
        status = mean_lying_restore(v->run, v->members[k], &where[k]);
    }
    return status;
}

static double total(const struct sums *sums)
{
    return sums->shares + sums->spread;
}

/* Surfaces that differ are laid alike, in the better of two ways. after: what they add up to
   there. differ: whether any do; if not, nothing has changed. */
static int lay_alike(const struct visits *v, struct sums *after, bool *differ,
                     struct srnf_error *error)
{
    struct sums second = {0};
    size_t other;
    int status = keep(v, v->found);

    status = status ? status : lay_by(v, best_of(v, true), error);
    other = best_of(v, false);
    *differ = other < v->m;
    if (status || !*differ) {
        return status;
    }
    status = add_up(v, after);
    status = status ? status : keep(v, v->first);
    status = status ? status : go_back(v, v->found);
    status = status ? status : lay_by(v, other, error);
    status = status ? status : add_up(v, &second);
    if (status == SRNF_OK && total(&second) < total(after)) {
        *after = second;
        return SRNF_OK;
    }
    return status ? status : go_back(v, v->first);
}

/* ---- All subjects ---------------------------------------------------------------------------- */

struct join {
    struct mean_run *run;
    bool *moved; /* [subjects] */
};

static int join_one(void *argument, size_t k, const struct srnf_context *context,
                    struct srnf_error *error)
{
    const struct join *join = argument;
    struct mean_run *run = join->run;
    struct visits v = {.run = run};
    struct sums before = {0}, after = {0};
    bool differ = false, nearer;
    int status;

    if (run->owners.size[k] < 2) {
        return SRNF_OK;
    }
    status = open_visits(run, k, context, &v);
    status = status ? status : add_up(&v, &before);
    status = status ? status : lay_alike(&v, &after, &differ, error);
    if (status == SRNF_OK && differ) {
        nearer = after.spread < NEARER * before.spread;
        join->moved[k] =
            nearer && run->joins < JOINS && total(&after) < total(&before) + SLACK * before.shares;
        status = join->moved[k] ? SRNF_OK : go_back(&v, v.found);
        run->apart[k] = nearer && !join->moved[k];
    }
    close_visits(&v);
    return status;
}

static int lay_one(void *argument, size_t i, double *field, const struct srnf_context *context,
                   struct srnf_error *error)
{
    (void)context;
    (void)error;
    return mean_measure(argument, i, field, NULL);
}

bool mean_has_visits(const struct mean_run *run)
{
    const struct srnf_register_options *o = &run->registration;

    return mean_is_warped(run) && run->owners.count < run->owners.n && !o->common_pose &&
           o->start == SRNF_START_TOURNAMENT && !mean_is_guided(run);
}

int mean_join_visits(struct mean_run *run, struct stats_progress progress, bool *moved,
                     struct srnf_error *error)
{
    struct join join = {run, srnf_alloc(run->owners.count, sizeof *join.moved)};
    int status = join.moved ? mean_aim(run) : SRNF_ENOMEM;

    *moved = false;
    memset(run->apart, 0, run->owners.count * sizeof *run->apart);
    for (size_t i = 0; i < run->n && status == SRNF_OK; i++) {
        run->subjects[i].before = run->subjects[i].at;
    }
    status = status ? status
                    : stats_run(run->context, run->owners.count, join_one, &join, progress, error);
    for (size_t k = 0; k < run->owners.count && status == SRNF_OK; k++) {
        *moved = *moved || join.moved[k];
    }
    if (status == SRNF_OK && *moved) {
        status = mean_average_of(run, lay_one, run, run->points, (struct stats_progress){0},
                                 run->average, error);
        if (status == SRNF_OK) {
            mean_adopt(run, mean_variance_about(run, run->average));
            run->joins++;
            run->anew = run->iterations;
        }
    }
    for (size_t i = 0; i < run->n && status == SRNF_OK && !*moved; i++) {
        run->subjects[i].at = run->subjects[i].before;
    }
    srnf_free(join.moved);
    return status;
}
