/*
 * mean_register.c - all subjects registered to the mean from nothing, here or on other machines.
 */
#include "mean.h"

static int register_one(void *argument, size_t i, double *field, const struct srnf_context *context,
                        struct srnf_error *error)
{
    const struct mean_run *run = argument;
    bool placed;
    int status = mean_register(run, i, context, &placed, error);

    status = status || placed ? status : mean_replay(run, i);
    return status ? status : mean_measure(run, i, field, NULL);
}

/* Of one that was registered elsewhere. */
static int lay_one(void *argument, size_t i, double *field, const struct srnf_context *context,
                   struct srnf_error *error)
{
    const struct mean_run *run = argument;
    int status = mean_replay(run, i);

    (void)context;
    (void)error;
    return status ? status : mean_measure(run, i, field, NULL);
}

/* A search on other machines, and the first surface that cannot meet its landmarks. */
struct elsewhere {
    struct mean_run *run;
    size_t failed; /* SIZE_MAX: none */
    struct srnf_error why;
};

static int take_one(void *argument, size_t i, const double rotation[9], struct srnf_warp *warp)
{
    const struct elsewhere *elsewhere = argument;

    return mean_take_registered(elsewhere->run, i, rotation, warp);
}

static void landmarks_of_one(void *argument, size_t i, struct srnf_landmarks *landmarks)
{
    const struct elsewhere *elsewhere = argument;

    *landmarks = mean_landmarks_of(elsewhere->run, i);
}

/* The others go on: which fails does not depend on who comes first. */
static int unmet_one(void *argument, size_t i, const struct srnf_error *why)
{
    struct elsewhere *elsewhere = argument;

    if (i < elsewhere->failed) {
        elsewhere->failed = i;
        elsewhere->why = *why;
    }
    return SRNF_OK;
}

/* All to the mean from nothing where the caller has other machines for it (srnf_context.search), or
   SRNF_SEARCH_HERE. */
static int register_elsewhere(struct mean_run *run, struct stats_progress progress,
                              struct srnf_error *error)
{
    const struct srnf_context *context = run->context;
    struct elsewhere elsewhere = {.run = run, .failed = SIZE_MAX};
    const struct srnf_field_search search = {.sht = run->work,
                                             .field = run->mean_q,
                                             .norm2 = run->norm2,
                                             .options = &run->registration,
                                             .n = run->n,
                                             .surfaces = run->surfaces,
                                             .from = progress.from,
                                             .to = progress.to,
                                             .take = take_one,
                                             .landmarks =
                                                 mean_is_guided(run) ? landmarks_of_one : NULL,
                                             .unmet = unmet_one,
                                             .argument = &elsewhere};
    int status = context && context->search ? context->search(context->user, &search, error)
                                            : SRNF_SEARCH_HERE;

    return status == SRNF_OK && elsewhere.failed != SIZE_MAX
               ? mean_register_failed(elsewhere.failed, elsewhere.why.status, &elsewhere.why, error)
               : status;
}

int mean_register_all(struct mean_run *run, struct stats_progress progress,
                      struct srnf_error *error)
{
    mean_body *body = lay_one;
    int status;

    mean_set_target(run);
    status = mean_aim(run);
    status = status ? status : register_elsewhere(run, progress, error);
    if (status == SRNF_SEARCH_HERE) {
        body = register_one;
        status = SRNF_OK;
    } else {
        progress.message = NULL; /* all of it is told */
    }
    if (status) {
        return status;
    }
    status = mean_average_of(run, body, run, run->points, progress, run->average, error);
    run->started = status == SRNF_OK;
    if (status == SRNF_OK) {
        mean_adopt(run, mean_variance_about(run, run->average));
    }
    if (status == SRNF_OK && !isfinite(run->variance)) {
        return srnf_fail(error, SRNF_ENUMERIC, -1, "the variance about the mean is not finite");
    }
    return status;
}
