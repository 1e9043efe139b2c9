/*
 * token_file.h - what the files that read and write the tokens share.
 */
#ifndef SRNFD_STORE_TOKEN_FILE_H
#define SRNFD_STORE_TOKEN_FILE_H

#include "store/token.h"

#define STORE_TOKENS_HEADER "srnfd-tokens 1\n"
#define STORE_TOKEN_PATH 4096

/* DIRECTORY/NAME; STORE_IO where it is too long. */
int store_token_path(char path[STORE_TOKEN_PATH], const char *directory, const char *name);

#endif
