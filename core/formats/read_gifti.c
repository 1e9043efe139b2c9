/*
 * read_gifti.c - GIfTI surfaces (.surf.gii): the XML, read by expat.
 *
 *     <GIFTI> ... <DataArray Intent="NIFTI_INTENT_POINTSET" DataType="NIFTI_TYPE_FLOAT32"
 *         Dimensionality="2"
 *         Dim0="n" Dim1="3" ArrayIndexingOrder="RowMajorOrder" Encoding="GZipBase64Binary"
 *         Endian="LittleEndian" ...> ... <Data>...</Data></DataArray>
 *     <DataArray Intent="NIFTI_INTENT_TRIANGLE" ...> ... </DataArray> ... </GIFTI>
 *
 * Source: "GIFTI Surface Data Format", version 1.0, 2008. Needed are one point set and one array
 * of triangles; others are passed over without being decoded. The coordinates are taken as they
 * stand, as FreeSurfer and Connectome Workbench do: the CoordinateSystemTransformMatrix of the
 * point set, which would carry them to another space, is not applied. One that does more than move
 * the points is told of. External files are refused.
 *
 * What XML can do to a reader: a document type with declarations inside the file is refused at its
 * bracket, so that there are neither entities to expand nor attributes by default; the external
 * one that GIfTI files name is never fetched. The depth of elements is bounded. The input is given
 * to expat in one piece, which it reads in place and once. expat salts its hash tables itself,
 * which no result depends on.
 */
#include "gifti.h"
#include "xml.h"

#include <math.h>
#include <string.h>

#define SNIFF_BYTES ((size_t)4096)
#define MATRIX_BYTES ((size_t)2048) /* of 16 numbers; what is longer is passed over */
#define MATRIX_EQUAL 1e-6           /* of the identity, as it is written in single precision */

enum { ARRAY_POINTS, ARRAY_TRIANGLES, ARRAY_COUNT };

struct gifti {
    struct mesh_reader *reader;
    XML_Parser parser;
    int status;
    size_t depth, n_arrays;
    struct gifti_array arrays[ARRAY_COUNT];
    bool seen[ARRAY_COUNT];
    struct gifti_array *current; /* that the parser is inside of, if it is wanted */
    bool in_data, in_matrix;
    struct gifti_decoder decoder;
    unsigned char matrix[MATRIX_BYTES];
    size_t matrix_size;
};

/* ---- Arrays ---------------------------------------------------------------------------------- */

/* Which of the two arrays the Intent names, or ARRAY_COUNT. */
static size_t wanted_array(const XML_Char **pairs)
{
    for (; pairs[0]; pairs += 2) {
        if (strcmp(pairs[0], "Intent") == 0) {
            if (strcmp(pairs[1], "NIFTI_INTENT_POINTSET") == 0) {
                return ARRAY_POINTS;
            }
            return strcmp(pairs[1], "NIFTI_INTENT_TRIANGLE") == 0 ? ARRAY_TRIANGLES : ARRAY_COUNT;
        }
    }
    return ARRAY_COUNT;
}

static int begin_array(struct gifti *gifti, const XML_Char **pairs)
{
    size_t which = wanted_array(pairs), number = gifti->n_arrays++;
    struct gifti_array *array;
    int status = SRNF_OK;

    if (which == ARRAY_COUNT) {
        return SRNF_OK;
    }
    if (gifti->seen[which]) {
        return srnf_fail(gifti->reader->error, SRNF_EPARSE, (int64_t)number,
                         "DataArray %zu: there is another %s before it", number,
                         which == ARRAY_POINTS ? "point set" : "array of triangles");
    }
    array = &gifti->arrays[which];
    array->number = number;
    gifti->seen[which] = true;
    gifti->current = array;
    for (; pairs[0] && status == SRNF_OK; pairs += 2) {
        status = gifti_set_attribute(gifti->reader, array, pairs[0], pairs[1]);
    }
    if (status == SRNF_OK) {
        status = gifti_check_attributes(gifti->reader, array);
    }
    return status;
}

