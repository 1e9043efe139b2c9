/*
 * part.c - the progress of a computation of several parts: each counts from 0 to 1 for itself, and
 * is told as its share of the whole, by what the parts cost.
 */
#include "stats.h"

static void part_progress(void *user, double fraction, const char *message)
{
    const struct stats_part *part = (const struct stats_part *)user;

    srnf_report_progress(part->whole, part->from + fraction * (part->to - part->from), message);
}

static bool part_canceled(void *user)
{
    return srnf_is_canceled(((const struct stats_part *)user)->whole);
}

static void part_parallel_for(void *user, size_t count, void (*body)(void *, size_t),
                              void *argument)
{
    const struct srnf_context *whole = ((const struct stats_part *)user)->whole;

    whole->parallel_for(whole->user, count, body, argument);
}

static bool part_recall(void *user, uint64_t series, uint64_t index, size_t count, double *values)
{
    const struct srnf_context *whole = ((const struct stats_part *)user)->whole;

    return whole->recall(whole->user, series, index, count, values);
}

static void part_keep(void *user, uint64_t series, uint64_t index, size_t count,
                      const double *values)
{
    const struct srnf_context *whole = ((const struct stats_part *)user)->whole;

    whole->keep(whole->user, series, index, count, values);
}

/* The search tells its progress itself: as a share of the whole, too. */
static int part_search(void *user, const struct srnf_field_search *search, struct srnf_error *error)
{
    const struct stats_part *part = (const struct stats_part *)user;
    struct srnf_field_search own = *search;

    own.from = part->from + search->from * (part->to - part->from);
    own.to = part->from + search->to * (part->to - part->from);
    return part->whole->search(part->whole->user, &own, error);
}

struct srnf_context stats_part_enter(struct stats_part *part, double cost)
{
    const struct srnf_context *whole = part->whole;
    struct srnf_context context = {
        .user = part, .progress = part_progress, .canceled = part_canceled};

    part->from = part->all > 0.0 ? part->done / part->all : 0.0;
    part->done += cost;
    part->to = part->all > 0.0 ? part->done / part->all : 0.0;
    if (whole) {
        context.parallel_for = whole->parallel_for ? part_parallel_for : NULL;
        context.recall = whole->recall ? part_recall : NULL;
        context.keep = whole->keep ? part_keep : NULL;
        context.search = whole->search ? part_search : NULL;
    }
    return context;
}
