/*
 * group.c - loading a group: each member by itself, in the run's parallel loop, and then
 * all of them into one array at one degree.
 *
 * Each body writes its own slot only, problem included; the problem told is that of the lowest
 * index, whoever finished first.
 */
#include "compute/group.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

struct slot {
    struct compute_surface surface;
    struct jobs_result result;
    int status;
    bool bridged;
};

struct loading {
    struct jobs_run *run;
    const char *const *ids;
    const struct compute_mirrored *mirrored; /* NULL: none */
    const struct compute_origin *origins;    /* of those to be bridged; NULL: none */
    struct slot *slots;
    size_t mesh_degree;
    struct srnf_context context; /* the run's, without its progress: that is the group's */
    size_t n;
    atomic_size_t done;
};

static bool is_bridged(const struct compute_origin *origins, size_t index)
{
    return origins && origins[index].surface[0];
}

static void load_one(void *argument, size_t index)
{
    struct loading *loading = argument;
    struct slot *slot = &loading->slots[index];
    const struct srnf_context *context = jobs_run_context(loading->run);
    bool mirror = loading->mirrored && loading->mirrored->member[index];
    size_t done;

    if (context->canceled(context->user)) {
        slot->status = SRNF_ECANCELED;
        return;
    }
    if (is_bridged(loading->origins, index)) {
        slot->status =
            compute_bridge_load(loading->run, &loading->context, &loading->origins[index], mirror,
                                &slot->surface, &slot->bridged, &slot->result);
    } else {
        slot->status = compute_surface_load_within(
            loading->run, &loading->context, loading->ids[index], mirror, loading->mesh_degree,
            &slot->surface, &slot->result);
    }
    done = atomic_fetch_add(&loading->done, 1) + 1;
    context->progress(context->user, (double)done / (double)loading->n, "loading the surfaces");
}

void compute_group_clear(struct compute_group *group)
{
    srnf_free(group->coefficients);
    srnf_free(group->surfaces);
    srnf_free(group->scales);
    srnf_free(group->origins);
    srnf_free(group->contents);
    srnf_free(group->ids);
    srnf_free(group->bridged);
    *group = (struct compute_group){0};
}

/* Puts what was loaded side by side. */
static int gather(const struct slot *slots, size_t n, size_t degree, struct compute_group *group)
{
    size_t count;

    for (size_t i = 0; degree == 0 && i < n; i++) {
        size_t own = slots[i].surface.degree;
        group->degree = own > group->degree ? own : group->degree;
    }
    group->n = n;
    group->degree = degree ? degree : group->degree;
    count = 3 * srnf_coefficient_count(group->degree);
    group->coefficients = srnf_alloc(n, count * sizeof(double));
    group->surfaces = srnf_alloc(n, sizeof *group->surfaces);
    group->scales = srnf_alloc(n, sizeof(double));
    group->origins = srnf_alloc(n, sizeof *group->origins);
    group->contents = srnf_alloc(n, sizeof *group->contents);
    group->ids = srnf_alloc(n, sizeof *group->ids);
    group->bridged = srnf_alloc(n, sizeof *group->bridged);
    if (!group->coefficients || !group->surfaces || !group->scales || !group->origins ||
        !group->contents || !group->ids || !group->bridged) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < n; i++) {
        srnf_surface_change_degree(slots[i].surface.degree, slots[i].surface.coefficients,
                                   group->degree, group->coefficients + i * count);
        group->surfaces[i] = group->coefficients + i * count;
        group->scales[i] = slots[i].surface.scale;
        memcpy(group->origins[i], slots[i].surface.origin, sizeof group->origins[i]);
        group->bridged[i] = slots[i].bridged;
        memcpy(group->contents[i], slots[i].surface.content, STORE_ID_MAX);
        memcpy(group->ids[i], slots[i].surface.surface, STORE_ID_MAX);
    }
    return 0;
}

/* How many are encoded. */
static size_t count_meshes(size_t n, const char *const *ids, const struct compute_origin *origins)
{
    size_t count = 0;

    for (size_t i = 0; i < n; i++) {
        count += compute_is_mesh(ids[i]) || is_bridged(origins, i);
    }
    return count;
}

int compute_group_load(struct jobs_run *run, size_t n, const char *const *ids,
                       const struct compute_mirrored *mirrored,
                       const struct compute_origin *origins, size_t mesh_degree, size_t degree,
                       double share, struct compute_group *group, struct jobs_result *result)
{
    const struct srnf_context *context = jobs_run_context(run);
    struct loading loading = {.run = run,
                              .ids = ids,
                              .mirrored = mirrored,
                              .origins = origins,
                              .mesh_degree = mesh_degree,
                              .slots = srnf_alloc(n, sizeof(struct slot)),
                              .context = *context,
                              .n = n};
    int status = 0;

    loading.context.progress = NULL;
    jobs_run_phase(run, share * (double)count_meshes(n, ids, origins) / (double)n);
    *group = (struct compute_group){0};
    if (!loading.slots) {
        return compute_fail(result, SRNF_ENOMEM, NULL, "loading the surfaces");
    }
    context->parallel_for(context->user, n, load_one, &loading);
    for (size_t i = 0; status == 0 && i < n; i++) {
        status = loading.slots[i].status;
        if (status) {
            *result = loading.slots[i].result;
        }
    }
    if (status == 0) {
        status = gather(loading.slots, n, degree, group);
        if (status) {
            compute_group_clear(group);
            (void)compute_fail(result, status, NULL, "loading the surfaces");
        }
    }
    for (size_t i = 0; i < n; i++) {
        compute_surface_clear(&loading.slots[i].surface);
    }
    srnf_free(loading.slots);
    return status;
}
