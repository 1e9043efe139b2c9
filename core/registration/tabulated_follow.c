/*
 * tabulated_follow.c - exp(w) and its inverse at many points, to rounding, from a table.
 *
 * A step of a chain is followed where its map is told: by splines of twelve nodes and so many rows
 * that their errors are those of rounding. The derivative along phi is a difference of nodes
 * divided by sin theta, so that points next to a pole are moved directly (step.c), and so are those
 * that Newton's method does not bring back at once.
 */
#include "tabulated.h"
#include "tabulated_lanes.h"

#include <string.h>

#define ORDER ((size_t)12)
#define FINENESS 5.0 /* rows a degree */
/* From so many points on a table costs less than they do themselves: forwards by fields of some
   degree, and backwards, where each is visited several times. */
#define POINTS ((size_t)2000)
#define POINTS_BACK ((size_t)500)
#define DEGREE ((size_t)8)
#define POLAR 1e-2           /* sin theta: nearer to a pole points are moved directly */
#define NEWTON_STEPS 12      /* of a point that comes back at once */
#define TOLERANCE 1e-12      /* as in step.c */
#define ASKED ((size_t)1024) /* points between two looks at cancellation */

static const struct field_table fine_table = {ORDER, FINENESS};

bool fine_steps_pay(size_t degree, bool inverse, size_t n)
{
    return inverse ? n >= POINTS_BACK : n >= POINTS && degree >= DEGREE;
}

int fine_steps_create(struct fine_steps *steps, size_t degree, const struct srnf_context *context)
{
    int status;

    *steps = (struct fine_steps){.fields = {.degree = 0}};
    status = fields_create(&steps->direct, degree, context);
    if (status == SRNF_OK) {
        status = tabulated_fields_create(&steps->fields, degree, ORDER,
                                         field_table_rows(&fine_table, degree));
    }
    if (status) {
        fine_steps_clear(steps);
    }
    return status;
}

void fine_steps_clear(struct fine_steps *steps)
{
    fields_clear(&steps->direct);
    tabulated_fields_clear(&steps->fields);
}

/* Four points of [n][3] from the first one, the last one repeated. */
SIMD_INLINE void load_four(const double *points, size_t n, size_t first, simd p[3])
{
    for (size_t k = 0; k < SRNF_LANES; k++) {
        const double *at = points + 3 * (first + k < n ? first + k : n - 1);

        for (size_t c = 0; c < 3; c++) {
            p[c][k] = at[c];
        }
    }
}

/* Where the table serves. */
SIMD_INLINE void is_served(const struct four_steps *f, simd_bits *served)
{
    *served = (f->sin_theta >= SIMD_SET(POLAR)) & (f->square < SIMD_SET(LONG_STEP2));
}

/* ---- Forwards -------------------------------------------------------------------------------- */

/* moved, jacobian: of four points; returns which of them hold. */
SRNF_HOT static unsigned move(const struct sphere_spline *field, const double *points, size_t n,
                              size_t first, double moved[3 * SRNF_LANES],
                              double jacobian[SRNF_LANES])
{
    struct four_steps f;
    simd p[3];
    simd_bits good;
    unsigned which = 0;

    load_four(points, n, first, p);
    step_four(field, ORDER, p, &f);
    step_image(&f, p);
    is_served(&f, &good);
    for (size_t k = 0; k < SRNF_LANES; k++) {
        for (size_t c = 0; c < 3; c++) {
            moved[3 * k + c] = p[c][k];
        }
        jacobian[k] = f.jacobian[k];
        which |= good[k] ? 1U << k : 0U;
    }
    return which;
}

/* ---- Backwards ------------------------------------------------------------------------------- */

/* One Newton step of x toward exp_x(w(x)) = y; *left: the distance that was left, negative where it
   is none. */
SIMD_INLINE void newton_four(const struct four_steps *f, const simd y[3], const simd x[3],
                             simd step[3], simd *left)
{
    simd image[3] = {x[0], x[1], x[2]};
    simd u[3], v[3], error[3];
    simd along, a = SIMD_SET(0.0), b = SIMD_SET(0.0), sine = f->sinc, first, second, length;
    simd flat = SIMD_SET(0.0);

    step_image(f, image);
    length = SIMD_MAX(f->square, SIMD_SET(1e-280));
    simd_sqrt(&length, &length);
    sine *= length;
    along = y[0] * image[0] + y[1] * image[1] + y[2] * image[2];
    for (size_t k = 0; k < 3; k++) {
        simd across = k < 2 ? f->b[k] : flat;

        u[k] = f->c * f->a[k] + f->s * across;
        v[k] = f->c * across - f->s * f->a[k];
        error[k] = y[k] - along * image[k];
        a += error[k] * (f->cosine * u[k] - sine * x[k]);
        b += error[k] * v[k];
    }
    *left = a * a + b * b;
    simd_sqrt(left, left);
    *left =
        SIMD_SELECT((along > SIMD_SET(0.0)) & (f->jacobian > SIMD_SET(0.0)), *left, SIMD_SET(-1.0));
    first = (f->d11 * a - f->d01 * b) / f->jacobian;
    second = (f->d00 * b - f->d10 * a) / f->jacobian;
    for (size_t k = 0; k < 3; k++) {
        step[k] = first * u[k] + second * v[k];
    }
}

