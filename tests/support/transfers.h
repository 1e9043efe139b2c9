/*
 * transfers.h - deformation transfer on real pairs: the contraction of one left ventricle, from end
 * diastole to end systole, carried to another one whose own end systole is known.
 */
#ifndef TESTS_TRANSFERS_H
#define TESTS_TRANSFERS_H

#include "srnf.h"

#define TRANSFERS_SUBJECTS ((size_t)10)

/* Ways to guess the end systole of a subject from another's contraction. */
enum transfers_way {
    TRANSFERS_NOTHING,            /* the subject's own end diastole */
    TRANSFERS_DISPLACEMENT,       /* plus the other's displacement of each vertex, in mm */
    TRANSFERS_DISPLACEMENT_RATIO, /* the same between shapes of unit area, the size by ratio */
    TRANSFERS_SRNF,               /* srnf_transfer, in mm */
    TRANSFERS_SRNF_RATIO,         /* srnf_transfer, shape and size apart */
    TRANSFERS_SRNF_REGISTERED, /* the same, without the correspondence of the vertices: encoded one
                                  by one, registered in the common pose as the process does */
    TRANSFERS_WAYS
};
extern const char *const transfers_names[TRANSFERS_WAYS];

/* How far a guess is from the truth, both about their centroids, in mm. */
struct transfers_error {
    double
        points; /* rms over the true surface between corresponding points; NAN: none correspond */
    double surface; /* rms distance of either surface from the other */
    double srnf;    /* ||Q(guess) - Q(truth)|| / ||Q(truth)||; NAN: no points correspond */
};

struct transfers_subject {
    char name[64];
    double *diastole, *systole; /* [3][(L+1)^2] in units of TRANSFERS_UNIT, in correspondence */
    double *star_diastole, *star_systole; /* the same, each encoded by itself */
};
#define TRANSFERS_UNIT 100.0 /* mm */

struct transfers {
    struct srnf_sht *sht;
    size_t degree, count; /* count = 3 (L+1)^2 */
    size_t n;
    struct transfers_subject subjects[TRANSFERS_SUBJECTS];
};

/* From the folders lv_endocardium_ed and lv_pairs of `data`. False, with nothing to close, where
   they are not there. Ends the program on any other trouble. */
bool transfers_open(struct transfers *t, const char *data, size_t degree);
void transfers_close(struct transfers *t);

/* The guess of the systole of `to` from the contraction of `from`, [3][(L+1)^2] in units of
   TRANSFERS_UNIT, and what it cost in gradient transforms (0 for a sum). */
double transfers_guess(const struct transfers *t, size_t from, size_t to, enum transfers_way way,
                       double *guess);
struct transfers_error transfers_measure(const struct transfers *t, size_t to,
                                         enum transfers_way way, const double *guess);

#endif
