/*
 * registered.c - registered distances of many pairs of one group.
 *
 * What belongs to one surface alone, its tables and its matrix (registration/subject.c), is made
 * once and shared by its pairs and by all threads. Groups of which that is too much go tile by
 * tile: pairs in the order of the blocks of both surfaces, as many at a time as SUBJECTS_BYTES
 * holds the surfaces of. A block of T of n surfaces makes each surface n / T times instead of n.
 *
 * Pairs that an earlier attempt has left are neither registered nor prepared.
 */
#include "registration/tabulated.h"
#include "stats.h"

#include <stdlib.h>
#include <string.h>

#define SUBJECTS_BYTES 6.4e7
#define SUBJECTS_MIN ((size_t)2) /* what a pair needs */

struct item {
    size_t tile;  /* of both surfaces */
    size_t index; /* of the pair */
};

struct run {
    const struct stats_registered *asked;
    double *matrix;
    size_t held;               /* surfaces that are prepared at a time, at most */
    struct item *items;        /* [count] of those that are left */
    struct subject **subjects; /* [n] NULL: not prepared */
    size_t *wanted;            /* [n] by the chunk of that number */
    size_t *missing;           /* [n] surfaces to be prepared */
    size_t first, last, chunk; /* items of the chunk, and its number */
    struct tools_pool pool;
};

static size_t subjects_held(size_t n, size_t degree)
{
    double each = registration_subject_bytes(degree);
    size_t held = (size_t)(SUBJECTS_BYTES / each);

    held = held < SUBJECTS_MIN ? SUBJECTS_MIN : held;
    return held < n ? held : n;
}

double srnf_distances_memory(size_t n, size_t degree)
{
    double pairs = 0.5 * (double)n * (double)n;

    return (double)subjects_held(n, degree) * registration_subject_bytes(degree) +
           pairs * (double)sizeof(struct item);
}

/* ---- The order of the pairs ------------------------------------------------------------------ */

static int compare_items(const void *a, const void *b)
{
    const struct item *x = a, *y = b;

    if (x->tile != y->tile) {
        return x->tile < y->tile ? -1 : 1;
    }
    return x->index < y->index ? -1 : x->index > y->index;
}

/* What is known goes to the matrix, the others to the items; returns their number. */
static size_t list_items(struct run *run, size_t count, const size_t *pairs,
                         const struct srnf_context *context)
{
    const struct stats_registered *asked = run->asked;
    size_t n = asked->n, left = 0;
    size_t block = run->held < n ? (run->held + 1) / 2 : n;
    size_t blocks = (n + block - 1) / block;

    for (size_t k = 0; k < count && !srnf_is_canceled(context); k++) {
        size_t index = pairs ? pairs[k] : k;
        double distance;
        size_t i, j;

        srnf_pair(index, &i, &j);
        if (stats_recall(context, asked->series, index, 1, &distance) && distance >= 0.0) {
            run->matrix[i * n + j] = distance;
        } else {
            run->items[left++] = (struct item){i / block * blocks + j / block, index};
        }
    }
    qsort(run->items, left, sizeof *run->items, compare_items);
    return left;
}

/* As many of the next items as have surfaces that may be held together. */
static void next_chunk(struct run *run, size_t count)
{
    size_t surfaces = 0;

    run->chunk++;
    run->first = run->last;
    while (run->last < count) {
        size_t ends[2], more = 0;

        srnf_pair(run->items[run->last].index, &ends[0], &ends[1]);
        for (size_t k = 0; k < 2; k++) {
            more += run->wanted[ends[k]] != run->chunk;
        }
        if (surfaces + more > run->held) {
            break;
        }
        surfaces += more;
        run->wanted[ends[0]] = run->wanted[ends[1]] = run->chunk;
        run->last++;
    }
}

/* ---- Chunks ---------------------------------------------------------------------------------- */

static int prepare_one(void *argument, size_t index, const struct srnf_context *context,
                       struct srnf_error *error)
{
    struct run *run = argument;
    size_t i = run->missing[index];
    struct tabulated_tools *tools;
    int status = tools_take(&run->pool, &tools);

