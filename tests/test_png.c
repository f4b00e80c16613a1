/* PNG files in and out: what is written is read again, and every way of being broken has its message. */
#include "tools/png.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "common/rng.h"
#include "support/alloc_fail.h"
#include "support/test_file.h"

enum { SEED = 99, HEADER = 33 };

/* CRC-32 of ISO 3309, bit by bit. */
static uint32_t crc32(const uint8_t *data, size_t size)
{
    uint32_t crc = 0xffffffffu;
    for (size_t i = 0; i < size; i++) {
        crc ^= data[i];
        for (int k = 0; k < 8; k++) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0);
    }
    return ~crc;
}

static void put_u32(uint8_t *p, uint32_t x)
{
    for (int i = 0; i < 4; i++) p[i] = (uint8_t)(x >> (24 - 8 * i));
}

/* A chunk behind `at`; returns its end. */
static uint8_t *put_chunk(uint8_t *at, const char *type, const void *data, size_t size)
{
    put_u32(at, (uint32_t)size);
    memcpy(at + 4, type, 4);
    if (size) memcpy(at + 8, data, size);
    put_u32(at + 8 + size, crc32(at + 4, 4 + size));
    return at + 12 + size;
}

/* Signature and header. */
static uint8_t *put_header(uint8_t *at, uint32_t width, uint32_t height, uint8_t depth, uint8_t colour)
{
    uint8_t header[13] = {0};
    memcpy(at, "\x89PNG\r\n\x1a\n", 8);
    put_u32(header, width);
    put_u32(header + 4, height);
    header[8] = depth;
    header[9] = colour;
    return put_chunk(at + 8, "IHDR", header, sizeof header);
}

/* The rows, each with its filter byte, as one stored block of deflate. */
static uint8_t *put_pixels(uint8_t *at, const uint8_t *rows, size_t size)
{
    uint8_t data[512] = {0x78, 1, 1, (uint8_t)size, (uint8_t)(size >> 8), (uint8_t)~size, (uint8_t)(~size >> 8)};
    memcpy(data + 7, rows, size);
    uint32_t a = 1, b = 0;
    for (size_t i = 0; i < size; i++) {
        a = (a + rows[i]) % 65521;
        b = (b + a) % 65521;
    }
    put_u32(data + 7 + size, b << 16 | a);
    at = put_chunk(at, "IDAT", data, size + 11);
    return put_chunk(at, "IEND", NULL, 0);
}

static void assert_error(const void *data, size_t size, ErrKind kind, const char *expected)
{
    const char *path = test_file_bytes("bad.png", data, size);
    Png png;
    Err err = {ERR_NONE, ""};
    assert_false(png_load(path, &png, &err));
    assert_int_equal(err.kind, kind);
    assert_memory_equal(err.text, path, strlen(path));
    assert_string_equal(err.text + strlen(path), expected);
    assert_null(png.rgb);
}

static void assert_pixels(const uint8_t *file, const uint8_t *end, const uint8_t *expected, size_t size)
{
    Png png;
    Err err = {ERR_NONE, ""};
    if (!png_load(test_file_bytes("a.png", file, (size_t)(end - file)), &png, &err)) fail_msg("%s", err.text);
    assert_int_equal(png.width * png.height * 3, size);
    assert_memory_equal(png.rgb, expected, size);
    png_free(&png);
    assert_null(png.rgb);
}

