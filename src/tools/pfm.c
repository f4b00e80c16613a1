/* The file is three lines, "PF" (colour) or "Pf" (grey), "WIDTH HEIGHT" and "SCALE", then the floats, rows from the bottom.
 * A scale below 0 says that the low byte comes first; its size is a factor of the values. */
#include "tools/pfm.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "common/picture.h"

enum { TOKEN_LENGTH = 31, HEADER_ROOM = 64 };

typedef struct {
    uint32_t width, height, channels;
    bool low_first;
    double scale;       /* > 0 */
    size_t data_at;     /* where the floats begin */
    size_t file_bytes;
} Header;

static bool is_blank(unsigned char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

bool pfm_begins(const unsigned char *head, size_t size)
{
    return size >= 3 && head[0] == 'P' && (head[1] == 'F' || head[1] == 'f') && is_blank(head[2]);
}

/* The next word of the header, which begins at *at; *at gets its end. False if it doesn't end within the data. */
static bool next_word(const unsigned char *data, size_t size, size_t *at, char word[TOKEN_LENGTH + 1])
{
    size_t i = *at, n = 0;
    while (i < size && is_blank(data[i])) i++;
    while (i < size && !is_blank(data[i]) && n < TOKEN_LENGTH) word[n++] = (char)data[i++];
    word[n] = '\0';
    *at = i;
    return i < size && is_blank(data[i]);
}

/* A whole number of at most `most`; more is most + 1. */
static bool parse_side(const char *word, uint32_t most, uint32_t *side)
{
    uint32_t x = 0;
    for (const char *c = word; *c; c++) {
        if (*c < '0' || *c > '9') return false;
        x = 10 * x + (uint32_t)(*c - '0');
        if (x > most) x = most + 1;
    }
    *side = x;
    return *word && x > 0;
}

static bool parse_scale(const char *word, Header *header)
{
    char *end;
    double scale = strtod(word, &end);
    if (end == word || *end || !isfinite(scale) || scale == 0) return false;
    header->low_first = scale < 0;
    header->scale = fabs(scale);
    return true;
}

static bool parse_header(const char *path, const unsigned char *data, size_t size, Header *header, Err *err)
{
    char width[TOKEN_LENGTH + 1], height[TOKEN_LENGTH + 1], scale[TOKEN_LENGTH + 1];
    size_t at = 2;
    *header = (Header){0};
    if (!pfm_begins(data, size)) return err_set(err, ERR_INPUT, "%s: no PFM: it begins with neither PF nor Pf", path);
    header->channels = data[1] == 'F' ? 3 : 1;
    if (!next_word(data, size, &at, width) || !next_word(data, size, &at, height) || !next_word(data, size, &at, scale))
        return err_set(err, ERR_INPUT, "%s: no width, height and scale in the header", path);
    if (!parse_side(width, MAX_SIDE, &header->width) || !parse_side(height, MAX_SIDE, &header->height))
        return err_set(err, ERR_INPUT, "%s: '%s %s' is no size of a picture", path, width, height);
    if (header->width > MAX_SIDE || header->height > MAX_SIDE || (uint64_t)header->width * header->height > MAX_AREA)
        return err_set(err, ERR_INPUT, "%s: %s x %s pixels; at most %u a side and %u in all are allowed", path, width,
                       height, MAX_SIDE, MAX_AREA);
    if (!parse_scale(scale, header)) return err_set(err, ERR_INPUT, "%s: '%s' is no scale", path, scale);
    header->data_at = at + 1;
    header->file_bytes = header->data_at + (size_t)header->width * header->height * header->channels * sizeof(float);
    return true;
}

/* A byte more than the file should have is read, so that surplus ones are noticed. */
bool pfm_accept(const char *path, const unsigned char *head, size_t size, size_t *most, Err *err)
{
    Header header;
    if (!parse_header(path, head, size, &header, err)) return false;
    *most = header.file_bytes + 1;
    return true;
}

static float read_float(const unsigned char *p, bool low_first)
{
    uint32_t bits = low_first ? (uint32_t)p[3] << 24 | (uint32_t)p[2] << 16 | (uint32_t)p[1] << 8 | p[0]
                              : (uint32_t)p[0] << 24 | (uint32_t)p[1] << 16 | (uint32_t)p[2] << 8 | p[3];
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static void write_float(unsigned char *p, float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    for (int i = 0; i < 4; i++) p[i] = (unsigned char)(bits >> 8 * i);
}

bool pfm_decode(const char *path, const unsigned char *data, size_t size, Pfm *pfm, Err *err)
{
    Header h;
    *pfm = (Pfm){0};
    if (!parse_header(path, data, size, &h, err)) return false;
    if (size < h.file_bytes) return err_set(err, ERR_INPUT, "%s: the file is cut off", path);
    if (size > h.file_bytes) return err_set(err, ERR_INPUT, "%s: more bytes than its pixels need", path);
    float *rgb = malloc((size_t)h.width * h.height * 3 * sizeof *rgb);
    if (!rgb) return err_memory(err, path);
    const unsigned char *p = data + h.data_at;
    for (uint32_t y = h.height; y-- > 0;) {
        float *out = rgb + (size_t)y * h.width * 3;
        for (uint32_t x = 0; x < h.width; x++, out += 3) {
            for (uint32_t k = 0; k < h.channels; k++, p += sizeof(float)) {
                double value = (double)read_float(p, h.low_first) * h.scale;
                if (!(fabs(value) <= (double)FLT_MAX)) {
                    free(rgb);
                    return err_set(err, ERR_INPUT, "%s: pixel %u,%u is no finite number", path, x, y);
                }
                out[k] = (float)value;
            }
            if (h.channels == 1) out[1] = out[2] = out[0];
        }
    }
    *pfm = (Pfm){h.width, h.height, rgb};
    return true;
}

void pfm_free(Pfm *pfm)
{
    free(pfm->rgb);
    *pfm = (Pfm){0};
}

bool pfm_encode(const float *rgb, uint32_t width, uint32_t height, uint8_t **data, size_t *size, Err *err)
{
    size_t row = (size_t)width * 3;
    uint8_t *out = malloc(HEADER_ROOM + row * height * sizeof(float));
    *data = NULL;
    *size = 0;
    if (!out) return err_memory(err, "the encoded picture");
    uint8_t *at = out + snprintf((char *)out, HEADER_ROOM, "PF\n%u %u\n-1.0\n", width, height);
    for (uint32_t y = height; y-- > 0;)
        for (size_t i = 0; i < row; i++, at += sizeof(float)) write_float(at, rgb[y * row + i]);
    *data = out;
    *size = (size_t)(at - out);
    return true;
}
