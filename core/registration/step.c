/*
 * step.c - vector fields on the sphere and the maps exp(w) that they generate.
 *
 * w = grad phi + p x grad psi. The point moves to cos t p + sin t w / t, t = |w|. With A = grad w
 * in the frame (w / t, p x w / t), A_ij the component i of the derivative in direction j, the
 * Jacobian follows from the Jacobi fields of the sphere:
 *   J_step = (1 + A11) (cos t + sinc t A22) - sinc t A12 A21.
 * The inverse map solves exp_x(w(x)) = y from x = exp_y(-w(y)) on, by Newton's method with the
 * derivative of exp in the same frames, in part where a whole step leads away; its Jacobian is
 * 1 / J_step(x).
 * grad w = Hess phi + R Hess psi, R the quarter turn v -> p x v; both from jets of the potentials
 * (harmonics/points_jets.c).
 */
#include "registration.h"

#include <math.h>

#define INVERSE_STEPS 60
#define INVERSE_SHORTEST 1e-4 /* part of a Newton step */
#define INVERSE_TOLERANCE \
    1e-12 /* radians, before the last step: quadratic convergence does the rest */

int fields_create(struct fields *fields, size_t degree, const struct srnf_context *context)
{
    int status;

    *fields = (struct fields){.degree = degree, .count = srnf_coefficient_count(degree)};
    fields->scale = srnf_alloc(fields->count, sizeof(double));
    status = sphere_jets_create(&fields->plan, degree, context);
    if (status || !fields->scale) {
        fields_clear(fields);
        return SRNF_ENOMEM;
    }
    for (size_t l = 1; l <= degree; l++) {
        for (size_t i = l * l; i < (l + 1) * (l + 1); i++) {
            fields->scale[i] = 1.0 / sqrt((double)(l * (l + 1)));
        }
    }
    return SRNF_OK;
}

void fields_clear(struct fields *fields)
{
    srnf_free(fields->scale);
    sphere_jets_clear(&fields->plan);
    *fields = (struct fields){0};
}

/* Jets of both potentials and the frames of n points. */
struct evaluation {
    size_t n;
    double *phi, *psi; /* [JET_KINDS][n] */
    double *t1, *t2;   /* [n][3] */
};

static struct evaluation evaluate(const struct fields *fields, const double *potentials, size_t n,
                                  const double *points, double *scratch)
{
    struct evaluation e = {n, scratch, scratch + JET_KINDS * n, scratch + 2 * JET_KINDS * n,
                           scratch + (2 * JET_KINDS + 3) * n};

    sphere_jets_evaluate(&fields->plan, 2, potentials, n, points, scratch, e.t1, e.t2);
    return e;
}

/* w at point i as a vector of R^3. */
static void field_vector(const struct evaluation *e, size_t i, double w[3])
{
    double along = e->phi[JET_THETA * e->n + i] - e->psi[JET_PHI * e->n + i];
    double across = e->phi[JET_PHI * e->n + i] + e->psi[JET_THETA * e->n + i];

    for (size_t k = 0; k < 3; k++) {
        w[k] = along * e->t1[3 * i + k] + across * e->t2[3 * i + k];
    }
}

/* exp(w) at one point with its derivative: column j of d is the image of u (j = 0) or v = p x u (j
   = 1), in the frame (radial, v) at the image. */
struct step {
    double u[3], v[3], radial[3], image[3];
    double d[2][2];
};

static void step_point(const struct evaluation *e, size_t i, const double *p, struct step *step)
{
    const double *phi = e->phi + i;
    const double *psi = e->psi + i;
    size_t n = e->n;
    double along = phi[JET_THETA * n] - psi[JET_PHI * n];
    double across = phi[JET_PHI * n] + psi[JET_THETA * n];
    double t = sqrt(along * along + across * across);
    double c = t > 0.0 ? along / t : 1.0; /* u = c e_theta + s e_phi; any where w vanishes */
    double s = t > 0.0 ? across / t : 0.0;
    double sinc = t > 1e-4 ? sin(t) / t : 1.0 - t * t / 6.0;
    double cosine = cos(t);
    double sine = t * sinc;
    /* The derivative of w in the frame: Hess phi + R Hess psi. */
    double a11 = phi[JET_THETA_THETA * n] - psi[JET_THETA_PHI * n];
    double a12 = phi[JET_THETA_PHI * n] - psi[JET_PHI_PHI * n];
    double a21 = phi[JET_THETA_PHI * n] + psi[JET_THETA_THETA * n];
    double a22 = phi[JET_PHI_PHI * n] + psi[JET_THETA_PHI * n];
    double norm = 0.0;

    step->d[0][0] = 1.0 + c * c * a11 + c * s * (a12 + a21) + s * s * a22;
    step->d[0][1] = c * c * a12 + c * s * (a22 - a11) - s * s * a21;
    step->d[1][0] = sinc * (c * c * a21 + c * s * (a22 - a11) - s * s * a12);
    step->d[1][1] = cosine + sinc * (c * c * a22 - c * s * (a12 + a21) + s * s * a11);
    for (size_t k = 0; k < 3; k++) {
        step->u[k] = c * e->t1[3 * i + k] + s * e->t2[3 * i + k];
        step->v[k] = c * e->t2[3 * i + k] - s * e->t1[3 * i + k];
        step->image[k] = cosine * p[k] + sine * step->u[k];
        step->radial[k] = cosine * step->u[k] - sine * p[k];
        norm += step->image[k] * step->image[k];
    }
    norm = 1.0 / sqrt(norm);
    for (size_t k = 0; k < 3; k++) {
        step->image[k] *= norm;
    }
}

