/*
 * model.h - what processes on a model share.
 */
#ifndef SRNFD_TOOLKIT_MODEL_H
#define SRNFD_TOOLKIT_MODEL_H

#include "toolkit/process.h"
#include "compute/model.h"

#define MODEL_NAME_MAX 64 /* bytes of a surface's name */

/* The input that names the model, in a process's table: its member of the typed inputs. */
#define MODEL_INPUT(typed)                                                                  \
    {                                                                                       \
        "model", INPUT_MODEL, offsetof(struct typed, model), "The model.", .required = true \
    }
/* The surfaces of a result, as model_keep_surfaces gives them. */
#define MODEL_SURFACES                                                            \
    {                                                                             \
        "surfaces", OUTPUT_OBJECTS,                                               \
            "Records; the deformation from the mean rides along in their meshes." \
    }

/* The components of the model that the canonical inputs name; 0 where it is gone. */
long model_components(struct process_inputs *inputs);

/* Stores what was inverted; the records (new reference), or NULL with the problem set.
   names: [points->n] */
json_t *model_keep_surfaces(struct jobs_run *run, const char *process,
                            const struct compute_model *model,
                            const struct compute_reconstruction *points,
                            const char (*names)[MODEL_NAME_MAX], struct jobs_result *result);

#endif
