/*
 * read_vtp.c - VTK's XML polydata (.vtp): the XML, read by expat.
 *
 *     <VTKFile type="PolyData" byte_order= header_type= compressor=> <PolyData>
 *       <Piece NumberOfPoints= NumberOfPolys= NumberOfStrips= ...>
 *         <Points> <DataArray NumberOfComponents="3" ...> </Points>
 *         <Polys> <DataArray Name="connectivity"> <DataArray Name="offsets"> </Polys>
 *         <Strips> ... </Strips> </Piece> ...
 *     </PolyData> <AppendedData encoding="raw"|"base64"> _... </AppendedData> </VTKFile>
 *
 * Source: VTK's wiki, "VTK XML Formats". Pieces are joined one behind the other. PointData,
 * CellData, FieldData, Verts and Lines are passed over. Compressors other than zlib are refused by
 * name.
 *
 * The parse notes where the bytes of each array are; the arrays of a piece are decoded when all is
 * known (vtp_piece.c). It ends at AppendedData, because raw data are no XML: what is behind the
 * underscore is found by the array's offset. As in GIfTI, a document type with declarations is
 * refused.
 */
#include "vtp.h"
#include "xml.h"

#include <string.h>

#define PIECES_MAX 100
#define SNIFF_BYTES ((size_t)4096)

static const char *const array_names[VTP_COUNT] = {
    "points", "the polygons' connectivity", "the polygons' offsets", "the strips' connectivity",
    "the strips' offsets"};

struct vtp {
    struct vtp_file file;
    XML_Parser parser;
    int status;
    size_t depth;
    bool polydata; /* the type has been seen */
    size_t n_pieces;
    struct vtp_piece *pieces; /* [PIECES_MAX] */
    struct vtp_piece *piece;  /* that the parser is inside of */
    int section;              /* of its arrays; -1: none that is needed */
    struct vtp_array *array;
};

static const struct scalar_name type_names[] = {
    {"Int8", SCALAR_INT8},       {"UInt8", SCALAR_UINT8},   {"Int16", SCALAR_INT16},
    {"UInt16", SCALAR_UINT16},   {"Int32", SCALAR_INT32},   {"UInt32", SCALAR_UINT32},
    {"Int64", SCALAR_INT64},     {"UInt64", SCALAR_UINT64}, {"Float32", SCALAR_FLOAT32},
    {"Float64", SCALAR_FLOAT64}, {NULL, SCALAR_NONE},
};

static void stop(struct vtp *vtp, int status)
{
    if (status != SRNF_OK && vtp->status == SRNF_OK) {
        vtp->status = status;
        (void)XML_StopParser(vtp->parser, XML_FALSE);
    }
}

static const unsigned char *token_at(const struct vtp *vtp)
{
    return vtp->file.reader->bytes + XML_GetCurrentByteIndex(vtp->parser);
}

static const unsigned char *behind_token(const struct vtp *vtp)
{
    return token_at(vtp) + XML_GetCurrentByteCount(vtp->parser);
}

static const char *attribute(const XML_Char **pairs, const char *name)
{
    for (; pairs[0]; pairs += 2) {
        if (strcmp(pairs[0], name) == 0) {
            return pairs[1];
        }
    }
    return NULL;
}

static struct token text_of(const char *value)
{
    return (struct token){(const unsigned char *)value, value ? strlen(value) : 0};
}

/* An attribute that is a count; absent: the fallback; -1 where it is none. */
static int64_t count_of(const XML_Char **pairs, const char *name, int64_t fallback)
{
    const char *value = attribute(pairs, name);
    int64_t count = -1;

    if (!value) {
        return fallback;
    }
    return token_integer(text_of(value), &count) && count >= 0 ? count : -1;
}

/* ---- Elements -------------------------------------------------------------------------------- */

static int begin_file(struct vtp *vtp, const XML_Char **pairs)
{
    const char *type = attribute(pairs, "type"), *order = attribute(pairs, "byte_order");
    const char *header = attribute(pairs, "header_type");
    const char *compressor = attribute(pairs, "compressor");
    struct srnf_error *error = vtp->file.reader->error;

    if (!type || strcmp(type, "PolyData") != 0) {
        return srnf_fail(error, SRNF_EFORMAT, -1,
                         "this is VTK's XML format of type '%s', not PolyData; extract the surface "
                         "and save it as .vtp",
                         token_quote(text_of(type)).text);
    }
    if (compressor && compressor[0] && strcmp(compressor, "vtkZLibDataCompressor") != 0) {
        return srnf_fail(error, SRNF_EFORMAT, -1,
                         "the VTP file is packed by '%s'; save it with zlib or without compression",
                         token_quote(text_of(compressor)).text);
    }
    vtp->polydata = true;
    vtp->file.zip = compressor && compressor[0];
    vtp->file.big_endian = order && strcmp(order, "BigEndian") == 0;
    vtp->file.header = header && strcmp(header, "UInt64") == 0 ? 8 : 4;
    return SRNF_OK;
}

