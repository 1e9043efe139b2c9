/*
 * test_invert_threads.c - inversions in threads of a caller who holds no lock: no plan of FFTW's is
 * made, and each thread gets the bits that one alone gets.
 */
#include "inversions.h"

#include <dlfcn.h>
#include <fftw3.h>
#include <pthread.h>

/* Every transform with plans of its own makes one of these. */
static _Atomic int plans;

fftw_plan fftw_plan_dft_r2c_1d(int n, double *in, fftw_complex *out, unsigned flags)
{
    fftw_plan (*next)(int, double *, fftw_complex *, unsigned);
    void *symbol = dlsym(RTLD_NEXT, "fftw_plan_dft_r2c_1d");

    memcpy(&next, &symbol, sizeof next);
    plans++;
    return next(n, in, out, flags);
}

static struct shapes_surface star;

static int invert_star(struct srnf_inversion *result)
{
    struct srnf_invert_options options = srnf_invert_options_defaults();

    options.method = SRNF_INVERT_GAUSS_NEWTON;
    options.initial = SRNF_INITIAL_SPHERE;
    options.certify = false;
    return srnf_invert(star.sht, star.q, &options, NULL, result, NULL);
}

struct job {
    struct srnf_inversion result;
    int status;
};

static void *invert_in_thread(void *argument)
{
    struct job *job = argument;

    job->status = invert_star(&job->result);
    return NULL;
}

/* Callers hold no lock: nothing is planned, and four threads get the same bits. */
static void threads_need_no_lock(void **state)
{
    struct srnf_inversion alone;
    struct job jobs[4];
    pthread_t threads[4];
    int before;
    (void)state;

    shapes_open(&star, 14);
    shapes_fill(&star, shapes_bumpy, 0.0);
    before = plans;
    assert_true(before > 0);
    assert_int_equal(invert_star(&alone), SRNF_OK);
    assert_true(alone.transforms <= 150.0 && alone.relative_energy <= 1e-12);
    for (size_t k = 0; k < 4; k++) {
        assert_int_equal(pthread_create(&threads[k], NULL, invert_in_thread, &jobs[k]), 0);
    }
    for (size_t k = 0; k < 4; k++) {
        assert_int_equal(pthread_join(threads[k], NULL), 0);
        assert_int_equal(jobs[k].status, SRNF_OK);
        assert_memory_equal(jobs[k].result.coefficients, alone.coefficients,
                            star.count * sizeof(double));
        assert_true(jobs[k].result.transforms == alone.transforms);
        srnf_inversion_clear(&jobs[k].result);
    }
    assert_int_equal(plans, before);
    srnf_inversion_clear(&alone);
    shapes_close(&star);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(threads_need_no_lock),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
