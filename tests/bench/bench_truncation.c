/*
 * bench_truncation.c - what registration in exact mode leaves of a warped and turned ventricle that
 * was cut to degrees 23, 31 and 47, beside the floor of each: the squared distance between the cut
 * surface and the uncut, below which nothing can be matched.
 *
 * Three random warps of each strength (least Jacobian .7, .5, .3), the median of each figure; all
 * at unit area. Says so, with status 1, where more is left than the floor explains: for .7 and .5
 * a tenth more, and the rounding of registration; for .3 the figures are printed alone.
 */
#include "core/surface/truncations.h"
#include "support/timing.h"

#define VENTRICLE "../shared/data/lv_endocardium_ed/lv_asymp_0083.ply"
#define BASE ((size_t)23)
#define SEEDS ((size_t)3)
#define MARGIN 1.1
#define ROUNDING 1e-10

static bool bench_degree(size_t degree, double least, bool *there)
{
    double left[SEEDS];
    double floor[SEEDS];
    double seconds = timing_cpu();
    bool met = true;
    struct shapes_surface s;

    *there = truncations_open(&s, VENTRICLE, BASE, degree);
    if (!*there) {
        return true;
    }
    for (size_t k = 0; k < SEEDS; k++) {
        left[k] = truncations_run(&s, least, 22 + k, &floor[k]);
        met = met && left[k] <= MARGIN * floor[k] + ROUNDING;
    }
    seconds = (timing_cpu() - seconds) / (double)SEEDS;
    met = met || least < 0.5;
    printf("%6zu  %4.1f  %10.1e  %10.1e  %8.2f%s\n", degree, least, timing_median(SEEDS, floor),
           timing_median(SEEDS, left), seconds, met ? "" : "  NOT MET");
    shapes_close(&s);
    return met;
}

int main(void)
{
    const size_t degrees[] = {23, 31, 47};
    const double strengths[] = {0.7, 0.5, 0.3};
    bool met = true;
    bool there = true;

    openblas_set_num_threads(1);
    printf("A ventricle of degree %zu, warped, turned and cut; medians of %zu\n\n", BASE, SEEDS);
    printf("%6s  %4s  %10s  %10s  %8s\n", "degree", "J", "floor", "left", "s each");
    for (size_t d = 0; there && d < 3; d++) {
        for (size_t k = 0; there && k < 3; k++) {
            met = bench_degree(degrees[d], strengths[k], &there) && met;
        }
    }
    return met ? EXIT_SUCCESS : EXIT_FAILURE;
}
