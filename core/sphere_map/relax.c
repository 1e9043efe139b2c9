/*
 * relax.c - active-set Gauss-Seidel on the whole map: one Newton step for each active
 * vertex in turn.
 *
 * A vertex whose star energy fell by more than GAIN wakes itself and its neighbours; the others
 * sleep. Sweeps run in the order of indices, so the result is the same on every run.
 */
#include "sphere_map.h"

#define STEPS_ASKED 256 /* vertices between two looks at cancellation */
#define GAIN 1e-5       /* looser leaves slivers far from the minimum */

static int sweep(struct spherical *s, bool *active, size_t *woken)
{
    size_t steps = 0;

    *woken = 0;
    for (uint32_t v = 0; v < s->n; v++) {
        const struct ring *ring = &s->rings[v];

        if (!active[v]) {
            continue;
        }
        if (++steps % STEPS_ASKED == 0 && srnf_is_canceled(s->context)) {
            return SRNF_ECANCELED;
        }
        active[v] = false;
        if (spherical_star_load(s, v)) {
            return SRNF_ENOMEM;
        }
        if (spherical_star_step(s, v) > GAIN) {
            (*woken)++;
            active[v] = true;
            for (uint32_t i = 0; i < ring->count; i++) {
                active[ring->at[i]] = true;
            }
        }
    }
    return SRNF_OK;
}

int spherical_relax(struct spherical *s, size_t max_sweeps)
{
    bool *active = srnf_alloc(s->n, sizeof *active);
    size_t woken = 1;
    int status = SRNF_OK;

    if (!active) {
        return SRNF_ENOMEM;
    }
    for (size_t v = 0; v < s->n; v++) {
        active[v] = s->present[v];
    }
    for (size_t k = 0; k < max_sweeps && woken > 0 && status == SRNF_OK; k++) {
        status = sweep(s, active, &woken);
        if (status == SRNF_OK && srnf_is_canceled(s->context)) {
            status = SRNF_ECANCELED;
        }
    }
    srnf_free(active);
    return status;
}
