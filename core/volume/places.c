/*
 * places.c - where voxels were changed: those of one change that touch, by a corner at least, are a
 * place, with their mean in the world.
 */
#include "extract.h"

#include <stdlib.h>

void extract_world(const struct extraction *work, const double place[3], double point[3])
{
    const double *a = work->volume->affine;
    double index[3];

    for (size_t k = 0; k < 3; k++) {
        index[k] = place[k] + (double)work->box.first[k];
    }
    for (size_t row = 0; row < 3; row++) {
        point[row] = a[4 * row] * index[0] + a[4 * row + 1] * index[1] + a[4 * row + 2] * index[2] +
                     a[4 * row + 3];
    }
}

static int by_size(const void *a, const void *b)
{
    const struct srnf_changed_place *x = a, *y = b;

    if (x->voxels != y->voxels) {
        return x->voxels < y->voxels ? 1 : -1;
    }
    for (size_t k = 0; k < 3; k++) {
        if (x->position[k] < y->position[k] || x->position[k] > y->position[k]) {
            return x->position[k] < y->position[k] ? -1 : 1;
        }
    }
    return 0;
}

/* The voxels of one change that hang together with this one; their marks go. */
static struct srnf_changed_place gather(struct extraction *work, size_t seed, uint32_t *stack)
{
    const struct voxel_box *box = &work->box;
    const unsigned char mark = box->changes[seed];
    struct srnf_changed_place place = {.change = (enum srnf_change)(mark - 1)};
    struct simple_tables tables;
    double sum[3] = {0.0, 0.0, 0.0};
    size_t top = 0;

    simple_tables_fill(&tables, box);
    box->changes[seed] = 0;
    stack[top++] = (uint32_t)seed;
    while (top > 0) {
        size_t at = stack[--top];

        place.voxels++;
        sum[0] += (double)(at % box->stride[1]);
        sum[1] += (double)(at % box->stride[2] / box->stride[1]);
        sum[2] += (double)(at / box->stride[2]);
        for (size_t b = 0; b < 27; b++) {
            size_t beside = at + (size_t)tables.offset[b];

            if (box->changes[beside] == mark) {
                box->changes[beside] = 0;
                stack[top++] = (uint32_t)beside;
            }
        }
    }
    for (size_t k = 0; k < 3; k++) {
        sum[k] /= (double)place.voxels;
    }
    extract_world(work, sum, place.position);
    return place;
}

static void count_changes(struct extraction *work)
{
    for (size_t i = 0; i < work->box.count; i++) {
        enum srnf_change change = (enum srnf_change)(work->box.changes[i] - 1);

        if (work->box.changes[i]) {
            work->extracted->changed++;
            work->extracted->added += change == SRNF_CHANGE_CAVITY || change == SRNF_CHANGE_FILLED;
        }
    }
    work->extracted->removed = work->extracted->changed - work->extracted->added;
}

int extract_places(struct extraction *work)
{
    struct srnf_extracted *extracted = work->extracted;
    struct srnf_changed_place *places;
    uint32_t *stack;

    count_changes(work);
    if (extracted->changed == 0) {
        return SRNF_OK;
    }
    places = srnf_alloc(extracted->changed, sizeof *places);
    stack = srnf_alloc(extracted->changed, sizeof *stack);
    for (size_t i = 0; places && stack && i < work->box.count; i++) {
        if (work->box.changes[i]) {
            places[extracted->n_places++] = gather(work, i, stack);
        }
    }
    srnf_free(stack);
    if (!places || !stack) {
        srnf_free(places);
        return extract_no_memory(work);
    }
    qsort(places, extracted->n_places, sizeof *places, by_size);
    extracted->places = places;
    return SRNF_OK;
}
