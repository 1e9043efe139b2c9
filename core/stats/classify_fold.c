/*
 * classify_fold.c - a normal distribution for each class on the first principal components, for
 * every number of them, and the likelihoods of members, also of training members left out.
 *
 * Features are the log scale and other numbers, if asked for, and then the scores, so that k
 * components are the first D = k + o features, o the number of the others. With S the scatter
 * matrix and f its degrees of freedom, and L L' = S, the log-likelihood of x under N(m, S / f) with
 * D features is
 *
 *   -1/2 [D log(2 pi / f) + 2 sum of log L_ii + f |z|^2],  z = L^-1 (x - m),
 *
 * and since the leading block of L is the factor of the leading block of S, one factorization and
 * one substitution give it for every D at once, as running sums.
 *
 * Inner leave-one-out: a training subject is taken out with all its members. Where r of them belong
 * to class c, n_c of it before and n_c' after, with the columns of U their x - m_c, the mean of c
 * moves by -U 1 / n_c', and its scatter to S' = S - U K U', K = 1 + 11' / n_c'. By Woodbury's
 * formula and the determinant lemma, with Z = L^-1 U and z = L^-1 (x - m_d') for any class d,
 *
 *   (x - m_d')' S'^-1 (x - m_d') = |z|^2 + (Z'z)' M^-1 (Z'z),   M = 1 - 11' / n_c - Z'Z,
 *   log det S' = log det S + log det M + log(n_c / n_c'),
 *
 * running sums again, with a factorization of M, r by r, for every D. The pooled scatter loses the
 * members of all classes: 11' / n_c stands in the blocks of M where both are of class c. For r = 1
 * it is Sherman and Morrison's formula.
 *
 * Degrees of freedom are f = n_c - sum_s m_s^2 / n_c, m_s the members of subject s: the expectation
 * of the scatter is then f times the covariance between subjects, however often each is repeated,
 * and n_c - 1 where nobody is. A covariance has features no more than subjects less one: what lies
 * beyond is only the variation within them. The pooled one has the sums of both over classes.
 *
 * Cost of a fold: O(n C D^2) for C classes, and O(r^3 D) for each subject of r members. Members of
 * a subject share their fold. Nothing is regularized: where subjects are too few for a covariance
 * it is not a candidate.
 */
#include "classify_fold.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define LOG_2PI 1.83787706640934548356
#define PIVOT_FLOOR 1e-12 /* of the diagonal entry: less is rounding */
#define DOWNDATE_FLOOR 1e-9

int classify_fold_create(struct classify_fold *fold, const struct study *study)
{
    size_t n = study->comparison->n;
    size_t k =
        study->options->components ? study->options->components : study->comparison->components;
    size_t c = study->n_classes;
    size_t r = study->subjects.largest;
    size_t d;

    *fold = (struct classify_fold){.subjects = &study->subjects,
                                   .n = n,
                                   .classes = c,
                                   .offset = (study->options->log_scale != NULL) +
                                             study->options->n_features};
    fold->d = d = k + fold->offset;
    fold->memory =
        srnf_alloc(n * d + 2 * c * d + (c + 1) * d * d + 2 * d + r * CLASSIFY_KINDS * d * c +
                       CLASSIFY_KINDS * d + c + r * d + d * r * r + 2 * r,
                   sizeof(double));
    fold->rank = srnf_alloc(c + 1, sizeof *fold->rank);
    fold->class = srnf_alloc(c, 2 * sizeof *fold->class);
    if (!fold->memory || !fold->rank || !fold->class) {
        return SRNF_ENOMEM;
    }
    fold->inside = fold->class + c;
    fold->x = fold->memory;
    fold->mean = fold->x + n * d;
    fold->moved = fold->mean + c * d;
    fold->factor = fold->moved + c * d;
    fold->z = fold->factor + (c + 1) * d * d;
    fold->removal.log_det = fold->z + d;
    fold->table = fold->removal.log_det + d;
    fold->score = fold->table + r * CLASSIFY_KINDS * d * c;
    fold->own = fold->score + CLASSIFY_KINDS * d;
    fold->removal.z = fold->own + c;
    fold->removal.factor = fold->removal.z + r * d;
    fold->removal.along = fold->removal.factor + d * r * r;
    return SRNF_OK;
}

void classify_fold_clear(struct classify_fold *fold)
{
    srnf_free(fold->memory);
    srnf_free(fold->rank);
    srnf_free(fold->class);
}

/* ---- Fitting --------------------------------------------------------------------------------- */

