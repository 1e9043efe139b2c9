/*
 * group.h - what processes on several surfaces share: the inputs "surfaces" and "cohort", and what
 * is made and told of the members.
 */
#ifndef SRNFD_TOOLKIT_GROUP_H
#define SRNFD_TOOLKIT_GROUP_H

#include "api/cohorts.h"
#include "compute/group.h"
#include "toolkit/names.h"
#include "toolkit/process.h"
#include "toolkit/table.h"

struct store_model; /* store/model.h */

_Static_assert(PROCESS_LARGE_GROUP_MAX <= COMPUTE_GROUP_MAX, "a group can be computed");

/* ---- Inputs (group_inputs.c) ----------------------------------------------------------------- */

/* A group as it is typed; zero where another input stands in its place. */
struct group_input {
    size_t n;
    const char **ids; /* [n] surfaces or meshes */
    size_t *subjects; /* [n] whose each is: group_subject_numbers */
    size_t n_subjects, largest;
    struct compute_mirrored mirrored; /* members that are taken mirrored */
    bool mixed_routes;
    size_t mesh_degree; /* at which meshes are encoded; 0: the default */
    /* Canonical, for what results tell: [n] ids; {name, labels, subjects, mirrored} of the members
       and what the process adds, or NULL without a cohort. */
    json_t *surfaces, *cohort;
};

#define GROUP_MIXED_ROUTES_TEXT                                                                   \
    "Compare surfaces that came to their sphere by different routes (star, area, given); "        \
    "otherwise they are refused with mixed-routes. Registered, those that encode made by star "   \
    "beside others by area are encoded again by area (bridgedSurfaces); of what differs all the " \
    "same the result has the warning mixed-routes."

/* Rows of a table whose typed inputs have a struct group_input called group, of up to `most`
   members: listed is a GROUP_SURFACES_OWN of as many. Surfaces or a cohort must be given, and not
   both: */
#define GROUP_INPUTS_OF(typed, listed, most)                                          \
    {"surfaces",                                                                      \
     INPUT_OWN,                                                                       \
     offsetof(struct typed, group),                                                   \
     "The surfaces, or cohort instead. Meshes are encoded with the default options.", \
     .own = &(listed),                                                                \
     .highest = (most)},                                                              \
        {"cohort",                                                                    \
         INPUT_OWN,                                                                   \
         offsetof(struct typed, group),                                               \
         "Name of a cohort, instead of surfaces.",                                    \
         .own = &group_cohort,                                                        \
         .highest = (most)},                                                          \
    {                                                                                 \
        "mixedRoutes", INPUT_BOOLEAN, offsetof(struct typed, group.mixed_routes),     \
            GROUP_MIXED_ROUTES_TEXT, .fallback = 0                                    \
    }
#define GROUP_INPUTS(typed) GROUP_INPUTS_OF(typed, group_surfaces, PROCESS_LARGE_GROUP_MAX)
/* The same of a process that needs what a cohort says of its members. The canonical surfaces then
   stand in the cohort. */
#define GROUP_MEMBERS_INPUTS(typed, text)                                         \
    {"cohort", INPUT_OWN,        offsetof(struct typed, group),                   \
     text,     .required = true, .own = &group_members},                          \
    {                                                                             \
        "mixedRoutes", INPUT_BOOLEAN, offsetof(struct typed, group.mixed_routes), \
            GROUP_MIXED_ROUTES_TEXT, .fallback = 0                                \
    }

/*
 * The readers refuse surfaces that are known to have come by different routes, unless mixedRoutes
 * allows them (routes.h). The largest degree of the members is then that of the inputs.
 */
extern const struct input_own group_surfaces, group_cohort, group_members;
/* Their parts, for inputs that differ a little. */
void group_read_surfaces(struct process_inputs *inputs, const struct process_input *input);
void group_read_members(struct process_inputs *inputs, const struct process_input *input);
/* The same of a process that compares some members with each other and not others, and asks
   inputs_routes of each such part itself. */
void group_read_members_apart(struct process_inputs *inputs, const struct process_input *input);
bool group_type_surfaces(const json_t *value, void *member);
bool group_type_cohort(const json_t *value, void *member);
bool group_type_members(const json_t *value, void *member);
void group_input_clear(void *member); /* struct group_input */
/* type: "\"array\"", or a list of types. */
#define GROUP_SURFACES_OWN(types, least, most)                                                    \
    {                                                                                             \
        .schema =                                                                                 \
            "\"type\":" types ",\"minItems\":" PROCESS_TEXT(least) ",\"maxItems\":" PROCESS_TEXT( \
                most) ",\"items\":{"                                                              \
                      "\"type\":\"string\",\"pattern\":\"" PROCESS_SURFACE_PATTERN "\"}",         \
        .refers = true, .read = group_read_surfaces, .type = group_type_surfaces,                 \
        .clear = group_input_clear,                                                               \
    }
