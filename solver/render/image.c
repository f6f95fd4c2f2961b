#include "solver/render/image.h"

#include "solver/base/atomic_file.h"

#include <errno.h>
#include <png.h>
#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

lam_status image_check_size(size_t width, size_t height, lam_error *error) {
    lam_status status = LAM_OK;
    if (width < 1 || height < 1 || width > IMAGE_MAX_SIDE || height > IMAGE_MAX_SIDE)
        FAIL(error, LAM_ERR_ARGUMENT, "picture of %zux%zu pixels: each side must be from 1 to %d", width,
             height, IMAGE_MAX_SIDE);
    if (width * height > IMAGE_MAX_PIXELS)
        FAIL(error, LAM_ERR_ARGUMENT, "picture of %zux%zu pixels: must have at most %zu", width, height,
             IMAGE_MAX_PIXELS);
done:
    return status;
}

lam_status image_create(size_t width, size_t height, size_t channels, image *picture, lam_error *error) {
    lam_status status = LAM_OK;
    size_t row;
    TRY(image_check_size(width, height, error));
    if (channels != 1 && channels != 3)
        FAIL(error, LAM_ERR_ARGUMENT, "picture of %zu channels, must be 1 or 3", channels);
    if (!size_multiply(width, channels, &row))
        FAIL(error, LAM_ERR_MEMORY, "picture of %zux%zu pixels: too large", width, height);
    uint8_t *pixels = memory_allocate(height, row, "picture", error);
    if (pixels == NULL) return LAM_ERR_MEMORY;
    *picture = (image){.width = width, .height = height, .channels = channels, .pixels = pixels};
done:
    return status;
}

void image_free(image *picture) {
    if (picture == NULL) return;
    free(picture->pixels);
    *picture = (image){0};
}

/* The level of zlib: of smooth light a quarter of the time of its preset, 6, for a ninth more bytes. */
enum { COMPRESSION = 4 };

/* The state that libpng's callbacks share with encode_to. */
typedef struct png_writer {
    FILE *file;
    int cause; /* errno when writing failed, else 0 */
    char message[128];
} png_writer;

/* libpng demands that this does not return. */
static void on_png_error(png_structp png, png_const_charp message) {
    png_writer *writer = png_get_error_ptr(png);
    snprintf(writer->message, sizeof writer->message, "%s", message);
    png_longjmp(png, 1);
}

static void on_png_warning(png_structp png, png_const_charp message) {
    (void)png;
    (void)message;
}

static void on_png_write(png_structp png, png_bytep bytes, png_size_t length) {
    png_writer *writer = png_get_io_ptr(png);
    errno = 0;
    if (fwrite(bytes, 1, length, writer->file) == length) return;
    writer->cause = errno != 0 ? errno : EIO;
    png_error(png, "write");
}

static void on_png_flush(png_structp png) {
    (void)png;
}

/* Values of 8 bits, which are sRGB, or of 16. */
typedef struct png_content {
    size_t width, height, channels;
    const uint8_t *shallow;
    const uint16_t *deep;
} png_content;

/* A function of its own for setjmp: it changes no variable afterwards. */
static bool encode(png_structp png, png_infop info, const png_content *p) {
    static const uint16_t one = 1;
    const size_t row = p->width * p->channels;
    if (setjmp(png_jmpbuf(png)) != 0) return false;
    png_set_IHDR(png, info, (png_uint_32)p->width, (png_uint_32)p->height, p->deep != NULL ? 16 : 8,
                 p->channels == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_compression_level(png, COMPRESSION);
    if (p->deep == NULL) png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_write_info(png, info);
    /* The format has the high byte first. */
    if (p->deep != NULL && *(const uint8_t *)&one == 1) png_set_swap(png);
    for (size_t y = 0; y < p->height; y++)
        png_write_row(png, p->deep != NULL ? (png_const_bytep)(p->deep + y * row) : p->shallow + y * row);
    png_write_end(png, info);
    return true;
}

static lam_status encode_to(FILE *file, const png_content *picture, const char *path, lam_error *error) {
    lam_status status = LAM_OK;
    png_writer writer = {.file = file};
    png_infop info = NULL;
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &writer, on_png_error, on_png_warning);
    if (png != NULL) info = png_create_info_struct(png);
    if (info == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory for the picture's encoder", path);
    png_set_write_fn(png, &writer, on_png_write, on_png_flush);
    if (!encode(png, info, picture)) {
        if (writer.cause != 0)
            FAIL(error, LAM_ERR_IO, "%s: cannot write the picture: %s", path, strerror(writer.cause));
        FAIL(error, LAM_ERR_INTERNAL, "%s: libpng: %s", path, writer.message);
    }
done:
    png_destroy_write_struct(&png, &info);
    return status;
}

lam_status image_encode_deep(size_t width, size_t height, size_t channels, const uint16_t *values,
                             unsigned char **bytes, size_t *length, lam_error *error) {
    lam_status status = LAM_OK;
    const png_content content = {.width = width, .height = height, .channels = channels, .deep = values};
    char *made = NULL;
    size_t made_length = 0;
    FILE *stream = open_memstream(&made, &made_length);
    if (stream == NULL) return status_fail(error, LAM_ERR_MEMORY, "not enough memory for a picture");
    status = encode_to(stream, &content, "a picture in memory", error);
    if (fclose(stream) != 0 && status == LAM_OK)
        status = status_fail(error, LAM_ERR_MEMORY, "not enough memory for a picture");
    if (status == LAM_ERR_IO) status = LAM_ERR_MEMORY; /* a stream in memory lacks nothing else */
    if (status == LAM_OK) {
        *bytes = (unsigned char *)made;
        *length = made_length;
        made = NULL;
    }
    free(made);
    return status;
}

lam_status image_write_png(const image *picture, const char *path, lam_error *error) {
    lam_status status = LAM_OK;
    atomic_file out = {0};
    const png_content content = {.width = picture->width,
                                 .height = picture->height,
                                 .channels = picture->channels,
                                 .shallow = picture->pixels};
    TRY(atomic_file_open(path, &out, error));
    TRY(encode_to(out.stream, &content, path, error));
    TRY(atomic_file_commit(&out, error));
done:
    atomic_file_abort(&out);
    return status;
}
