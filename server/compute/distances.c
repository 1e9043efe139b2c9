/*
 * distances.c - distances of a group, and how they are cut into tasks.
 *
 * Pairs are numbered as the entries above the diagonal, column by column, or come as a list; a task
 * is a block of consecutive ones that is estimated to take a second (compute/seconds.h). The matrix
 * is filled from the results in any order: each entry belongs to one pair.
 */
#include "compute/distances.h"

#include "compute/seconds.h"
#include "jobs/tasks.h"
#include "store/digest.h"

#include <stdlib.h>
#include <string.h>

#define BLOCK_MAX 64 /* pairs */

struct spread {
    struct tasks_pairs asked; /* without surfaces and pairs */
    const double *const *surfaces;
    size_t n, count, block;         /* surfaces, pairs, pairs of a task */
    const size_t (*pairs)[2];       /* [count]; NULL: all that there are */
    size_t each;                    /* bytes of a surface */
    unsigned char *bytes;           /* [n][each] */
    struct tasks_content *contents; /* [n] */
    double *matrix;                 /* [n][n] of all pairs */
    double *distances;              /* [count] of some */
};

static void ends_of(const struct spread *spread, size_t index, size_t pair[2])
{
    if (spread->pairs) {
        memcpy(pair, spread->pairs[index], sizeof spread->pairs[index]);
    } else {
        srnf_pair(index, &pair[0], &pair[1]);
    }
}

static size_t block_size(const struct spread *spread, size_t task)
{
    size_t first = task * spread->block, left = spread->count - first;

    return left < spread->block ? left : spread->block;
}

/* Index of the surface among those of the task, which it joins if it is not there. */
static size_t place_of(const struct spread *spread, size_t surface, struct jobs_task *task)
{
    const struct tasks_content *content = &spread->contents[surface];
    size_t i = 0;

    while (i < task->n_contents && task->contents[i].bytes != content->bytes) {
        i++;
    }
    if (i == task->n_contents) {
        task->contents[task->n_contents++] = *content;
    }
    return i;
}

static int describe(void *user, size_t index, struct jobs_task *task)
{
    const struct spread *spread = user;
    size_t size = block_size(spread, index), pairs[BLOCK_MAX][2];
    struct tasks_pairs asked = spread->asked;
    int status = SRNF_ENOMEM;

    *task = (struct jobs_task){.contents = malloc(2 * size * sizeof *task->contents)};
    if (!task->contents) {
        return status;
    }
    for (size_t k = 0; k < size; k++) {
        ends_of(spread, index * spread->block + k, pairs[k]);
        pairs[k][0] = place_of(spread, pairs[k][0], task);
        pairs[k][1] = place_of(spread, pairs[k][1], task);
    }
    asked.n_surfaces = task->n_contents;
    asked.n_pairs = size;
    asked.pairs = pairs;
    status = tasks_pairs_write(&asked, &task->inputs);
    if (status) {
        jobs_task_clear(task);
    }
    return status;
}

static int take(void *user, size_t index, const void *result, size_t size)
{
    const struct spread *spread = user;
    double distances[BLOCK_MAX];
    size_t n_pairs = block_size(spread, index);

    (void)size;
    tasks_pairs_distances(result, n_pairs, distances);
    for (size_t k = 0; k < n_pairs; k++) {
        size_t pair[2];

        if (spread->pairs) {
            spread->distances[index * spread->block + k] = distances[k];
            continue;
        }
        srnf_pair(index * spread->block + k, &pair[0], &pair[1]);
        spread->matrix[pair[0] * spread->n + pair[1]] = distances[k];
        spread->matrix[pair[1] * spread->n + pair[0]] = distances[k];
    }
    return SRNF_OK;
}