/* Random samples, or rows of one value. */
static void written_and_read(unsigned bits, uint32_t w, uint32_t h, bool noisy)
{
    Rng rng = rng_seed(SEED, bits);
    size_t bytes = bits / 8, count = 3 * bytes * w * h, size, again;
    uint8_t *rgb = malloc(count), *data, *same;
    assert_non_null(rgb);
    for (size_t k = 0; k < count; k++) rgb[k] = (uint8_t)(noisy ? rng_u32(&rng) : k / 3 / bytes / w);
    Err err = {ERR_NONE, ""};
    assert_true(png_encode(rgb, bits, w, h, &data, &size, &err));
    assert_true(png_encode(rgb, bits, w, h, &same, &again, &err));
    assert_int_equal(size, again);
    assert_memory_equal(data, same, size);
    /* header, pixels, end, and nothing else */
    assert_memory_equal(data + 12, "IHDR", 4);
    assert_int_equal(data[24], bits);
    assert_memory_equal(data + HEADER + 4, "IDAT", 4);
    assert_memory_equal(data + size - 8, "IEND", 4);
    Png png;
    if (!png_decode("a.png", data, size, bits, &png, &err)) fail_msg("%s", err.text);
    assert_int_equal(png.width, w);
    assert_int_equal(png.height, h);
    assert_memory_equal(png.rgb, rgb, count);
    png_free(&png);
    if (bits == 8) {
        if (!png_load(test_file_bytes("a.png", data, size), &png, &err)) fail_msg("%s", err.text);
        assert_memory_equal(png.rgb, rgb, count);
        png_free(&png);
    }
    free(rgb);
    free(data);
    free(same);
}

static void what_is_written_is_read(void **state)
{
    (void)state;
    static const uint32_t sizes[][2] = {{1, 1}, {3, 5}, {1, 300}, {300, 1}, {257, 129}, {65535, 1}, {1, 65535}};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
        for (unsigned bits = 8; bits <= 16; bits += 8) written_and_read(bits, sizes[i][0], sizes[i][1], i % 2);
}

/* Fewer bits are stretched so that black and white stay black and white. */
static void fewer_bits_become_sixteen(void **state)
{
    (void)state;
    uint8_t file[1024], *end;
    Png png;
    Err err = {ERR_NONE, ""};
    const uint8_t bytes[] = {0, 1, 128, 255}, bits[] = {0, 0x40};
    end = put_pixels(put_header(file, 1, 1, 8, 2), bytes, sizeof bytes);
    assert_true(png_decode("a.png", file, (size_t)(end - file), 16, &png, &err));
    assert_memory_equal(png.rgb, ((const uint8_t[]){1, 1, 128, 128, 255, 255}), 6);
    png_free(&png);
    end = put_pixels(put_header(file, 2, 1, 1, 0), bits, sizeof bits);
    assert_true(png_decode("a.png", file, (size_t)(end - file), 16, &png, &err));
    assert_memory_equal(png.rgb, ((const uint8_t[]){0, 0, 0, 0, 0, 0, 255, 255, 255, 255, 255, 255}), 12);
    png_free(&png);
}

static void every_kind_of_pixel_becomes_rgb(void **state)
{
    (void)state;
    uint8_t file[1024], *end;
    const uint8_t alpha[] = {0, 10, 20, 30, 0, 200, 100, 50, 128};
    end = put_pixels(put_header(file, 2, 1, 8, 6), alpha, sizeof alpha);
    assert_pixels(file, end, (const uint8_t[]){10, 20, 30, 200, 100, 50}, 6);
    const uint8_t grey[] = {0, 7, 255};
    end = put_pixels(put_header(file, 2, 1, 8, 0), grey, sizeof grey);
    assert_pixels(file, end, (const uint8_t[]){7, 7, 7, 255, 255, 255}, 6);
    const uint8_t grey_alpha[] = {0, 7, 0, 255, 9};
    end = put_pixels(put_header(file, 2, 1, 8, 4), grey_alpha, sizeof grey_alpha);
    assert_pixels(file, end, (const uint8_t[]){7, 7, 7, 255, 255, 255}, 6);
    const uint8_t bits[] = {0, 0x40};
    end = put_pixels(put_header(file, 2, 1, 1, 0), bits, sizeof bits);
    assert_pixels(file, end, (const uint8_t[]){0, 0, 0, 255, 255, 255}, 6);
    const uint8_t deep[] = {0, 255, 255, 0, 0, 128, 128};
    end = put_pixels(put_header(file, 1, 1, 16, 2), deep, sizeof deep);
    assert_pixels(file, end, (const uint8_t[]){255, 0, 128}, 3);
    const uint8_t palette[] = {1, 2, 3, 4, 5, 6}, indices[] = {0, 1, 0};
    end = put_chunk(put_header(file, 2, 1, 8, 3), "PLTE", palette, sizeof palette);
    end = put_pixels(end, indices, sizeof indices);
    assert_pixels(file, end, (const uint8_t[]){4, 5, 6, 1, 2, 3}, 6);
}

