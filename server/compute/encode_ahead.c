/*
 * encode_ahead.c - how the encodings of many meshes are cut into tasks.
 *
 * A task is some consecutive meshes, of about a second. Their bytes are in memory while a round is
 * open, and belong to the job: so meshes are offered in rounds of MESH_BYTES at most, or an eighth
 * of what a job may have.
 */
#include "compute/encode_ahead.h"

#include "compute/compute.h"
#include "compute/prepared.h"
#include "compute/seconds.h"
#include "jobs/tasks.h"
#include "store/digest.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define TASK_SECONDS 1.0
#define MESH_BYTES ((size_t)64 << 20)
#define CONTENT_MAX ((size_t)48 << 20) /* that a worker takes (worker/link.c) */

/* A mesh of a round. */
struct offered {
    size_t place; /* among those of the caller */
    struct tasks_encoding asked;
    struct tasks_content contents[2]; /* bytes are srnf_alloc's */
    double seconds;
};

struct task {
    size_t first, n; /* offered */
};

struct spread {
    struct compute_ahead *ahead;
    struct offered *offered; /* [n], room for all */
    struct task *tasks;      /* [n_tasks] */
    size_t n, n_tasks, bytes;
};

void compute_ahead_clear(struct compute_ahead *ahead)
{
    for (size_t i = 0; ahead->found && i < ahead->n; i++) {
        srnf_free(ahead->found[i].encoded.coefficients);
    }
    srnf_free(ahead->found);
    srnf_free(ahead->there);
    *ahead = (struct compute_ahead){.n = 0};
}

/* ---- The round ------------------------------------------------------------------------------- */

static int describe(void *user, size_t index, struct jobs_task *task)
{
    const struct spread *spread = user;
    const struct task *what = &spread->tasks[index];
    struct tasks_encoding asked[TASKS_ENCODINGS_MAX];
    int status;

    *task = (struct jobs_task){.contents = malloc(2 * what->n * sizeof *task->contents)};
    if (!task->contents) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < what->n; i++) {
        const struct offered *offered = &spread->offered[what->first + i];

        asked[i] = offered->asked;
        task->contents[task->n_contents++] = offered->contents[0];
        if (offered->asked.has_sphere) {
            task->contents[task->n_contents++] = offered->contents[1];
        }
    }
    status = tasks_encodings_write(what->n, asked, &task->inputs);
    if (status) {
        jobs_task_clear(task);
    }
    return status;
}

static int take(void *user, size_t index, const void *result, size_t size)
{
    const struct spread *spread = user;
    const struct task *what = &spread->tasks[index];
    struct tasks_encoded *found = srnf_alloc(what->n, sizeof *found);
    int status = found ? tasks_encodings_read(result, size, what->n, found) : SRNF_ENOMEM;

    for (size_t i = 0; status == SRNF_OK && i < what->n; i++) {
        size_t place = spread->offered[what->first + i].place;

        spread->ahead->found[place] = found[i];
        spread->ahead->there[place] = true;
    }
    srnf_free(found);
    return status;
}

/* Consecutive meshes until they take a second. */
static void cut(struct spread *spread)
{
    double seconds = INFINITY;

    spread->n_tasks = 0;
    for (size_t i = 0; i < spread->n; i++) {
        if (seconds >= TASK_SECONDS ||
            spread->tasks[spread->n_tasks - 1].n == TASKS_ENCODINGS_MAX) {
            spread->tasks[spread->n_tasks++] = (struct task){.first = i};
            seconds = 0.0;
        }
        spread->tasks[spread->n_tasks - 1].n++;
        seconds += spread->offered[i].seconds;
    }
}

static void clear_offered(struct spread *spread)
{
    for (size_t i = 0; i < spread->n; i++) {
        for (size_t k = 0; k < 2; k++) {
            union {
                const void *given;
                void *own;
            } bytes = {spread->offered[i].contents[k].bytes};

            srnf_free(bytes.own);
        }
    }
    spread->n = spread->bytes = 0;
}

static int run_round(struct jobs_run *run, struct spread *spread, double from, double to,
                     struct jobs_result *result)
{
    struct jobs_round round = {.kind = tasks_kind_find(TASKS_ENCODINGS),
                               .from = from,
                               .to = to,
                               .describe = describe,
                               .take = take,
                               .user = spread};
    int status = 0;

    cut(spread);
    round.n = spread->n_tasks;
    if (round.n > 0) {
        status = jobs_run_round(run, &round, result);
    }
    clear_offered(spread);
    if (status && status != JOBS_TASK_FAILED) {
        (void)compute_fail(result, status, NULL, "encoding the members");
    }
    return status;
}

/* ---- Meshes ---------------------------------------------------------------------------------- */

