/* PNG, JPEG and WebP to RGB: the only file that reads images, and that knows libwebp. */
#include "solver/scene/import/images.h"

#include <math.h>
#include <png.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>
#include <webp/decode.h>

/* Pixels along a side; an image of that size takes 800 MB, which the limits of the child allow. */
enum { SIDE_MOST = 16384 };

static bool say(char why[IMAGE_WHY], const char *library, const char *text) {
    snprintf(why, IMAGE_WHY, "it is damaged (%s: %.100s)", library, text);
    return false;
}

/* Room for an image of that size; false with a reason where it is too large. */
static bool reserve(size_t width, size_t height, texture_image *out, char why[IMAGE_WHY]) {
    lam_error error;
    *out = (texture_image){.width = width, .height = height};
    if (width == 0 || height == 0 || width > SIDE_MOST || height > SIDE_MOST) {
        snprintf(why, IMAGE_WHY, "it has %zu x %zu pixels, must be 1 to %d along each side", width, height,
                 SIDE_MOST);
        return false;
    }
    out->pixels = memory_allocate(width * height, sizeof *out->pixels, "image", &error);
    if (out->pixels == NULL)
        snprintf(why, IMAGE_WHY, "there is no memory for %zu x %zu pixels", width, height);
    return out->pixels != NULL;
}

static bool decode_png(const unsigned char *bytes, size_t length, texture_image *out, char why[IMAGE_WHY]) {
    png_image png = {.version = PNG_IMAGE_VERSION};
    unsigned char(*rgba)[4] = NULL;
    lam_error error;
    bool done = false;
    if (png_image_begin_read_from_memory(&png, bytes, length) == 0) return say(why, "libpng", png.message);
    png.flags |= PNG_IMAGE_FLAG_16BIT_sRGB;
    /* The format has alpha: without it the library would lay the image on a background. */
    png.format = PNG_FORMAT_RGBA;
    if (!reserve(png.width, png.height, out, why)) goto done;
    rgba = memory_allocate(out->width * out->height, sizeof *rgba, "image", &error);
    if (rgba == NULL) {
        snprintf(why, IMAGE_WHY, "there is no memory for %zu x %zu pixels", out->width, out->height);
        goto done;
    }
    if (png_image_finish_read(&png, NULL, rgba, 0, NULL) == 0) {
        say(why, "libpng", png.message);
        goto done;
    }
    for (size_t k = 0; k < out->width * out->height; k++) memcpy(out->pixels[k], rgba[k], 3);
    done = true;
done:
    free(rgba);
    png_image_free(&png);
    return done;
}

static bool decode_jpeg(const unsigned char *bytes, size_t length, texture_image *out, char why[IMAGE_WHY]) {
    int width = 0, height = 0, sampling, space;
    bool done = false;
    tjhandle jpeg = tjInitDecompress();
    if (jpeg == NULL) return say(why, "libjpeg-turbo", tjGetErrorStr2(NULL));
    if (tjDecompressHeader3(jpeg, bytes, length, &width, &height, &sampling, &space) != 0) {
        say(why, "libjpeg-turbo", tjGetErrorStr2(jpeg));
    } else if (width < 1 || height < 1) {
        say(why, "libjpeg-turbo", "it ends before its size");
    } else if (space == TJCS_CMYK || space == TJCS_YCCK) {
        snprintf(why, IMAGE_WHY, "it is a JPEG for print (CMYK); save it as RGB");
    } else if (reserve((size_t)width, (size_t)height, out, why)) {
        done = tjDecompress2(jpeg, bytes, length, out->pixels[0], width, 3 * width, height, TJPF_RGB,
                             TJFLAG_ACCURATEDCT) == 0;
        /* A file that is cut off is a warning to the library, as are harmless faults. */
        const char *text = tjGetErrorStr2(jpeg);
        if (!done && tjGetErrorCode(jpeg) == TJERR_WARNING && strstr(text, "Premature end") == NULL)
            done = true;
        if (!done) say(why, "libjpeg-turbo", text);
    }
    tjDestroy(jpeg);
    return done;
}

