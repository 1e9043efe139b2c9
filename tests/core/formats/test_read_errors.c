/*
 * test_read_errors.c - wrong inputs of each format: the status, the element, and a message that
 * names it. Also what is no error: polygons, strips, numbers in unusual spellings.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <locale.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <zlib.h>

#include "srnf.h"
#include "support/mesh_files.h"

#define ANY (-2)

/* A wrong text, and what must be said of it: part of the message, and the element unless ANY. */
struct wrong {
    enum srnf_mesh_format format;
    const char *text;
    int status;
    int64_t element;
    const char *message;
};

static void check_wrong(const struct wrong *wrong, const void *bytes, size_t size)
{
    struct srnf_mesh mesh;
    struct srnf_error error = {0};
    int status = srnf_mesh_read(bytes, size, wrong->format, NULL, &mesh, NULL, &error);

    if (status != wrong->status || !strstr(error.message, wrong->message) ||
        (wrong->element != ANY && error.element != wrong->element)) {
        fail_msg("expected %d '%s' at %lld, but got %d '%s' at %lld", wrong->status, wrong->message,
                 (long long)wrong->element, status, error.message, (long long)error.element);
    }
    assert_int_equal(error.status, status);
    assert_null(mesh.vertices);
    assert_null(mesh.faces);
    /* Nobody has to ask for the details. */
    assert_int_equal(srnf_mesh_read(bytes, size, wrong->format, NULL, &mesh, NULL, NULL), status);
}

static void check_table(const struct wrong *table, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        check_wrong(&table[i], table[i].text, strlen(table[i].text));
    }
}
#define CHECK_TABLE(table) check_table(table, sizeof table / sizeof table[0])

static void test_strangers(void **state)
{
    static const struct wrong table[] = {
        {SRNF_MESH_UNKNOWN, "", SRNF_EFORMAT, -1, "empty"},
        {SRNF_MESH_PLY, "", SRNF_EFORMAT, -1, "empty"},
        {SRNF_MESH_OBJ, " \n\t", SRNF_EFORMAT, -1, "white space"},
        {SRNF_MESH_UNKNOWN, "<!DOCTYPE html><html></html>", SRNF_EFORMAT, -1, "HTML"},
        {SRNF_MESH_STL, "\n <HTML><body>", SRNF_EFORMAT, -1, "HTML"},
        {SRNF_MESH_GIFTI, "<!doctype HTML>", SRNF_EFORMAT, -1, "HTML"},
        {SRNF_MESH_UNKNOWN, "<VTKFile type=\"ImageData\">", SRNF_EFORMAT, -1, "another type than"},
        {SRNF_MESH_VTP, "<VTKFile type=\"UnstructuredGrid\"/>", SRNF_EFORMAT, -1,
         "extract the surf"},
        {SRNF_MESH_UNKNOWN, "PK\x03\x04", SRNF_EFORMAT, -1, "this is a zip archive"},
        {SRNF_MESH_UNKNOWN,
         "\xff\xfe"
         "1",
         SRNF_EFORMAT, -1, "text in UTF-16"},
        {SRNF_MESH_UNKNOWN, "\xfe\xff", SRNF_EFORMAT, -1, "text in UTF-16"},
        {SRNF_MESH_GMSH, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\nword\n", SRNF_EPARSE, 35,
         "byte 35: 'word' stands where"},
        {SRNF_MESH_PLY, "PK\x03\x04...3D/3dmodel.model", SRNF_EFORMAT, -1, "3MF"},
        {SRNF_MESH_UNKNOWN, "7z\xbc\xaf\x27\x1c", SRNF_EFORMAT, -1, "7z archive"},
        {SRNF_MESH_UNKNOWN, "%PDF-1.4", SRNF_EFORMAT, -1, "PDF"},
        {SRNF_MESH_UNKNOWN, "\x89PNG", SRNF_EFORMAT, -1, "an image (PNG)"},
        {SRNF_MESH_UNKNOWN, "BLENDER-v304", SRNF_EFORMAT, -1, "export the object"},
        {SRNF_MESH_UNKNOWN, "; FBX 7.4.0", SRNF_EFORMAT, -1, "FBX"},
        {SRNF_MESH_UNKNOWN, "ISO-10303-21;", SRNF_EFORMAT, -1, "STEP"},
        {SRNF_MESH_UNKNOWN, "#usda 1.0", SRNF_EFORMAT, -1, "USD"},
        {SRNF_MESH_UNKNOWN, "<?xml version=\"1.0\"?>\n<COLLADA>", SRNF_EFORMAT, -1, "Collada"},
        {SRNF_MESH_UNKNOWN, "<?xml version=\"1.0\"?>\n<X3D>", SRNF_EFORMAT, -1, "X3D"},
        {SRNF_MESH_UNKNOWN, "<?xml version=\"1.0\"?>\n<other>", SRNF_EFORMAT, -1,
         "neither GIfTI nor"},
        {SRNF_MESH_UNKNOWN, "OCTM", SRNF_EFORMAT, -1, "OpenCTM"},
        {SRNF_MESH_UNKNOWN, "NRRD0004", SRNF_EFORMAT, -1, "a volume (NRRD)"},
        {SRNF_MESH_UNKNOWN, "\x1f\x8b\x08", SRNF_EPARSE, ANY, "gzip file is cut"},
        {SRNF_MESH_UNKNOWN, "glTF", SRNF_EPARSE, 0, "begins with glTF"},
        {SRNF_MESH_GLB, "v 0 0 0", SRNF_EPARSE, 0, "begins with glTF"},
        {SRNF_MESH_UNKNOWN, "\xff\xff\xff", SRNF_EFORMAT, -1, "quadrangle"},
        {SRNF_MESH_UNKNOWN, "some words, not a mesh", SRNF_EFORMAT, -1, "no known mesh format"},
        {SRNF_MESH_UNKNOWN, "v\nf 1 2 3", SRNF_EFORMAT, -1, "no known mesh format"},
        {SRNF_MESH_UNKNOWN, "COFFEE 1 2 3", SRNF_EFORMAT, -1, "no known mesh format"},
        {SRNF_MESH_UNKNOWN, "{\"a\":1}", SRNF_EFORMAT, -1, "this is JSON"},
        {(enum srnf_mesh_format)99, "ply\n", SRNF_EINVAL, -1, "no such"},
    };

    (void)state;
    CHECK_TABLE(table);
    assert_int_equal(srnf_mesh_sniff(NULL, 5), SRNF_MESH_UNKNOWN);
}