static void headers_are_judged_before_anything_is_allocated(void **state)
{
    (void)state;
    uint8_t file[256];
    const uint8_t row[] = {0, 1, 2, 3};
    static const struct { uint32_t w, h; const char *text; } sizes[] = {
        {1000000000, 1000000000, ": 1000000000 x 1000000000 pixels; at most 65535 a side and 268435456 in all are allowed"},
        {65536, 1, ": 65536 x 1 pixels; at most 65535 a side and 268435456 in all are allowed"},
        {1, 65536, ": 1 x 65536 pixels; at most 65535 a side and 268435456 in all are allowed"},
        {16385, 16384, ": 16385 x 16384 pixels; at most 65535 a side and 268435456 in all are allowed"},
        {0, 5, ": zero width or height is invalid"},
    };
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        uint8_t *end = put_pixels(put_header(file, sizes[i].w, sizes[i].h, 8, 2), row, sizeof row);
        assert_error(file, (size_t)(end - file), ERR_INPUT, sizes[i].text);
    }
}

static void broken_files(void **state)
{
    (void)state;
    uint8_t file[256];
    const uint8_t row[] = {0, 1, 2, 3};
    uint8_t *end = put_pixels(put_header(file, 1, 1, 8, 2), row, sizeof row);
    size_t size = (size_t)(end - file);
    assert_error("", 0, ERR_INPUT, ": empty input buffer given to decoder. Maybe caused by non-existing file?");
    assert_error("GIF89a, and more than thirty-three bytes", 40, ERR_INPUT,
                 ": incorrect PNG signature, it's no PNG or corrupted");
    /* cut anywhere: never a picture */
    for (size_t cut = 1; cut < size; cut++) {
        Png png;
        Err err = {ERR_NONE, ""};
        assert_false(png_load(test_file_bytes("bad.png", file, cut), &png, &err));
        assert_int_equal(err.kind, ERR_INPUT);
    }
    assert_error(file, size - 14, ERR_INPUT, ": the file is cut off");
    /* a wrong byte in any chunk's data or checksum */
    for (size_t at = HEADER - 4; at < size; at++) {
        file[at] ^= 0x10;
        Png png;
        Err err = {ERR_NONE, ""};
        bool done = png_load(test_file_bytes("bad.png", file, size), &png, &err);
        assert_false(done);
        assert_int_equal(err.kind, ERR_INPUT);
        file[at] ^= 0x10;
    }
    file[size - 13] ^= 1;
    assert_error(file, size, ERR_INPUT, ": invalid CRC encountered (checking CRC can be disabled)");
}

static void files_that_cant_be_opened(void **state)
{
    (void)state;
    Png png;
    Err err;
    assert_false(png_load("build/none.png", &png, &err));
    assert_int_equal(err.kind, ERR_INPUT);
    assert_string_equal(err.text, "can't open build/none.png: No such file or directory");
    assert_false(png_load("src", &png, &err));
    assert_int_equal(err.kind, ERR_INPUT);
    assert_string_equal(err.text, "can't open src: Is a directory");
    assert_false(png_load("/dev/zero", &png, &err));
    assert_int_equal(err.kind, ERR_INPUT);
}

/* A megabyte of zeros deflates to a kilobyte: what goes beyond the header's size isn't even unpacked. */
static void more_pixels_than_announced(void **state)
{
    (void)state;
    enum { SIDE = 2000 };
    uint8_t *rgb = calloc(SIDE * SIDE, 3), *data;
    assert_non_null(rgb);
    size_t size;
    assert_true(png_encode(rgb, 8, SIDE, SIDE, &data, &size, NULL));
    put_u32(data + 16, 1);
    put_u32(data + 20, 1);
    put_u32(data + 29, crc32(data + 12, 17));
    assert_error(data, size, ERR_INPUT,
                 ": tried to decompress zlib or deflate data larger than desired max_output_size");
    free(rgb);
    free(data);
}