static bool decode_webp(const unsigned char *bytes, size_t length, texture_image *out, char why[IMAGE_WHY]) {
    int width = 0, height = 0;
    if (WebPGetInfo(bytes, length, &width, &height) == 0) return say(why, "libwebp", "its head is not whole");
    if (!reserve((size_t)width, (size_t)height, out, why)) return false;
    const size_t size = out->width * out->height * sizeof *out->pixels;
    if (WebPDecodeRGBInto(bytes, length, out->pixels[0], size, 3 * width) == NULL)
        return say(why, "libwebp", "it is cut off, animated or not sound");
    return true;
}

/* One row a type: its name, its first bytes, and its decoder, or NULL. */
static const struct image_type {
    const char *name, *start;
    size_t length;
    bool (*decode)(const unsigned char *bytes, size_t length, texture_image *out, char why[IMAGE_WHY]);
} types[] = {
    {"PNG", "\x89PNG", 4, decode_png},
    {"JPEG", "\xFF\xD8\xFF", 3, decode_jpeg},
    {"WebP", "RIFF", 4, decode_webp},
    {"KTX2", "\xABKTX 20", 7, NULL},
    {"KTX", "\xABKTX 11", 7, NULL},
    {"DDS", "DDS ", 4, NULL},
    {"GIF", "GIF8", 4, NULL},
    {"BMP", "BM", 2, NULL},
    {"TIFF", "II*", 3, NULL},
    {"TIFF", "MM", 2, NULL},
    {"OpenEXR", "\x76\x2F\x31\x01", 4, NULL},
    {"Radiance HDR", "#?", 2, NULL},
};

bool image_decode(const unsigned char *bytes, size_t length, texture_image *out, char why[IMAGE_WHY]) {
    *out = (texture_image){.pixels = NULL};
    for (size_t k = 0; k < sizeof types / sizeof *types; k++) {
        if (length < types[k].length || memcmp(bytes, types[k].start, types[k].length) != 0) continue;
        if (types[k].decode != NULL && types[k].decode(bytes, length, out, why)) return true;
        if (types[k].decode == NULL)
            snprintf(why, IMAGE_WHY, "it is a %s, and only PNG, JPEG and WebP are read", types[k].name);
        free(out->pixels);
        *out = (texture_image){.pixels = NULL};
        return false;
    }
    snprintf(why, IMAGE_WHY, "it is no PNG, JPEG or WebP");
    return false;
}

/* IEC 61966-2-1, from linear light to a level. */
static unsigned char level_of(double linear) {
    const double x = linear <= .0031308 ? 12.92 * linear : 1.055 * pow(linear, 1 / 2.4) - .055;
    return (unsigned char)lround(255 * fmin(fmax(x, 0), 1));
}

void image_halve(texture_image *image) {
    enum { STEPS = 4096 };
    const size_t width = image->width, height = image->height;
    const size_t across = (width + 1) / 2, down = (height + 1) / 2;
    double linear[256];
    unsigned char level[STEPS + 1]; /* of the square root, along which levels lie evenly */
    texture_linear_levels(linear);
    for (int k = 0; k <= STEPS; k++) level[k] = level_of((double)k / STEPS * ((double)k / STEPS));
    for (size_t y = 0; y < down; y++)
        for (size_t x = 0; x < across; x++) {
            const size_t right = 2 * x + 1 < width ? 2 * x + 1 : 2 * x;
            const size_t below = 2 * y + 1 < height ? 2 * y + 1 : 2 * y;
            const size_t from[4] = {2 * y * width + 2 * x, 2 * y * width + right, below * width + 2 * x,
                                    below * width + right};
            unsigned char mean[3];
            for (int c = 0; c < 3; c++) {
                double sum = 0;
                for (int k = 0; k < 4; k++) sum += linear[image->pixels[from[k]][c]];
                mean[c] = level[lround(STEPS * sqrt(sum / 4))];
            }
            memcpy(image->pixels[y * across + x], mean, sizeof mean); /* never ahead of what is still read */
        }
    image->width = across;
    image->height = down;
}

bool image_is_grey(const texture_image *image) {
    for (size_t k = 0; k < image->width * image->height; k++) {
        const uint8_t *p = image->pixels[k];
        if (p[0] != p[1] || p[1] != p[2]) return false;
    }
    return true;
}