static int begin_data(struct gifti *gifti)
{
    struct gifti_array *array = gifti->current;
    bool is_points = array == &gifti->arrays[ARRAY_POINTS];
    const struct srnf_mesh_limits *limits = &gifti->reader->limits;
    size_t limit = is_points ? limits->max_vertices : limits->max_faces;
    int status;

    if (array->raw) {
        return srnf_fail(gifti->reader->error, SRNF_EPARSE, (int64_t)array->number,
                         "DataArray %zu: there is more than one Data", array->number);
    }
    status = gifti_decode_open(&gifti->decoder, gifti->reader, array, limit,
                               is_points ? "vertices" : "faces");
    gifti->in_data = true;
    return status;
}

/* The linear part of the matrix, where there are 16 numbers. */
static void end_matrix(struct gifti *gifti)
{
    struct scan scan;
    struct token word;
    double value;
    size_t n = 0;
    bool differs = false;

    gifti->in_matrix = false;
    scan_begin(&scan, gifti->matrix, gifti->matrix_size);
    while (n < 16 && scan_word(&scan, &word) && token_number(word, gifti->reader->locale, &value)) {
        double wanted = n / 4 == n % 4 ? 1.0 : 0.0;

        differs = differs || (n / 4 < 3 && n % 4 < 3 && !(fabs(value - wanted) <= MATRIX_EQUAL));
        n++;
    }
    gifti->reader->info.transform_ignored =
        gifti->reader->info.transform_ignored || (n == 16 && differs);
}

/* ---- Handlers -------------------------------------------------------------------------------- */

static void stop(struct gifti *gifti, int status)
{
    if (status != SRNF_OK && gifti->status == SRNF_OK) {
        gifti->status = status;
        (void)XML_StopParser(gifti->parser, XML_FALSE);
    }
}

static void on_start(void *user, const XML_Char *name, const XML_Char **pairs)
{
    struct gifti *gifti = user;
    int status = SRNF_OK;

    if (gifti->status != SRNF_OK) {
        return;
    }
    gifti->depth++;
    status = mesh_step(gifti->reader);
    if (status != SRNF_OK) {
        stop(gifti, status);
        return;
    }
    if (gifti->depth == 1 && strcmp(name, "GIFTI") != 0) {
        status = srnf_fail(gifti->reader->error, SRNF_EPARSE, 0, "the root element is not GIFTI");
    } else if (gifti->depth > XML_DEPTH_MAX) {
        status = srnf_fail(gifti->reader->error, SRNF_ELIMIT, XML_DEPTH_MAX,
                           "XML elements are nested deeper than %d", XML_DEPTH_MAX);
    } else if (gifti->in_data) {
        status = srnf_fail(gifti->reader->error, SRNF_EPARSE, (int64_t)gifti->current->number,
                           "DataArray %zu: an element stands inside Data", gifti->current->number);
    } else if (gifti->depth == 2 && strcmp(name, "DataArray") == 0) {
        status = begin_array(gifti, pairs);
    } else if (gifti->depth == 3 && gifti->current && strcmp(name, "Data") == 0) {
        status = begin_data(gifti);
    } else if (gifti->depth == 4 && gifti->current == &gifti->arrays[ARRAY_POINTS] &&
               strcmp(name, "MatrixData") == 0) {
        gifti->in_matrix = true;
        gifti->matrix_size = 0;
    }
    stop(gifti, status);
}

static void on_end(void *user, const XML_Char *name)
{
    struct gifti *gifti = user;
    int status = SRNF_OK;

    (void)name;
    if (gifti->status != SRNF_OK) {
        return;
    }
    if (gifti->in_data) {
        status = gifti_decode_end(&gifti->decoder);
        gifti_decode_close(&gifti->decoder);
        gifti->in_data = false;
    }
    if (gifti->in_matrix && gifti->depth == 4) {
        end_matrix(gifti);
    }
    gifti->depth--;
    if (gifti->depth == 1) {
        gifti->current = NULL;
    }
    stop(gifti, status);
}

static void on_text(void *user, const XML_Char *text, int size)
{
    struct gifti *gifti = user;

    stop(gifti, gifti->status == SRNF_OK ? mesh_step(gifti->reader) : gifti->status);
    if (gifti->status == SRNF_OK && gifti->in_data) {
        stop(gifti, gifti_decode(&gifti->decoder, (const unsigned char *)text, (size_t)size));
    } else if (gifti->status == SRNF_OK && gifti->in_matrix && size > 0 &&
               (size_t)size <= MATRIX_BYTES - gifti->matrix_size) {
        memcpy(gifti->matrix + gifti->matrix_size, text, (size_t)size);
        gifti->matrix_size += (size_t)size;
    }
}

