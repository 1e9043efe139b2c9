/*
 * commands.h - the commands that look after a data directory: backup and check. Arguments are those
 * after the command; each returns the exit status of the process.
 */
#ifndef SRNFD_COMMANDS_H
#define SRNFD_COMMANDS_H

/* srnfd backup DIRECTORY [--link] [--data ..] [--config ..] */
int command_backup(int n_arguments, char **arguments);
/* srnfd check [--repair] [--data ..] [--config ..] */
int command_check(int n_arguments, char **arguments);

#endif
