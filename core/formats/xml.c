/*
 * xml.c - expat with the memory of the library (see xml.h).
 */
#include "xml.h"

#include <limits.h>
#include <string.h>

/* ---- expat's memory: from srnf_alloc, with the size in front for realloc --------------------- */

#define BLOCK_HEADER ((size_t)64) /* keeps the alignment of srnf_alloc */

static void *xml_malloc(size_t size)
{
    unsigned char *block =
        size > SIZE_MAX - BLOCK_HEADER ? NULL : srnf_alloc(size + BLOCK_HEADER, 1);

    if (!block) {
        return NULL;
    }
    memcpy(block, &size, sizeof size);
    return block + BLOCK_HEADER;
}

static void xml_free(void *pointer)
{
    if (pointer) {
        srnf_free((unsigned char *)pointer - BLOCK_HEADER);
    }
}

static void *xml_realloc(void *pointer, size_t size)
{
    void *grown = xml_malloc(size);

    if (grown && pointer) {
        size_t old;

        memcpy(&old, (unsigned char *)pointer - BLOCK_HEADER, sizeof old);
        memcpy(grown, pointer, old < size ? old : size);
        xml_free(pointer);
    }
    return grown;
}

int xml_open(struct mesh_reader *reader, XML_Parser *parser)
{
    static const XML_Memory_Handling_Suite memory = {xml_malloc, xml_realloc, xml_free};

    if (reader->size > INT_MAX) {
        return srnf_fail(reader->error, SRNF_ELIMIT, -1, "XML files above %d bytes are not read",
                         INT_MAX);
    }
    *parser = XML_ParserCreate_MM(NULL, &memory, NULL);
    return *parser ? SRNF_OK : srnf_fail(reader->error, SRNF_ENOMEM, -1, "not enough memory");
}

void xml_parse(struct mesh_reader *reader, XML_Parser parser, int *status)
{
    enum XML_Status result =
        XML_Parse(parser, (const char *)reader->bytes, (int)reader->size, XML_TRUE);
    enum XML_Error code = XML_GetErrorCode(parser);

    if (*status != SRNF_OK || result == XML_STATUS_OK || code == XML_ERROR_ABORTED) {
        return;
    }
    *status = code == XML_ERROR_NO_MEMORY
                  ? srnf_fail(reader->error, SRNF_ENOMEM, -1, "not enough memory")
                  : srnf_fail(reader->error, SRNF_EPARSE, (int64_t)XML_GetCurrentByteIndex(parser),
                              "XML, line %lu: %s", XML_GetCurrentLineNumber(parser),
                              XML_ErrorString(code));
}

int xml_refuse_declarations(struct mesh_reader *reader)
{
    return srnf_fail(reader->error, SRNF_EPARSE, -1,
                     "a document type with declarations (entities) inside the file is refused");
}
