#include "tools/escape.h"

#include <stdbool.h>

/* Length of the UTF-8 sequence (RFC 3629) that a string begins with; 0 if it begins with none. */
static size_t utf8_length(const char *s)
{
    const unsigned char *u = (const unsigned char *)s;
    size_t n = u[0] < 0x80 ? 1 : u[0] < 0xc2 ? 0 : u[0] < 0xe0 ? 2 : u[0] < 0xf0 ? 3 : u[0] < 0xf5 ? 4 : 0;
    for (size_t i = 1; i < n; i++)
        if ((u[i] & 0xc0) != 0x80) return 0;
    if ((u[0] == 0xe0 && u[1] < 0xa0) || (u[0] == 0xed && u[1] >= 0xa0)) return 0;
    if ((u[0] == 0xf0 && u[1] < 0x90) || (u[0] == 0xf4 && u[1] >= 0x90)) return 0;
    return n;
}

void escape_json(FILE *out, const char *text, size_t length)
{
    fputc('"', out);
    for (const char *s = text, *end = text + length; s < end;) {
        size_t n = utf8_length(s);
        unsigned char c = (unsigned char)*s;
        if (n > (size_t)(end - s)) n = 0;
        if (n == 0) fputs("\\ufffd", out);
        else if (c == '"' || c == '\\') fprintf(out, "\\%c", c);
        else if (c < 0x20 || c == 0x7f) fprintf(out, "\\u%04x", c);
        else fwrite(s, 1, n, out);
        s += n ? n : 1;
    }
    fputc('"', out);
}

/* U+FFFE and U+FFFF are the last two of the three-byte sequences' plane that XML leaves out. */
static bool xml_has(const char *s, size_t n)
{
    const unsigned char *u = (const unsigned char *)s;
    if (n == 0) return false;
    if (n == 1) return u[0] >= 0x20 && u[0] != 0x7f;
    return !(n == 3 && u[0] == 0xef && u[1] == 0xbf && u[2] >= 0xbe);
}

static size_t characters(const char *s)
{
    size_t count = 0;
    for (; *s; count++) {
        size_t n = utf8_length(s);
        s += n ? n : 1;
    }
    return count;
}

void escape_xml(FILE *out, const char *text, size_t most)
{
    bool cut = characters(text) > most;
    size_t left = cut ? most - 1 : most;
    for (const char *s = text; *s && left > 0; left--) {
        size_t n = utf8_length(s);
        if (!xml_has(s, n)) fputs("&#xfffd;", out);
        else if (*s == '&') fputs("&amp;", out);
        else if (*s == '<') fputs("&lt;", out);
        else if (*s == '>') fputs("&gt;", out);
        else if (*s == '"') fputs("&quot;", out);
        else fwrite(s, 1, n, out);
        s += n ? n : 1;
    }
    if (cut) fputs("&#x2026;", out);
}

void escape_csv(FILE *out, const char *text)
{
    fputc('"', out);
    for (const char *s = text; *s;) {
        size_t n = utf8_length(s);
        if (n == 0) fputs("\xef\xbf\xbd", out);
        else if (*s == '"') fputs("\"\"", out);
        else fwrite(s, 1, n, out);
        s += n ? n : 1;
    }
    fputc('"', out);
}
