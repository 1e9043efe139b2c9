/*
 * memory.h - what a job has in use of the core's memory, and how much of it it may have.
 *
 * The daemon brings its own srnf_alloc and srnf_free (memory.c), which the linker prefers to those
 * of the library. Each block remembers the account that it was charged to, which is that of the
 * thread that asked for it: a worker enters its job's account for the run, and a helper the account
 * of the job it helps. So a block may be freed by anyone, and an account is exact to the byte.
 *
 * Uploads that are read share one account: each has its own within it, which tells what became of
 * this one, and which can be stopped: then the next request for memory is refused, or the next
 * question of what is being read is answered so.
 *
 * Counted are the blocks of the core with what they are rounded up to. Outside stay what belongs to
 * no single job (the shared transforms), the texts of inputs and results and the bytes of stored
 * meshes, what FFTW, GLPK, LAPACKE, SQLite and jansson allocate for themselves, and of each thread
 * up to 16 MiB of freed blocks, which it has for its next ones until it leaves its account.
 */
#ifndef SRNFD_JOBS_MEMORY_H
#define SRNFD_JOBS_MEMORY_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>

/* One account. Must outlive the blocks charged to it. */
struct jobs_memory {
    size_t limit;          /* bytes */
    atomic_size_t used;    /* bytes in use */
    atomic_size_t peak;    /* the most that were in use at once since jobs_memory_begin */
    atomic_size_t refused; /* bytes of the first request beyond the limit; 0: there was none */
    atomic_size_t held;    /* bytes that were in use when it came */
    /* An account within another one, which counts all blocks of this one too and has a limit for
       all of them together; NULL: none. */
    struct jobs_memory *parent;
    atomic_size_t beside;    /* bytes of others in the parent when it refused */
    const atomic_bool *stop; /* true: nothing more is granted; NULL: never */
    atomic_bool stopped;     /* somebody was told so */
};

/* Begins a job's accounting: [in] limit in bytes, above 0. What is still in use of an earlier one
   stays counted. While no thread charges the account. */
void jobs_memory_begin(struct jobs_memory *memory, size_t limit);
/* From now on the calling thread's blocks are charged to this account (NULL: to none). Returns the
   one before. */
struct jobs_memory *jobs_memory_enter(struct jobs_memory *memory);
/* That of the calling thread, or NULL. */
struct jobs_memory *jobs_memory_current(void);
/* For what others than the core allocate: false where the account has no room (NULL: always). What
   was charged is to be discharged by whoever did it. */
bool jobs_memory_charge(struct jobs_memory *memory, size_t bytes);
void jobs_memory_discharge(struct jobs_memory *memory, size_t bytes);
/* The same for what can do without, of an account with no parent: no room is no refusal. */
bool jobs_memory_fits(struct jobs_memory *memory, size_t bytes);
/* Sets aside what the account has room for, `most` bytes of it at most, as the limit of another
   one, until it is returned. That this refuses is no refusal of the account, and what it had in use
   does not count as the peak of the account. */
void jobs_memory_lend(struct jobs_memory *memory, size_t most, struct jobs_memory *other);
void jobs_memory_return(struct jobs_memory *memory, const struct jobs_memory *other);
/* Whether what uses the account is to stop, and notes that it was said (NULL: never). */
bool jobs_memory_told(struct jobs_memory *memory);

/* Once, before any thread: from now on large blocks are pages of their own, and what is freed goes
   back to the system. */
void jobs_memory_prepare(void);

/* ---- What there is to share (machine.c) ------------------------------------------------------ */

/* Bytes of memory that this process may use: that of the machine, or less where a control group
   (version 2) that it is in has a memory.max, or its address space a limit (RLIMIT_AS). */
size_t jobs_machine_memory(void);
/* The smallest memory.max from the control group that the file self (as /proc/self/cgroup) names up
   to the root, below the folder groups (as /sys/fs/cgroup); SIZE_MAX where none is set. */
size_t jobs_group_memory(const char *self, const char *groups);
/* What one of so many jobs may have in use where nothing else is said: its part of three quarters
   of that. The last quarter is for bodies, the database's cache and the shared transforms. */
size_t jobs_memory_share(size_t workers);
/* What reading uploads may have in use, all of them together, where nothing else is said: an
   eighth of that memory, and enough for one large document. */
size_t jobs_memory_of_uploads(void);

#endif