static void on_doctype(void *user, const XML_Char *name, const XML_Char *system,
                       const XML_Char *public, int has_internal_subset)
{
    struct gifti *gifti = user;

    (void)name;
    (void)system;
    (void)public;
    if (has_internal_subset) {
        stop(gifti, xml_refuse_declarations(gifti->reader));
    }
}

/* ---- The file -------------------------------------------------------------------------------- */

static bool contains(const unsigned char *bytes, size_t size, const char *text)
{
    return memmem(bytes, size < SNIFF_BYTES ? size : SNIFF_BYTES, text, strlen(text)) != NULL;
}

bool mesh_sniff_gifti(const unsigned char *bytes, size_t size)
{
    struct scan scan;
    struct token word;

    scan_sniff(&scan, bytes, size);
    return scan_word(&scan, &word) && word.text[0] == '<' &&
           (contains(bytes, size, "<GIFTI") || contains(bytes, size, "<!DOCTYPE GIFTI"));
}

static int parse(struct gifti *gifti)
{
    int status = xml_open(gifti->reader, &gifti->parser);

    if (status != SRNF_OK) {
        return status;
    }
    XML_SetUserData(gifti->parser, gifti);
    XML_SetElementHandler(gifti->parser, on_start, on_end);
    XML_SetCharacterDataHandler(gifti->parser, on_text);
    XML_SetStartDoctypeDeclHandler(gifti->parser, on_doctype);
    xml_parse(gifti->reader, gifti->parser, &gifti->status);
    gifti_decode_close(&gifti->decoder);
    XML_ParserFree(gifti->parser);
    return gifti->status;
}

static int add_vertices(struct mesh_reader *reader, const struct gifti_array *points)
{
    int status = SRNF_OK;

    for (size_t i = 0; i < (size_t)points->rows && status == SRNF_OK; i++) {
        double position[3];

        for (size_t k = 0; k < 3; k++) {
            position[k] = gifti_value(points, i, k);
        }
        status = mesh_add_vertex(reader, position);
    }
    return status;
}

static int add_faces(struct mesh_reader *reader, const struct gifti_array *triangles)
{
    int status = SRNF_OK;

    for (size_t i = 0; i < (size_t)triangles->rows; i++) {
        for (size_t k = 0; k < 3 && status == SRNF_OK; k++) {
            int64_t index = 0;

            if (!gifti_index(triangles, i, k, &index)) {
                status = srnf_fail(reader->error, SRNF_EPARSE, (int64_t)i,
                                   "face %zu: an index is not a whole number", i);
            } else {
                status = mesh_add_corner(reader, i, k, index);
            }
        }
    }
    return status;
}

/* Two arrays become a mesh; the points are given back before the faces are made. */
static int build(struct gifti *gifti)
{
    struct mesh_reader *reader = gifti->reader;
    struct gifti_array *points = &gifti->arrays[ARRAY_POINTS];
    struct gifti_array *triangles = &gifti->arrays[ARRAY_TRIANGLES];
    int status;

    if (!points->raw || !triangles->raw) {
        return srnf_fail(reader->error, SRNF_EPARSE, -1, "the file has no %s with data",
                         points->raw ? "array of triangles" : "point set");
    }
    status = mesh_expect(reader, (size_t)points->rows, 0);
    if (status == SRNF_OK) {
        status = add_vertices(reader, points);
    }
    mesh_release(reader, points->raw, points->size, 1);
    points->raw = NULL;
    if (status == SRNF_OK) {
        status = mesh_expect(reader, (size_t)points->rows, (size_t)triangles->rows);
    }
    if (status == SRNF_OK) {
        status = add_faces(reader, triangles);
    }
    return status;
}

int mesh_read_gifti(struct mesh_reader *reader)
{
    struct gifti *gifti = mesh_alloc(reader, 1, sizeof *gifti);
    int status;

    if (!gifti) {
        return reader->status;
    }
    gifti->reader = reader;
    status = parse(gifti);
    if (status == SRNF_OK) {
        status = build(gifti);
    }
    for (size_t i = 0; i < ARRAY_COUNT; i++) {
        mesh_release(reader, gifti->arrays[i].raw, gifti->arrays[i].size, 1);
    }
    mesh_release(reader, gifti, 1, sizeof *gifti);
    return status;
}
