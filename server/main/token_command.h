/*
 * token_command.h - `srnfd token add|list|revoke`.
 */
#ifndef SRNFD_MAIN_TOKEN_COMMAND_H
#define SRNFD_MAIN_TOKEN_COMMAND_H

/* arguments are those after "token". Returns the exit status: 0, 1 where the file could not be
   changed, 2 where the arguments are wrong. */
int token_command(int n_arguments, char **arguments);

#endif
