/*
 * star_kernel.c - the kernel of a closed surface: is there a point that sees all of it, and which
 * sees it best?
 *
 * For each face f with unit normal n_f, a corner v_f and offset d_f = <n_f, v_f>, the slack of a
 * point c is s_f(c) = d_f - <n_f, c>, its distance behind the plane of the face. The margin of c is
 * min_f s_f(c), a concave function; the best centre maximizes it:
 *
 *   primal   max t   subject to   <n_f, c> + t <= d_f           four unknowns, one row per face
 *   dual     min sum d_f y_f   subject to   sum n_f y_f = 0, sum y_f = 1, y >= 0      four rows
 *
 * The dual goes to the primal simplex method of GLPK; (c, t) are the duals of its rows. Not all
 * faces do: most never bind. Starting from the faces that bind most around the middle of the box,
 * one per bin of normal directions, each round solves over the faces taken so far, evaluates the
 * margin of that c over all faces, and takes in, per bin, the face that is violated most. t falls
 * from round to round, the best margin seen rises, and the gap between them proves how far from
 * optimal the answer can be. A handful of rounds over some hundred columns suffice for any size of
 * mesh, and what GLPK allocates stays small.
 *
 * Coordinates are taken about the centre of the bounding box in units of its diagonal. The centre
 * is sought in the cube of half-width 1 there, which holds the box twice over: six more columns see
 * to it that every round has a solution.
 *
 * GLPK keeps its state in a thread-local environment. It is created by the first call and freed
 * before srnf_star_kernel returns, so nothing is left behind per thread; a program that uses GLPK
 * for itself on the same thread must not hold problem objects across the call. GLPK ends the
 * process on internal errors and on lack of memory unless a hook jumps out: ours does, and the call
 * fails with SRNF_ENUMERIC.
 *
 * Cost: rounds x faces; about 2 ms for 6,000 faces.
 */
#include "mesh_geometry.h"

#include <glpk.h>
#include <setjmp.h>

/* For a diagonal of 1. A margin below MARGIN_ZERO is rounding (the simplex works to
   SIMPLEX_TOLERANCE), and no use to a ray. The gap is closed at GAP_CLOSED; what is still below
   GAP_USABLE when no face is left to take is as good as the tolerances allow. */
#define MARGIN_ZERO 1e-9
#define SIMPLEX_TOLERANCE 1e-10
#define GAP_CLOSED 1e-12
#define GAP_USABLE 1e-7
#define ROUNDS_MAX 200

/* A face whose doubled area is at most this part of the square of its longest edge has a normal
   that is mostly rounding. */
#define SLIVER 1e-12

/* Bins of directions: each side of a cube in BIN_SIDE x BIN_SIDE squares. */
#define BIN_SIDE 4
#define BINS (6 * BIN_SIDE * BIN_SIDE)

struct planes {
    size_t n;
    double (*plane)[4]; /* unit normal and offset, relative to centre, in units of diagonal */
    double *area;       /* same units; 0: leave the face out */
    uint8_t *bin;
    bool *taken; /* is a column of the program */
    double center[3], diagonal, total_area;
};

static void planes_clear(struct planes *planes)
{
    srnf_free(planes->plane);
    srnf_free(planes->area);
    srnf_free(planes->bin);
    srnf_free(planes->taken);
}

static uint8_t direction_bin(const double normal[3])
{
    size_t axis = 0, cell[2];

    for (size_t k = 1; k < 3; k++) {
        if (fabs(normal[k]) > fabs(normal[axis])) {
            axis = k;
        }
    }
    for (size_t k = 0; k < 2; k++) {
        double x = normal[(axis + 1 + k) % 3] / fabs(normal[axis]); /* -1 .. 1 */

        cell[k] = (size_t)(0.5 * (x + 1.0) * BIN_SIDE);
        cell[k] = cell[k] < BIN_SIDE ? cell[k] : BIN_SIDE - 1;
    }
    return (uint8_t)(((2 * axis + (normal[axis] < 0.0)) * BIN_SIDE + cell[0]) * BIN_SIDE + cell[1]);
}

static void plane_of_face(const struct srnf_mesh *mesh, size_t face, struct planes *planes)
{
    double corner[3][3], edge[3][3], normal[3], length, longest = 0.0;

    for (size_t k = 0; k < 3; k++) {
        vector_subtract(mesh_corner(mesh, face, k), planes->center, corner[k]);
        for (size_t i = 0; i < 3; i++) {
            corner[k][i] /= planes->diagonal;
        }
    }
    for (size_t k = 0; k < 3; k++) {
        vector_subtract(corner[(k + 1) % 3], corner[k], edge[k]);
        longest = larger(longest, vector_dot(edge[k], edge[k]));
    }
    vector_cross(edge[0], edge[1], normal);
    length = vector_norm(normal);
    if (!(length > SLIVER * longest)) {
        return;
    }
    for (size_t k = 0; k < 3; k++) {
        normal[k] /= length;
        planes->plane[face][k] = normal[k];
        planes->plane[face][3] += normal[k] * (corner[0][k] + corner[1][k] + corner[2][k]) / 3.0;
    }
    planes->area[face] = 0.5 * length;
    planes->total_area += 0.5 * length;
    planes->bin[face] = direction_bin(normal);
}

