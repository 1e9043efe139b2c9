/*
 * mean_kept.c - the first registration of each subject to the start of a group mean, kept as parts
 * (srnf_context.recall): of a large group it takes longer than all iterations after it, which have
 * a checkpoint each (mean_checkpoint.c). What is recalled goes on with the same bits.
 *
 * Part 2 i is the number of numbers of part 2 i + 1: the rotation, then for each link of the chain
 * its kind, its degree, and its values.
 */
#include "mean.h"

#include <string.h>

#define LINK_DEGREE_MAX 64
#define NUMBERS_MAX 1e8

static size_t link_values(const struct srnf_warp_link *link)
{
    return link->kind == SRNF_WARP_ROTATION ? 9 : 2 * srnf_coefficient_count(link->degree);
}

uint64_t mean_series(const struct mean_run *run, size_t start)
{
    uint64_t what = STATS_KEPT_REGISTERED | (start == STATS_START_DEFAULT ? 0 : start + 1) << 8;

    return stats_series(run->work, what, run->n, run->surfaces, &run->registration);
}

void mean_keep_registered(const struct mean_run *run, size_t i, const struct srnf_context *context)
{
    const struct mean_subject *subject = &run->subjects[i];
    size_t count = 9, at = 9;
    double *numbers;
    double number;

    if (!context || !context->keep) {
        return;
    }
    for (size_t k = 0; k < subject->warp.n_links; k++) {
        count += 2 + link_values(&subject->warp.links[k]);
    }
    numbers = srnf_alloc(count, sizeof(double));
    if (!numbers) {
        return; /* it is registered anew */
    }
    linear_copy(9, subject->at.rotation, numbers);
    for (size_t k = 0; k < subject->warp.n_links; k++) {
        const struct srnf_warp_link *link = &subject->warp.links[k];

        numbers[at++] = (double)link->kind;
        numbers[at++] = link->kind == SRNF_WARP_ROTATION ? 0.0 : (double)link->degree;
        linear_copy(link_values(link), link->values, numbers + at);
        at += link_values(link);
    }
    number = (double)count;
    stats_keep(context, run->series, 2 * i, 1, &number);
    stats_keep(context, run->series, 2 * i + 1, count, numbers);
    srnf_free(numbers);
}

/* One of two kinds and a degree, or not what was kept. */
static bool is_link(const double *numbers, size_t left, struct srnf_warp_link *link)
{
    bool rotation = left >= 2 && numbers[0] == (double)SRNF_WARP_ROTATION;
    bool step = left >= 2 && numbers[0] == (double)SRNF_WARP_EXP;

    if ((!rotation && !step) || !(numbers[1] >= 0.0 && numbers[1] <= LINK_DEGREE_MAX)) {
        return false;
    }
    *link = (struct srnf_warp_link){.kind = rotation ? SRNF_WARP_ROTATION : SRNF_WARP_EXP,
                                    .degree = (size_t)numbers[1]};
    return link_values(link) <= left - 2;
}

/* The chain from its numbers; false leaves some of it. */
static bool read_chain(const double *numbers, size_t count, struct srnf_warp *warp)
{
    struct srnf_warp_link link = {.values = NULL};
    size_t at = 0;

    while (at < count && is_link(numbers + at, count - at, &link)) {
        if (warp_append(warp, link.kind, link.degree, numbers + at + 2)) {
            return false;
        }
        at += 2 + link_values(&link);
    }
    return at == count;
}

bool mean_recall_registered(const struct mean_run *run, size_t i,
                            const struct srnf_context *context)
{
    struct mean_subject *subject = &run->subjects[i];
    double number = 0.0;
    double *numbers;
    size_t count;
    bool good;

    if (!stats_recall(context, run->series, 2 * i, 1, &number) ||
        !(number >= 9.0 && number <= NUMBERS_MAX)) {
        return false;
    }
    count = (size_t)number;
    numbers = srnf_alloc(count, sizeof(double));
    good = numbers && stats_recall(context, run->series, 2 * i + 1, count, numbers);
    srnf_warp_clear(&subject->warp);
    if (good) {
        linear_copy(9, numbers, subject->at.rotation);
        good = read_chain(numbers + 9, count - 9, &subject->warp);
    }
    if (!good) {
        srnf_warp_clear(&subject->warp);
    }
    srnf_free(numbers);
    return good;
}