static double step_jacobian(const struct step *step)
{
    return step->d[0][0] * step->d[1][1] - step->d[0][1] * step->d[1][0];
}

double fields_apply(const struct fields *fields, const double *potentials, size_t n,
                    const double *points, const double *jacobian, double *new_points,
                    double *new_jacobian, double *scratch)
{
    struct evaluation e = evaluate(fields, potentials, n, points, scratch);
    double least = INFINITY;

    for (size_t i = 0; i < n; i++) {
        struct step step;
        double j;

        step_point(&e, i, points + 3 * i, &step);
        j = step_jacobian(&step);
        for (size_t k = 0; k < 3; k++) {
            new_points[3 * i + k] = step.image[k];
        }
        new_jacobian[i] = jacobian[i] * j;
        least = j < least ? j : least;
    }
    return least;
}

/* Moves x along the great circle that starts with the tangent s. */
static void walk(double *x, const double *s)
{
    double t = sqrt(vector_dot(s, s));
    double sinc = t > 1e-4 ? sin(t) / t : 1.0 - t * t / 6.0;
    double norm;

    for (size_t k = 0; k < 3; k++) {
        x[k] = cos(t) * x[k] + sinc * s[k];
    }
    norm = sqrt(vector_dot(x, x));
    for (size_t k = 0; k < 3; k++) {
        x[k] /= norm;
    }
}

/* Newton's method at one point: where its last step began, that step, and how much of it is
   taken. */
struct newton {
    double from[3], move[3];
    double left, length; /* what was left there; 0: it has not begun */
};
_Static_assert(sizeof(struct newton) == FIELDS_NEWTON * sizeof(double), "only doubles");

/* One step of x toward exp_x(w(x)) = y. Where the step before led further away, or to where the map
   folds, half of that is tried instead: of a map that is one to one there is always a part that
   leads nearer. Returns the distance that was left. */
static double newton_point(const struct evaluation *e, size_t i, const double *y,
                           struct newton *newton, double *x, double *jacobian)
{
    struct step step;
    double error[3];
    double a, b, along, left;

    step_point(e, i, x, &step);
    *jacobian = step_jacobian(&step);
    along = vector_dot(y, step.image);
    for (size_t k = 0; k < 3; k++) {
        error[k] = y[k] - along * step.image[k];
    }
    a = vector_dot(error, step.radial);
    b = vector_dot(error, step.v);
    left = along > 0.0 ? sqrt(a * a + b * b) : 2.0 - sqrt(a * a + b * b);
    if (newton->length > INVERSE_SHORTEST &&
        !(*jacobian > 0.0 && (left < newton->left || left <= INVERSE_TOLERANCE))) {
        double move[3];

        newton->length *= 0.5;
        for (size_t k = 0; k < 3; k++) {
            x[k] = newton->from[k];
            move[k] = newton->length * newton->move[k];
        }
        walk(x, move);
        return newton->left;
    }
    for (size_t k = 0; k < 3; k++) {
        newton->from[k] = x[k];
        newton->move[k] = ((step.d[1][1] * a - step.d[0][1] * b) * step.u[k] +
                           (step.d[0][0] * b - step.d[1][0] * a) * step.v[k]) /
                          *jacobian;
    }
    newton->left = left;
    newton->length = 1.0;
    if (*jacobian > 0.0) {
        walk(x, newton->move);
    }
    return left;
}

int fields_apply_inverse(const struct fields *fields, const double *potentials, size_t n,
                         double *points, double *jacobian, double *scratch)
{
    struct newton *newton = (struct newton *)scratch;
    double *x = scratch + FIELDS_NEWTON * n;
    double *steps = x + 3 * n; /* Jacobians of the step */
    double *rest = steps + n;
    double left = INFINITY;
    struct evaluation e = evaluate(fields, potentials, n, points, rest);

    for (size_t i = 0; i < n; i++) {
        double back[3];

        field_vector(&e, i, back);
        for (size_t k = 0; k < 3; k++) {
            back[k] = -back[k];
            x[3 * i + k] = points[3 * i + k];
        }
        walk(x + 3 * i, back);
        newton[i].length = 0.0;
    }
    for (int step = 0; step < INVERSE_STEPS && left > INVERSE_TOLERANCE; step++) {
        left = 0.0;
        e = evaluate(fields, potentials, n, x, rest);
        for (size_t i = 0; i < n; i++) {
            double one = newton_point(&e, i, points + 3 * i, &newton[i], x + 3 * i, &steps[i]);

            left = isnan(left) || one <= left ? left : one; /* what is no number stays */
        }
    }
    if (!(left <= INVERSE_TOLERANCE)) {
        return SRNF_ENUMERIC;
    }
    for (size_t i = 0; i < n; i++) {
        jacobian[i] /= steps[i];
        for (size_t k = 0; k < 3; k++) {
            points[3 * i + k] = x[3 * i + k];
        }
    }
    return SRNF_OK;
}
