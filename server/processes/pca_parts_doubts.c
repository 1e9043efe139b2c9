/*
 * pca_parts_doubts.c - warnings of pca-parts: what a mean of one group is told of, of each part by
 * its name.
 *
 * The detail begins with the name; figures have it as part, and in what the word modes where the
 * surfaces of the modes are meant.
 */
#include "processes/pca_parts.h"

#include "api/warnings.h"
#include "toolkit/answers.h"
#include "toolkit/handedness.h"
#include "toolkit/typicality.h"

void pca_parts_tell(json_t *warnings, json_t *document, const char *part, const char *what)
{
    json_t *entry;
    size_t i;

    json_array_foreach(json_object_get(document, "warnings"), i, entry)
    {
        const char *detail = json_string_value(json_object_get(entry, "detail"));
        json_t *figures = json_object_get(entry, "figures");

        if (!figures) {
            figures = json_object();
            (void)json_object_set_new(entry, "figures", figures);
        }
        (void)json_object_set_new(figures, "part", json_string(part));
        if (what) {
            (void)json_object_set_new(figures, "what", json_string(what));
        }
        (void)json_object_set_new(
            entry, "detail",
            json_sprintf("Part %s%s%s: %s", part, what ? ", " : "", what ? what : "", detail));
    }
    warnings_merge(warnings, json_object_get(document, "warnings"));
    json_decref(document);
}

static json_t *slice(const json_t *all, size_t from, size_t n)
{
    json_t *list = json_array();

    for (size_t i = from; i < from + n && json_is_array(all); i++) {
        (void)json_array_append(list, json_array_get(all, i));
    }
    return list;
}

/* The cohort of the members of a part (new reference). */
static json_t *cohort_of(const json_t *cohort, size_t from, size_t n)
{
    static const char *const arrays[] = {"labels", "subjects", "mirrored"};
    json_t *own = json_object();

    for (size_t k = 0; k < sizeof arrays / sizeof arrays[0]; k++) {
        const json_t *all = json_object_get(cohort, arrays[k]);

        if (json_is_array(all)) {
            (void)json_object_set_new(own, arrays[k], slice(all, from, n));
        }
    }
    return own;
}

/* Of the members and the mean of a part; false with the problem set. */
static bool warn_mean(struct jobs_run *run, const struct group_mean *mean, const char *part,
                      json_t *warnings, struct jobs_result *result)
{
    const struct group_input *members = mean->members;
    json_t *document = json_object();

    typicality_warn_poses(run, members, &mean->outputs, mean->positions, warnings_of(document));
    warnings_put(document, handedness_of_names(run, members->surfaces, members->cohort));
    mean_warn_converged(mean, document);
    document = mean_warn(run, mean, (struct group_doubts){.classes = NULL}, document, result);
    if (document) {
        json_t *energy = json_real(mean->outputs.mean.relative_energy);

        answers_warn_energies(energy, document);
        json_decref(energy);
        pca_parts_tell(warnings, document, part, NULL);
    }
    return document != NULL;
}

static void warn_modes(const struct compute_parts_outputs *found, size_t p, const char *part,
                       json_t *warnings)
{
    json_t *document = json_object(), *energies = json_array();

    for (size_t i = p; i < 2 * found->modes * found->n_parts; i += found->n_parts) {
        (void)json_array_append_new(energies, json_finite(found->relative_energy[i]));
    }
    answers_warn_energies(energies, document);
    json_decref(energies);
    pca_parts_tell(warnings, document, part, "modes");
}

struct group_input pca_parts_members(const struct pca_parts *asked, size_t part)
{
    const struct group_input *group = &asked->group;
    size_t from = part * asked->n;

    return (struct group_input){
        .n = asked->n,
        .ids = group->ids + from,
        .subjects = group->subjects + from,
        .n_subjects = asked->n,
        .largest = 1,
        .surfaces = slice(group->surfaces, from, asked->n),
        .cohort = cohort_of(group->cohort, from, asked->n),
    };
}

bool pca_parts_warn(struct jobs_run *run, const struct pca_parts *asked,
                    const struct compute_parts_inputs *inputs,
                    const struct compute_parts_outputs *found, json_t *document,
                    struct jobs_result *result)
{
    const struct group_input *group = &asked->group;
    json_t *warnings = warnings_of(document);
    bool good = true;

    for (size_t p = 0; p < found->n_parts && good; p++) {
        const char *name =
            json_string_value(json_array_get(json_object_get(group->cohort, "parts"), p));
        struct group_input members = pca_parts_members(asked, p);
        const struct group_mean mean = {
            .members = &members,
            .positions = asked->relative_pose,
            .inputs = {.registration = inputs->registration,
                       .max_iterations = inputs->max_iterations},
            .outputs = found->means[p],
        };

        good = warn_mean(run, &mean, name, warnings, result);
        if (good) {
            warn_modes(found, p, name, warnings);
        }
        json_decref(members.surfaces);
        json_decref(members.cohort);
    }
    return good;
}
