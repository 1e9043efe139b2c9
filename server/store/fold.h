/*
 * fold.h - folded(text) of SQL (fold.c).
 */
#ifndef SRNFD_STORE_FOLD_H
#define SRNFD_STORE_FOLD_H

#include <sqlite3.h>

/* Defines it for statements of the connection. Returns what SQLite says. */
int store_fold_define(sqlite3 *db);

#endif
