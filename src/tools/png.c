#include "tools/png.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <lodepng.h>

/* Debian builds liblodepng with a C++ compiler, so its functions carry C++ names (the Itanium ABI's, size_t being
 * unsigned long). Define LODEPNG_C_NAMES for a library that was built as C. */
#ifndef LODEPNG_C_NAMES
extern unsigned lodepng_inspect(unsigned *, unsigned *, LodePNGState *, const unsigned char *, size_t)
    __asm__("_Z15lodepng_inspectPjS_P12LodePNGStatePKhm");
extern unsigned lodepng_decode(unsigned char **, unsigned *, unsigned *, LodePNGState *, const unsigned char *, size_t)
    __asm__("_Z14lodepng_decodePPhPjS1_P12LodePNGStatePKhm");
extern unsigned lodepng_encode(unsigned char **, size_t *, const unsigned char *, unsigned, unsigned, LodePNGState *)
    __asm__("_Z14lodepng_encodePPhPmPKhjjP12LodePNGState");
extern void lodepng_state_init(LodePNGState *) __asm__("_Z18lodepng_state_initP12LodePNGState");
extern void lodepng_state_cleanup(LodePNGState *) __asm__("_Z21lodepng_state_cleanupP12LodePNGState");
extern const char *lodepng_error_text(unsigned) __asm__("_Z18lodepng_error_textj");
#endif

enum {
    LODEPNG_NO_MEMORY = 83,
    SIGNATURE_BYTES = 8,
    CHUNK_BYTES = 12,   /* of a chunk without data: length, type, checksum */
    PIXEL_BYTES = 8,    /* of a pixel at most: four channels of 16 bits */
    ROW_BYTES = 8,      /* more than the filter bytes and the padding of a row, interlaced or not */
    FIRST_READ = 64 * 1024,
    SIDE_LIMIT = 65535,
    AREA_LIMIT = 1 << 28,
};

static bool lodepng_failed(const char *path, unsigned code, Err *err)
{
    if (code == LODEPNG_NO_MEMORY) return err_memory(err, path);
    return err_set(err, ERR_INPUT, "%s: %s", path, lodepng_error_text(code));
}

/* The header alone decides how much will be allocated, so it is judged before the rest is even read. *most gets a bound
 * on the bytes that the pixels may inflate to. */
static bool check_header(const char *path, const unsigned char *data, size_t size, size_t *most, Err *err)
{
    LodePNGState state;
    lodepng_state_init(&state);
    unsigned width, height;
    unsigned code = lodepng_inspect(&width, &height, &state, data, size);
    lodepng_state_cleanup(&state);
    if (code) return lodepng_failed(path, code, err);
    if (width > SIDE_LIMIT || height > SIDE_LIMIT || (uint64_t)width * height > AREA_LIMIT)
        return err_set(err, ERR_INPUT, "%s: %u x %u pixels; at most %d a side and %d in all are allowed", path, width,
                       height, SIDE_LIMIT, AREA_LIMIT);
    *most = ((size_t)width * PIXEL_BYTES + ROW_BYTES) * height;
    return true;
}

/* The whole file, malloc'ed. */
static bool read_file(const char *path, unsigned char **data, size_t *size, size_t *most, Err *err)
{
    FILE *file = fopen(path, "rb");
    if (!file) return err_system(err, ERR_INPUT, "open", path, errno);
    bool checked = false, ok = false;
    size_t capacity = FIRST_READ, used = 0;
    unsigned char *buffer = malloc(capacity);
    if (!buffer) {
        err_memory(err, path);
        goto done;
    }
    for (;;) {
        size_t got = fread(buffer + used, 1, capacity - used, file);
        used += got;
        if (ferror(file)) {
            err_system(err, ERR_INPUT, "open", path, errno);
            goto done;
        }
        if (!checked && !check_header(path, buffer, used, most, err)) goto done;
        checked = true;
        if (used < capacity) break;
        unsigned char *more = capacity <= SIZE_MAX / 2 ? realloc(buffer, 2 * capacity) : NULL;
        if (!more) {
            err_memory(err, path);
            goto done;
        }
        buffer = more;
        capacity *= 2;
    }
    *data = buffer;
    *size = used;
    buffer = NULL;
    ok = true;
done:
    free(buffer);
    fclose(file);
    return ok;
}

/* Whether the chunks reach the last one; lodepng says something else about a file that was cut off. */
static bool is_whole(const unsigned char *data, size_t size)
{
    size_t at = SIGNATURE_BYTES;
    while (at <= size && size - at >= CHUNK_BYTES) {
        const unsigned char *p = data + at;
        uint32_t length = (uint32_t)p[0] << 24 | (uint32_t)p[1] << 16 | (uint32_t)p[2] << 8 | p[3];
        if (length > size - at - CHUNK_BYTES) return false;
        if (memcmp(p + 4, "IEND", 4) == 0) return true;
        at += CHUNK_BYTES + (size_t)length;
    }
    return false;
}

bool png_load(const char *path, Png *png, Err *err)
{
    unsigned char *data = NULL, *rgb = NULL;
    size_t size = 0, most = 0;
    *png = (Png){0};
    if (!read_file(path, &data, &size, &most, err)) return false;
    if (!is_whole(data, size)) {
        free(data);
        return err_set(err, ERR_INPUT, "%s: the file is cut off", path);
    }
    LodePNGState state;
    lodepng_state_init(&state);
    state.info_raw.colortype = LCT_RGB;
    state.info_raw.bitdepth = 8;
    state.decoder.zlibsettings.max_output_size = most;
    state.decoder.read_text_chunks = 0;
    unsigned width = 0, height = 0;
    unsigned code = lodepng_decode(&rgb, &width, &height, &state, data, size);
    lodepng_state_cleanup(&state);
    free(data);
    if (code) {
        free(rgb);
        return lodepng_failed(path, code, err);
    }
    *png = (Png){width, height, rgb};
    return true;
}

void png_free(Png *png)
{
    free(png->rgb);
    *png = (Png){0};
}

bool png_encode(const uint8_t *rgb, uint32_t width, uint32_t height, uint8_t **data, size_t *size, Err *err)
{
    LodePNGState state;
    lodepng_state_init(&state);
    state.info_raw.colortype = state.info_png.color.colortype = LCT_RGB;
    state.info_raw.bitdepth = state.info_png.color.bitdepth = 8;
    state.encoder.auto_convert = 0;
    state.encoder.add_id = 0;
    /* Measured on rendered pictures: half the time of the default settings for the same size of file. */
    state.encoder.zlibsettings.windowsize = 512;
    state.encoder.zlibsettings.minmatch = 6;
    state.encoder.zlibsettings.nicematch = 64;
    *data = NULL;
    *size = 0;
    unsigned code = lodepng_encode(data, size, rgb, width, height, &state);
    lodepng_state_cleanup(&state);
    if (!code) return true;
    free(*data);
    *data = NULL;
    *size = 0;
    if (code == LODEPNG_NO_MEMORY) return err_memory(err, "the encoded picture");
    return err_set(err, ERR_OUTPUT, "can't encode the picture: %s", lodepng_error_text(code));
}
