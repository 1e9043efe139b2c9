/*
 * polygon.h - polygons of more than three corners: noted while a file is read, cut into triangles
 * at its end, when all vertices are known (polygon.c).
 */
#ifndef SRNF_FORMATS_POLYGON_H
#define SRNF_FORMATS_POLYGON_H

#include "formats.h"

/* Notes that the polygon whose fan ends the faces has that many corners, from its fourth one on:
   called for each corner. Errors: those of mesh_alloc. */
SRNF_CHECKED int mesh_note_polygon(struct mesh_reader *reader, size_t corners);

/* Replaces the fans of concave polygons by triangles that lie in them. Errors: those of mesh_alloc;
   SRNF_ELIMIT when the concave polygons of the file are too large together. */
SRNF_CHECKED int mesh_cut_polygons(struct mesh_reader *reader);

#endif