SIMD_INLINE void walk_four(simd x[3], const simd step[3], const simd_bits *moving)
{
    simd square = step[0] * step[0] + step[1] * step[1] + step[2] * step[2];
    simd cosine, sinc, to[3];

    simd_cos_sinc(&square, &cosine, &sinc);
    for (size_t k = 0; k < 3; k++) {
        to[k] = cosine * x[k] + sinc * step[k];
    }
    scale_to_unit(to);
    for (size_t k = 0; k < 3; k++) {
        x[k] = SIMD_SELECT(*moving, to[k], x[k]);
    }
}

/* As move, of the inverse; jacobian: of the step itself. */
SRNF_HOT static unsigned move_back(const struct sphere_spline *field, const double *points,
                                   size_t n, size_t first, double moved[3 * SRNF_LANES],
                                   double jacobian[SRNF_LANES])
{
    simd x[3], y[3], area = SIMD_SET(0.0);
    simd_bits moving = SIMD_SET(0.0) < SIMD_SET(1.0);
    simd_bits good = ~moving;
    unsigned which = 0;

    load_four(points, n, first, y);
    for (size_t c = 0; c < 3; c++) {
        x[c] = y[c];
    }
    for (size_t i = 0; i < NEWTON_STEPS && (moving[0] | moving[1] | moving[2] | moving[3]); i++) {
        struct four_steps f;
        simd step[3], left;
        simd_bits there, served;

        step_four(field, ORDER, x, &f);
        newton_four(&f, y, x, step, &left);
        there = moving & (left >= SIMD_SET(0.0)) & (left <= SIMD_SET(TOLERANCE));
        is_served(&f, &served);
        good |= there & served;
        area = SIMD_SELECT(there, f.jacobian, area);
        moving &= left >= SIMD_SET(0.0);
        walk_four(x, step, &moving);
        moving &= ~there;
    }
    for (size_t k = 0; k < SRNF_LANES; k++) {
        for (size_t c = 0; c < 3; c++) {
            moved[3 * k + c] = x[c][k];
        }
        jacobian[k] = area[k];
        which |= good[k] ? 1U << k : 0U;
    }
    return which;
}

/* ---- All points ------------------------------------------------------------------------------ */

static int move_directly(const struct fine_steps *steps, const double *potentials, bool inverse,
                         double *point, double *jacobian)
{
    double scratch[FIELDS_INVERSE];

    if (inverse) {
        return fields_apply_inverse(&steps->direct, potentials, 1, point, jacobian, scratch);
    }
    (void)fields_apply(&steps->direct, potentials, 1, point, jacobian, point, jacobian, scratch);
    return SRNF_OK;
}

int fine_steps_apply(struct fine_steps *steps, const double *potentials, bool inverse,
                     const struct srnf_context *context, size_t n, double *points, double *jacobian)
{
    int status = SRNF_OK;

    tabulated_fields_fill(&steps->fields, potentials);
    for (size_t first = 0; first < n && status == SRNF_OK; first += SRNF_LANES) {
        double moved[3 * SRNF_LANES], areas[SRNF_LANES];
        unsigned good = inverse ? move_back(&steps->fields.table, points, n, first, moved, areas)
                                : move(&steps->fields.table, points, n, first, moved, areas);

        for (size_t k = 0; k < SRNF_LANES && first + k < n && status == SRNF_OK; k++) {
            double *point = points + 3 * (first + k);

            if (good & 1U << k) {
                memcpy(point, moved + 3 * k, 3 * sizeof *point);
                jacobian[first + k] *= inverse ? 1.0 / areas[k] : areas[k];
            } else {
                status = move_directly(steps, potentials, inverse, point, jacobian + first + k);
            }
        }
        if (first % ASKED == 0 && srnf_is_canceled(context)) {
            break; /* warp_follow asks again */
        }
    }
    return status;
}