    if (status == SRNF_OK) {
        status = registration_subject(run->asked->sht, run->asked->surfaces[i], run->asked->options,
                                      tools, context, &run->subjects[i]);
    }
    tools_give_back(&run->pool, tools);
    return status ? srnf_fail(error, status, -1, "%s", srnf_strerror(status)) : SRNF_OK;
}

/* The surfaces of the chunk, instead of those that it does not ask for. */
static int prepare(struct run *run, const struct srnf_context *context, struct srnf_error *error)
{
    size_t count = 0;

    for (size_t i = 0; i < run->asked->n; i++) {
        if (run->wanted[i] != run->chunk) {
            registration_subject_destroy(run->subjects[i]);
            run->subjects[i] = NULL;
        } else if (!run->subjects[i]) {
            run->missing[count++] = i;
        }
    }
    return stats_run(context, count, prepare_one, run, (struct stats_progress){0}, error);
}

static int measure_one(void *argument, size_t index, const struct srnf_context *context,
                       struct srnf_error *error)
{
    struct run *run = argument;
    const struct stats_registered *asked = run->asked;
    size_t pair = run->items[run->first + index].index;
    struct tabulated_tools *tools;
    double distance = 0.0;
    size_t i, j;
    int status;

    if (tools_take(&run->pool, &tools)) {
        return stats_fail(error, SRNF_ENOMEM, NULL);
    }
    srnf_pair(pair, &i, &j);
    status =
        registration_distance(asked->sht, asked->surfaces[i], asked->surfaces[j], run->subjects[i],
                              run->subjects[j], tools, asked->options, context, &distance, error);
    tools_give_back(&run->pool, tools);
    if (status >= 0) {
        stats_keep(context, asked->series, pair, 1, &distance);
    }
    run->matrix[i * asked->n + j] = distance;
    return status;
}

static int run_chunks(struct run *run, size_t left, size_t count, struct stats_progress progress,
                      const struct srnf_context *context, struct srnf_error *error)
{
    double known = (double)(count - left), all = (double)count;
    double range = progress.to - progress.from;
    int status = SRNF_OK;

    while (run->last < left && status == SRNF_OK) {
        struct stats_progress part = {.message = progress.message};

        next_chunk(run, left);
        part.from = progress.from + range * (known + (double)run->first) / all;
        part.to = progress.from + range * (known + (double)run->last) / all;
        status = prepare(run, context, error);
        if (status == SRNF_OK) {
            status = stats_run(context, run->last - run->first, measure_one, run, part, error);
        }
    }
    return status;
}

int stats_registered_distances(const struct stats_registered *asked, size_t count,
                               const size_t *pairs, struct stats_progress progress,
                               const struct srnf_context *context, double *matrix,
                               struct srnf_error *error)
{
    size_t n = asked->n;
    struct run run = {.asked = asked,
                      .matrix = matrix,
                      .held =
                          asked->held ? asked->held : subjects_held(n, srnf_sht_degree(asked->sht)),
                      .items = srnf_alloc(count ? count : 1, sizeof *run.items),
                      .subjects = srnf_alloc(n, sizeof(struct subject *)),
                      .wanted = srnf_alloc(n, sizeof *run.wanted),
                      .missing = srnf_alloc(n, sizeof *run.missing)};
    int status = run.items && run.subjects && run.wanted && run.missing
                     ? SRNF_OK
                     : stats_fail(error, SRNF_ENOMEM, NULL);

    tools_pool_open(&run.pool);
    if (status == SRNF_OK) {
        size_t left = list_items(&run, count, pairs, context);

        status = srnf_is_canceled(context)
                     ? stats_fail(error, SRNF_ECANCELED, NULL)
                     : run_chunks(&run, left, count, progress, context, error);
    }
    for (size_t i = 0; run.subjects && i < n; i++) {
        registration_subject_destroy(run.subjects[i]);
    }
    tools_pool_clear(&run.pool);
    srnf_free(run.items);
    srnf_free(run.subjects);
    srnf_free(run.wanted);
    srnf_free(run.missing);
    return status;
}