static int planes_create(struct planes *planes, const struct srnf_mesh *mesh,
                         const struct srnf_context *context)
{
    struct srnf_mesh_measures measures;
    int status = SRNF_EDEGENERATE;

    *planes = (struct planes){.n = mesh->n_faces};
    srnf_mesh_measure(mesh, context, &measures);
    if (!(measures.relative_area > 0.0)) {
        goto out;
    }
    planes->diagonal = measures.diagonal;
    for (size_t k = 0; k < 3; k++) {
        planes->center[k] = measures.center[k];
    }
    status = SRNF_ENOMEM;
    planes->plane = srnf_alloc(planes->n, sizeof *planes->plane);
    planes->area = srnf_alloc(planes->n, sizeof *planes->area);
    planes->bin = srnf_alloc(planes->n, sizeof *planes->bin);
    planes->taken = srnf_alloc(planes->n, sizeof *planes->taken);
    if (!planes->plane || !planes->area || !planes->bin || !planes->taken) {
        goto out;
    }
    for (size_t f = 0; f < planes->n && !srnf_asks(context, f); f++) {
        plane_of_face(mesh, f, planes);
    }
    status = planes->total_area > 0.0 ? SRNF_OK : SRNF_EDEGENERATE;
out:
    if (srnf_is_canceled(context)) {
        status = SRNF_ECANCELED;
    }
    if (status != SRNF_OK) {
        planes_clear(planes);
    }
    return status;
}

static double plane_slack(const struct planes *planes, size_t face, const double point[3])
{
    return planes->plane[face][3] - vector_dot(planes->plane[face], point);
}

/* Margin of a point, and per bin the face with the least slack that is not in the program yet, or
   SIZE_MAX. */
static double find_margin(const struct planes *planes, const struct srnf_context *context,
                          const double point[3], size_t worst[BINS])
{
    double least[BINS], margin = INFINITY;

    for (size_t b = 0; b < BINS; b++) {
        worst[b] = SIZE_MAX;
        least[b] = INFINITY;
    }
    for (size_t f = 0; f < planes->n && !srnf_asks(context, f); f++) {
        double slack;

        if (planes->area[f] == 0.0) {
            continue;
        }
        slack = plane_slack(planes, f, point);
        margin = smaller(margin, slack);
        if (!planes->taken[f] && slack < least[planes->bin[f]]) {
            least[planes->bin[f]] = slack;
            worst[planes->bin[f]] = f;
        }
    }
    return margin;
}

/* What is left when the centre is fixed; center in the planes' units. */
static void measure_center(const struct planes *planes, const double center[3],
                           struct srnf_star *star)
{
    double margin = INFINITY, violating = 0.0;

    for (size_t f = 0; f < planes->n; f++) {
        if (planes->area[f] > 0.0) {
            double slack = plane_slack(planes, f, center);

            margin = smaller(margin, slack);
            violating += slack < 0.0 ? planes->area[f] : 0.0;
        }
    }
    star->value = margin > MARGIN_ZERO;
    star->margin = margin * planes->diagonal;
    star->violating_area_fraction = violating / planes->total_area;
}

/* ---- The linear program ---------------------------------------------------------------------- */

/* Adds the column of <normal, c> + share t <= offset. */
static void add_column(glp_prob *program, const double normal[3], double share, double offset)
{
    const int rows[5] = {0, 1, 2, 3, 4};
    const double values[5] = {0.0, normal[0], normal[1], normal[2], share};
    int column = glp_add_cols(program, 1);

    glp_set_col_bnds(program, column, GLP_LO, 0.0, 0.0);
    glp_set_obj_coef(program, column, offset);
    glp_set_mat_col(program, column, 4, rows, values);
}

static glp_prob *create_program(void)
{
    glp_prob *program = glp_create_prob();

    glp_set_obj_dir(program, GLP_MIN);
    glp_add_rows(program, 4);
    for (int row = 1; row <= 4; row++) {
        double side = row == 4 ? 1.0 : 0.0;

        glp_set_row_bnds(program, row, GLP_FX, side, side);
    }
    for (size_t k = 0; k < 6; k++) {
        double normal[3] = {0.0, 0.0, 0.0};

        normal[k / 2] = k % 2 == 0 ? 1.0 : -1.0;
        add_column(program, normal, 0.0, 1.0);
    }
    return program;
}

/* Solves from the basis of the last round, then, should that fail, from a fresh basis, then by the
   dual simplex method with presolving. */
