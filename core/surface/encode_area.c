/*
 * encode_area.c - the route area: any closed mesh of genus zero through a low-distortion map to the
 * sphere (srnf_spherical_map), which is a bijection proved face by face. Its rotation is canonical,
 * so the same mesh in another pose or numbering becomes the same surface in that pose.
 *
 * Cost: the map, about 10 us a vertex; it runs on one thread, since each vertex needs its
 * predecessors.
 */
#include "encode.h"

/* The map has this part of the route's progress, from 0.1 on. */
#define PROGRESS_FROM 0.1
#define PROGRESS_SPAN 0.4

struct stage {
    const struct srnf_context *outer;
};

static void stage_progress(void *user, double fraction, const char *message)
{
    const struct stage *stage = user;

    srnf_report_progress(stage->outer, PROGRESS_FROM + PROGRESS_SPAN * fraction, message);
}

static bool stage_canceled(void *user)
{
    const struct stage *stage = user;

    return srnf_is_canceled(stage->outer);
}

int encode_area(const struct encode_task *task, struct encode_result *result)
{
    struct stage stage = {task->context};
    struct srnf_context context = {
        .user = &stage, .progress = stage_progress, .canceled = stage_canceled};
    struct srnf_spherical_map map = {0};
    int status = srnf_spherical_map(task->mesh, &context, &map, task->error);

    if (status == SRNF_OK) {
        result->distortion =
            (struct srnf_distortion){map.symmetric_dirichlet, map.log_area_deviation, map.flipped};
        status = encode_through_map(task, map.points, result);
    }
    srnf_free(map.points);
    return status;
}
