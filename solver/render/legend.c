#include "solver/render/picture.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* The most characters of a number beside the scale. */
#define LONGEST 8

/* A font of 3 x 5 or 5 x 5 pixels: three or five bits for each row, top row first; scaled up on larger
 * pictures. */
#define GLYPH_WIDTH 3
#define GLYPH_HEIGHT 5

typedef struct glyph {
    char symbol;
    unsigned rows;
    size_t width; /* 0: GLYPH_WIDTH */
} glyph;

static const glyph font[] = {{.symbol = '0', .rows = 075557},
                             {.symbol = '1', .rows = 026227},
                             {.symbol = '2', .rows = 071747},
                             {.symbol = '3', .rows = 071717},
                             {.symbol = '4', .rows = 055711},
                             {.symbol = '5', .rows = 074717},
                             {.symbol = '6', .rows = 074757},
                             {.symbol = '7', .rows = 071122},
                             {.symbol = '8', .rows = 075757},
                             {.symbol = '9', .rows = 075717},
                             {.symbol = '.', .rows = 000002},
                             {.symbol = '-', .rows = 000700},
                             {.symbol = '+', .rows = 002720},
                             {.symbol = 'e', .rows = 003563},
                             {.symbol = '/', .rows = 011244},
                             {.symbol = 'l', .rows = 022222},
                             {.symbol = 'x', .rows = 000525},
                             {.symbol = 'k', .rows = 045655},
                             {.symbol = 'f', .rows = 032722},
                             {.symbol = 'c', .rows = 003443},
                             {.symbol = 't', .rows = 027223},
                             {.symbol = 'W', .rows = 0x118d6aa, .width = 5},
                             {.symbol = 'm', .rows = 0xd56b5, .width = 5}};

static void put(image *picture, size_t x, size_t y, const unsigned char rgb[3]) {
    if (x < picture->width && y < picture->height)
        memcpy(picture->pixels + (y * picture->width + x) * picture->channels, rgb, 3);
}

static void fill(image *picture, size_t x, size_t y, size_t width, size_t height,
                 const unsigned char rgb[3]) {
    for (size_t j = 0; j < height; j++)
        for (size_t i = 0; i < width; i++) put(picture, x + i, y + j, rgb);
}

static const glyph *glyph_of(char symbol) {
    for (size_t g = 0; g < sizeof font / sizeof font[0]; g++)
        if (font[g].symbol == symbol) return &font[g];
    return NULL;
}

static size_t advance_of(char symbol, size_t scale) {
    const glyph *g = glyph_of(symbol);
    return ((g != NULL && g->width > 0 ? g->width : GLYPH_WIDTH) + 1) * scale;
}

/* Writes a text that ends left of x, centred on y. */
static void write_text(image *picture, size_t x, size_t y, size_t scale, const char *text) {
    static const unsigned char ink[3] = {235, 235, 235};
    size_t wanted = 0;
    for (const char *c = text; *c != '\0'; c++) wanted += advance_of(*c, scale);
    x = x > wanted ? x - wanted : 0;
    y -= GLYPH_HEIGHT * scale / 2;
    for (const char *c = text; *c != '\0'; x += advance_of(*c, scale), c++) {
        const glyph *g = glyph_of(*c);
        if (g == NULL) continue;
        const size_t wide = g->width > 0 ? g->width : GLYPH_WIDTH;
        for (size_t bit = 0; bit < wide * GLYPH_HEIGHT; bit++)
            if (g->rows >> (wide * GLYPH_HEIGHT - 1 - bit) & 1)
                fill(picture, x + bit % wide * scale, y + bit / wide * scale, scale, scale, ink);
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

void picture_legend(const color_scale *scale, const char *unit, image *picture) {
    static const unsigned char panel[3] = {38, 38, 38}, mark[3] = {235, 235, 235};
    const layout l = layout_of(picture->height);
    if (picture->channels != 3 || picture_legend_width(picture->width, picture->height) == 0) return;
    fill(picture, picture->width - l.width, 0, l.width, picture->height, panel);
    const size_t bar = picture->width - l.margin - l.bar_width;
    const size_t height = picture->height * 3 / 4, top = picture->height / 8;
    for (size_t y = 0; y < height; y++) {
        float rgb[3];
        unsigned char code[3];
        palette_color(scale->palette, (float)(height - 1 - y) / (float)(height - 1), rgb);
        for (int c = 0; c < 3; c++) code[c] = (unsigned char)(255 * rgb[c] + .5f);
        fill(picture, bar, top + y, l.bar_width, 1, code);
    }
    double ticks[COLOR_SCALE_TICKS];
    const size_t n_ticks = color_scale_ticks(scale, ticks);
    for (size_t tick = 0; tick < n_ticks; tick++) {
        char text[32];
        const double place = color_scale_place(scale, ticks[tick]);
        const size_t down = (size_t)((1 - fmin(fmax(place, 0), 1)) * (double)(height - 1) + .5);
        snprintf(text, sizeof text, "%.6g", ticks[tick]);
        write_text(picture, bar - l.margin / 2, top + down, l.scale, text);
        fill(picture, bar - l.scale, top + down, l.scale, 1, mark);
    }
    write_text(picture, picture->width - l.margin, top / 2, l.scale, unit);
}
