/*
 * subject.h - what is put beside a model: a surface, or for a model of several structures a surface
 * for each part by its name.
 */
#ifndef SRNFD_TOOLKIT_SUBJECT_H
#define SRNFD_TOOLKIT_SUBJECT_H

#include "toolkit/model.h"
#include "toolkit/table.h"

struct subject_input {
    char surface[STORE_ID_MAX]; /* "" where parts are given */
    json_t *parts;              /* {name: id}, owned; NULL without */
};

/* Rows of a table whose typed inputs have a struct subject_input called subject. */
#define SUBJECT_INPUTS(typed)                                                                     \
    {"surface",                                                                                   \
     INPUT_SURFACE,                                                                               \
     offsetof(struct typed, subject.surface),                                                     \
     "The surface; registered to the mean as those of the model were. A mesh is encoded with "    \
     "the default options, and at the degree of the model where that was made of surfaces. Of a " \
     "model of several structures parts instead.",                                                \
     .nullable = true,                                                                            \
     .unless = "parts"},                                                                          \
    {                                                                                             \
        "parts", INPUT_OWN, offsetof(struct typed, subject.parts),                                \
            "For a model of several structures, instead of surface: {name: surface}, one for "    \
            "each part of the model. Each is registered to the mean of its part.",                \
            .own = &subject_parts                                                                 \
    }
extern const struct input_own subject_parts;

/* Its parts, for other processes that take some: {name: id} (new reference) of the value at a
   pointer, or NULL with a problem noted; and whether they are those of a model. */
json_t *subject_read_parts(struct process_inputs *inputs, json_t *value, const char *at);
void subject_check_names(struct process_inputs *given, const json_t *names, json_t *parts,
                         const char *at);

/* For complete: whether what is given is what the model is of; problems name what is not. */
void subject_check(struct process_inputs *given);

/* As the core takes it; subject must outlive it. False: a part of the model is missing, with the
   problem set. */
bool subject_open(const struct subject_input *subject, const struct compute_model *model,
                  struct compute_projected *projected, struct jobs_result *result);

/* Output parts. */
#define SUBJECT_PARTS_TEXT                                                                         \
    "name, surface, distance (from the mean of the part), distanceBefore (registration), "         \
    "residual "                                                                                    \
    "(what the components cannot represent; null of a member of a registered model) and "          \
    "mahalanobisShare, its share of the square of mahalanobis, below 0 where it draws the "        \
    "subject "                                                                                     \
    "towards the others. Distances hold the part's weight, so that their squares add up to those " \
    "of the subject"
#define SUBJECT_OUTPUTS                                                                \
    {"parts", "\"type\":[\"array\",\"null\"],\"items\":{" OUTPUT_OBJECT "}",           \
     "Of a model of several structures, what each part has in it: " SUBJECT_PARTS_TEXT \
     ". Null of one structure."},                                                      \
    {                                                                                  \
        "position", OUTPUT_OBJECT_OR_NULL,                                             \
            "The same of the relative positions of the parts: distance, residual and " \
            "mahalanobisShare; null of a model without them."                          \
    }
/* Sets both. */
void subject_set_parts(json_t *document, const struct subject_input *subject,
                       const struct compute_model *model,
                       const struct compute_projection *projection);

#endif
