/*
 * projected.c - a subject beside a model (projected.h).
 */
#include "toolkit/projected.h"

#include "api/models.h"
#include "toolkit/handedness.h"
#include "toolkit/registration_options.h"

int projected_make(struct jobs_run *run, const char *model, const struct subject_input *input,
                   struct projected *projected, struct jobs_result *result)
{
    struct projected *p = projected;

    *p = (struct projected){.trial = {.distance = 0.0}};
    if (model_load(run, model, &p->model, result) ||
        !subject_open(input, &p->model, &p->subject, result)) {
        return SRNF_EINVAL;
    }
    p->made = model_made_from(&p->model.stored);
    if (registration_read(json_object_get(p->made, "registration"), &p->options)) {
        p->registration = &p->options;
    }
    if (model_members_read(p->made, p->model.pca.n, p->model.joint.n_parts, &p->members)) {
        return compute_fail(result, SRNF_ENOMEM, NULL, "reading the model");
    }
    return compute_project(run, &p->model, &p->subject, p->registration, &p->members.view,
                           &p->projection, result);
}

int projected_try_mirrored(struct jobs_run *run, int handedness, struct projected *projected,
                           struct jobs_result *result)
{
    if (handedness == HANDEDNESS_IGNORE || projected->projection.training_subject) {
        return 0;
    }
    return compute_project_mirrored(run, &projected->model, &projected->subject,
                                    projected->registration, &projected->projection,
                                    &projected->trial, result);
}

void projected_clear(struct projected *projected)
{
    compute_projection_clear(&projected->projection);
    model_members_clear(&projected->members);
    json_decref(projected->made);
    compute_model_clear(&projected->model);
}
