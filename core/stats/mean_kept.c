/*
 * mean_kept.c - the first registration of each subject to the start of a group mean, kept as parts
 * (srnf_context.recall): of a large group it takes longer than all iterations after it, which have
 * a checkpoint each (mean_checkpoint.c). What is recalled goes on with the same bits.
 *
 * Part 2 i is the number of numbers of part 2 i + 1: the rotation and the chain (mean_spill.c).
 * Where chains are in scratch, part i is the rotation and where the chain is: small, however many.
 */
#include "mean.h"

#include <string.h>

#define NUMBERS_MAX 1e8
#define PLACE ((size_t)13) /* rotation, offset, count, two halves of the digest */
#define HALF ((uint64_t)1 << 32)
#define WHOLE_MAX 9007199254740992 /* to which doubles hold all whole numbers */

uint64_t mean_hash_landmarks(const struct mean_run *run, uint64_t hash)
{
    const struct srnf_group_landmarks *l = run->landmarks;

    if (!l) {
        return hash;
    }
    hash = stats_hash(stats_hash(hash, l->n), l->guiding);
    hash = stats_hash_doubles(hash, 1, &l->weight);
    return stats_hash_doubles(hash, 3 * run->n * l->n, l->points);
}

uint64_t mean_series(const struct mean_run *run, size_t start)
{
    uint64_t kind = run->spill ? STATS_KEPT_SPILLED : STATS_KEPT_REGISTERED;
    uint64_t what = kind | (start == STATS_START_DEFAULT ? 0 : start + 1) << 8;

    return mean_hash_landmarks(
        run, stats_series(run->work, what, run->n, run->surfaces, &run->registration));
}

/* ---- In scratch ------------------------------------------------------------------------------ */

static void keep_place(const struct mean_run *run, size_t i, const struct srnf_context *context)
{
    const struct mean_subject *subject = &run->subjects[i];
    const struct mean_piece *piece = subject->pieces;
    double numbers[PLACE];

    if (subject->n_pieces == 1 && piece->offset < WHOLE_MAX) {
        linear_copy(9, subject->at.rotation, numbers);
        numbers[9] = (double)piece->offset;
        numbers[10] = (double)piece->count;
        numbers[11] = (double)(piece->digest % HALF);
        numbers[12] = (double)(piece->digest / HALF);
        stats_keep(context, run->series, i, PLACE, numbers);
    }
}

static bool is_whole(double number, double below)
{
    return number >= 0.0 && number < below && number == (double)(uint64_t)number;
}

static bool recall_place(const struct mean_run *run, size_t i, const struct srnf_context *context,
                         struct srnf_warp *chain)
{
    struct mean_subject *subject = &run->subjects[i];
    struct mean_piece piece;
    double numbers[PLACE];

    if (!stats_recall(context, run->series, i, PLACE, numbers) ||
        !is_whole(numbers[9], (double)WHOLE_MAX) || !is_whole(numbers[10], NUMBERS_MAX) ||
        !is_whole(numbers[11], (double)HALF) || !is_whole(numbers[12], (double)HALF)) {
        return false;
    }
    piece.offset = (uint64_t)numbers[9];
    piece.count = (uint64_t)numbers[10];
    piece.digest = (uint64_t)numbers[11] + (uint64_t)numbers[12] * HALF;
    subject->n_pieces = 0;
    if (!mean_piece_is_there(run, &piece) || mean_pieces_add(subject, &piece)) {
        return false;
    }
    if (mean_chain_open(run, i, chain)) {
        subject->n_pieces = 0;
        return false;
    }
    linear_copy(9, numbers, subject->at.rotation);
    return true;
}

/* ---- In memory ------------------------------------------------------------------------------- */

static void keep_chain(const struct mean_run *run, size_t i, const struct srnf_context *context)
{
    const struct mean_subject *subject = &run->subjects[i];
    size_t count = 9 + mean_chain_size(&subject->warp);
    double *numbers = srnf_alloc(count, sizeof(double));
    double number = (double)count;

    if (numbers) { /* without memory it is registered anew */
        linear_copy(9, subject->at.rotation, numbers);
        mean_chain_write(&subject->warp, numbers + 9);
        stats_keep(context, run->series, 2 * i, 1, &number);
        stats_keep(context, run->series, 2 * i + 1, count, numbers);
    }
    srnf_free(numbers);
}

static bool recall_chain(const struct mean_run *run, size_t i, const struct srnf_context *context,
                         struct srnf_warp *chain)
{
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
    good = numbers && stats_recall(context, run->series, 2 * i + 1, count, numbers) &&
           mean_chain_read(numbers + 9, count - 9, chain) == SRNF_OK;
    if (good) {
        linear_copy(9, numbers, run->subjects[i].at.rotation);
    }
    srnf_free(numbers);
    return good;
}

/* ---- Either ---------------------------------------------------------------------------------- */

void mean_keep_registered(const struct mean_run *run, size_t i, const struct srnf_context *context)
{
    if (!context || !context->keep) {
        return;
    }
    if (run->spill) {
        keep_place(run, i, context);
    } else {
        keep_chain(run, i, context);
    }
}

bool mean_recall_registered(const struct mean_run *run, size_t i,
                            const struct srnf_context *context, struct srnf_warp *chain)
{
    bool good =
        run->spill ? recall_place(run, i, context, chain) : recall_chain(run, i, context, chain);

    if (!good) {
        srnf_warp_clear(chain);
    }
    return good;
}
