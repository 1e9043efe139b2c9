/*
 * mean_lying.c - where a subject lies: kept while it is tried elsewhere.
 */
#include "mean.h"

static int copy_links(const struct srnf_warp *chain, struct srnf_warp *copy)
{
    int status = SRNF_OK;

    for (size_t k = 0; k < chain->n_links && status == SRNF_OK; k++) {
        const struct srnf_warp_link *link = &chain->links[k];

        status = warp_append(copy, link->kind, link->degree, link->values);
    }
    return status;
}

int mean_lying_copy(const struct mean_run *run, size_t i, struct mean_lying *copy)
{
    const struct mean_subject *subject = &run->subjects[i];
    struct srnf_warp chain;
    int status = mean_chain_open(run, i, &chain);

    mean_lying_clear(copy);
    if (status) {
        return status;
    }
    copy->at = subject->at;
    copy->tabulated = subject->tabulated;
    status = copy_links(&chain, &copy->warp);
    mean_chain_close(run, &chain);
    return status;
}

int mean_lying_restore(const struct mean_run *run, size_t i, const struct mean_lying *from)
{
    struct mean_subject *subject = &run->subjects[i];
    struct srnf_warp chain = {0};
    int status = copy_links(&from->warp, &chain);

    if (status) {
        srnf_warp_clear(&chain);
        return status;
    }
    subject->at = from->at;
    subject->tabulated = from->tabulated;
    status = mean_chain_set(run, i, &chain);
    return status ? status : mean_replay(run, i);
}

/* Measuring finds the rotation to the mean. */
int mean_lying_on(const struct mean_run *run, size_t i, size_t by, const struct warp *registered)
{
    struct mean_lying composed = {.tabulated = 0};
    int status = mean_lying_copy(run, by, &composed);

    status = status ? status : copy_links(&registered->chain, &composed.warp);
    status = status ? status : mean_take_registered(run, i, registered->rotation, &composed.warp);
    mean_lying_clear(&composed);
    return status ? status : mean_replay(run, i);
}

void mean_lying_clear(struct mean_lying *lying)
{
    srnf_warp_clear(&lying->warp);
    *lying = (struct mean_lying){.tabulated = 0};
}