/* A file whose pixels are really compressed, and where its only IDAT begins; malloc'ed. */
static uint8_t *packed_file(uint32_t side, size_t *size)
{
    uint8_t *rgb = malloc((size_t)3 * side * side), *data;
    assert_non_null(rgb);
    for (uint32_t i = 0; i < 3 * side * side; i++) rgb[i] = (uint8_t)(i / 7 ^ i / (5 * side));
    assert_true(png_encode(rgb, 8, side, side, &data, size, NULL));
    free(rgb);
    return data;
}

/* Bytes of the compressed data replaced, its checksum set right: an error, or a picture that the damage missed. */
static void damaged_pixels(void **state)
{
    (void)state;
    enum { SIDE = 40 };
    size_t size;
    uint8_t *good = packed_file(SIDE, &size), *bad = malloc(size);
    assert_non_null(bad);
    size_t idat = size - HEADER - 24;
    Png whole;
    assert_true(png_decode("a.png", good, size, 8, &whole, NULL));
    Rng rng = rng_seed(SEED, 2);
    int damaged = 0;
    for (int i = 0; i < 4000; i++) {
        memcpy(bad, good, size);
        for (uint32_t k = 1 + rng_u32(&rng) % 3; k > 0; k--)
            bad[HEADER + 8 + rng_u32(&rng) % idat] = (uint8_t)rng_u32(&rng);
        put_u32(bad + HEADER + 8 + idat, crc32(bad + HEADER + 4, idat + 4));
        Png png;
        Err err = {ERR_NONE, ""};
        if (png_decode("a.png", bad, size, 8, &png, &err)) {
            assert_memory_equal(png.rgb, whole.rgb, 3 * SIDE * SIDE);
            png_free(&png);
            continue;
        }
        assert_int_equal(err.kind, ERR_INPUT);
        damaged += strcmp(err.text, "a.png: the compressed data is damaged") == 0;
    }
    assert_true(damaged > 2000);
    png_free(&whole);
    free(good);
    free(bad);
}

static void every_allocation_of_the_encoder_may_fail(void **state)
{
    (void)state;
    static const uint8_t rgb[3 * 10 * 10];
    for (long n = 1;; n++) {
        uint8_t *data;
        size_t size;
        Err err = {ERR_NONE, ""};
        alloc_fail_at(n);
        bool done = png_encode(rgb, 8, 10, 10, &data, &size, &err);
        bool failed = alloc_fail_stop();
        assert_true(failed == !done);
        if (!failed) {
            free(data);
            assert_true(n > 1);
            break;
        }
        assert_null(data);
        assert_int_equal(err.kind, ERR_LIMIT);
        assert_string_equal(err.text, "out of memory for the encoded picture");
    }
}

static void every_allocation_may_fail(void **state)
{
    (void)state;
    /* more than the first read takes, so that the buffer grows */
    enum { SIDE = 200 };
    static uint8_t rgb[3 * SIDE * SIDE];
    Rng rng = rng_seed(SEED, 1);
    for (size_t i = 0; i < sizeof rgb; i++) rgb[i] = (uint8_t)rng_u32(&rng);
    uint8_t *data;
    size_t size;
    assert_true(png_encode(rgb, 8, SIDE, SIDE, &data, &size, NULL));
    const char *path = test_file_bytes("a.png", data, size);
    free(data);
    for (long n = 1;; n++) {
        Png png;
        Err err = {ERR_NONE, ""};
        alloc_fail_at(n);
        bool done = png_load(path, &png, &err);
        bool failed = alloc_fail_stop();
        assert_true(failed == !done);
        png_free(&png);
        if (!failed) {
            assert_true(n > 2);
            break;
        }
        assert_int_equal(err.kind, ERR_LIMIT);
        assert_string_equal(err.text, test_message("out of memory for ", "a.png", ""));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_written_is_read),
        cmocka_unit_test(fewer_bits_become_sixteen),
        cmocka_unit_test(every_kind_of_pixel_becomes_rgb),
        cmocka_unit_test(headers_are_judged_before_anything_is_allocated),
        cmocka_unit_test(broken_files),
        cmocka_unit_test(files_that_cant_be_opened),
        cmocka_unit_test(more_pixels_than_announced),
        cmocka_unit_test(damaged_pixels),
        cmocka_unit_test(every_allocation_of_the_encoder_may_fail),
        cmocka_unit_test(every_allocation_may_fail),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
