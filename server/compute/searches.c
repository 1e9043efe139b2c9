/*
 * searches.c - how registrations to a field are cut into tasks.
 *
 * A task is a block of consecutive surfaces, of about a second, with the field: the centre of an
 * iteration of a mean, or the template of folds. Both are contents, named by their digests, so that
 * a worker gets the field once and keeps it. Their bytes are the doubles of the computation
 * themselves.
 */
#include "compute/searches.h"

#include "compute/seconds.h"
#include "jobs/tasks.h"
#include "store/digest.h"

#include <stdlib.h>
#include <string.h>

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "contents are doubles as they lie here");

#define BLOCK_MAX 64 /* surfaces */
#define LEAST 2      /* surfaces that are worth a round */

struct spread {
    const struct srnf_field_search *search;
    struct tasks_searches asked; /* of a whole block */
    size_t block;
    struct tasks_content *contents; /* [1 + n]: field, surfaces */
    double *marks;                  /* [n][landmarks][3] of the surfaces; NULL: none guide */
};

static size_t block_size(const struct spread *spread, size_t task)
{
    size_t left = spread->search->n - task * spread->block;

    return left < spread->block ? left : spread->block;
}

static int describe(void *user, size_t index, struct jobs_task *task)
{
    const struct spread *spread = user;
    struct tasks_searches asked = spread->asked;
    int status;

    asked.n = block_size(spread, index);
    if (spread->marks) {
        asked.moving = spread->marks + 3 * asked.n_landmarks * index * spread->block;
    }
    *task = (struct jobs_task){.contents = malloc((1 + asked.n) * sizeof *task->contents),
                               .n_contents = 1 + asked.n};
    if (!task->contents) {
        return SRNF_ENOMEM;
    }
    task->contents[0] = spread->contents[0];
    for (size_t i = 0; i < asked.n; i++) {
        task->contents[1 + i] = spread->contents[1 + index * spread->block + i];
    }
    status = tasks_searches_write(&asked, &task->inputs);
    if (status) {
        jobs_task_clear(task);
    }
    return status;
}

/* Gives what was found of one block to the computation. */
struct taking {
    struct spread *spread;
    size_t first;
};

static int take_one(void *argument, size_t i, const double rotation[9], struct srnf_warp *warp)
{
    const struct taking *taking = argument;
    const struct srnf_field_search *search = taking->spread->search;

    return search->take(search->argument, taking->first + i, rotation, warp);
}

static int unmet_one(void *argument, size_t i, const struct srnf_error *why)
{
    const struct taking *taking = argument;
    const struct srnf_field_search *search = taking->spread->search;

    return search->unmet(search->argument, taking->first + i, why);
}

static int take(void *user, size_t index, const void *result, size_t size)
{
    struct spread *spread = user;
    struct taking taking = {spread, index * spread->block};

    return tasks_searches_read(result, size, block_size(spread, index), take_one,
                               spread->marks ? unmet_one : NULL, &taking);
}

static void set_content(struct tasks_content *content, const double *values, size_t count)
{
    content->bytes = values;
    content->size = count * sizeof(double);
    store_sha256_hex(content->digest, values, content->size);
}

/* Copies the landmarks of all surfaces, where some guide. */
static int prepare_landmarks(struct spread *spread)
{
    const struct srnf_field_search *search = spread->search;
    struct srnf_landmarks one;
    size_t most;

    if (!search->landmarks) {
        return SRNF_OK;
    }
    search->landmarks(search->argument, 0, &one);
    spread->asked.n_landmarks = one.n;
    spread->asked.weight = one.weight;
    spread->asked.fixed = one.fixed;
    most = tasks_searches_most(one.n);
    spread->block = spread->block < most ? spread->block : most;
    spread->marks = srnf_alloc(3 * one.n * search->n, sizeof(double));
    for (size_t i = 0; spread->marks && i < search->n; i++) {
        search->landmarks(search->argument, i, &one);
        memcpy(spread->marks + 3 * one.n * i, one.moving, 3 * one.n * sizeof(double));
    }
    return spread->marks ? SRNF_OK : SRNF_ENOMEM;
}

static int prepare(struct spread *spread)
{
    const struct srnf_field_search *search = spread->search;

    spread->contents = srnf_alloc(1 + search->n, sizeof *spread->contents);
    if (!spread->contents) {
        return SRNF_ENOMEM;
    }
    set_content(&spread->contents[0], search->field,
                3 * spread->asked.n_theta * spread->asked.n_phi);
    for (size_t i = 0; i < search->n; i++) {
        set_content(&spread->contents[1 + i], search->surfaces[i],
                    3 * srnf_coefficient_count(spread->asked.degree));
    }
    return SRNF_OK;
}

/* The member search of the run's context. */
static int search_by_workers(void *user, const struct srnf_field_search *search,
                             struct srnf_error *error)
{
    const struct srnf_grid *grid = srnf_sht_grid(search->sht);
    double seconds = seconds_of_registration((double)srnf_sht_degree(search->sht));
    struct spread spread = {.search = search,
                            .asked = {.degree = srnf_sht_degree(search->sht),
                                      .n_theta = grid->n_theta,
                                      .n_phi = grid->n_phi,
                                      .norm2 = search->norm2,
                                      .registration = *search->options},
                            .block = seconds_block(seconds, search->n, BLOCK_MAX)};
    struct jobs_round round = {.kind = tasks_kind_find(TASKS_SEARCHES),
                               .from = search->from,
                               .to = search->to,
                               .describe = describe,
                               .take = take,
                               .user = &spread};
    struct jobs_result result = {.results = NULL};
    int status;

    (void)error;
    if (search->n < LEAST || grid->kind != SRNF_GRID_GAUSS_LEGENDRE) {
        return SRNF_SEARCH_HERE;
    }
    status = prepare_landmarks(&spread);
    status = status ? status : prepare(&spread);
    if (status == SRNF_OK) {
        round.n = (search->n + spread.block - 1) / spread.block;
        status = jobs_run_round(user, &round, &result);
    }
    if (status == JOBS_TASK_FAILED) {
        jobs_run_fail(user, &result);
        status = SRNF_ECANCELED;
    }
    srnf_free(spread.contents);
    srnf_free(spread.marks);
    return status;
}

void compute_searches_spread(struct jobs_run *run)
{
    if (jobs_offers_tasks(jobs_run_jobs(run))) {
        jobs_run_search_by(run, search_by_workers);
    }
}
