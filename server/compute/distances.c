/*
 * distances.c - distances of a group, and how they are cut into tasks.
 *
 * Pairs are numbered as the entries above the diagonal, column by column; a task is a block of
 * consecutive ones that is estimated to take a second (compute/seconds.h). The matrix is filled
 * from the results in any order: each entry belongs to one pair.
 */
#include "compute/distances.h"

#include "compute/seconds.h"
#include "jobs/tasks.h"
#include "store/digest.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define BLOCK_MAX 64 /* pairs */

struct spread {
    struct tasks_pairs asked;       /* without surfaces and pairs */
    size_t n, count, block;         /* surfaces, pairs of a task */
    size_t each;                    /* bytes of a surface */
    unsigned char *bytes;           /* [n][each] */
    struct tasks_content *contents; /* [n] */
    double *matrix;
};

static void pair_at(size_t index, size_t pair[2])
{
    size_t upper = (size_t)((1.0 + sqrt(1.0 + 8.0 * (double)index)) / 2.0);

    while (upper * (upper - 1) / 2 > index) {
        upper--;
    }
    while (upper * (upper + 1) / 2 <= index) {
        upper++;
    }
    pair[0] = index - upper * (upper - 1) / 2;
    pair[1] = upper;
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
        pair_at(index * spread->block + k, pairs[k]);
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

        pair_at(index * spread->block + k, pair);
        spread->matrix[pair[0] * spread->n + pair[1]] = distances[k];
        spread->matrix[pair[1] * spread->n + pair[0]] = distances[k];
    }
    return SRNF_OK;
}

/* The surfaces as bytes, with their digests. */
static int prepare(const struct compute_group *group, struct spread *spread)
{
    size_t count = 3 * srnf_coefficient_count(group->degree);

    spread->each = 8 * count;
    spread->bytes = srnf_alloc(group->n, spread->each);
    spread->contents = srnf_alloc(group->n, sizeof *spread->contents);
    if (!spread->bytes || !spread->contents) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < group->n; i++) {
        struct tasks_content *content = &spread->contents[i];
        unsigned char *bytes = spread->bytes + i * spread->each;

        tasks_put_doubles(bytes, group->surfaces[i], count);
        content->bytes = bytes;
        content->size = spread->each;
        store_sha256_hex(content->digest, bytes, spread->each);
        spread->matrix[i * group->n + i] = 0.0;
    }
    return SRNF_OK;
}

static int spread_distances(struct jobs_run *run, enum srnf_metric metric,
                            const struct compute_group *group,
                            const struct srnf_register_options *registration, double *matrix,
                            struct jobs_result *result)
{
    size_t count = group->n * (group->n - 1) / 2;
    struct spread spread = {
        .asked = {.degree = group->degree, .metric = metric, .registration = *registration},
        .n = group->n,
        .count = count,
        .block = seconds_block(seconds_of_pair((double)group->degree), count, BLOCK_MAX),
        .matrix = matrix};
    struct jobs_round round = {.kind = tasks_kind_find(TASKS_PAIRS),
                               .n = (spread.count + spread.block - 1) / spread.block,
                               .describe = describe,
                               .take = take,
                               .user = &spread};
    int status = prepare(group, &spread);

    if (status == SRNF_OK) {
        status = jobs_run_round(run, &round, result);
    }
    srnf_free(spread.bytes);
    srnf_free(spread.contents);
    return status == JOBS_TASK_FAILED ? COMPUTE_FAILED : status;
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
