/*
 * registration_step.c - vector fields on the sphere and the maps exp(w) that they generate.
 *
 * w = grad phi + p x grad psi. The point moves to cos t p + sin t w / t, t = |w|. With A = grad w
 * in the frame (w / t, p x w / t), A_ij the component i of the derivative in direction j, the
 * Jacobian follows from the Jacobi fields of the sphere:
 *   J_step = (1 + A11) (cos t + sinc t A22) - sinc t A12 A21.
 * The inverse map solves exp_x(w(x)) = y from x = exp_y(-w(y)) on, by Newton's method with the
 * derivative of exp in the same frames; its Jacobian is 1 / J_step(x).
 * grad w = Hess phi + R Hess psi, R the quarter turn v -> p x v. Hessians come from the gradients
 * of the Cartesian components of grad phi and grad psi, which are series of one degree more.
 */
#include "registration.h"

#include <math.h>

#define INVERSE_STEPS 30
#define INVERSE_TOLERANCE \
    1e-12 /* radians, before the last step: quadratic convergence does the rest */

int fields_create(struct fields *fields, size_t degree)
{
    int status;

    *fields = (struct fields){.degree = degree, .count = srnf_coefficient_count(degree)};
    fields->components = srnf_alloc(6 * srnf_coefficient_count(degree + 1), sizeof(double));
    fields->scale = srnf_alloc(fields->count, sizeof(double));
    status = gradient_operator_create(&fields->op, degree);
    if (status == SRNF_OK) {
        status = sphere_points_create(&fields->plan, degree + 1);
    }
    if (status == SRNF_OK) {
        status = sphere_points_create(&fields->potential_plan, degree);
    }
    if (status || !fields->components || !fields->scale) {
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
    srnf_free(fields->components);
    srnf_free(fields->scale);
    gradient_operator_clear(&fields->op);
    sphere_points_clear(&fields->plan);
    sphere_points_clear(&fields->potential_plan);
    *fields = (struct fields){0};
}

/* w and the rows of its derivative matrix at one point from the six components and their gradients.
   */
struct field_jet {
    double phi[3], psi[3];           /* grad phi, grad psi */
    double d_phi[3][3], d_psi[3][3]; /* [component][direction] */
};

static void load_jet(size_t n, size_t i, const double *values, const double *gradients,
                     struct field_jet *jet)
{
    for (size_t k = 0; k < 3; k++) {
        jet->phi[k] = values[k * n + i];
        jet->psi[k] = values[(3 + k) * n + i];
        for (size_t j = 0; j < 3; j++) {
            jet->d_phi[k][j] = gradients[3 * (k * n + i) + j];
            jet->d_psi[k][j] = gradients[3 * ((3 + k) * n + i) + j];
        }
    }
}

/* <a, D b> */
static double bilinear(double d[3][3], const double *a, const double *b)
{
    return a[0] * vector_dot(d[0], b) + a[1] * vector_dot(d[1], b) + a[2] * vector_dot(d[2], b);
}

/* Unit vector along w, or any tangent where the field vanishes; returns |w|. */
static double direction(const double *p, const double *w, double *u)
{
    double t = sqrt(vector_dot(w, w));
    double length = t;

    for (size_t k = 0; k < 3; k++) {
        u[k] = w[k];
    }
    if (!(t > 1e-300)) {
        double axis[3] = {fabs(p[0]) < 0.6, fabs(p[0]) >= 0.6, 0.0};

        vector_cross(p, axis, u);
        length = sqrt(vector_dot(u, u));
        t = 0.0;
    }
    for (size_t k = 0; k < 3; k++) {
        u[k] /= length;
    }
    return t;
}

/* exp(w) at one point with its derivative: column j of d is the image of u (j = 0) or v = p x u (j
   = 1), in the frame (radial, p x u) at the image. */
struct step {
    double u[3], v[3], radial[3], image[3];
    double d[2][2];
};

static void step_point(struct field_jet *jet, const double *p, struct step *step)
{
    double w[3];
    double t;
    double sinc;
    double norm;

    vector_cross(p, jet->psi, w);
    for (size_t k = 0; k < 3; k++) {
        w[k] += jet->phi[k];
    }
    t = direction(p, w, step->u);
    vector_cross(p, step->u, step->v);
    sinc = t > 1e-4 ? sin(t) / t : 1.0 - t * t / 6.0;
    /* R' u = -v and R' v = u: <u, R H x> = -<v, H x>, <v, R H x> = <u, H x>. */
    step->d[0][0] =
        1.0 + bilinear(jet->d_phi, step->u, step->u) - bilinear(jet->d_psi, step->v, step->u);
    step->d[0][1] = bilinear(jet->d_phi, step->u, step->v) - bilinear(jet->d_psi, step->v, step->v);
    step->d[1][0] =
        sinc * (bilinear(jet->d_phi, step->v, step->u) + bilinear(jet->d_psi, step->u, step->u));
    step->d[1][1] = cos(t) + sinc * (bilinear(jet->d_phi, step->v, step->v) +
                                     bilinear(jet->d_psi, step->u, step->v));
    for (size_t k = 0; k < 3; k++) {
        step->image[k] = cos(t) * p[k] + sin(t) * step->u[k];
        step->radial[k] = cos(t) * step->u[k] - sin(t) * p[k];
    }
    norm = sqrt(vector_dot(step->image, step->image));
    for (size_t k = 0; k < 3; k++) {
        step->image[k] /= norm;
    }
}

static double step_jacobian(const struct step *step)
{
    return step->d[0][0] * step->d[1][1] - step->d[0][1] * step->d[1][0];
}

double fields_apply(const struct fields *fields, const double *potentials, size_t n,
                    const double *points, const double *jacobian, double *new_points,
                    double *new_jacobian, double *values, double *gradients)
{
    double least = INFINITY;

    gradient_operator_apply(&fields->op, 2, potentials, fields->components);
    sphere_points_evaluate(&fields->plan, 6, fields->components, n, points, values, gradients);
    for (size_t i = 0; i < n; i++) {
        struct field_jet jet;
        struct step step;
        double j;

        load_jet(n, i, values, gradients, &jet);
        step_point(&jet, points + 3 * i, &step);
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

/* One Newton step of x toward exp_x(w(x)) = y; returns the distance that was left. */
static double newton_point(struct field_jet *jet, const double *y, double *x, double *jacobian)
{
    struct step step;
    double error[3];
    double a;
    double b;
    double move[3];
    double along;

    step_point(jet, x, &step);
    *jacobian = step_jacobian(&step);
    along = vector_dot(y, step.image);
    for (size_t k = 0; k < 3; k++) {
        error[k] = y[k] - along * step.image[k];
    }
    a = vector_dot(error, step.radial);
    b = vector_dot(error, step.v);
    for (size_t k = 0; k < 3; k++) {
        move[k] = ((step.d[1][1] * a - step.d[0][1] * b) * step.u[k] +
                   (step.d[0][0] * b - step.d[1][0] * a) * step.v[k]) /
                  *jacobian;
    }
    if (*jacobian > 0.0) {
        walk(x, move);
    }
    return sqrt(a * a + b * b);
}

int fields_apply_inverse(const struct fields *fields, const double *potentials, size_t n,
                         double *points, double *jacobian, double *scratch)
{
    double *x = scratch;
    double *values = scratch + 3 * n;
    double *gradients = scratch + 9 * n;
    double left = INFINITY;

    gradient_operator_apply(&fields->op, 2, potentials, fields->components);
    sphere_points_evaluate(&fields->plan, 6, fields->components, n, points, values, gradients);
    for (size_t i = 0; i < n; i++) {
        struct field_jet jet;
        double back[3];

        load_jet(n, i, values, gradients, &jet);
        vector_cross(points + 3 * i, jet.psi, back);
        for (size_t k = 0; k < 3; k++) {
            back[k] = -(back[k] + jet.phi[k]);
            x[3 * i + k] = points[3 * i + k];
        }
        walk(x + 3 * i, back);
    }
    for (int step = 0; step < INVERSE_STEPS && left > INVERSE_TOLERANCE; step++) {
        left = 0.0;
        sphere_points_evaluate(&fields->plan, 6, fields->components, n, x, values, gradients);
        for (size_t i = 0; i < n; i++) {
            struct field_jet jet;
            double j;

            load_jet(n, i, values, gradients, &jet);
            left = fmax(left, newton_point(&jet, points + 3 * i, x + 3 * i, &j));
            values[i] = j; /* read already: component 0 of this point */
        }
    }
    if (!(left <= INVERSE_TOLERANCE)) {
        return SRNF_ENUMERIC;
    }
    for (size_t i = 0; i < n; i++) {
        jacobian[i] /= values[i];
        for (size_t k = 0; k < 3; k++) {
            points[3 * i + k] = x[3 * i + k];
        }
    }
    return SRNF_OK;
}