#define PLY "ply\nformat ascii 1.0\n"
#define PLY_XYZ "property float x\nproperty float y\nproperty float z\n"
#define PLY_LIST "property list uchar int vertex_indices\nend_header\n"
#define PLY_3_1 PLY "element vertex 3\n" PLY_XYZ "element face 1\n" PLY_LIST

static void test_ply(void **state)
{
    static const struct wrong table[] = {
        {SRNF_MESH_PLY, "plx\n", SRNF_EPARSE, 0, "begins with"},
        {SRNF_MESH_PLY, "ply\nformat ascii 2.0\n", SRNF_EPARSE, ANY, "version '2.0'"},
        {SRNF_MESH_PLY, "ply\nformat ascii\n", SRNF_EPARSE, ANY, "incomplete"},
        {SRNF_MESH_PLY, PLY "element vertex 3\n", SRNF_EPARSE, ANY, "before end_header"},
        {SRNF_MESH_PLY, "ply\nelement vertex 0\nend_header\n", SRNF_EPARSE, ANY, "one format line"},
        {SRNF_MESH_PLY, PLY "element vertex 0\nend_header\n", SRNF_EPARSE, ANY, "x, y and z"},
        {SRNF_MESH_PLY, PLY "element vertex\n", SRNF_EPARSE, 0, "element 0"},
        {SRNF_MESH_PLY, PLY "element vertex -3\n", SRNF_EPARSE, 0, "element 0"},
        {SRNF_MESH_PLY, PLY "property float x\n", SRNF_EPARSE, ANY, "before any element"},
        {SRNF_MESH_PLY, PLY "element vertex 1\nproperty complex x\n", SRNF_EPARSE, 0, "complex"},
        {SRNF_MESH_PLY, PLY "hello\n", SRNF_EPARSE, ANY, "'hello'"},
        {SRNF_MESH_PLY, PLY "element vertex 3\n" PLY_XYZ "end_header\n0 0 0 1 0 0 0 1 0",
         SRNF_EPARSE, ANY, "one element face"},
        {SRNF_MESH_PLY,
         PLY "element vertex 3\n" PLY_XYZ "property float x\nelement face 1\n" PLY_LIST,
         SRNF_EPARSE, ANY, "once each"},
        {SRNF_MESH_PLY,
         PLY "element vertex 3\n" PLY_XYZ "element face 1\nproperty int a\nend_header\n",
         SRNF_EPARSE, ANY, "vertex_indices"},
        {SRNF_MESH_PLY, PLY_3_1 "0 0 0 1 0 0 0 1 0\n3 0 1 99\n", SRNF_EPARSE, 0,
         "face 0: index 99 is not below the 3 vertices"},
        {SRNF_MESH_PLY, PLY_3_1 "0 0 0 1 0 0 0 1 0\n3 0 1 -2\n", SRNF_EPARSE, 0, "negative"},
        {SRNF_MESH_PLY, PLY_3_1 "0 0 0 1 0 0 0 1 0\n3 0 1 1.5\n", SRNF_EPARSE, 0, "whole number"},
        {SRNF_MESH_PLY, PLY_3_1 "0 0 0 1 0 0 0 1 0\n2 0 1    \n", SRNF_EPARSE, 0, "2 corners"},
        {SRNF_MESH_PLY, PLY_3_1 "0 0 0 1 0 0 0 1 0\n-1 0 1  \n", SRNF_EPARSE, 0, "negative"},
        {SRNF_MESH_PLY, PLY_3_1 "0 0 0 1 nan 0 0 1 0\n3 0 1 2\n", SRNF_EPARSE, 1,
         "vertex 1: coordinate y is not finite"},
        {SRNF_MESH_PLY, PLY_3_1 "0 0 0 1 0 0 0 1 -inf\n3 0 1 2\n", SRNF_EPARSE, 2,
         "vertex 2: coordinate z is not finite"},
        {SRNF_MESH_PLY, PLY_3_1 "0 0 0 1 0 0 1e999 1 0\n3 0 1 2\n", SRNF_EPARSE, 2, "coordinate x"},
        {SRNF_MESH_PLY, PLY_3_1 "0 0 0 1 zero 0 0 1 0\n3 0 1 2\n", SRNF_EPARSE, 1,
         "vertex 1: 'zero' is not a number"},
        {SRNF_MESH_PLY, PLY_3_1 "0 0 0 1 0x10 0 0 1 0\n3 0 1 2\n", SRNF_EPARSE, 1, "'0x10'"},
        {SRNF_MESH_PLY, PLY_3_1 "0 0 0 1 1,5 0 0 1 0\n3 0 1 2\n", SRNF_EPARSE, 1, "'1,5'"},
        {SRNF_MESH_PLY, PLY_3_1 "0.000000000 0.000000000 0.000000000 1\n", SRNF_EPARSE, 1,
         "the file ends in vertex 1 of 3"},
        {SRNF_MESH_PLY, PLY_3_1 "0 0 0 1 0 0 0 1 0\n3 0 1 2\n3 0 1 2\n", SRNF_EPARSE, ANY,
         "follows"},
        {SRNF_MESH_PLY,
         PLY "element vertex 3\n" PLY_XYZ "element face 1000000000\n" PLY_LIST
             "0 0 0 1 0 0 0 1 0\n3 0 1 2",
         SRNF_EPARSE, 1, "promises 1000000000 faces"},
        {SRNF_MESH_PLY, PLY "element vertex 99999999999999999999\n", SRNF_EPARSE, 0, "count"},
        {SRNF_MESH_PLY, PLY "element vertex 0\n" PLY_XYZ "element face 0\n" PLY_LIST, SRNF_EPARSE,
         ANY, "no vertices"},
        {SRNF_MESH_PLY, PLY "element vertex 1\n" PLY_XYZ "element face 0\n" PLY_LIST "0 0 0",
         SRNF_EPARSE, ANY, "no faces"},
    };

    (void)state;
    CHECK_TABLE(table);
}

