/*
 * handedness.h - warnings of mirror images: what members' labels, subjects and names tell of sides,
 * and what trials with mirrored surfaces came to.
 */
#ifndef SRNFD_TOOLKIT_HANDEDNESS_H
#define SRNFD_TOOLKIT_HANDEDNESS_H

#include "toolkit/sides.h"
#include "toolkit/table.h"
#include "compute/mirror.h"

/* The input handedness in the table of a process, with a member handedness (int) of its typed
   inputs. trial: what is tried, for the text ("the mirror image of .., and to warn where it"). */
#define HANDEDNESS_INPUT(typed, trial)                                                  \
    {                                                                                   \
        "handedness", INPUT_CHOICE, offsetof(struct typed, handedness),                 \
            "Whether to try " trial " matches clearly better (warning mirror-images); " \
            "ignore saves that time.",                                                  \
            .choices = handedness_choices                                               \
    }
enum handedness { HANDEDNESS_CHECK, HANDEDNESS_IGNORE };
extern const char *const handedness_choices[];

/* Where a member may tell of its side. */
#define SIDES_TEXTS 3

struct group_sides {
    size_t n;
    struct side_reading (*readings)[SIDES_TEXTS]; /* [n] of label, subject and name; of what is
                                                     mirrored, the other side */
};

/*
 * Reads the sides of the members of canonical inputs: surfaces, an array of ids, and the cohort
 * with their labels, subjects and mirrored members, or null. A mirrored member, and a surface whose
 * record says that it is mirrored, is of the other side. False without memory; sides are then empty
 * and cleared.
 */
bool group_sides_read(struct jobs_run *run, const json_t *surfaces, const json_t *cohort,
                      struct group_sides *sides);
void group_sides_clear(struct group_sides *sides);
/* Whether a label, a subject or a name makes members i and j the left and the right one of the
   same. sides: struct group_sides. */
bool group_sides_opposite(const void *sides, size_t i, size_t j);

/* The warnings of a group whose opposite pairs were tried: of those that match clearly better with
   one mirrored. labels: an array of texts. New reference. */
json_t *handedness_of_trials(const json_t *labels, const struct compute_handedness *handedness);
/* The warnings of a group that has left and right ones, by what they are called alone. */
json_t *handedness_of_names(struct jobs_run *run, const json_t *surfaces, const json_t *cohort);
/* The warnings of new surfaces that are the other side of what a model was made from (made, its
   madeFrom), by what they are called. New reference. */
json_t *handedness_of_new(struct jobs_run *run, const json_t *surfaces, const json_t *cohort,
                          const json_t *made);
/* The warnings of a new surface beside a model: by what it is called, or else by a trial with its
   mirror image, to which a member of the model may be clearly nearer. surface "": one of several
   structures, of which the trial tells alone. New reference. */
json_t *handedness_of_projection(struct jobs_run *run, const char *surface, const json_t *made,
                                 const struct compute_mirror_trial *trial);
/* The warnings of new surfaces whose mirror images are nearer to a training member.
     nearest, mirrored  [in] [n] distances from the nearest one; a mirrored one that was not tried
                        is as the other */
json_t *handedness_of_predictions(struct jobs_run *run, const json_t *surfaces,
                                  const json_t *cohort, const double *nearest,
                                  const double *mirrored);
/* Whether the names of two surfaces or meshes make them the left and the right one of the same. */
bool handedness_opposite(struct jobs_run *run, const char *first, const char *second);
/* The warnings of such a pair, or of any; trial may have been left out (distance 0). */
json_t *handedness_of_pair(struct jobs_run *run, const char *first, const char *second,
                           bool opposite, const struct compute_mirror_trial *trial);

#endif