static bool solve_program(glp_prob *program)
{
    static const struct {
        int method, presolve;
        bool fresh;
    } attempts[] = {
        {GLP_PRIMAL, GLP_OFF, false}, {GLP_PRIMAL, GLP_OFF, true}, {GLP_DUALP, GLP_ON, true}};
    glp_smcp parameters;

    for (size_t i = 0; i < sizeof attempts / sizeof attempts[0]; i++) {
        glp_init_smcp(&parameters);
        parameters.msg_lev = GLP_MSG_OFF;
        parameters.meth = attempts[i].method;
        parameters.presolve = attempts[i].presolve;
        parameters.tol_bnd = SIMPLEX_TOLERANCE;
        parameters.tol_dj = SIMPLEX_TOLERANCE;
        parameters.it_lim = 100000; /* never reached: a guard against cycling */
        if (attempts[i].fresh) {
            glp_std_basis(program);
        }
        if (glp_simplex(program, &parameters) == 0 && glp_get_status(program) == GLP_OPT) {
            return true;
        }
    }
    return false;
}

/* The rounds; center in the planes' units. */
static int find_center(struct planes *planes, const struct srnf_context *context, double center[3])
{
    double point[3] = {0.0, 0.0, 0.0}, bound = INFINITY, best = -INFINITY;
    size_t worst[BINS];
    glp_prob *program = create_program();
    int status = SRNF_OK;

    for (size_t round = 0; round < ROUNDS_MAX; round++) {
        double margin = find_margin(planes, context, point, worst);
        size_t added = 0;

        if (srnf_is_canceled(context)) {
            status = SRNF_ECANCELED;
            break;
        }
        if (margin > best) {
            best = margin;
            for (size_t k = 0; k < 3; k++) {
                center[k] = point[k];
            }
        }
        for (size_t b = 0; b < BINS && bound - best > GAP_CLOSED; b++) {
            if (worst[b] != SIZE_MAX && plane_slack(planes, worst[b], point) < bound) {
                const double *plane = planes->plane[worst[b]];

                add_column(program, plane, 1.0, plane[3]);
                planes->taken[worst[b]] = true;
                added++;
            }
        }
        if (added == 0 || !solve_program(program)) {
            break;
        }
        for (int k = 0; k < 3; k++) {
            point[k] = glp_get_row_dual(program, k + 1);
        }
        bound = glp_get_row_dual(program, 4);
    }
    if (status == SRNF_OK && !(bound - best <= GAP_USABLE)) {
        status = SRNF_ENUMERIC;
    }
    glp_delete_prob(program);
    return status;
}

static void jump_out(void *trap)
{
    longjmp(*(jmp_buf *)trap, 1);
}

/* Even with its terminal output off, GLPK reports an internal error there: say nothing. */
static int swallow_output(void *info, const char *text)
{
    (void)info;
    (void)text;
    return 1;
}

/* Runs find_center inside an environment of GLPK that can neither print nor end the process. */
static int find_center_guarded(struct planes *planes, const struct srnf_context *context,
                               double center[3])
{
    jmp_buf trap;
    int status;

    if (setjmp(trap) != 0) {
        glp_free_env(); /* and with it all that the interrupted call held */
        return SRNF_ENUMERIC;
    }
    if (glp_init_env() > 1) { /* no memory for it: GLPK itself would print and abort */
        return SRNF_ENOMEM;
    }
    glp_error_hook(jump_out, &trap);
    glp_term_hook(swallow_output, NULL);
    glp_term_out(GLP_OFF);
    status = find_center(planes, context, center);
    glp_free_env();
    return status;
}

/* ---- Public functions ------------------------------------------------------------------------ */

int srnf_star_kernel_within(const struct srnf_mesh *mesh, const struct srnf_context *context,
                            struct srnf_star *star)
{
    struct planes planes;
    double center[3] = {0.0, 0.0, 0.0};
    int status = planes_create(&planes, mesh, context);

    if (status != SRNF_OK) {
        return status;
    }
    status = find_center_guarded(&planes, context, center);
    if (status == SRNF_OK) {
        *star = (struct srnf_star){0};
        measure_center(&planes, center, star);
        for (size_t k = 0; k < 3; k++) {
            star->center[k] = planes.center[k] + planes.diagonal * center[k];
        }
    }
    planes_clear(&planes);
    return status;
}

int srnf_star_kernel(const struct srnf_mesh *mesh, struct srnf_star *star)
{
    return srnf_star_kernel_within(mesh, NULL, star);
}

int srnf_star_at(const struct srnf_mesh *mesh, const double center[3], struct srnf_star *star)
{
    struct planes planes;
    double relative[3];
    int status = SRNF_EINVAL;

    for (size_t k = 0; k < 3; k++) {
        if (!(fabs(center[k]) <= SRNF_MESH_COORDINATE_MAX)) {
            return status;
        }
    }
    status = planes_create(&planes, mesh, NULL);
    if (status != SRNF_OK) {
        return status;
    }
    for (size_t k = 0; k < 3; k++) {
        relative[k] = (center[k] - planes.center[k]) / planes.diagonal;
    }
    *star = (struct srnf_star){.center = {center[0], center[1], center[2]}};
    measure_center(&planes, relative, star);
    planes_clear(&planes);
    return SRNF_OK;
}
