/*
 * worker.h - `srnfd worker`: computes tasks of a service on this or another machine.
 */
#ifndef SRNFD_WORKER_H
#define SRNFD_WORKER_H

/* Arguments are those after the command; returns the exit status of the process: 0 it was told to
   end, or there was nothing to do; 1 the service was gone for too long; 2 wrong use; 3 the service
   refuses this worker. */
int worker_command(int n_arguments, char **arguments);

#endif
