/*
 * mean_spill.c - the warps of the subjects of a group mean, in memory or in scratch.
 *
 * What a subject has of its own is its chain, some 20 to 90 kB, and the points of the working grid
 * with their Jacobians, 32 P bytes. Of a large group both go to scratch that the caller lends
 * (srnf_mean_options.scratch): the points of all but the first subjects, which are held, and the
 * chains of all. An iteration visits the subjects one after the other, so that a cache of those
 * seen last would never find the next one; holding the first ones is as good as any.
 *
 * Layout of the scratch: n times 32 P bytes for the points, then the chains as they come. A chain
 * is in pieces, one of its registration and one of each step: so many doubles at an offset, with a
 * digest (kept.c), for each link its kind, its degree and its values. Points are those of this run
 * alone, which keeps their digests in memory. Pieces that a checkpoint names are read by a later
 * run, which puts its own behind all that
 * there is.
 *
 * What comes back from scratch has the bits that were written, so the mean has the same bits with
 * it and without. SRNF_EIO: a piece or points do not have their digest.
 */
#include "mean.h"

#include <string.h>

#define CHAIN_BYTES 1e5               /* of a chain, about, for the decision alone */
#define PIECE_MAX UINT64_C(100000000) /* numbers */
#define HEAD ((size_t)2)              /* numbers of a link before its values */

/* ---- Chains as numbers ----------------------------------------------------------------------- */

size_t mean_chain_size(const struct srnf_warp *chain)
{
    size_t count = 0;

    for (size_t k = 0; k < chain->n_links; k++) {
        count += HEAD + mean_link_values(&chain->links[k]);
    }
    return count;
}

void mean_chain_write(const struct srnf_warp *chain, double *numbers)
{
    for (size_t k = 0; k < chain->n_links; k++) {
        const struct srnf_warp_link *link = &chain->links[k];

        numbers[0] = (double)link->kind;
        numbers[1] = link->kind == SRNF_WARP_ROTATION ? 0.0 : (double)link->degree;
        linear_copy(mean_link_values(link), link->values, numbers + HEAD);
        numbers += HEAD + mean_link_values(link);
    }
}

/* One of two kinds and a degree, or not what was written. */
static bool is_link(const double *numbers, size_t left, struct srnf_warp_link *link)
{
    bool rotation = left >= HEAD && numbers[0] == (double)SRNF_WARP_ROTATION;
    bool step = left >= HEAD && numbers[0] == (double)SRNF_WARP_EXP;

    if ((!rotation && !step) || !(numbers[1] >= 0.0 && numbers[1] <= MEAN_LINK_DEGREE_MAX)) {
        return false;
    }
    *link = (struct srnf_warp_link){.kind = rotation ? SRNF_WARP_ROTATION : SRNF_WARP_EXP,
                                    .degree = (size_t)numbers[1]};
    return mean_link_values(link) <= left - HEAD;
}

int mean_chain_read(const double *numbers, size_t count, struct srnf_warp *chain)
{
    struct srnf_warp_link link = {.values = NULL};
    size_t at = 0;

    while (at < count && is_link(numbers + at, count - at, &link)) {
        if (warp_append(chain, link.kind, link.degree, numbers + at + HEAD)) {
            return SRNF_ENOMEM;
        }
        at += HEAD + mean_link_values(&link);
    }
    return at == count ? SRNF_OK : SRNF_EIO;
}

/* ---- Whether, and how much ------------------------------------------------------------------- */

static size_t page_bytes(const struct mean_run *run)
{
    return 4 * run->padded * sizeof(double);
}

int mean_spill_create(struct mean_run *run, const struct srnf_mean_options *options)
{
    double page = (double)page_bytes(run), n = (double)run->n;
    double fits = (double)options->held_bytes / page;

    run->held = run->n;
    if (options->scratch && n * (page + CHAIN_BYTES) > (double)options->held_bytes) {
        run->spill = srnf_alloc(1, sizeof *run->spill);
        if (!run->spill) {
            return SRNF_ENOMEM;
        }
        run->spill->lent = *options->scratch;
        atomic_init(&run->spill->end, run->n * page_bytes(run) > options->scratch->used
                                          ? run->n * page_bytes(run)
                                          : options->scratch->used);
        run->held = fits < n ? (size_t)fits : run->n;
    }
    run->held_points = srnf_alloc(run->held ? run->held : 1, page_bytes(run));
    return run->held_points ? SRNF_OK : SRNF_ENOMEM;
}

void mean_spill_clear(struct mean_run *run)
{
    srnf_free(run->held_points);
    srnf_free(run->spill);
}

/* ---- Points ---------------------------------------------------------------------------------- */

static uint64_t points_digest(const struct mean_run *run, const struct mean_points *points)
{
    return stats_hash_doubles(STATS_HASH_START, 4 * run->padded, points->copy);
}

static int read_points(const struct mean_run *run, size_t i, const struct mean_points *points)
{
    const struct srnf_scratch *lent = &run->spill->lent;
    int status = lent->read(lent->user, i * page_bytes(run), points->copy, page_bytes(run));

    if (status == SRNF_OK && points_digest(run, points) != run->subjects[i].points_digest) {
        status = SRNF_EIO;
    }
    return status;
}

