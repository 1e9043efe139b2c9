/*
 * ui.h - files of the dashboard for those who make something of them.
 */
#ifndef SRNFD_API_UI_H
#define SRNFD_API_UI_H

#include <stddef.h>

/* The file of that name in web/dist, unpacked (malloc); NULL: no memory, or there is none. */
unsigned char *ui_unpacked(const char *name, size_t *size);

#endif