/* The surfaces as bytes, with their digests. */
static int prepare(struct spread *spread)
{
    size_t count = 3 * srnf_coefficient_count(spread->asked.degree);

    spread->each = 8 * count;
    spread->bytes = srnf_alloc(spread->n, spread->each);
    spread->contents = srnf_alloc(spread->n, sizeof *spread->contents);
    if (!spread->bytes || !spread->contents) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < spread->n; i++) {
        struct tasks_content *content = &spread->contents[i];
        unsigned char *bytes = spread->bytes + i * spread->each;

        tasks_put_doubles(bytes, spread->surfaces[i], count);
        content->bytes = bytes;
        content->size = spread->each;
        store_sha256_hex(content->digest, bytes, spread->each);
    }
    return SRNF_OK;
}

/* As jobs_run_round. from, to: of the progress of the phase, as there. */
static int run_spread(struct jobs_run *run, struct spread *spread, double from, double to,
                      struct jobs_result *result)
{
    struct jobs_round round = {.kind = tasks_kind_find(TASKS_PAIRS),
                               .from = from,
                               .to = to,
                               .describe = describe,
                               .take = take,
                               .user = spread};
    int status = prepare(spread);

    spread->block = seconds_block(
        seconds_of_pair((double)spread->asked.degree, spread->asked.registration.symmetric),
        spread->count, BLOCK_MAX);
    round.n = (spread->count + spread->block - 1) / spread->block;
    if (status == SRNF_OK) {
        status = jobs_run_round(run, &round, result);
    }
    srnf_free(spread->bytes);
    srnf_free(spread->contents);
    return status;
}

static int spread_distances(struct jobs_run *run, enum srnf_metric metric,
                            const struct compute_group *group,
                            const struct srnf_register_options *registration, double *matrix,
                            struct jobs_result *result)
{
    struct spread spread = {
        .asked = {.degree = group->degree, .metric = metric, .registration = *registration},
        .surfaces = group->surfaces,
        .n = group->n,
        .count = group->n * (group->n - 1) / 2,
        .matrix = matrix};
    int status;

    for (size_t i = 0; i < group->n; i++) {
        matrix[i * group->n + i] = 0.0;
    }
    status = run_spread(run, &spread, 0.0, 0.0, result);
    return status == JOBS_TASK_FAILED ? COMPUTE_FAILED : status;
}

/* The member measure of the run's context. */
static int measure_by_workers(void *user, const struct srnf_pair_search *pairs,
                              struct srnf_error *error)
{
    struct spread spread = {.asked = {.degree = srnf_sht_degree(pairs->sht),
                                      .metric = SRNF_METRIC_SRNF,
                                      .registration = *pairs->options},
                            .surfaces = pairs->surfaces,
                            .n = pairs->n,
                            .count = pairs->count,
                            .pairs = pairs->pairs,
                            .distances = pairs->distances};
    struct jobs_result result = {.results = NULL};
    int status = run_spread(user, &spread, pairs->from, pairs->to, &result);

    (void)error;
    if (status == JOBS_TASK_FAILED) {
        jobs_run_fail(user, &result);
        status = SRNF_ECANCELED;
    }
    return status;
}

void compute_pairs_measured(struct jobs_run *run)
{
    if (jobs_offers_tasks(jobs_run_jobs(run))) {
        jobs_run_measure_by(run, measure_by_workers);
    } else {
        jobs_run_keep_parts(run);
    }
}

int compute_distances(struct jobs_run *run, const struct srnf_sht *sht, enum srnf_metric metric,
                      const struct compute_group *group,
                      const struct srnf_register_options *registration, double *matrix,
                      struct jobs_result *result, struct srnf_error *error)
{
    bool spreads = registration && (metric == SRNF_METRIC_SRNF || metric == SRNF_METRIC_SRM) &&
                   group->n > 1 && jobs_offers_tasks(jobs_run_jobs(run));

    if (spreads) {
        return spread_distances(run, metric, group, registration, matrix, result);
    }
    jobs_run_keep_parts(run);
    return srnf_metric_distances(sht, metric, group->n, group->surfaces, registration,
                                 jobs_run_context(run), matrix, error);
}
