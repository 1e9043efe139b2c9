/*
 * internal.h - what the files of the executor share.
 *
 *   slurm.c     the thread: looks, settles, asks for pilots and cancels them, in turn
 *   arrays.c    arrays of pilots from their intent to their end
 *   memory.c    pilots that ran out of memory, and what the next get
 *   cancel.c    pilots that are not needed, and those that nobody knows
 *   operations.c  jobs that have pilots: how many each wants, when to try again, what to say
 *   queue.c     what squeue answers
 *   script.c    what sbatch is given
 *   command.c   running one program with a deadline
 *
 * One thread, srnfd-slurm, does all of it; slurm_wake is the only way in, under slurm->mutex.
 */
#ifndef SRNFD_SLURM_INTERNAL_H
#define SRNFD_SLURM_INTERNAL_H

#include <pthread.h>
#include <stdatomic.h>

#include "jobs/tasks.h"
#include "slurm/slurm.h"
#include "store/pilots.h"

/* ---- Programs (command.c) -------------------------------------------------------------------- */

#define SLURM_OUTPUT_MAX ((size_t)4 << 20)
#define SLURM_WHY_MAX 200

struct slurm_command {
    const char *const *arguments; /* ended by NULL; the first is the program, found in PATH */
    const char *input;            /* of its standard input, or NULL */
    double seconds;               /* after which it is killed */
    const atomic_bool *hurry;     /* once true, some seconds are left; may be NULL */
};
struct slurm_answer {
    int status; /* of its exit; -1: it gave none, or could not be started */
    bool ended; /* by itself: what it did is done */
    char *text; /* of standard output (malloc), with a zero after it; NULL: too much of it */
    size_t size;
    char why[SLURM_WHY_MAX]; /* without success: its last line of standard error, or what else */
};
/* answer is to be cleared in any case. */
void slurm_run(const struct slurm_command *command, struct slurm_answer *answer);
void slurm_answer_clear(struct slurm_answer *answer);
/* Whether PATH has the program. */
bool slurm_has(const char *program);

/* ---- The queue (queue.c) --------------------------------------------------------------------- */

enum slurm_state { SLURM_PENDING, SLURM_RUNNING, SLURM_LEAVING, SLURM_ENDED };

#define SLURM_ID_MAX 32
#define SLURM_REASON_MAX 64
#define SLURM_FORMAT "%j|%i|%T|%r" /* of squeue */

/* An element of an array, as the queue has it. */
struct slurm_element {
    char name[STORE_PILOTS_NAME_MAX]; /* of its array */
    char id[SLURM_ID_MAX];            /* "123_4" */
    enum slurm_state state;
    char word[24]; /* the state as Slurm calls it */
    char reason[SLURM_REASON_MAX];
};
/* Elements (malloc) of what squeue printed; false: it is not what squeue prints, or no memory. */
bool slurm_queue_read(const char *text, struct slurm_element **elements, size_t *n);

/* ---- What sbatch is given (script.c) --------------------------------------------------------- */

/* The script of an array whose pilots prove themselves by this token: malloc; NULL with a sentence
   where memory is short or the certificate cannot be read. */
char *slurm_script(const struct slurm_config *config, const char *token, char *message,
                   size_t size);
#define SLURM_ARGUMENTS_MAX 96
struct slurm_arguments {
    const char *list[SLURM_ARGUMENTS_MAX]; /* ended by NULL; all in text */
    size_t n;
    char text[4096];
    size_t used;
};
/* Arguments of sbatch for `size` pilots with so much memory. */
void slurm_submit_arguments(const struct slurm_config *config, const struct store_pilots *row,
                            struct slurm_arguments *arguments);
/* Why these cannot be further arguments of sbatch, a static sentence, or NULL. */
const char *slurm_arguments_problem(const char *text);

/* ---- Arrays (arrays.c) ----------------------------------------------------------------------- */

struct slurm_array {
    struct store_pilots row;
    size_t pending, running, leaving;  /* elements at the last look */
    size_t delayed;                    /* pending ones that ran, and have to wait for some time */
    bool ran;                          /* an element, at some look */
    bool seen;                         /* at some look */
    bool spent;                        /* its memory was too little, and that was noted */
    bool cut;                          /* some of its elements were cancelled */
    bool told;                         /* it vanished, and was cancelled by its number */
    double doubt;                      /* it may still come to light until then */
    size_t done;                       /* tasks of its job that were done when it was submitted */
    char reason[SLURM_REASON_MAX];     /* of what is pending */
    char ended[SLURM_REASON_MAX + 32]; /* how an element ended that did not end well, or "" */
    struct slurm_array *next;          /* an older one */
};

