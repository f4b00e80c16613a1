/* Any bytes as text of another format. What is no UTF-8 (RFC 3629) becomes U+FFFD. */
#ifndef RT_TOOLS_ESCAPE_H
#define RT_TOOLS_ESCAPE_H

#include <stddef.h>
#include <stdio.h>

/* The first `length` bytes as a JSON string, quotes included. */
void escape_json(FILE *out, const char *text, size_t length);

/* Character data or an attribute's value of XML 1.0, of at most `most` characters: a longer text ends in an ellipsis.
 * Characters that XML doesn't have, controls among them, become U+FFFD. */
void escape_xml(FILE *out, const char *text, size_t most);

/* A field of a CSV file (RFC 4180), in quotes. */
void escape_csv(FILE *out, const char *text);

#endif