int mean_points_open(const struct mean_run *run, size_t i, bool filled, struct mean_points *points)
{
    double *page = i < run->held ? run->held_points + 4 * i * run->padded : NULL;
    int status = SRNF_OK;

    *points = (struct mean_points){0};
    if (!page) {
        page = points->copy = srnf_alloc(1, page_bytes(run));
        if (!page) {
            return SRNF_ENOMEM;
        }
        if (filled) {
            status = read_points(run, i, points);
        }
    }
    for (size_t c = 0; c < 3; c++) {
        points->gamma[c] = page + c * run->padded;
    }
    points->jacobian = page + 3 * run->padded;
    if (status) {
        mean_points_drop(points);
    }
    return status;
}

void mean_points_drop(struct mean_points *points)
{
    srnf_free(points->copy);
    *points = (struct mean_points){0};
}

int mean_points_keep(const struct mean_run *run, size_t i, struct mean_points *points)
{
    int status = SRNF_OK;

    if (points->copy) {
        run->subjects[i].points_digest = points_digest(run, points);
        status = run->spill->lent.write(run->spill->lent.user, i * page_bytes(run), points->copy,
                                        page_bytes(run));
    }
    mean_points_drop(points);
    return status;
}

/* ---- Chains ---------------------------------------------------------------------------------- */

bool mean_piece_is_there(const struct mean_run *run, const struct mean_piece *piece)
{
    uint64_t used = run->spill->lent.used;

    return piece->count > 0 && piece->count <= PIECE_MAX && piece->offset <= used &&
           8 * piece->count <= used - piece->offset;
}

int mean_pieces_add(struct mean_subject *subject, const struct mean_piece *piece)
{
    size_t capacity = subject->n_pieces < subject->capacity ? 0 : 2 * subject->capacity + 4;
    struct mean_piece *pieces;

    if (capacity > 0) {
        pieces = srnf_alloc(capacity, sizeof *pieces);
        if (!pieces) {
            return SRNF_ENOMEM;
        }
        if (subject->n_pieces > 0) {
            memcpy(pieces, subject->pieces, subject->n_pieces * sizeof *pieces);
        }
        srnf_free(subject->pieces);
        subject->pieces = pieces;
        subject->capacity = capacity;
    }
    subject->pieces[subject->n_pieces++] = *piece;
    return SRNF_OK;
}

/* Writes the links behind all that there is, and notes where. */
static int spill_links(const struct mean_run *run, size_t i, const struct srnf_warp *links)
{
    size_t count = mean_chain_size(links);
    struct mean_spill *spill = run->spill;
    struct mean_piece piece = {.count = count};
    double *numbers;
    int status;

    if (count == 0) {
        return SRNF_OK;
    }
    numbers = srnf_alloc(count, sizeof(double));
    if (!numbers) {
        return SRNF_ENOMEM;
    }
    mean_chain_write(links, numbers);
    piece.digest = stats_hash_doubles(STATS_HASH_START, count, numbers);
    piece.offset = atomic_fetch_add(&spill->end, 8 * count);
    status = spill->lent.write(spill->lent.user, piece.offset, numbers, 8 * count);
    srnf_free(numbers);
    return status ? status : mean_pieces_add(&run->subjects[i], &piece);
}

static int read_piece(const struct mean_run *run, const struct mean_piece *piece,
                      struct srnf_warp *chain)
{
    const struct srnf_scratch *lent = &run->spill->lent;
    size_t count = (size_t)piece->count;
    double *numbers = srnf_alloc(count, sizeof(double));
    int status = SRNF_ENOMEM;

    if (numbers) {
        status = lent->read(lent->user, piece->offset, numbers, 8 * count);
    }
    if (status == SRNF_OK) {
        status = stats_hash_doubles(STATS_HASH_START, count, numbers) == piece->digest
                     ? mean_chain_read(numbers, count, chain)
                     : SRNF_EIO;
    }
    srnf_free(numbers);
    return status;
}

int mean_chain_open(const struct mean_run *run, size_t i, struct srnf_warp *chain)
{
    const struct mean_subject *subject = &run->subjects[i];
    int status = SRNF_OK;

    if (!run->spill) {
        *chain = subject->warp;
        return SRNF_OK;
    }
    *chain = (struct srnf_warp){0};
    for (size_t k = 0; k < subject->n_pieces && status == SRNF_OK; k++) {
        status = read_piece(run, &subject->pieces[k], chain);
    }
    if (status) {
        srnf_warp_clear(chain);
    }
    return status;
}

void mean_chain_close(const struct mean_run *run, struct srnf_warp *chain)
{
    if (run->spill) {
        srnf_warp_clear(chain);
    }
    *chain = (struct srnf_warp){0};
}

int mean_chain_set(const struct mean_run *run, size_t i, struct srnf_warp *chain)
{
    struct mean_subject *subject = &run->subjects[i];
    int status = SRNF_OK;

    srnf_warp_clear(&subject->warp);
    subject->n_pieces = 0;
    if (run->spill) {
        status = spill_links(run, i, chain);
        srnf_warp_clear(chain);
    } else {
        subject->warp = *chain;
        *chain = (struct srnf_warp){0};
    }
    return status;
}

int mean_chain_step(const struct mean_run *run, size_t i, const double *potentials)
{
    struct srnf_warp step = {0};
    int status;

    if (!run->spill) {
        return warp_append(&run->subjects[i].warp, SRNF_WARP_EXP, run->degree, potentials);
    }
    status = warp_append(&step, SRNF_WARP_EXP, run->degree, potentials);
    status = status ? status : spill_links(run, i, &step);
    srnf_warp_clear(&step);
    return status;
}
