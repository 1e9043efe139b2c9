/*
 * folders.c - the mesh files of a folder, in one order on every machine.
 */
#include "support/folders.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int by_name(const void *a, const void *b)
{
    return strcmp(*(char *const *)a, *(char *const *)b);
}

size_t folders_list(const char *folder, char *paths[FOLDERS_FILES_MAX])
{
    DIR *dir = opendir(folder);
    const struct dirent *entry;
    size_t n = 0;

    while (dir && n < FOLDERS_FILES_MAX && (entry = readdir(dir))) {
        size_t length = strlen(entry->d_name);
        size_t size = strlen(folder) + length + 2;

        if (length > 4 && strcmp(entry->d_name + length - 4, ".ply") == 0) {
            paths[n] = malloc(size);
            if (!paths[n]) {
                (void)fprintf(stderr, "folders: out of memory\n");
                abort();
            }
            (void)snprintf(paths[n], size, "%s/%s", folder, entry->d_name);
            n++;
        }
    }
    if (dir) {
        (void)closedir(dir);
    }
    if (n > 0) {
        qsort(paths, n, sizeof *paths, by_name);
    }
    return n;
}

const char *folders_name(const char *path)
{
    const char *slash = strrchr(path, '/');

    return slash ? slash + 1 : path;
}