static int begin_piece(struct vtp *vtp, const XML_Char **pairs)
{
    struct vtp_piece *piece;

    if (vtp->n_pieces == PIECES_MAX) {
        return srnf_fail(vtp->file.reader->error, SRNF_ELIMIT, -1,
                         "the VTP file has more than %d pieces", PIECES_MAX);
    }
    piece = &vtp->pieces[vtp->n_pieces++];
    piece->points = count_of(pairs, "NumberOfPoints", -1);
    piece->polys = count_of(pairs, "NumberOfPolys", 0);
    piece->strips = count_of(pairs, "NumberOfStrips", 0);
    vtp->piece = piece;
    return piece->points < 0 || piece->polys < 0 || piece->strips < 0
               ? srnf_fail(vtp->file.reader->error, SRNF_EPARSE, (int64_t)vtp->n_pieces - 1,
                           "Piece %zu: a count is missing or wrong", vtp->n_pieces - 1)
               : SRNF_OK;
}

/* Which array of the piece this is, or -1. */
static int which_array(const struct vtp *vtp, const XML_Char **pairs)
{
    const char *name = attribute(pairs, "Name");

    if (vtp->section == VTP_POINTS) {
        return VTP_POINTS;
    }
    if (vtp->section < 0 || !name) {
        return -1;
    }
    if (strcmp(name, "connectivity") == 0) {
        return vtp->section;
    }
    return strcmp(name, "offsets") == 0 ? vtp->section + 1 : -1;
}

static int begin_array(struct vtp *vtp, const XML_Char **pairs)
{
    struct srnf_error *error = vtp->file.reader->error;
    int which = which_array(vtp, pairs);
    const char *type = attribute(pairs, "type");
    struct vtp_array *array;

    if (which < 0) {
        return SRNF_OK;
    }
    array = &vtp->piece->arrays[which];
    if (array->present) {
        return srnf_fail(error, SRNF_EPARSE, -1, "DataArray of %s: there are two",
                         array_names[which]);
    }
    array->present = true;
    array->what = array_names[which];
    array->type = token_scalar(text_of(type ? type : ""), type_names);
    array->encoding = vtp_encoding_named(attribute(pairs, "format"));
    array->components = count_of(pairs, "NumberOfComponents", 1);
    array->offset = count_of(pairs, "offset", -1);
    if (array->type == SCALAR_NONE || array->encoding == VTP_NONE) {
        return srnf_fail(error, SRNF_EPARSE, -1,
                         "DataArray of %s: its type or format is missing or cannot be read",
                         array->what);
    }
    if (which == VTP_POINTS && array->components != 3) {
        return srnf_fail(error, SRNF_EPARSE, -1, "DataArray of points: %lld components, not 3",
                         (long long)array->components);
    }
    vtp->array = array;
    array->text = array->text_end = behind_token(vtp);
    return SRNF_OK;
}

/* Finds the underscore, and ends the parse. */
static int begin_appended(struct vtp *vtp, const XML_Char **pairs)
{
    const struct mesh_reader *reader = vtp->file.reader;
    const unsigned char *at = behind_token(vtp);
    const unsigned char *end = reader->bytes + reader->size;
    const char *encoding = attribute(pairs, "encoding");

    while (at < end && scan_is_space(*at)) {
        at++;
    }
    if (at == end || *at != '_') {
        return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)(at - reader->bytes),
                         "AppendedData, byte %zu: its underscore is missing",
                         (size_t)(at - reader->bytes));
    }
    vtp->file.appended = at + 1;
    vtp->file.raw = encoding && strcmp(encoding, "raw") == 0;
    (void)XML_StopParser(vtp->parser, XML_FALSE);
    return SRNF_OK;
}

static int begin_section(struct vtp *vtp, const char *name)
{
    static const struct {
        const char *name;
        int section;
    } sections[] = {
        {"Points", VTP_POINTS}, {"Polys", VTP_POLY_CORNERS}, {"Strips", VTP_STRIP_CORNERS}};

    vtp->section = -1;
    for (size_t i = 0; i < sizeof sections / sizeof sections[0]; i++) {
        if (strcmp(name, sections[i].name) == 0) {
            vtp->section = sections[i].section;
        }
    }
    return SRNF_OK;
}

/* The text of an array ends at the token here, unless it is blank so far: elements that describe
   the array stand before it or behind it. */
static void end_text(struct vtp *vtp)
{
    struct vtp_array *array = vtp->array;
    const unsigned char *at = token_at(vtp);

    if (array->text != array->text_end) {
        return;
    }
    for (const unsigned char *p = array->text; p < at; p++) {
        if (!scan_is_space(*p)) {
            array->text_end = at;
            return;
        }
    }
}

