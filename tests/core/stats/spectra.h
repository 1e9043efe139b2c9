/*
 * spectra.h - principal components of groups that are drawn from a known covariance, and how often
 * their intervals hold it.
 */
#ifndef SRNF_TESTS_SPECTRA_H
#define SRNF_TESTS_SPECTRA_H

#include "group.h"
#include "linear/linear.h"

#define SPECTRA_MEMBERS ((size_t)200)
#define SPECTRA_COUNTED ((size_t)3) /* components */

/* Variances of independent directions. */
struct spectrum {
    const char *name;
    size_t directions;
    double first[3]; /* of the first; 0: scale k^-decline from there on */
    double scale, decline;
    size_t kept; /* components; 0: all */
    bool tails;  /* Student's with 8 degrees of freedom, not normal */
};

struct spectra_missed {
    size_t given[SPECTRA_COUNTED], missed[SPECTRA_COUNTED], shares[SPECTRA_COUNTED];
    size_t total;
};

static inline double spectrum_variance(const struct spectrum *of, size_t k)
{
    return k < 3 && of->first[k] > 0.0 ? of->first[k]
                                       : of->scale * pow((double)(k + 1), -of->decline);
}

static inline double spectrum_draw(const struct spectrum *of, struct test_random *random)
{
    double squares = 0.0;

    for (int k = 0; k < 8 && of->tails; k++) {
        double z = test_random_normal(random);

        squares += z * z;
    }
    return test_random_normal(random) * (of->tails ? sqrt(6.0 / squares) : 1.0);
}

/* pca: of n members, without modes; distances: [n]. */
static inline void spectrum_group(const struct spectrum *of, size_t n, struct test_random *random,
                                  struct srnf_pca *pca, double *distances)
{
    size_t p = of->directions;
    double *x = shapes_doubles(n * p);
    double *gram = shapes_doubles(n * n);
    double *values = shapes_doubles(n);

    for (size_t k = 0; k < p; k++) {
        double root = sqrt(spectrum_variance(of, k));
        double mean = 0.0;

        for (size_t i = 0; i < n; i++) {
            x[i * p + k] = root * spectrum_draw(of, random);
            mean += x[i * p + k] / (double)n;
        }
        for (size_t i = 0; i < n; i++) {
            x[i * p + k] -= mean;
        }
    }
    assert_int_equal(stats_gram(n, p, x, gram, NULL), SRNF_OK);
    *pca = (struct srnf_pca){.n = n};
    for (size_t i = 0; i < n; i++) {
        distances[i] = sqrt(gram[i * n + i]);
        pca->total_variance += gram[i * n + i] / (double)(n - 1);
    }
    assert_int_equal(linear_eigenvalues(n, true, gram, values), SRNF_OK);
    pca->components = of->kept ? of->kept : (p < n - 1 ? p : n - 1);
    pca->eigenvalues = shapes_doubles(n);
    pca->scores = shapes_doubles(n * n);
    for (size_t k = 0; k < pca->components; k++) {
        pca->eigenvalues[k] = values[n - 1 - k] / (double)(n - 1);
        for (size_t i = 0; i < n; i++) {
            pca->scores[i * pca->components + k] =
                sqrt(values[n - 1 - k]) * gram[(n - 1 - k) * n + i];
        }
    }
    srnf_free(values);
    srnf_free(gram);
    srnf_free(x);
}

static inline bool spectra_misses(const double interval[2], double truth)
{
    return !(interval[0] <= truth && truth <= interval[1]);
}

static inline void spectrum_study(const struct spectrum *of, size_t n, struct test_random *random,
                                  struct spectra_missed *missed)
{
    double distances[SPECTRA_MEMBERS], interval[2], share[2], total = 0.0;
    struct srnf_pca pca;

    for (size_t k = 0; k < of->directions; k++) {
        total += spectrum_variance(of, k);
    }
    spectrum_group(of, n, random, &pca, distances);
    srnf_pca_total_interval(&pca, distances, interval);
    assert_true(interval[0] <= pca.total_variance && pca.total_variance <= interval[1]);
    missed->total += spectra_misses(interval, total);
    for (size_t k = 0; k < SPECTRA_COUNTED && k < pca.components; k++) {
        srnf_pca_interval(&pca, k, interval, share);
        if (!isnan(interval[0])) {
            assert_true(interval[0] <= pca.eigenvalues[k] && pca.eigenvalues[k] <= interval[1]);
            assert_true(share[0] >= 0.0 && share[1] <= 1.0);
            assert_true(!spectra_misses(share, pca.eigenvalues[k] / pca.total_variance));
            missed->given[k]++;
            missed->missed[k] += spectra_misses(interval, spectrum_variance(of, k));
            missed->shares[k] += spectra_misses(share, spectrum_variance(of, k) / total);
        }
    }
    srnf_pca_clear(&pca);
}

#endif
