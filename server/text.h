/*
 * text.h - sentences in UTF-8 that have no room for all of them.
 */
#ifndef SRNFD_TEXT_H
#define SRNFD_TEXT_H

/* Takes away what is left of a character at the end of a text that was cut. Other bytes that are no
   UTF-8 stay. */
void text_trim_cut(char *text);

#endif
