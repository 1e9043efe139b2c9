/*
 * statement.h - SQL statements: their parameters, steps, columns, and queries of readers
 * (statement.c).
 */
#ifndef SRNFD_STORE_STATEMENT_H
#define SRNFD_STORE_STATEMENT_H

#include <sqlite3.h>
#include <stddef.h>
#include <stdint.h>

struct store;
struct store_reader;

/* The STORE_* code of what the connection just answered. */
int store_map(sqlite3 *db, int rc);

/*
 * Prepares a statement and binds its parameters in order. Each letter of kinds takes its arguments:
 *   t  const char * (NULL binds NULL)    i  int64_t    d  double    b  const void *, size_t
 * The bound memory must outlive the statement. *out is NULL on error.
 */
int store_prepare(sqlite3 *db, sqlite3_stmt **out, const char *sql, const char *kinds, ...);
/* STORE_OK: there is a row; STORE_NOT_FOUND: no further row. */
int store_step(sqlite3 *db, sqlite3_stmt *statement);
/* Prepares, binds, runs to the end; *changed (may be NULL) gets the number of rows touched. */
int store_execute(sqlite3 *db, size_t *changed, const char *sql, const char *kinds, ...);
/* The same on the writer's connection, with a statement that is prepared once; sql is static. */
int store_execute_kept(struct store *store, size_t *changed, const char *sql, const char *kinds,
                       ...);
/* First column of the first row as an integer; STORE_NOT_FOUND without a row. */
int store_scalar(sqlite3 *db, int64_t *value, const char *sql);
/* First column of the first row as a text, cut to size; "" for NULL. The statement has one
   parameter, key, which may be the buffer. STORE_NOT_FOUND without a row: text stays as it is. */
int store_text(sqlite3 *db, char *text, size_t size, const char *sql, const char *key);

/* A query of a reader's connection, from the pool and back. */
struct store_query {
    struct store *store;
    struct store_reader *reader;
    sqlite3_stmt *row;
};
/* Takes a connection and prepares as store_prepare does; first: also steps to the first row. It is
   to be closed whatever the status. */
int store_query_open(struct store_query *query, struct store *store, const char *sql,
                     const char *kinds, ...);
int store_query_first(struct store_query *query, struct store *store, const char *sql,
                      const char *kinds, ...);
/* As store_step. */
int store_query_next(struct store_query *query);
void store_query_close(struct store_query *query);

/* Copies of columns: malloc, NULL for NULL; *status becomes STORE_NOMEM when memory is short. */
char *store_column_text(sqlite3_stmt *statement, int column, int *status);
void store_column_id(sqlite3_stmt *statement, int column, char *buffer, size_t size);

#endif