/* In place; returns how many leading rows have a factor. */
static size_t factorize(size_t d, double *a)
{
    for (size_t i = 0; i < d; i++) {
        double diagonal = a[i * d + i];

        for (size_t j = 0; j <= i; j++) {
            double sum = a[i * d + j];

            for (size_t k = 0; k < j; k++) {
                sum -= a[i * d + k] * a[j * d + k];
            }
            if (j < i) {
                a[i * d + j] = sum / a[j * d + j];
            } else if (sum > PIVOT_FLOOR * diagonal) {
                a[i * d + i] = sqrt(sum);
            } else {
                return i;
            }
        }
    }
    return d;
}

/* Members, subjects and squares of each class among the training members. */
static void count_classes(struct classify_fold *fold)
{
    const struct subjects *s = fold->subjects;

    memset(fold->class, 0, fold->classes * sizeof *fold->class);
    for (size_t k = 0; k < s->count; k++) {
        memset(fold->own, 0, fold->classes * sizeof *fold->own);
        for (size_t m = s->start[k]; m < s->start[k + 1] && k != fold->left_out; m++) {
            size_t c = fold->labels[s->members[m]];
            struct classify_tally *tally = &fold->class[c];

            tally->members += 1.0;
            tally->subjects += fold->own[c] > 0.0 ? 0.0 : 1.0;
            tally->squares += 2.0 * fold->own[c] + 1.0; /* (m + 1)^2 - m^2 */
            fold->own[c] += 1.0;
        }
    }
}

/* The first training member of a class. */
static const double *first_of(const struct classify_fold *fold, size_t c)
{
    size_t i = 0;

    while (i + 1 < fold->n && (fold->labels[i] != c || fold->subjects->of[i] == fold->left_out)) {
        i++;
    }
    return fold->x + i * fold->d;
}

/* Those of numbers beside shape are taken about a member: one that is the same in a whole class has
   no scatter then, where that of rounding would pass for a precise measurement. */
static void find_means(struct classify_fold *fold)
{
    size_t d = fold->d;

    memset(fold->mean, 0, fold->classes * d * sizeof(double));
    for (size_t c = 0; c < fold->classes; c++) {
        const double *about = first_of(fold, c);
        double *mean = fold->mean + c * d;

        for (size_t i = 0; i < fold->n; i++) {
            const double *x = fold->x + i * d;
            bool own = fold->labels[i] == c && fold->subjects->of[i] != fold->left_out;

            for (size_t k = 0; own && k < d; k++) {
                mean[k] += k < fold->offset ? x[k] - about[k] : x[k];
            }
        }
        for (size_t k = 0; k < d; k++) {
            mean[k] = mean[k] / fold->class[c].members + (k < fold->offset ? about[k] : 0.0);
        }
    }
}

static void find_factors(struct classify_fold *fold)
{
    size_t d = fold->d;
    double *pooled = fold->factor + fold->classes * d * d;

    memset(fold->factor, 0, (fold->classes + 1) * d * d * sizeof(double));
    for (size_t i = 0; i < fold->n; i++) {
        size_t c = fold->labels[i];
        const double *x = fold->x + i * d;
        const double *m = fold->mean + c * d;

        for (size_t k = 0; k < d && fold->subjects->of[i] != fold->left_out; k++) {
            for (size_t l = 0; l <= k; l++) {
                fold->factor[(c * d + k) * d + l] += (x[k] - m[k]) * (x[l] - m[l]);
            }
        }
    }
    for (size_t c = 0; c < fold->classes; c++) {
        for (size_t k = 0; k < d * d; k++) {
            pooled[k] += fold->factor[c * d * d + k];
        }
    }
    for (size_t c = 0; c <= fold->classes; c++) {
        fold->rank[c] = factorize(d, fold->factor + c * d * d);
    }
}

void classify_fold_fit(struct classify_fold *fold, const struct study *study, size_t left_out,
                       const size_t *labels)
{
    size_t stride = study->comparison->components;
    size_t first = fold->subjects->members[fold->subjects->start[left_out]];

    classify_fold_fit_scores(fold, study, study->comparison->scores + first * fold->n * stride,
                             left_out, labels);
}

void classify_fold_fit_scores(struct classify_fold *fold, const struct study *study,
                              const double *scores, size_t left_out, const size_t *labels)
{
    size_t components = fold->d - fold->offset;
    size_t stride = study->comparison->components;

    fold->left_out = left_out;
    fold->labels = labels;
    for (size_t i = 0; i < fold->n; i++) {
        double *x = fold->x + i * fold->d;

        if (study->options->log_scale) {
            *x++ = study->options->log_scale[i];
        }
        for (size_t k = 0; k < study->options->n_features; k++) {
            *x++ = study->options->features[i * study->options->n_features + k];
        }
        memcpy(x, scores + i * stride, components * sizeof(double));
    }
    count_classes(fold);
    find_means(fold);
    find_factors(fold);
}