static void test_obj_off(void **state)
{
    static const struct wrong table[] = {
        {SRNF_MESH_OBJ, "v 0 0\n", SRNF_EPARSE, 0, "vertex 0: coordinate z is missing"},
        {SRNF_MESH_OBJ, "v 0 0 0\nv 0 a 0\n", SRNF_EPARSE, 1, "vertex 1: 'a' is not a number"},
        {SRNF_MESH_OBJ, "v 0 0 0\nv 0 0 infinity\n", SRNF_EPARSE, 1, "coordinate z is not finite"},
        {SRNF_MESH_OBJ, "v 0 0 0\nf 1 1 2\n", SRNF_EPARSE, 0,
         "face 0: index 2 is above the 1 vertices"},
        {SRNF_MESH_OBJ, "v 0 0 0\nf 1 1 1\nf 0 1 1\n", SRNF_EPARSE, 1, "counts from 1"},
        {SRNF_MESH_OBJ, "v 0 0 0\nf 1 1 -2\n", SRNF_EPARSE, 0, "beyond the first"},
        {SRNF_MESH_OBJ, "v 0 0 0\nf 1 1\n", SRNF_EPARSE, 0, "2 corners"},
        {SRNF_MESH_OBJ, "v 0 0 0\nf\n", SRNF_EPARSE, 0, "0 corners"},
        {SRNF_MESH_OBJ, "v 0 0 0\nf 1 x/1 1\n", SRNF_EPARSE, 0, "'x/1' is not an index"},
        {SRNF_MESH_OBJ, "v 0 0 0\nf 9223372036854775808 1 1\n", SRNF_EPARSE, 0, "is not an index"},
        {SRNF_MESH_OBJ, "v 0 0 0\n", SRNF_EPARSE, ANY, "no faces"},
        {SRNF_MESH_OBJ, "hello\n", SRNF_EPARSE, ANY, "no vertices"},
        {SRNF_MESH_OFF, "ONN\n", SRNF_EPARSE, 0, "begins with the word OFF"},
        {SRNF_MESH_OFF, "4OFF\n1 1 1\n", SRNF_EPARSE, 0, "three dimensions"},
        {SRNF_MESH_OFF, "OFF BINARY\n", SRNF_EPARSE, 0, "binary"},
        {SRNF_MESH_OFF, "OFF\n3\n", SRNF_EPARSE, ANY, "numbers of vertices"},
        {SRNF_MESH_OFF, "OFF\n-3 1 0\n", SRNF_EPARSE, ANY, "promises -3 vertices"},
        {SRNF_MESH_OFF, "OFF\n1 1000000000 0\n0 0 0\n3 0 0 0\n", SRNF_EPARSE, ANY,
         "1000000000 faces"},
        {SRNF_MESH_OFF, "OFF\n1 1 0\n0 0\n3 0 0 0   \n", SRNF_EPARSE, 0, "vertex 0: coordinate z"},
        {SRNF_MESH_OFF, "OFF\n1 1 0\n0 b 0\n3 0 0 0\n", SRNF_EPARSE, 0, "'b'"},
        {SRNF_MESH_OFF, "OFF\n1 1 0\n0 nan 0\n3 0 0 0\n", SRNF_EPARSE, 0, "not finite"},
        {SRNF_MESH_OFF, "OFF\n1 1 0\n0 0 0\n3 0 0\n   ", SRNF_EPARSE, 0, "corner 2 of 3"},
        {SRNF_MESH_OFF, "OFF\n1 1 0\n0 0 0\n3 0 0 1\n", SRNF_EPARSE, 0,
         "index 1 is not below the 1"},
        {SRNF_MESH_OFF, "OFF\n1 1 0\n0 0 0\n1 0 0 0\n", SRNF_EPARSE, 0, "1 corners"},
        {SRNF_MESH_OFF, "OFF\n1 1 0\n0 0 0\nx 0 0 0\n", SRNF_EPARSE, 0, "number of corners"},
        {SRNF_MESH_OFF, "OFF\n1 1 0\n0 0 0\n3 0 0 0\nmore\n", SRNF_EPARSE, ANY, "follows"},
        {SRNF_MESH_OFF, "OFF\n2 1 0\n0.0000000 0.0000000 0.0000000\n", SRNF_EPARSE, 1,
         "the file ends in vertex 1 of 2"},
    };

    (void)state;
    CHECK_TABLE(table);
}