/* A job with pilots. */
struct slurm_operation {
    char job[STORE_ID_MAX];
    bool wanted;             /* the job goes on */
    bool waits;              /* it has an open round */
    size_t left;             /* tasks of that round, 0 without one */
    size_t round_done, done; /* tasks done of the last round seen, and of all */
    double seconds;          /* that a task took, in the last round that tells; 0: not known */
    size_t most;             /* pilots that it gets */
    size_t pending, running; /* that it has, without those that are delayed */
    size_t alive;            /* of those that run, as their signs say */
    size_t silent;           /* of those that run, without a sign for long */
    double heard;            /* when no others were without a sign */
    size_t fewest;           /* that were without one at any look since; SIZE_MAX: no look */
    bool unclear;            /* it is not known whether an array was submitted */
    int64_t attempt, memory; /* of the last array; of the next */
    unsigned failures;       /* arrays in a row that did nothing */
    double next;             /* no array is submitted before */
    bool refused;            /* the trouble is that sbatch did not take the last one */
    char reason[SLURM_REASON_MAX], trouble[SLURM_WHY_MAX];
    struct slurm_operation *link;
};

struct slurm {
    struct slurm_config config;
    char start[5]; /* of this run: names of arrays that have gone are in the queue for minutes, and
                      must not come again */
    pthread_t thread;
    pthread_mutex_t mutex; /* guards the next two */
    pthread_cond_t wake;
    bool woken;
    atomic_bool closing;
    struct slurm_array *arrays;
    struct slurm_operation *operations;
    struct slurm_element *elements; /* of the last look that was answered */
    size_t n_elements;
    double active;           /* when there was an array or a job last, or this run began */
    double swept;            /* when strays were looked for last; 0: never */
    double looked;           /* when the last look began, by the monotonic clock; 0: never */
    bool blind;              /* the last look was not answered */
    char why[SLURM_WHY_MAX]; /* then: why */
};

/* Rows of an earlier run. */
int slurm_arrays_load(struct slurm *slurm);
void slurm_arrays_free(struct slurm *slurm);
/* Asks squeue for all arrays at once. */
void slurm_look(struct slurm *slurm);
/* What the last look means for each array: adopted, gone, or still unclear. */
void slurm_settle(struct slurm *slurm);
/* Asks for `size` pilots more. */
void slurm_submit(struct slurm *slurm, struct slurm_operation *operation, size_t size);
/* Cancels up to `most` pending pilots of the operation, the newest first; those with less memory
   than it asks for now in any case. */
void slurm_shrink(struct slurm *slurm, const struct slurm_operation *operation, size_t most);
/* Cancels what the last look has shown of arrays that are to end; all: whatever it has shown. */
void slurm_cancel_ending(struct slurm *slurm, bool all);
/* Cancels strays, if it is time to look for them again. */
void slurm_sweep(struct slurm *slurm);
/* When that is; 0: not before there is another array. */
double slurm_sweep_due(const struct slurm *slurm);
/* What the names of all arrays of this installation begin with. */
#define SLURM_PREFIX_MAX 32
void slurm_name_prefix(const struct slurm *slurm, char prefix[SLURM_PREFIX_MAX]);
/* The array is to end, and its token ends with it. */
void slurm_array_end(struct slurm *slurm, struct slurm_array *array);
/* Where an element ran out of memory, the next pilots of the job get twice as much (memory.c). */
void slurm_memory_note(struct slurm *slurm, struct slurm_array *array,
                       struct slurm_operation *operation);
/* MiB of a pilot in what squeue prints of resources, "cpu=1,mem=1.50G,node=1"; 0: it tells none. */
int64_t slurm_memory_read(const char *text);

/* ---- Operations (operations.c) --------------------------------------------------------------- */

/* The operation of a job; made where there is none. NULL without memory. */
struct slurm_operation *slurm_operation_of(struct slurm *slurm, const char *job);
/* Brings the operations up to date with the open rounds and the arrays, shares the pilots out, and
   lets go of those that are over. */
void slurm_operations_update(struct slurm *slurm);
/* An array has done nothing, or could not be submitted: the next comes later. */
void slurm_operation_fail(struct slurm_operation *operation, const char *trouble);
/* Says in the jobs what became of their pilots. */
void slurm_operations_tell(struct slurm *slurm);
void slurm_operations_free(struct slurm *slurm);

/* Pilots that an operation can use: [in] tasks left, seconds that one takes (0: not known), tasks
   at once of a pilot. */
size_t slurm_pilots_wanted(size_t tasks, double seconds, size_t cpus);
/* Shares `most` pilots out among n operations with these wishes, which become what each gets. */
void slurm_share(size_t most, size_t n, size_t *wishes);

#endif
