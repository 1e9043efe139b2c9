/*
 * model_members.c - see model_members.h.
 */
#include "toolkit/model_members.h"

#include "toolkit/group.h"
#include "toolkit/typicality.h"

void model_members_clear(struct model_members *members)
{
    srnf_free(members->subjects);
    srnf_free(members->weights);
    srnf_free(members->contents);
    srnf_free(members->numbers);
}

/* How much each member counts. A record that names no subjects is of members that are their own. */
static int read_weights(const json_t *made, size_t n, struct model_members *members)
{
    size_t largest;
    size_t *numbers =
        group_subject_numbers(json_object_get(made, "subjects"), n, &members->view.count, &largest);

    members->weights = numbers ? typicality_weights(n, numbers) : NULL;
    members->view.weights = members->weights;
    members->subjects = numbers;
    return members->weights ? 0 : SRNF_ENOMEM;
}

int model_members_read(const json_t *made, size_t n, size_t n_parts, struct model_members *members)
{
    const json_t *shapes = json_object_get(made, "shapes"); /* older models have none */
    const json_t *contents = shapes ? shapes : json_object_get(made, "contents");
    const json_t *residuals = json_object_get(made, "residuals");
    const json_t *distances = json_object_get(made, "distances");

    *members = (struct model_members){0};
    if (read_weights(made, n, members)) {
        return SRNF_ENOMEM;
    }
    if (json_array_size(contents) != n * n_parts || json_array_size(residuals) != n ||
        json_array_size(distances) != n) {
        return 0;
    }
    members->contents = srnf_alloc(n * n_parts, sizeof *members->contents);
    members->numbers = srnf_alloc(2 * n, sizeof(double));
    if (!members->contents || !members->numbers) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < n * n_parts; i++) {
        const char *content = json_string_value(json_array_get(contents, i));

        members->contents[i] = content ? content : "";
    }
    for (size_t i = 0; i < n; i++) {
        members->numbers[i] = json_number_value(json_array_get(residuals, i));
        members->numbers[n + i] = json_number_value(json_array_get(distances, i));
    }
    members->view.n = n;
    members->view.contents = members->contents;
    members->view.residuals = members->numbers;
    members->view.distances = members->numbers + n;
    return 0;
}