#define FACET \
    "facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop endfacet\n"

static void test_stl_vtk(void **state)
{
    static const struct wrong table[] = {
        {SRNF_MESH_STL, "solid a\n" FACET, SRNF_EPARSE, 1, "without 'endsolid'"},
        {SRNF_MESH_STL, "solid a\n" FACET "facet normal 0 0 1 outer", SRNF_EPARSE, 1,
         "ends in face 1"},
        {SRNF_MESH_STL, "solid a\n" FACET "endsolid a\nhello", SRNF_EPARSE, ANY, "outside a solid"},
        {SRNF_MESH_STL, "solid a\nfacet normal 0 0 1 inner loop", SRNF_EPARSE, 0, "'outer' should"},
        {SRNF_MESH_STL, "solid a\nfacet normal 0 0 1 outer loop vertex 0 q 0", SRNF_EPARSE, 0,
         "'q'"},
        {SRNF_MESH_STL, "solid a\nfacet normal 0 0 1 outer loop vertex 0 inf 0", SRNF_EPARSE, 0,
         "not finite"},
        {SRNF_MESH_STL, "solid a\nendsolid a\n", SRNF_EPARSE, ANY, "no vertices"},
        {SRNF_MESH_STL, "short", SRNF_EPARSE, 5, "header of 84 bytes"},
        {SRNF_MESH_VTK, "# vtk\n", SRNF_EPARSE, 0, "begins with"},
        {SRNF_MESH_VTK, "# vtk DataFile Version 3.0\n", SRNF_EPARSE, ANY, "ends in the VTK header"},
        {SRNF_MESH_VTK, "# vtk DataFile Version 3.0\nt\nTEXT\n", SRNF_EPARSE, ANY,
         "ASCII or BINARY"},
        {SRNF_MESH_VTK, "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_GRID\n",
         SRNF_EPARSE, ANY, "not the dataset POLYDATA"},
#define VTK "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\n"
#define VTK_3 VTK "POINTS 3 float\n0 0 0 1 0 0 0 1 0\n"
        {SRNF_MESH_VTK, VTK, SRNF_EPARSE, ANY, "no vertices"},
        {SRNF_MESH_VTK, VTK_3, SRNF_EPARSE, ANY, "no faces"},
        {SRNF_MESH_VTK, VTK "POLYGONS 1 4\n3 0 1 2\n", SRNF_EPARSE, ANY, "before POINTS"},
        {SRNF_MESH_VTK, VTK "POINTS 3 bit\n", SRNF_EPARSE, ANY, "'bit'"},
        {SRNF_MESH_VTK, VTK "POINTS x float\n", SRNF_EPARSE, ANY, "POINTS"},
        {SRNF_MESH_VTK, VTK "POINTS 1000000000 float\n0 0 0\n", SRNF_EPARSE, ANY,
         "1000000000 vertices"},
        {SRNF_MESH_VTK, VTK_3 "POINTS 3 float\n0 0 0 1 0 0 0 1 0\n", SRNF_EPARSE, ANY, "two such"},
        {SRNF_MESH_VTK, VTK "POINTS 3 float\n0 0 0 1 nan 0 0 1 0\n", SRNF_EPARSE, 1, "not finite"},
        {SRNF_MESH_VTK, VTK "POINTS 3 float\n0 0 0 1 k 0 0 1 0\n", SRNF_EPARSE, 1, "vertex 1: 'k'"},
        {SRNF_MESH_VTK, VTK_3 "POLYGONS 1 4\n3 0 1 3\n", SRNF_EPARSE, 0, "face 0: index 3"},
        {SRNF_MESH_VTK, VTK_3 "POLYGONS 1 4\n2 0 1 2\n", SRNF_EPARSE, 0, "2 corners"},
        {SRNF_MESH_VTK, VTK_3 "POLYGONS 1 4\n4 0 1 2\n", SRNF_EPARSE, 0, "4 corners, but"},
        {SRNF_MESH_VTK, VTK_3 "POLYGONS 1 5\n3 0 1 2 2\n", SRNF_EPARSE, ANY, "1 numbers are left"},
        {SRNF_MESH_VTK, VTK_3 "POLYGONS 2 4\n3 0 1 2\n", SRNF_EPARSE, 1, "end before it"},
        {SRNF_MESH_VTK, VTK_3 "POLYGONS 9 4\n3 0 1 2\n", SRNF_EPARSE, ANY, "cannot make 9 cells"},
        {SRNF_MESH_VTK, VTK_3 "POLYGONS 1 400\n3 0 1 2\n", SRNF_EPARSE, ANY, "promises 400"},
        {SRNF_MESH_VTK, VTK_3 "POLYGONS 2 3\nOFFSETS int\n1 3\nCONNECTIVITY int\n0 1 2\n",
         SRNF_EPARSE, 0, "offset 0"},
        {SRNF_MESH_VTK, VTK_3 "POLYGONS 3 3\nOFFSETS int\n0 3 1\nCONNECTIVITY int\n0 1 2\n",
         SRNF_EPARSE, 1, "-2 corners"},
        {SRNF_MESH_VTK, VTK_3 "POLYGONS 2 3\nOFFSETS int\n0 4\nCONNECTIVITY int\n0 1 2\n",
         SRNF_EPARSE, 0, "4 corners, but"},
        {SRNF_MESH_VTK, VTK_3 "POLYGONS 2 3\nOFFSETS int\n0 3\n0 1 2\n", SRNF_EPARSE, ANY,
         "CONNECTIVITY"},
        {SRNF_MESH_VTK, VTK_3 "hello", SRNF_EPARSE, ANY, "'hello'"},
    };

    (void)state;
    CHECK_TABLE(table);
}