static int begin_element(struct vtp *vtp, const char *name, const XML_Char **pairs)
{
    struct srnf_error *error = vtp->file.reader->error;

    if (vtp->depth == 1) {
        return strcmp(name, "VTKFile") == 0
                   ? begin_file(vtp, pairs)
                   : srnf_fail(error, SRNF_EPARSE, 0, "the root element is not VTKFile");
    }
    if (vtp->depth > XML_DEPTH_MAX) {
        return srnf_fail(error, SRNF_ELIMIT, XML_DEPTH_MAX,
                         "XML elements are nested deeper than %d", XML_DEPTH_MAX);
    }
    if (vtp->array) {
        if (vtp->depth == 6) {
            end_text(vtp);
        }
        return SRNF_OK;
    }
    if (vtp->depth == 2 && strcmp(name, "AppendedData") == 0) {
        return begin_appended(vtp, pairs);
    }
    if (vtp->depth == 3 && strcmp(name, "Piece") == 0) {
        return begin_piece(vtp, pairs);
    }
    if (vtp->depth == 4 && vtp->piece) {
        return begin_section(vtp, name);
    }
    if (vtp->depth == 5 && vtp->piece && strcmp(name, "DataArray") == 0) {
        return begin_array(vtp, pairs);
    }
    return SRNF_OK;
}

static void on_start(void *user, const XML_Char *name, const XML_Char **pairs)
{
    struct vtp *vtp = user;
    int status;

    if (vtp->status != SRNF_OK) {
        return;
    }
    vtp->depth++;
    status = mesh_step(vtp->file.reader);
    stop(vtp, status == SRNF_OK ? begin_element(vtp, name, pairs) : status);
}

static void on_end(void *user, const XML_Char *name)
{
    struct vtp *vtp = user;

    (void)name;
    if (vtp->status != SRNF_OK || vtp->file.appended) {
        return;
    }
    if (vtp->array && vtp->depth == 5) {
        end_text(vtp);
    } else if (vtp->array && vtp->depth == 6 && vtp->array->text == vtp->array->text_end) {
        vtp->array->text = vtp->array->text_end = behind_token(vtp);
    }
    if (vtp->depth == 5) {
        vtp->array = NULL;
    }
    if (vtp->depth == 4) {
        vtp->section = -1;
    }
    if (vtp->depth == 3) {
        vtp->piece = NULL;
    }
    vtp->depth--;
}

/* Where text is, the elements around it tell. */
static void on_text(void *user, const XML_Char *text, int size)
{
    struct vtp *vtp = user;

    (void)text;
    (void)size;
    stop(vtp, vtp->status == SRNF_OK ? mesh_step(vtp->file.reader) : vtp->status);
}

static void on_doctype(void *user, const XML_Char *name, const XML_Char *system,
                       const XML_Char *public, int has_internal_subset)
{
    struct vtp *vtp = user;

    (void)name;
    (void)system;
    (void)public;
    if (has_internal_subset) {
        stop(vtp, xml_refuse_declarations(vtp->file.reader));
    }
}

/* ---- The file -------------------------------------------------------------------------------- */

bool mesh_sniff_vtp(const unsigned char *bytes, size_t size)
{
    struct scan scan;
    struct token word;
    const unsigned char *root;

    size = size < SNIFF_BYTES ? size : SNIFF_BYTES;
    scan_sniff(&scan, bytes, size);
    if (!scan_word(&scan, &word) || word.text[0] != '<') {
        return false;
    }
    root = memmem(bytes, size, "<VTKFile", strlen("<VTKFile"));
    return root &&
           memmem(root, (size_t)(bytes + size - root), "PolyData", strlen("PolyData")) != NULL;
}

static int read_pieces(struct vtp *vtp)
{
    int status = xml_open(vtp->file.reader, &vtp->parser);

    if (status != SRNF_OK) {
        return status;
    }
    XML_SetUserData(vtp->parser, vtp);
    XML_SetElementHandler(vtp->parser, on_start, on_end);
    XML_SetCharacterDataHandler(vtp->parser, on_text);
    XML_SetStartDoctypeDeclHandler(vtp->parser, on_doctype);
    xml_parse(vtp->file.reader, vtp->parser, &vtp->status);
    XML_ParserFree(vtp->parser);
    status = vtp->status;
    for (size_t i = 0; i < vtp->n_pieces && status == SRNF_OK; i++) {
        status = vtp_piece_load(&vtp->file, &vtp->pieces[i]);
    }
    return status;
}

int mesh_read_vtp(struct mesh_reader *reader)
{
    struct vtp vtp = {.file = {.reader = reader, .header = 4}, .section = -1};
    int status;

    vtp.pieces = mesh_alloc(reader, PIECES_MAX, sizeof *vtp.pieces);
    if (!vtp.pieces) {
        return reader->status;
    }
    status = read_pieces(&vtp);
    mesh_release(reader, vtp.pieces, PIECES_MAX, sizeof *vtp.pieces);
    return status;
}