#define GROUP_MEMBERS_SCHEMA "\"type\":\"string\",\"pattern\":\"" COHORT_NAME_PATTERN "\""

/* The stored cohort of that name; false with a problem noted or answered, or where only the form is
   judged. */
bool group_find_cohort(struct process_inputs *inputs, const json_t *value,
                       struct store_cohort *cohort);
/* The members of the canonical cohort with all that the store says of them, as they were when its
   surfaces were read: a change since then is not seen (new reference; NULL without a cohort). */
json_t *group_stored_members(const struct process_inputs *inputs);
/* Such a member in words: its place, its id, the name of that and its subject. */
#define GROUP_MEMBER_TEXT 256
void group_member_text(struct process_inputs *inputs, const json_t *members, size_t i,
                       char text[GROUP_MEMBER_TEXT]);
/* Notes a problem where n fields of that degree, `copies` of them for each surface, and `more`
   bytes are beyond the memory of a job. */
void inputs_check_memory(struct process_inputs *inputs, size_t n, long degree, size_t copies,
                         double more);

/* Reads "model": canonical, and the stored model without its arrays (store_model_clear). kind: that
   it must be of (api/models.h); NULL: components. False with a problem noted or answered. */
bool inputs_model(struct process_inputs *inputs, const char *kind, struct store_model *model);

/* ---- Members and results (group.c) ----------------------------------------------------------- */

/* Members that results on groups have. */
#define GROUP_LABELS_OUTPUTS                                                                  \
    {"labels", "\"type\":\"array\",\"items\":{" OUTPUT_STRING "}",                            \
     "A name for each surface, in order, no two the same: the subject, or else the name, or " \
     "else the id, with more in brackets where that is not enough."},                         \
    {                                                                                         \
        "groups", "\"type\":[\"array\",\"null\"],\"items\":{\"type\":[\"string\",\"null\"]}", \
            "The label of each member of the cohort; null without a cohort."                  \
    }

/* A name for each of the surfaces where labels are classes: the subject of the member, or else the
   name that the mesh or surface has, or else its id. subjects: an array of texts and nulls, or
   NULL. */
json_t *group_subjects(struct jobs_run *run, const json_t *surfaces, const json_t *subjects);
/* Such names with no two alike. Where several would be the same, the name follows the subject in
   brackets, the id the name, and then the number of the member. */
json_t *group_labels(struct jobs_run *run, const json_t *surfaces, const json_t *subjects);
/* Loads the members, as compute_group_load does, those bridged that mixedRoutes asks for where the
   group is registered. */
int group_load(struct jobs_run *run, const struct group_input *members, bool registered,
               size_t degree, struct compute_group *group, struct jobs_result *result);

/* The label, or null, of each member of the canonical cohort; null where there is none. */
json_t *group_groups(const json_t *cohort);

/*
 * Whose each member is: [n] numbers below n, the same where the subjects are the same text; a
 * member without a subject is one of its own. subjects: an array of texts and nulls, or NULL. count
 * gets the number of subjects, largest the members of the largest. srnf_free; NULL without memory.
 */
size_t *group_subject_numbers(const json_t *subjects, size_t n, size_t *count, size_t *largest);
/* Refuses with labels-within-subject where members of a subject have different labels; advice says
   why that matters and what to do instead. labels: of all members. True: there are none. */
bool group_check_labels(struct process_inputs *inputs, const json_t *subjects, const json_t *labels,
                        const char *advice);
/*
 * Warns, in the result document, of members with the same content (duplicate-content): the same
 * surface, or surfaces and meshes that come from one mesh. Mirror images are not the same.
 *   surfaces  [in] [n] ids
 *   cohort    [in] what holds "subjects" and "mirrored", for all members; or NULL
 *   contents  [in] [n] of compute_group, by which meshes of the same surface are known; or NULL
 */
void group_warn_duplicates(struct jobs_run *run, json_t *document, const json_t *surfaces,
                           const json_t *cohort, const char (*contents)[STORE_ID_MAX]);

#endif
