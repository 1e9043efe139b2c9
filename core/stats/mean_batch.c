/*
 * mean_batch.c - the average of a field of each subject, without the fields of all at once.
 *
 * Subjects are taken a batch at a time: the bodies of a batch run in parallel, each into a field of
 * its own, which are then added up in the order of the subjects, all nodes in parallel. So the sum
 * does not depend on the number of threads, nor on the size of a batch.
 */
#include "mean.h"

/* Of the fields of a batch: many subjects for as many threads, and little memory. */
#define BATCH_BYTES ((size_t)32 << 20)
#define BATCH_LEAST ((size_t)16)
#define BATCH_MOST ((size_t)128)

struct batch {
    const struct mean_run *run;
    mean_body *body;
    void *argument;
    size_t first, count; /* subjects */
    size_t size;         /* 3 P */
    double *fields;      /* [count][3][P] */
    double *sum;         /* [3][P] */
};

static size_t batch_of(size_t n, size_t size)
{
    size_t fit = BATCH_BYTES / (size * sizeof(double));

    fit = fit < BATCH_LEAST ? BATCH_LEAST : fit > BATCH_MOST ? BATCH_MOST : fit;
    return fit < n ? fit : n;
}

static int make_one(void *argument, size_t index, const struct srnf_context *context,
                    struct srnf_error *error)
{
    const struct batch *batch = argument;

    return batch->body(batch->argument, batch->first + index, batch->fields + index * batch->size,
                       context, error);
}

static int add_block(void *argument, size_t block, const struct srnf_context *context,
                     struct srnf_error *error)
{
    const struct batch *batch = argument;
    size_t first = block * MEAN_BLOCK;
    size_t last = first + MEAN_BLOCK < batch->size ? first + MEAN_BLOCK : batch->size;

    (void)context;
    (void)error;
    for (size_t i = 0; i < batch->count; i++) {
        const double *field = batch->fields + i * batch->size;

        for (size_t k = first; k < last; k++) {
            batch->sum[k] += field[k];
        }
    }
    return SRNF_OK;
}

static int run_batch(struct batch *batch, struct stats_progress progress, struct srnf_error *error)
{
    const struct mean_run *run = batch->run;
    double length = progress.to - progress.from;
    struct stats_progress own = progress;
    int status;

    own.from = progress.from + length * (double)batch->first / (double)run->n;
    own.to = progress.from + length * (double)(batch->first + batch->count) / (double)run->n;
    status = stats_run(run->context, batch->count, make_one, batch, own, error);
    if (status == SRNF_OK) {
        status = stats_run(run->context, (batch->size + MEAN_BLOCK - 1) / MEAN_BLOCK, add_block,
                           batch, (struct stats_progress){0}, error);
    }
    return status;
}

int mean_average_of(const struct mean_run *run, mean_body *body, void *argument, size_t points,
                    struct stats_progress progress, double *average, struct srnf_error *error)
{
    size_t size = 3 * points;
    size_t most = batch_of(run->n, size);
    struct batch batch = {.run = run,
                          .body = body,
                          .argument = argument,
                          .size = size,
                          .fields = srnf_alloc(most, size * sizeof(double)),
                          .sum = average};
    int status = batch.fields ? SRNF_OK : SRNF_ENOMEM;

    for (size_t k = 0; k < size; k++) {
        average[k] = 0.0;
    }
    for (; batch.first < run->n && status == SRNF_OK; batch.first += batch.count) {
        batch.count = run->n - batch.first < most ? run->n - batch.first : most;
        status = run_batch(&batch, progress, error);
    }
    for (size_t k = 0; k < size; k++) {
        average[k] /= (double)run->n;
    }
    srnf_free(batch.fields);
    return status;
}