#define GII_POINTS(more) "<DataArray Intent=\"NIFTI_INTENT_POINTSET\" " more
#define GII_ASCII "DataType=\"NIFTI_TYPE_FLOAT32\" Encoding=\"ASCII\" Dim1=\"3\" "
#define GII_BASE64 \
    "DataType=\"NIFTI_TYPE_FLOAT32\" Encoding=\"Base64Binary\" Dim0=\"1\" Dim1=\"3\">"
#define GII_3 GII_POINTS(GII_ASCII "Dim0=\"3\"><Data>0 0 0 1 0 0 0 1 0</Data></DataArray>")
#define GII_FACES(data)                                                               \
    "<DataArray Intent=\"NIFTI_INTENT_TRIANGLE\" " GII_ASCII "Dim0=\"1\"><Data>" data \
    "</Data></DataArray>"

static void test_gifti(void **state)
{
    static const struct wrong table[] = {
        {SRNF_MESH_GIFTI, "<a></a>", SRNF_EPARSE, 0, "root element"},
        {SRNF_MESH_GIFTI, "<GIFTI>", SRNF_EPARSE, ANY, "XML, line 1"},
        {SRNF_MESH_GIFTI, "<GIFTI></GIFTI>", SRNF_EPARSE, ANY, "no point set"},
        {SRNF_MESH_GIFTI, "<GIFTI>" GII_3 "</GIFTI>", SRNF_EPARSE, ANY, "no array of triangles"},
        {SRNF_MESH_GIFTI, "<GIFTI>" GII_3 GII_3, SRNF_EPARSE, 1, "another point set"},
        {SRNF_MESH_GIFTI, "<GIFTI>" GII_3 GII_FACES("0 1 3") "</GIFTI>", SRNF_EPARSE, 0,
         "face 0: index 3"},
        {SRNF_MESH_GIFTI, "<GIFTI>" GII_3 GII_FACES("0 1 .5") "</GIFTI>", SRNF_EPARSE, 0, "whole"},
        {SRNF_MESH_GIFTI, "<GIFTI>" GII_3 GII_FACES("0 1") "</GIFTI>", SRNF_EPARSE, 1,
         "2 of 3 numbers"},
        {SRNF_MESH_GIFTI, "<GIFTI>" GII_3 GII_FACES("0 1 2 0") "</GIFTI>", SRNF_EPARSE, 1,
         "more data"},
        {SRNF_MESH_GIFTI, "<GIFTI>" GII_3 GII_FACES("0 one 2") "</GIFTI>", SRNF_EPARSE, 1, "'one'"},
        {SRNF_MESH_GIFTI, "<GIFTI>" GII_POINTS("><Data>"), SRNF_EPARSE, 0, "is missing"},
        {SRNF_MESH_GIFTI, "<GIFTI>" GII_POINTS("DataType=\"NIFTI_TYPE_RGB24\">"), SRNF_EPARSE, 0,
         "RGB24"},
        {SRNF_MESH_GIFTI, "<GIFTI>" GII_POINTS("Encoding=\"ExternalFileBinary\">"), SRNF_EPARSE, 0,
         "ExternalFileBinary"},
        {SRNF_MESH_GIFTI, "<GIFTI>" GII_POINTS("Dim1=\"2\">"), SRNF_EPARSE, 0, "Dim1 '2'"},
        {SRNF_MESH_GIFTI, "<GIFTI>" GII_POINTS(GII_ASCII "Dim0=\"1000000000\"><Data>"), SRNF_EPARSE,
         ANY, "1000000000 vertices"},
        {SRNF_MESH_GIFTI, "<GIFTI>" GII_POINTS(GII_BASE64 "<Data>AAA%"), SRNF_EPARSE, 0, "Base64"},
        {SRNF_MESH_GIFTI, "<GIFTI>" GII_POINTS(GII_BASE64 "<Data>AA==A"), SRNF_EPARSE, 0, "Base64"},
        {SRNF_MESH_GIFTI, "<GIFTI>" GII_POINTS(GII_BASE64 "<Data>AAAAAAAAAAAAAAAAAAAA</Data>"),
         SRNF_EPARSE, 0, "more data"},
        {SRNF_MESH_GIFTI, "<GIFTI>" GII_POINTS(GII_BASE64 "<Data><b/>"), SRNF_EPARSE, 0,
         "inside Data"},
        {SRNF_MESH_GIFTI, "<!DOCTYPE GIFTI [<!ENTITY a \"b\">]><GIFTI/>", SRNF_EPARSE, ANY,
         "refused"},
        {SRNF_MESH_GIFTI, "<!DOCTYPE GIFTI [<!ATTLIST GIFTI a CDATA \"b\">]><GIFTI/>", SRNF_EPARSE,
         ANY, "refused"},
        {SRNF_MESH_GIFTI, "<GIFTI>&a;</GIFTI>", SRNF_EPARSE, ANY, "XML"},
        {SRNF_MESH_FREESURFER, "\xff\xff", SRNF_EPARSE, 0, "ff ff fe"},
        {SRNF_MESH_FREESURFER, "\xff\xff\xfetext\n\n", SRNF_EPARSE, ANY,
         "ends in the FreeSurfer header"},
    };

    (void)state;
    CHECK_TABLE(table);
}

