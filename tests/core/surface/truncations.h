/*
 * truncations.h - a surface that was warped, turned and then cut to a degree, as an encoder would
 * deliver it, registered to the surface that it came from.
 *
 * The cut surface is another one than the warped: what is between their SRNFs, the floor, no
 * registration can take away. The surface itself has a lower degree (base) in all, so that only the
 * room for its warped image grows with the degree.
 */
#ifndef TESTS_SHAPE_TRUNCATIONS_H
#define TESTS_SHAPE_TRUNCATIONS_H

#include "core/registration/registrations.h"

/* ||q of the cut surface - q||^2, q that of the warped surface itself. */
static inline double truncations_floor(const struct shapes_surface *s, const struct srnf_warp *warp,
                                       const double rotation[9], const double *q)
{
    double *f = shapes_doubles(s->count);
    double *cut = shapes_doubles(3 * s->points);
    double norm2;

    registrations_resample(s, warp, rotation, f);
    srnf_field(s->sht, f, cut, s->workspace);
    for (size_t i = 0; i < 3 * s->points; i++) {
        cut[i] -= q[i];
    }
    norm2 = srnf_inner_product(s->grid, cut, cut);
    srnf_free(f);
    srnf_free(cut);
    return norm2;
}

/* What registrations_open opens, at degree base with room for the degree; false when it is not
   there. */
static inline bool truncations_open(struct shapes_surface *s, const char *what, size_t base,
                                    size_t degree)
{
    struct shapes_surface own;

    if (!registrations_open(&own, base, what)) {
        return false;
    }
    shapes_open(s, degree);
    for (size_t c = 0; c < 3; c++) {
        memcpy(s->f + c * s->each, own.f + c * own.each, own.each * sizeof(double));
    }
    shapes_update(s);
    shapes_close(&own);
    return true;
}

/* Registers the surface in exact mode to its image under a random warp of least Jacobian `least`
   in random pose, cut to its degree. Returns the squared distance that is left; floor gets that of
   the cut image from the uncut. */
static inline double truncations_run(struct shapes_surface *s, double least, uint64_t seed,
                                     double *floor)
{
    struct test_random random = test_random_seed(seed);
    struct srnf_register_options options = srnf_register_options_defaults();
    struct shapes_surface image;
    struct srnf_registration r;
    struct srnf_warp warp;
    double rotation[9];
    double left;
    double *q = shapes_doubles(3 * s->points);

    registrations_warp(&random, least, &warp);
    shapes_random_rotation(&random, rotation);
    registrations_act(s, &warp, rotation, q);
    *floor = truncations_floor(s, &warp, rotation, q);
    shapes_open(&image, s->degree);
    registrations_resample(s, &warp, rotation, image.f);
    options.exact = true;
    options.start = SRNF_START_RIGID;
    registrations_run(&image, NULL, s->f, &options, &r);
    left = r.distance * r.distance;
    srnf_registration_clear(&r);
    srnf_warp_clear(&warp);
    srnf_free(q);
    shapes_close(&image);
    return left;
}

#endif
