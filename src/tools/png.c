#include "tools/png.h"

#include <stdlib.h>
#include <string.h>

#include <lodepng.h>

#include "common/picture.h"
#include "tools/infile.h"

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
};

static bool lodepng_failed(const char *path, unsigned code, Err *err)
{
    if (code == LODEPNG_NO_MEMORY) return err_memory(err, path);
    return err_set(err, ERR_INPUT, "%s: %s", path, lodepng_error_text(code));
}

/* The header alone decides how much will be allocated, so it is judged before the rest is even read. *inflated gets a
 * bound on the bytes that the pixels may inflate to. */
static bool check_header(const char *path, const unsigned char *data, size_t size, size_t *inflated, Err *err)
{
    LodePNGState state;
    lodepng_state_init(&state);
    unsigned width, height;
    unsigned code = lodepng_inspect(&width, &height, &state, data, size);
    lodepng_state_cleanup(&state);
    if (code) return lodepng_failed(path, code, err);
    if (width > MAX_SIDE || height > MAX_SIDE || (uint64_t)width * height > MAX_AREA)
        return err_set(err, ERR_INPUT, "%s: %u x %u pixels; at most %u a side and %u in all are allowed", path, width,
                       height, MAX_SIDE, MAX_AREA);
    *inflated = ((size_t)width * PIXEL_BYTES + ROW_BYTES) * height;
    return true;
}

bool png_accept(const char *path, const unsigned char *head, size_t size, size_t *most, Err *err)
{
    (void)most;  /* compressed, a picture may have any size */
    size_t inflated;
    return check_header(path, head, size, &inflated, err);
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

bool png_decode(const char *path, const unsigned char *data, size_t size, unsigned bits, Png *png, Err *err)
{
    uint8_t *rgb = NULL;
    size_t inflated;
    *png = (Png){0};
    if (!check_header(path, data, size, &inflated, err)) return false;
    if (!is_whole(data, size)) return err_set(err, ERR_INPUT, "%s: the file is cut off", path);
    LodePNGState state;
    lodepng_state_init(&state);
    state.info_raw.colortype = LCT_RGB;
    state.info_raw.bitdepth = bits;
    state.decoder.zlibsettings.max_output_size = inflated;
    state.decoder.read_text_chunks = 0;
    unsigned width = 0, height = 0;
    unsigned code = lodepng_decode(&rgb, &width, &height, &state, data, size);
    lodepng_state_cleanup(&state);
    if (code) {
        free(rgb);
        return lodepng_failed(path, code, err);
    }
    *png = (Png){width, height, rgb};
    return true;
}

bool png_load(const char *path, Png *png, Err *err)
{
    unsigned char *data;
    size_t size;
    *png = (Png){0};
    if (!infile_read(path, png_accept, &data, &size, err)) return false;
    bool ok = png_decode(path, data, size, 8, png, err);
    free(data);
    return ok;
}

void png_free(Png *png)
{
    free(png->rgb);
    *png = (Png){0};
}

bool png_encode(const uint8_t *rgb, unsigned bits, uint32_t width, uint32_t height, uint8_t **data, size_t *size,
                Err *err)
{
    LodePNGState state;
    lodepng_state_init(&state);
    state.info_raw.colortype = state.info_png.color.colortype = LCT_RGB;
    state.info_raw.bitdepth = state.info_png.color.bitdepth = bits;
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
