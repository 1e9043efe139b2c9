/*
 * xml.h - expat as GIfTI and VTP use it: with the memory of the library, over the whole input in
 * one piece.
 */
#ifndef SRNF_FORMATS_XML_H
#define SRNF_FORMATS_XML_H

#include <expat.h>

#include "formats.h"

#define XML_DEPTH_MAX 64 /* of elements */

/* A parser whose memory is srnf_alloc's, freed with XML_ParserFree. Errors: SRNF_ENOMEM,
   SRNF_ELIMIT (more bytes than expat takes). */
SRNF_CHECKED int xml_open(struct mesh_reader *reader, XML_Parser *parser);

/* Parses the reader's bytes. *status, which handlers set when they stop the parser, stays as they
   left it; where it is SRNF_OK and the file is no XML, it becomes SRNF_EPARSE or SRNF_ENOMEM. */
void xml_parse(struct mesh_reader *reader, XML_Parser parser, int *status);

/* What a document type with an internal subset gets, which could declare entities. */
SRNF_CHECKED int xml_refuse_declarations(struct mesh_reader *reader);

#endif