/* Everything in the binary formats that a text cannot show. */
static void test_binary(void **state)
{
    static const struct wrong stl_short = {SRNF_MESH_STL, NULL, SRNF_EPARSE, 3, "promises 4 faces"};
    static const struct wrong fs_index = {SRNF_MESH_FREESURFER, NULL, SRNF_EPARSE, 3, "index 7"};
    static const struct wrong fs_huge = {SRNF_MESH_FREESURFER, NULL, SRNF_EPARSE, ANY, "vertices"};
    struct srnf_mesh sample = mesh_file_sample();

    (void)state;
    for (const struct mesh_file_kind *kind = mesh_file_kinds; kind->label; kind++) {
        struct srnf_buffer file = {0};

        kind->make(&sample, &file);
        if (strcmp(kind->label, "stl-binary") == 0) {
            check_wrong(&stl_short, file.data, file.size - 1);
        }
        if (strcmp(kind->label, "freesurfer") == 0) {
            file.data[file.size - 1] = 7;
            check_wrong(&fs_index, file.data, file.size);
            file.data[3 + strlen("created by nobody, never\n\n")] = 0x7f;
            check_wrong(&fs_huge, file.data, file.size);
        }
        srnf_buffer_clear(&file);
    }
    srnf_mesh_clear(&sample);
}

/* ---- What is no error ------------------------------------------------------------------------ */

static void check_faces(enum srnf_mesh_format format, const char *text, const uint32_t *faces,
                        size_t n_faces, size_t polygons)
{
    struct srnf_mesh mesh;
    struct srnf_mesh_read_info info;
    struct srnf_error error = {0};

    if (srnf_mesh_read(text, strlen(text), format, NULL, &mesh, &info, &error) != SRNF_OK) {
        fail_msg("%s", error.message);
    }
    assert_int_equal(mesh.n_faces, n_faces);
    assert_memory_equal(mesh.faces, faces, 3 * n_faces * sizeof faces[0]);
    assert_int_equal(info.polygons_triangulated, polygons);
    srnf_mesh_clear(&mesh);
}

#define PLY_5(element) PLY "element vertex 5\n" PLY_XYZ "element " element "\n" PLY_LIST
#define XYZ_5 "0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n"

