/*
 * bench_transfer.c - the contraction of one left ventricle carried to another (the paper, Fig. 8),
 * against that subject's true end systole, over all ordered pairs of ten subjects: the transfer of
 * SRNFs beside adding the displacement of the vertices.
 *
 * For each way the mean and the worst error, about the centroids: rms between corresponding points,
 * rms from surface to surface, and between the SRNFs relative to that of the truth; in how many
 * pairs it comes closer to the truth than the displacement of vertices in mm does, by each of the
 * three; and what it costs.
 *
 * Subjects contract differently: that is most of every error, and the transfer does not come closer
 * between surfaces than the displacement of vertices on average, though it does between SRNFs. The
 * exit status guards against its becoming worse: 1 if the distance between surfaces is more than
 * RATIO_MAX of that of the displacement; 0 otherwise, and where the data are absent.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include <fftw3.h>

#include "core/figures.h"
#include "support/compare.h"
#include "support/timing.h"
#include "support/transfers.h"

#define DATA "../shared/data"
#define DEGREE ((size_t)15)
#define RATIO_MAX 1.15

struct row {
    double points, surface, srnf, worst, seconds, transforms;
    size_t closer_points, closer_surface, closer_srnf;
};

static void add(struct row *row, const struct transfers_error *error,
                const struct transfers_error *baseline)
{
    row->points += error->points;
    row->surface += error->surface;
    row->srnf += error->srnf;
    row->worst = compare_max(row->worst, error->surface);
    row->closer_points += error->points < baseline->points;
    row->closer_surface += error->surface < baseline->surface;
    row->closer_srnf += error->srnf < baseline->srnf;
}

/* One ordered pair by every way. */
static void run_pair(const struct transfers *t, size_t from, size_t to, double *guess,
                     struct row rows[TRANSFERS_WAYS])
{
    struct transfers_error errors[TRANSFERS_WAYS];

    for (int way = 0; way < TRANSFERS_WAYS; way++) {
        double start = timing_cpu();

        rows[way].transforms += transfers_guess(t, from, to, (enum transfers_way)way, guess);
        rows[way].seconds += timing_cpu() - start;
        errors[way] = transfers_measure(t, to, (enum transfers_way)way, guess);
    }
    for (int way = 0; way < TRANSFERS_WAYS; way++) {
        add(&rows[way], &errors[way], &errors[TRANSFERS_DISPLACEMENT]);
    }
}

static void print_rows(const struct row rows[TRANSFERS_WAYS], double pairs)
{
    printf("%-26s %9s %10s %8s %8s  %-18s %7s %6s\n", "way", "points mm", "surface mm", "worst mm",
           "SRNF", "closer (p, s, SRNF)", "ms", "U");
    for (int way = 0; way < TRANSFERS_WAYS; way++) {
        const struct row *r = &rows[way];

        printf("%-26s %9.3f %10.3f %8.3f %8.4f  %5zu %6zu %6zu %7.2f %6.0f\n", transfers_names[way],
               r->points / pairs, r->surface / pairs, r->worst, r->srnf / pairs, r->closer_points,
               r->closer_surface, r->closer_srnf, 1e3 * r->seconds / pairs, r->transforms / pairs);
    }
}

int main(void)
{
    struct row rows[TRANSFERS_WAYS] = {{.points = 0.0}};
    const struct row *transfer = &rows[TRANSFERS_SRNF_RATIO];
    const struct row *displacement = &rows[TRANSFERS_DISPLACEMENT];
    struct transfers t;
    double *guess;
    double pairs;

    openblas_set_num_threads(1);
    fftw_make_planner_thread_safe();
    if (!transfers_open(&t, DATA, DEGREE)) {
        printf("skipped: no %s/lv_pairs\n", DATA);
        return EXIT_SUCCESS;
    }
    guess = shapes_doubles(t.count);
    pairs = (double)(t.n * (t.n - 1));
    for (size_t from = 0; from < t.n; from++) {
        for (size_t to = 0; to < t.n; to++) {
            if (from != to) {
                run_pair(&t, from, to, guess, rows);
            }
        }
    }
    printf("End diastole to end systole carried between %zu left ventricles, degree %zu, %.0f "
           "pairs: distance from the truth\n\n",
           t.n, t.degree, pairs);
    print_rows(rows, pairs);
    printf("\ntransfer of SRNFs, size apart, against the displacement of vertices: %.3f of its "
           "distance between surfaces, %.3f between SRNFs\n",
           transfer->surface / displacement->surface, transfer->srnf / displacement->srnf);
    srnf_free(guess);
    transfers_close(&t);
    return transfer->surface <= RATIO_MAX * displacement->surface ? EXIT_SUCCESS : EXIT_FAILURE;
}
