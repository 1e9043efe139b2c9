/*
 * mcnemar.c - whether two methods are right equally often (srnf/train.h).
 */
#include "subjects.h"

#include "srnf/train.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* P(|sum of e_s d_s| >= |sum of d_s|), from the distribution of the sum, subject by subject. */
static int flip_signs(const struct subjects *s, const long *differences, double *p_value)
{
    long total = 0;
    long reach = 0;
    double *now, *next;

    for (size_t k = 0; k < s->count; k++) {
        total += differences[k];
        reach += labs(differences[k]);
    }
    now = srnf_alloc(2 * (2 * (size_t)reach + 1), sizeof(double));
    if (!now) {
        return SRNF_ENOMEM;
    }
    next = now + 2 * reach + 1;
    now[reach] = 1.0;
    for (size_t k = 0; k < s->count; k++) {
        long d = labs(differences[k]);

        for (long v = -reach; d > 0 && v <= reach; v++) {
            next[reach + v] = 0.5 * ((v - d >= -reach ? now[reach + v - d] : 0.0) +
                                     (v + d <= reach ? now[reach + v + d] : 0.0));
        }
        if (d > 0) {
            memcpy(now, next, (size_t)(2 * reach + 1) * sizeof(double));
        }
    }
    *p_value = 0.0;
    for (long v = -reach; v <= reach; v++) {
        *p_value += labs(v) >= labs(total) ? now[reach + v] : 0.0;
    }
    *p_value = fmin(*p_value, 1.0);
    srnf_free(now);
    return SRNF_OK;
}

int srnf_mcnemar(size_t n, const size_t *subjects, const bool *first, const bool *second,
                 size_t only[2], double *p_value)
{
    struct subjects s = {0};
    int status = n > 0 ? subjects_open(&s, n, subjects, NULL) : SRNF_EINVAL;
    long *differences = status == SRNF_OK ? srnf_alloc(s.count, sizeof *differences) : NULL;

    status = status == SRNF_OK && !differences ? SRNF_ENOMEM : status;
    if (status == SRNF_OK) {
        only[0] = only[1] = 0;
        for (size_t i = 0; i < n; i++) {
            only[0] += first[i] && !second[i];
            only[1] += second[i] && !first[i];
            differences[s.of[i]] += (long)first[i] - (long)second[i];
        }
        status = flip_signs(&s, differences, p_value);
    }
    srnf_free(differences);
    subjects_clear(&s);
    return status;
}