static void test_polygons(void **state)
{
    static const uint32_t fan[4][3] = {{4, 3, 2}, {4, 2, 1}, {4, 1, 0}, {1, 1, 2}};
    static const uint32_t strip[3][3] = {{0, 1, 2}, {2, 1, 3}, {2, 3, 4}};
    static const uint32_t strips[2][3] = {{0, 1, 2}, {4, 3, 2}};

    (void)state;
    check_faces(SRNF_MESH_PLY, PLY_5("face 2") XYZ_5 "5 4 3 2 1 0\n3 1 1 2\n", fan[0], 4, 1);
    check_faces(SRNF_MESH_OFF, "OFF\n5 2 0\n" XYZ_5 "5 4 3 2 1 0\n3 1 1 2\n", fan[0], 4, 1);
    check_faces(SRNF_MESH_OBJ,
                "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nf 5 4 3 2 1\nf 2 2 3\n", fan[0], 4,
                1);
    check_faces(SRNF_MESH_VTK,
                VTK "POINTS 5 int\n" XYZ_5 "POLYGONS 1 6\n5 4 3 2 1 0\nPOLYGONS 1 4\n3 1 1 2\n",
                fan[0], 4, 1);
    check_faces(SRNF_MESH_VTK, VTK "POINTS 5 int\n" XYZ_5 "TRIANGLE_STRIPS 1 6\n5 0 1 2 3 4\n",
                strip[0], 3, 0);
    check_faces(SRNF_MESH_PLY, PLY_5("tristrips 1") XYZ_5 "5 0 1 2 3 4\n", strip[0], 3, 0);
    check_faces(SRNF_MESH_PLY, PLY_5("tristrips 1") XYZ_5 "8 0 1 2 -1 4 3 2 2\n", strips[0], 2, 0);
}

/* Spellings of numbers against what the C library makes of them, and in a locale with a decimal
   comma too. */
static void test_numbers(void **state)
{
    static const char *const words[] = {
        "0",
        "-0.0",
        "+1.5",
        ".5",
        "5.",
        "1e3",
        "1E-3",
        "1e+2",
        "0.1",
        "1e22",
        "1e23",
        "1e-22",
        "1e-23",
        "3.14159265358979323846",
        "9007199254740993",
        "123456789012345678901234567890",
        "4.9e-324",
        "2.2250738585072011e-308",
        "1.7976931348623157e308",
        "0.000000000000000000000000000000000001",
        "1e-400",
        "000012.50",
        "0.1000000000000000055511151231257827021181583404541015625"};

    (void)state;
    if (!setlocale(LC_ALL, "de_DE.UTF-8")) {
        print_message("# de_DE.UTF-8 is not installed: numbers are tried in the C locale only\n");
    }
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        locale_t c = newlocale(LC_ALL_MASK, "C", (locale_t)0);
        double expected = strtod_l(words[i], NULL, c);
        struct srnf_buffer file = {0};
        struct srnf_mesh mesh;

        file_print(&file, "v 0 0 0\nv %s 0 0\nf 1 1 2\n", words[i]);
        assert_int_equal(
            srnf_mesh_read(file.data, file.size, SRNF_MESH_OBJ, NULL, &mesh, NULL, NULL), SRNF_OK);
        assert_memory_equal(&mesh.vertices[3], &expected, sizeof expected);
        srnf_mesh_clear(&mesh);
        srnf_buffer_clear(&file);
        freelocale(c);
    }
    (void)setlocale(LC_ALL, "C");
}

/* ---- Limits ---------------------------------------------------------------------------------- */

static void test_limits(void **state)
{
    static const struct {
        size_t vertices, faces, memory;
        const char *message;
    } limits[] = {
        {3, 100, 1 << 20, "limit of 3 vertices"},
        {100, 3, 1 << 20, "limit of 3 faces"},
        {100, 100, 40, "limit of 40 bytes"},
    };
    struct srnf_mesh sample = mesh_file_sample();

    (void)state;
    for (const struct mesh_file_kind *kind = mesh_file_kinds; kind->label; kind++) {
        struct srnf_buffer file = {0};

        kind->make(&sample, &file);
        for (size_t i = 0; i < sizeof limits / sizeof limits[0]; i++) {
            struct srnf_mesh_limits given = {.max_vertices = limits[i].vertices,
                                             .max_faces = limits[i].faces,
                                             .max_memory = limits[i].memory};
            struct srnf_error error = {0};
            struct srnf_mesh mesh;

            assert_int_equal(srnf_mesh_read(file.data, file.size, SRNF_MESH_UNKNOWN, &given, &mesh,
                                            NULL, &error),
                             SRNF_ELIMIT);
            if (!strstr(error.message, limits[i].message)) {
                fail_msg("%s: '%s' lacks '%s'", kind->label, error.message, limits[i].message);
            }
        }
        srnf_buffer_clear(&file);
    }
    srnf_mesh_clear(&sample);
}

/* What a header may hold, however small the file: elements, properties, elements within elements,
   and numbers of a field whose product no integer holds. */
static void test_crowded_headers(void **state)
{
    static const struct wrong elements = {SRNF_MESH_PLY, NULL, SRNF_ELIMIT, 32, "32 elements"};
    static const struct wrong properties = {SRNF_MESH_PLY, NULL, SRNF_ELIMIT, 512,
                                            "512 properties"};
    static const struct wrong nested = {SRNF_MESH_GIFTI, NULL, SRNF_ELIMIT, 64, "deeper than 64"};
    static const struct wrong field = {SRNF_MESH_VTK,
                                       VTK_3 "FIELD data 1\na 4294967296 4294967296 float\n0\n",
                                       SRNF_EPARSE, ANY, "numbers of a field"};
    struct srnf_buffer file = {0};

    (void)state;
    file_print(&file, PLY);
    for (size_t i = 0; i < 33; i++) {
        file_print(&file, "element e%zu 0\n", i);
    }
    check_wrong(&elements, file.data, file.size);
    srnf_buffer_clear(&file);
    file_print(&file, PLY "element vertex 1\n");
    for (size_t i = 0; i < 513; i++) {
        file_print(&file, "property int p%zu\n", i);
    }
    check_wrong(&properties, file.data, file.size);
    srnf_buffer_clear(&file);
    file_print(&file, "<GIFTI>");
    for (size_t i = 0; i < 64; i++) {
        file_print(&file, "<MetaData>");
    }
    check_wrong(&nested, file.data, file.size);
    srnf_buffer_clear(&file);
    check_wrong(&field, field.text, strlen(field.text));
}

