/*
 * folders.h - the mesh files of a folder.
 */
#ifndef TESTS_FOLDERS_H
#define TESTS_FOLDERS_H

#include <stddef.h>

#define FOLDERS_FILES_MAX 400

/* Paths of the .ply files of a folder in the order of their names, to be freed one by one; 0 when
   there is no such folder. Ends the program when memory is short. */
size_t folders_list(const char *folder, char *paths[FOLDERS_FILES_MAX]);

/* The part of a path after its last slash. */
const char *folders_name(const char *path);

#endif
