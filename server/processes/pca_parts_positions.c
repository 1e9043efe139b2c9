/*
 * pca_parts_positions.c - where the parts of subjects are (toolkit/positions.h), for the processes
 * of several structures.
 */
#include "processes/pca_parts.h"

#include <stdio.h>
#include <string.h>

#include "toolkit/positions.h"

void pca_parts_check_pose(struct process_inputs *given)
{
    const json_t *canonical = given->canonical, *registers = json_object_get(canonical, "register");

    if (json_is_true(json_object_get(canonical, "relativePose")) &&
        !json_is_true(json_object_get(canonical, "commonPose")) && !json_is_false(registers)) {
        problem_add(given->list, "/inputs/relativePose",
                    "needs commonPose%s: where parts are turned one by one, their pose is lost",
                    registers ? " or register false" : "");
    }
}

/* Those of one subject: [n_parts][3]. */
static int find_subject(struct jobs_run *run, const struct srnf_sht *sht,
                        const struct group_input *group, size_t n, size_t n_parts,
                        const struct compute_group *loaded, size_t subject, double *own,
                        struct jobs_result *result)
{
    struct compute_surface surfaces[PCA_PARTS_MAX];
    const double *numbers[PCA_PARTS_MAX];

    for (size_t p = 0; p < n_parts; p++) {
        size_t i = p * n + subject;

        surfaces[p] = (struct compute_surface){.scale = loaded->scales[i],
                                               .mirrored = group->mirrored.member[i]};
        (void)snprintf(surfaces[p].id, sizeof surfaces[p].id, "%s", group->ids[i]);
        memcpy(surfaces[p].origin, loaded->origins[i], sizeof surfaces[p].origin);
        numbers[p] = loaded->surfaces[i];
    }
    return positions_find(run, sht, n_parts, surfaces, numbers, own, result);
}

double *pca_parts_positions(struct jobs_run *run, const struct group_input *group, size_t n,
                            size_t n_parts, const struct compute_group *loaded,
                            struct jobs_result *result)
{
    struct jobs *jobs = jobs_run_jobs(run);
    const struct srnf_sht *sht = NULL;
    double *positions = srnf_alloc(3 * n * n_parts, sizeof(double));
    int status = jobs_transform_acquire(jobs, loaded->degree, SRNF_GRID_GAUSS_LEGENDRE, 0, 0, &sht);

    if (status || !positions) {
        status = compute_fail(result, status ? status : SRNF_ENOMEM, NULL, "placing the parts");
    }
    for (size_t i = 0; i < n && !status; i++) {
        status = find_subject(run, sht, group, n, n_parts, loaded, i, positions + 3 * i * n_parts,
                              result);
    }
    jobs_transform_release(jobs, sht);
    if (status) {
        srnf_free(positions);
        return NULL;
    }
    return positions;
}