/* Of an element without properties there is nothing to read, whatever it promises. */
static void test_empty_element(void **state)
{
    static const char text[] = PLY "element nothing 4000000000\nelement vertex 3\n" PLY_XYZ
                                   "element face 1\n" PLY_LIST "0 0 0 1 0 0 0 1 0\n3 0 1 2\n";
    struct srnf_mesh mesh;

    (void)state;
    assert_int_equal(srnf_mesh_read(text, sizeof text - 1, SRNF_MESH_PLY, NULL, &mesh, NULL, NULL),
                     SRNF_OK);
    assert_int_equal(mesh.n_faces, 1);
    srnf_mesh_clear(&mesh);
}

/* A packed array that unpacks to more than it says: refused at the first byte too many. */
static void test_bomb(void **state)
{
    static const struct wrong wrong = {SRNF_MESH_GIFTI, NULL, SRNF_EPARSE, 0, "more data"};
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    size_t size = (size_t)32 << 20;
    unsigned char *zeros = calloc(size, 1), *packed = malloc(size);
    uLongf n = (uLongf)size;
    struct srnf_buffer file = {0};

    (void)state;
    assert_non_null(zeros);
    assert_non_null(packed);
    assert_int_equal(compress(packed, &n, zeros, (uLong)size), Z_OK);
    file_print(&file,
               "<GIFTI><DataArray Intent=\"NIFTI_INTENT_POINTSET\" DataType=\"NIFTI_TYPE_FLOAT32\" "
               "Dim0=\"4\" Dim1=\"3\" Encoding=\"GZipBase64Binary\"><Data>");
    for (size_t i = 0; i + 2 < n; i += 3) {
        uint32_t word = (uint32_t)packed[i] << 16 | (uint32_t)packed[i + 1] << 8 | packed[i + 2];

        file_print(&file, "%c%c%c%c", digits[word >> 18], digits[(word >> 12) & 63],
                   digits[(word >> 6) & 63], digits[word & 63]);
    }
    check_wrong(&wrong, file.data, file.size);
    srnf_buffer_clear(&file);
    free(zeros);
    free(packed);
}

/* Many small sections, strips or arrays must not each cost the whole file. */
static void test_linear_time(void **state)
{
    struct srnf_buffer file = {0};
    struct srnf_mesh mesh;
    clock_t start;

    (void)state;
    file_print(&file, VTK_3);
    for (size_t i = 0; i < 100000; i++) {
        file_print(&file, "POLYGONS 1 4\n3 0 1 2\n");
    }
    start = clock();
    assert_int_equal(srnf_mesh_read(file.data, file.size, SRNF_MESH_VTK, NULL, &mesh, NULL, NULL),
                     SRNF_OK);
    assert_int_equal(mesh.n_faces, 100000);
    /* Copying all faces for each section would take 60 GB of copying; this takes 0.1 s. */
    assert_true(clock() - start < 5 * CLOCKS_PER_SEC);
    srnf_mesh_clear(&mesh);
    srnf_buffer_clear(&file);
}

/* What no text has is not read to its end to find that out. */
static void test_one_word(void **state)
{
    size_t size = (size_t)64 << 20;
    char *bytes = srnf_alloc(size, 1);
    struct srnf_mesh mesh;

    (void)state;
    assert_non_null(bytes);
    for (int byte = 0; byte <= 'a'; byte += 'a') {
        clock_t start;

        memset(bytes, byte, size);
        start = clock();
        assert_int_equal(srnf_mesh_read(bytes, size, SRNF_MESH_UNKNOWN, NULL, &mesh, NULL, NULL),
                         SRNF_EFORMAT);
        /* To its end by every format that looks at it takes .7 s. */
        assert_true(clock() - start < CLOCKS_PER_SEC / 20);
    }
    srnf_free(bytes);
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_strangers),     cmocka_unit_test(test_ply),
        cmocka_unit_test(test_obj_off),       cmocka_unit_test(test_stl_vtk),
        cmocka_unit_test(test_gifti),         cmocka_unit_test(test_binary),
        cmocka_unit_test(test_polygons),      cmocka_unit_test(test_numbers),
        cmocka_unit_test(test_limits),        cmocka_unit_test(test_bomb),
        cmocka_unit_test(test_linear_time),   cmocka_unit_test(test_crowded_headers),
        cmocka_unit_test(test_empty_element), cmocka_unit_test(test_one_word),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