/* ---- A subject out of the training members --------------------------------------------------- */

/* z = factor^-1 (x - mean), as far as the factor goes. */
static void substitute(const struct classify_fold *fold, size_t which, const double *x,
                       const double *mean, double *z)
{
    size_t d = fold->d;
    const double *l = fold->factor + which * d * d;

    for (size_t i = 0; i < fold->rank[which]; i++) {
        double sum = x[i] - mean[i];

        for (size_t k = 0; k < i; k++) {
            sum -= l[i * d + k] * z[k];
        }
        z[i] = sum / l[i * d + i];
    }
}

/* Tallies and means as they are without a subject; one that is no training subject changes
   nothing. */
static void leave_subject_out(struct classify_fold *fold, size_t subject)
{
    const struct subjects *s = fold->subjects;
    size_t d = fold->d;

    memset(fold->own, 0, fold->classes * sizeof *fold->own);
    memcpy(fold->inside, fold->class, fold->classes * sizeof *fold->class);
    memcpy(fold->moved, fold->mean, fold->classes * d * sizeof(double));
    if (subject == fold->left_out) {
        return;
    }
    for (size_t m = s->start[subject]; m < s->start[subject + 1]; m++) {
        fold->own[fold->labels[s->members[m]]] += 1.0;
    }
    for (size_t c = 0; c < fold->classes; c++) {
        fold->inside[c].members -= fold->own[c];
        fold->inside[c].subjects -= fold->own[c] > 0.0 ? 1.0 : 0.0;
        fold->inside[c].squares -= fold->own[c] * fold->own[c];
    }
    for (size_t m = s->start[subject]; m < s->start[subject + 1]; m++) {
        size_t c = fold->labels[s->members[m]];
        const double *x = fold->x + s->members[m] * d;

        for (size_t k = 0; k < d; k++) {
            fold->moved[c * d + k] -= (x[k] - fold->mean[c * d + k]) / fold->inside[c].members;
        }
    }
}

/* Cholesky of an r x r matrix in place; false where it is not positive. */
static bool factorize_small(size_t r, double *a)
{
    for (size_t i = 0; i < r; i++) {
        for (size_t j = 0; j <= i; j++) {
            double sum = a[i * r + j];

            for (size_t k = 0; k < j; k++) {
                sum -= a[i * r + k] * a[j * r + k];
            }
            if (j < i) {
                a[i * r + j] = sum / a[j * r + j];
            } else if (sum > DOWNDATE_FLOOR) {
                a[i * r + i] = sqrt(sum);
            } else {
                return false;
            }
        }
    }
    return true;
}

/* M for 1, 2, .. features, factored. rank: of the scatter; log_det: of K. */
static void factorize_removal(const struct classify_fold *fold, size_t rank, const size_t *members,
                              double log_det, struct classify_removal *removal)
{
    size_t r = removal->r;
    size_t d = fold->d;

    for (removal->rank = 0; removal->rank < rank; removal->rank++) {
        size_t i = removal->rank;
        double *m = removal->factor + i * r * r;

        for (size_t a = 0; a < r; a++) {
            size_t c = fold->labels[members[a]];

            for (size_t b = 0; b <= a; b++) {
                double entry = a == b ? 1.0 : 0.0;

                if (fold->labels[members[b]] == c) {
                    entry -= 1.0 / fold->class[c].members;
                }
                for (size_t k = 0; k <= i; k++) {
                    entry -= removal->z[a * d + k] * removal->z[b * d + k];
                }
                m[a * r + b] = entry;
            }
        }
        if (!factorize_small(r, m)) {
            return;
        }
        removal->log_det[i] = log_det;
        for (size_t a = 0; a < r; a++) {
            removal->log_det[i] += 2.0 * log(m[a * r + a]);
        }
    }
}

/* Takes the members of a subject out of the scatter `which`: those of the class, or, where it is
   the pooled one, all. members: [largest] of scratch. */
