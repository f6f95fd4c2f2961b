#include "solver/render/picture.h"

#include <stdio.h>
#include <string.h>

#define QUARTERS 4

/* The most characters of a number in three digits. */
#define LONGEST 8

/* A font of 3 x 5 pixels: three bits for each row, top row first; scaled up on larger pictures. */
#define GLYPH_WIDTH 3
#define GLYPH_HEIGHT 5

typedef struct glyph {
    char symbol;
    unsigned short rows;
} glyph;

static const glyph font[] = {{'0', 075557}, {'1', 026227}, {'2', 071747}, {'3', 071717}, {'4', 055711},
                             {'5', 074717}, {'6', 074757}, {'7', 071122}, {'8', 075757}, {'9', 075717},
                             {'.', 000002}, {'-', 000700}, {'+', 002720}, {'e', 003563}};

static void put(image *picture, size_t x, size_t y, const unsigned char rgb[3]) {
    if (x < picture->width && y < picture->height)
        memcpy(picture->pixels + (y * picture->width + x) * picture->channels, rgb, 3);
}

static void fill(image *picture, size_t x, size_t y, size_t width, size_t height,
                 const unsigned char rgb[3]) {
    for (size_t j = 0; j < height; j++)
        for (size_t i = 0; i < width; i++) put(picture, x + i, y + j, rgb);
}

/* Writes a text that ends left of x, centred on y. */
static void write_text(image *picture, size_t x, size_t y, size_t scale, const char *text) {
    static const unsigned char ink[3] = {235, 235, 235};
    const size_t advance = (GLYPH_WIDTH + 1) * scale;
    const size_t wanted = strlen(text) * advance;
    x = x > wanted ? x - wanted : 0;
    y -= GLYPH_HEIGHT * scale / 2;
    for (const char *c = text; *c != '\0'; c++, x += advance)
        for (size_t g = 0; g < sizeof font / sizeof font[0]; g++) {
            if (font[g].symbol != *c) continue;
            for (size_t bit = 0; bit < GLYPH_WIDTH * GLYPH_HEIGHT; bit++)
                if (font[g].rows >> (GLYPH_WIDTH * GLYPH_HEIGHT - 1 - bit) & 1)
                    fill(picture, x + bit % GLYPH_WIDTH * scale, y + bit / GLYPH_WIDTH * scale, scale, scale,
                         ink);
        }
}

/* The sizes of the legend, in pixels. */
typedef struct layout {
    size_t scale, margin, text_width, bar_width, width;
} layout;

static layout layout_of(size_t height) {
    layout l = {.scale = 1 + height / 480};
    l.margin = 4 * l.scale;
    l.text_width = LONGEST * (GLYPH_WIDTH + 1) * l.scale;
    l.bar_width = 8 * l.scale;
    l.width = l.text_width + l.bar_width + 3 * l.margin;
    return l;
}

size_t picture_legend_width(size_t width, size_t height) {
    const size_t legend = layout_of(height).width;
    return height >= 100 && width >= 3 * legend ? legend : 0;
}

void picture_legend(double range, image *picture) {
    static const unsigned char panel[3] = {38, 38, 38};
    const layout l = layout_of(picture->height);
    if (picture->channels != 3 || picture_legend_width(picture->width, picture->height) == 0) return;
    fill(picture, picture->width - l.width, 0, l.width, picture->height, panel);
    const size_t bar = picture->width - l.margin - l.bar_width;
    const size_t height = picture->height * 3 / 4, top = picture->height / 8;
    for (size_t y = 0; y < height; y++) {
        float rgb[3];
        unsigned char code[3];
        tone_false_color((float)(height - 1 - y) / (float)(height - 1), rgb);
        for (int c = 0; c < 3; c++) code[c] = (unsigned char)(255 * rgb[c] + .5f);
        fill(picture, bar, top + y, l.bar_width, 1, code);
    }
    for (int tick = 0; tick <= QUARTERS; tick++) {
        char text[32];
        snprintf(text, sizeof text, "%.3g", range * tick / QUARTERS);
        write_text(picture, bar - l.margin / 2, top + (height - 1) * (size_t)(QUARTERS - tick) / QUARTERS,
                   l.scale, text);
    }
}