static int set_content(const struct srnf_mesh *mesh, struct tasks_content *content)
{
    size_t size = tasks_mesh_size(mesh);
    unsigned char *bytes = srnf_alloc(size, 1);

    if (!bytes) {
        return SRNF_ENOMEM;
    }
    tasks_put_mesh(bytes, mesh);
    content->bytes = bytes;
    content->size = size;
    store_sha256_hex(content->digest, bytes, size);
    return SRNF_OK;
}

/* Adds a prepared mesh to the round. */
static int offer(struct spread *spread, size_t place, const struct compute_encode_inputs *inputs,
                 const struct compute_prepared *prepared)
{
    const struct srnf_mesh *meshes[2] = {&prepared->mesh, &prepared->sphere};
    struct offered *offered = &spread->offered[spread->n++];
    struct tasks_encoding *asked = &offered->asked;
    int status = SRNF_OK;

    *offered = (struct offered){
        .place = place,
        .asked = {.options = compute_encode_options(inputs),
                  .has_sphere = inputs->sphere[0] != '\0',
                  .kernel_known = prepared->kernel_known,
                  .kernel = prepared->kernel_known ? prepared->kernel : (struct srnf_star){0},
                  .volume = prepared->report.volume,
                  .area = prepared->report.area},
        .seconds = seconds_of_encodings((double)inputs->options.degree, 1.0,
                                        (double)prepared->mesh.n_faces)};
    memcpy(asked->centroid, prepared->report.centroid, sizeof asked->centroid);
    for (size_t k = 0; status == SRNF_OK && k < 1 + (size_t)asked->has_sphere; k++) {
        asked->n_vertices[k] = meshes[k]->n_vertices;
        asked->n_faces[k] = meshes[k]->n_faces;
        status = set_content(meshes[k], &offered->contents[k]);
        spread->bytes += offered->contents[k].size;
    }
    return status;
}

/* Adds one of the meshes to the round, if it is to be offered. */
static int consider(struct jobs_run *run, struct spread *spread, size_t place,
                    const struct compute_encode_inputs *inputs)
{
    struct compute_prepared prepared;
    struct jobs_result aside = {.results = NULL}; /* compute_encode tells it */
    int status;

    if (compute_encode_is_kept(run, inputs)) {
        return SRNF_OK;
    }
    status =
        compute_prepared_load(run, inputs->mesh, inputs->sphere, inputs->mirror, &prepared, &aside);
    if (status) {
        return SRNF_OK;
    }
    if (prepared.report.n_problems == 0 && tasks_mesh_size(&prepared.mesh) <= CONTENT_MAX &&
        tasks_mesh_size(&prepared.sphere) <= CONTENT_MAX) {
        status = offer(spread, place, inputs, &prepared);
    }
    compute_prepared_clear(&prepared);
    return status;
}

static int spread_all(struct jobs_run *run, size_t n, struct compute_encode_inputs **inputs,
                      double from, double to, struct spread *spread, struct jobs_result *result)
{
    const struct srnf_context *context = jobs_run_context(run);
    size_t most = jobs_memory_limit(jobs_run_jobs(run)) / 8;
    double begun = from;
    int status = 0;

    most = most < MESH_BYTES ? most : MESH_BYTES;
    for (size_t i = 0; i < n && status == 0; i++) {
        status = context->canceled(context->user) ? SRNF_ECANCELED : 0;
        if (status == 0 && inputs[i]) {
            status = consider(run, spread, i, inputs[i]);
        }
        if (status) {
            (void)compute_fail(result, status, NULL, "encoding the members");
        } else if (spread->bytes >= most || i + 1 == n) {
            double end = from + (to - from) * (double)(i + 1) / (double)n;

            status = run_round(run, spread, begun, end, result);
            begun = end;
        }
    }
    clear_offered(spread);
    return status;
}

int compute_encode_ahead(struct jobs_run *run, size_t n, struct compute_encode_inputs **inputs,
                         double from, double to, struct compute_ahead *ahead,
                         struct jobs_result *result)
{
    struct spread spread = {.ahead = ahead};
    int status = SRNF_ENOMEM;

    *ahead = (struct compute_ahead){.n = n};
    if (!jobs_offers_tasks(jobs_run_jobs(run)) || n == 0) {
        return 0;
    }
    ahead->found = srnf_alloc(n, sizeof *ahead->found);
    ahead->there = srnf_alloc(n, sizeof *ahead->there);
    spread.offered = srnf_alloc(n, sizeof *spread.offered);
    spread.tasks = srnf_alloc(n, sizeof *spread.tasks);
    if (ahead->found && ahead->there && spread.offered && spread.tasks) {
        status = spread_all(run, n, inputs, from, to, &spread, result);
    } else {
        (void)compute_fail(result, status, NULL, "encoding the members");
    }
    for (size_t i = 0; status == 0 && i < n; i++) {
        if (ahead->there[i]) {
            inputs[i]->ahead = &ahead->found[i];
        }
    }
    srnf_free(spread.offered);
    srnf_free(spread.tasks);
    return status;
}
