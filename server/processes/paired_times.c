/*
 * paired_times.c - whether two times of a cohort can be compared at all.
 */
#include "processes/paired.h"

static const json_t *time_of(const json_t *members, size_t i)
{
    return json_object_get(json_array_get(members, i), "time");
}

/* Whether a subject beside that of members i and k has members of their two times. */
static bool another_has(const json_t *members, const size_t *of, size_t i, size_t k)
{
    size_t n = json_array_size(members);

    for (size_t a = 0; a < n; a++) {
        bool first = of[a] != of[i] && json_equal(time_of(members, a), time_of(members, i));

        for (size_t b = 0; first && b < n; b++) {
            if (of[b] == of[a] && json_equal(time_of(members, b), time_of(members, k))) {
                return true;
            }
        }
    }
    return false;
}

bool paired_share_times(const json_t *members, const size_t *of)
{
    for (size_t i = 0; i < json_array_size(members); i++) {
        for (size_t k = 0; k < i; k++) {
            if (of[k] == of[i] && another_has(members, of, i, k)) {
                return true;
            }
        }
    }
    return false;
}
