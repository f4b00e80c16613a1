/* lodepng reads and writes the format; libdeflate packs and unpacks the pixels for it. */
#include "tools/png.h"

#include <stdlib.h>
#include <string.h>

#include <libdeflate.h>
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
    LODEPNG_UNPACK_FAILED = 110,  /* what lodepng makes of any failure of the functions given to it */
    LODEPNG_PACK_FAILED = 111,
    SIGNATURE_BYTES = 8,
    CHUNK_BYTES = 12,   /* of a chunk without data: length, type, checksum */
    PIXEL_BYTES = 8,    /* of a pixel at most: four channels of 16 bits */
    ROW_BYTES = 8,      /* more than the filter bytes and the padding of a row, interlaced or not */
    /* Bytes that one of deflate may stand for, at most: 258 by a length and a distance of one bit each (RFC 1951). */
    MAX_INFLATION = 4 * 258,
    /* Of libdeflate's 1 to 12. Rendered pictures get no larger by it than by lodepng's own packing. */
    PACK_LEVEL = 6,
};

/* ---- libdeflate behind lodepng's hooks ---- */

/* Why unpacking failed, for which lodepng has a single code. */
typedef struct { bool *no_memory; } UnpackContext;

/* Unpacks zlib data to at most max_output_size bytes. No more is allocated than that many bytes of input can stand for;
 * lodepng frees it soon, so what was too much isn't given back. */
static unsigned unpack(unsigned char **out, size_t *out_size, const unsigned char *in, size_t in_size,
                       const LodePNGDecompressSettings *settings)
{
    const UnpackContext *context = settings->custom_context;
    size_t room = settings->max_output_size, got = 0;
    if (in_size < room / MAX_INFLATION) room = in_size * MAX_INFLATION;
    struct libdeflate_decompressor *decompressor = libdeflate_alloc_decompressor();
    unsigned char *bytes = malloc(room + 1);
    if (!decompressor || !bytes) {
        *context->no_memory = true;
        libdeflate_free_decompressor(decompressor);
        free(bytes);
        return LODEPNG_NO_MEMORY;
    }
    enum libdeflate_result result = libdeflate_zlib_decompress(decompressor, in, in_size, bytes, room, &got);
    libdeflate_free_decompressor(decompressor);
    if (result != LIBDEFLATE_SUCCESS) {
        free(bytes);
        *out_size = result == LIBDEFLATE_INSUFFICIENT_SPACE ? settings->max_output_size + 1 : 0;
        return LODEPNG_UNPACK_FAILED;
    }
    *out = bytes;
    *out_size = got;
    return 0;
}

static unsigned pack(unsigned char **out, size_t *out_size, const unsigned char *in, size_t in_size,
                     const LodePNGCompressSettings *settings)
{
    (void)settings;
    struct libdeflate_compressor *compressor = libdeflate_alloc_compressor(PACK_LEVEL);
    size_t room = compressor ? libdeflate_zlib_compress_bound(compressor, in_size) : 0;
    *out = room ? malloc(room) : NULL;
    *out_size = *out ? libdeflate_zlib_compress(compressor, in, in_size, *out, room) : 0;
    libdeflate_free_compressor(compressor);
    return *out_size > 0 ? 0 : LODEPNG_NO_MEMORY;  /* the room suffices for whatever the input is */
}

/* ---- reading ---- */

static bool lodepng_failed(const char *path, unsigned code, Err *err)
{
    if (code == LODEPNG_NO_MEMORY) return err_memory(err, path);
    if (code == LODEPNG_UNPACK_FAILED) return err_set(err, ERR_INPUT, "%s: the compressed data is damaged", path);
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
    bool no_memory = false;
    UnpackContext context = {&no_memory};
    state.decoder.zlibsettings.max_output_size = inflated;
    state.decoder.zlibsettings.custom_zlib = unpack;
    state.decoder.zlibsettings.custom_context = &context;
    state.decoder.read_text_chunks = 0;
    unsigned width = 0, height = 0;
    unsigned code = lodepng_decode(&rgb, &width, &height, &state, data, size);
    lodepng_state_cleanup(&state);
    if (code) {
        free(rgb);
        return lodepng_failed(path, no_memory ? LODEPNG_NO_MEMORY : code, err);
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

/* ---- writing ---- */

bool png_encode(const uint8_t *rgb, unsigned bits, uint32_t width, uint32_t height, uint8_t **data, size_t *size,
                Err *err)
{
    LodePNGState state;
    lodepng_state_init(&state);
    state.info_raw.colortype = state.info_png.color.colortype = LCT_RGB;
    state.info_raw.bitdepth = state.info_png.color.bitdepth = bits;
    state.encoder.auto_convert = 0;
    state.encoder.add_id = 0;
    /* Measured on rendered pictures: smaller by a hundredth than by the least sum of differences, in the same time. */
    state.encoder.filter_strategy = LFS_ENTROPY;
    state.encoder.zlibsettings.custom_zlib = pack;
    *data = NULL;
    *size = 0;
    unsigned code = lodepng_encode(data, size, rgb, width, height, &state);
    lodepng_state_cleanup(&state);
    if (!code) return true;
    free(*data);
    *data = NULL;
    *size = 0;
    if (code == LODEPNG_NO_MEMORY || code == LODEPNG_PACK_FAILED) return err_memory(err, "the encoded picture");
    return err_set(err, ERR_OUTPUT, "can't encode the picture: %s", lodepng_error_text(code));
}