static void remove_members(struct classify_fold *fold, size_t subject, size_t which,
                           size_t *members)
{
    const struct subjects *s = fold->subjects;
    struct classify_removal *removal = &fold->removal;
    double log_det = 0.0;

    removal->r = 0;
    for (size_t m = s->start[subject]; m < s->start[subject + 1] && subject != fold->left_out;
         m++) {
        size_t i = s->members[m];
        size_t c = fold->labels[i];

        if (which == c || which == fold->classes) {
            substitute(fold, which, fold->x + i * fold->d, fold->mean + c * fold->d,
                       removal->z + removal->r * fold->d);
            members[removal->r++] = i;
        }
    }
    for (size_t c = 0; c < fold->classes; c++) {
        if (fold->own[c] > 0.0 && (which == c || which == fold->classes)) {
            log_det += log(fold->class[c].members / fold->inside[c].members);
        }
    }
    if (removal->r > 0) {
        factorize_removal(fold, fold->rank[which], members, log_det, removal);
    }
}

/* (Z'z)' M^-1 (Z'z) with the first i + 1 features; Z'z grows by feature i. */
static double removed_part(const struct classify_fold *fold, size_t i, double *along,
                           double *solved)
{
    const struct classify_removal *removal = &fold->removal;
    size_t r = removal->r;
    const double *m = removal->factor + i * r * r;
    double square = 0.0;

    for (size_t a = 0; a < r; a++) {
        double sum;

        along[a] += removal->z[a * fold->d + i] * fold->z[i];
        sum = along[a];
        for (size_t b = 0; b < a; b++) {
            sum -= m[a * r + b] * solved[b];
        }
        solved[a] = sum / m[a * r + a];
        square += solved[a] * solved[a];
    }
    return square;
}

/* ---- Likelihoods of a subject's members for every number of features ------------------------- */

/* Log-likelihoods of z for 1, 2, .. features: column c of out, [d][classes]. bound: features that
   the subjects determine. */
static void likelihoods(struct classify_fold *fold, size_t which, size_t c, double freedom,
                        double bound, double *out)
{
    const struct classify_removal *removal = &fold->removal;
    size_t d = fold->d;
    const double *l = fold->factor + which * d * d;
    double *along = removal->along;
    double square = 0.0;
    double determinant = 0.0;

    memset(along, 0, removal->r * sizeof *along);
    for (size_t i = 0; i < d; i++) {
        double *likelihood = &out[i * fold->classes + c];
        double mahalanobis;
        double log_det;

        *likelihood = -INFINITY;
        if (i >= fold->rank[which] || !(bound > (double)i) ||
            (removal->r > 0 && i >= removal->rank)) {
            continue;
        }
        square += fold->z[i] * fold->z[i];
        determinant += 2.0 * log(l[i * d + i]);
        mahalanobis = square;
        log_det = determinant;
        if (removal->r > 0) {
            mahalanobis += removed_part(fold, i, along, along + removal->r);
            log_det += removal->log_det[i];
        }
        *likelihood =
            -0.5 * ((double)(i + 1) * (LOG_2PI - log(freedom)) + log_det + freedom * mahalanobis);
    }
}

double classify_freedom(const struct classify_tally *tally)
{
    return tally->members - tally->squares / tally->members;
}

/* Log-likelihoods of the members of a subject, which is left out where it is a training subject.
   members: [largest] of scratch. */
void classify_fold_judge(struct classify_fold *fold, size_t subject, size_t *members)
{
    const struct subjects *s = fold->subjects;
    const size_t *first = s->members + s->start[subject];
    size_t d = fold->d;
    size_t size = d * fold->classes;
    double freedom = 0.0;
    double bound = 0.0;

    leave_subject_out(fold, subject);
    for (size_t c = 0; c < fold->classes; c++) {
        freedom += classify_freedom(&fold->inside[c]);
        bound += fold->inside[c].subjects - 1.0;
    }
    remove_members(fold, subject, fold->classes, members);
    for (size_t m = 0; m < s->size[subject]; m++) {
        for (size_t c = 0; c < fold->classes; c++) {
            substitute(fold, fold->classes, fold->x + first[m] * d, fold->moved + c * d, fold->z);
            likelihoods(fold, fold->classes, c, freedom, bound,
                        fold->table + (m * CLASSIFY_KINDS + CLASSIFY_POOLED) * size);
        }
    }
    for (size_t c = 0; c < fold->classes; c++) {
        remove_members(fold, subject, c, members);
        for (size_t m = 0; m < s->size[subject]; m++) {
            substitute(fold, c, fold->x + first[m] * d, fold->moved + c * d, fold->z);
            likelihoods(fold, c, c, classify_freedom(&fold->inside[c]),
                        fold->inside[c].subjects - 1.0,
                        fold->table + (m * CLASSIFY_KINDS + CLASSIFY_OWN) * size);
        }
    }
}
