/*
 * tournament.h - what searches by tables share: subject.c prepares the moving surface, tournament.c
 * finds the basin, climb.c its bottom.
 */
#ifndef SRNF_REGISTRATION_TOURNAMENT_H
#define SRNF_REGISTRATION_TOURNAMENT_H

#include "tabulated.h"

#define DIRECT_ENERGY 1e-4 /* below it two surfaces may be the same, and errors of tables count */
#define MATRIX_DEGREE ((size_t)12) /* up to it one matrix serves all degrees of fields */
/* Of the fields that the tournament ends with, whose steps come before those of delta (climb.c). */
#define BASIN_DEGREE ((size_t)8)

/* Degrees of the fields in turn, and the gain below which each is left. */
struct ladder_rung {
    size_t degree;
    double decrease;
};
#define LADDER_RUNGS ((size_t)6)
extern const struct ladder_rung registration_ladder[LADDER_RUNGS];
#define AMBIGUITY_ANGLE (15.0 * SRNF_PI / 180.0) /* between maps of two basins, at least */

/* Rows of the grid, degrees of the surfaces and of the fields, rows of the fields' tables, steps,
   how many entrants are kept at most. */
struct tournament_round {
    size_t rows, surface, fields, table, steps, keep;
    double behind; /* the best, by a part of its objective: what is more is out */
};
#define TOURNAMENT_ROUNDS ((size_t)4)
/* Round k for surfaces of a degree. */
struct tournament_round tournament_round(size_t k, size_t degree);

#define SCREEN_COUNT ((size_t)(REGISTRATION_SCREEN_DEGREE + 1) * (REGISTRATION_SCREEN_DEGREE + 1))

/* A moving surface, ready to be registered to any template. Immutable: searches of several threads
   may share it. */
struct subject {
    struct tabulated_moving full, rounds[TOURNAMENT_ROUNDS];
    size_t top;     /* degree of the matrix */
    double *matrix; /* of the data term, absolute */
    double screen[3 * SCREEN_COUNT];
};
SRNF_CHECKED int subject_create(struct subject *subject, const struct srnf_sht *sht,
                                const double *coefficients,
                                const struct srnf_register_options *options,
                                struct tabulated_tools *tools, const struct srnf_context *context);
void subject_clear(struct subject *subject);
/* Whether a search with these options reads any of it. */
bool subject_is_read(const struct srnf_register_options *options);

/* The best start after elastic steps on growing grids: result->warp has its chain alone (no
   points), and the ambiguity is known. */
SRNF_CHECKED int tournament_run(const struct search *search, struct search_result *result);

/* The same from the identity alone, by the last rounds. */
#define TOURNAMENT_STILL ((size_t)2)
SRNF_CHECKED int tournament_still(const struct search *search, struct search_result *result);

/* Whether a search may replace its links by fewer, of a higher degree: not where so low a degree is
   asked for that it stands for how smooth the warp is to be, nor in exact mode. */
bool search_refits(const struct search *search);
/* Whether a chain begins with the identity, as in a common pose, where it always does. */
bool warp_is_still(const struct srnf_warp *chain);
/* What a chain is replaced on: the degree of the fields, by which part the objective may rise, and
   the table by which the points are found, refit_rough where they are not kept. */
struct refit_terms {
    size_t degree;
    double worse;
    const struct field_table *table;
};
extern const struct field_table refit_rough;
/* A chain as one step of fields and a rotation (refit.c): cloud is at its points then, and
   measured. spare: of as many points. problem: on the nodes of a grid. */
SRNF_CHECKED int warp_refit(const struct tabulated_problem *problem, const struct nodes_of *grid,
                            const struct refit_terms *terms, struct tabulated_tools *tools,
                            struct cloud *cloud, struct cloud *spare, struct srnf_warp *chain);

/* The relative energy of the identity, by tables. */
SRNF_CHECKED int climb_still_energy(const struct search *search, double *energy);

/* Fields of rising degree on the full grid, all rungs above `from`. The points of result->warp are
   those of its chain, or, where replayed is false, are made from it: its fields are of the degree
   of a basin then. The objective is measured directly in the end, unless the chain alone is asked
   for and there is too much left for errors of tables to count. */
SRNF_CHECKED int climb_run(const struct search *search, size_t from, bool replayed,
                           struct search_result *result);

#endif
